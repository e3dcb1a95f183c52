"""Reads what `hapticctl record export` wrote: read_export.py press.h5 press.csv"""

import sys

import h5py
import pandas

with h5py.File(sys.argv[1]) as file:
    time_s = file["telemetry/time_s"][:]
    force = file["telemetry/contact_reaction_force_n"]
    print(f"{file.attrs['note']}: up to {force[:].max():.1f} {force.attrs['unit']} in {time_s[-1] - time_s[0]:.1f} s")
    for at_ns, text in zip(file["events/time_ns"][:], file["events/text"].asstr()[:]):
        print(f"{1e-9 * at_ns:.3f} s: {text}")

rows = pandas.read_csv(sys.argv[2], comment="#")  # metadata and events are comments
print(f"{len(rows)} rows, the last at {rows['time_s'].iloc[-1]:.3f} s")
