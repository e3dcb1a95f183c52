"""What 60 columns of telemetry cost a Python program, and whether any sample is lost."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import hapticd

import study_output
from daemon import Daemon

#: Groups with some 60 columns.
GROUPS = ["sample", "contact", "deformation", "control", "truth"]


def measure(rate_hz: int, seconds: float) -> tuple[float, int, int, int]:
    """CPU time over time, columns, samples, lost."""
    with tempfile.TemporaryDirectory() as folder:
        configuration = Path(folder) / "rig.toml"
        configuration.write_text(f"[loop]\nrate_hz = {rate_hz}\n")
        daemon = Daemon(Path(folder), "--model-store", ":memory:", "--config", str(configuration), "--scene", "tap_1d")
        try:
            with hapticd.connect(daemon.address) as rig:
                rig.set_hand_program({"kind": "press", "hold_s": -1.0})
                with rig.telemetry(GROUPS) as stream:
                    columns = len(next(iter(stream)).names)
                    samples = lost = 0
                    total = 0.0
                    begun, cpu = time.monotonic(), time.process_time()
                    for block in stream:
                        samples += len(block)
                        lost += block.lost
                        total += float(block[block.names[-1]].sum())
                        if time.monotonic() - begun > seconds:
                            break
                    share = (time.process_time() - cpu) / (time.monotonic() - begun)
                    return share, columns, samples, lost
        finally:
            daemon.end()


def main() -> None:
    options = study_output.options(__doc__)
    output = study_output.Output(options.out, "telemetry", "Telemetry in Python")
    rows = []
    for rate_hz, goal in ((1000, 0.02), (5000, 0.05)):
        share, columns, samples, lost = measure(rate_hz, 10.0 if options.quick else 60.0)
        failed = f"{lost} samples were lost" if lost else ""
        output.figure(
            "python_cpu_share", share, {"rate_hz": rate_hz}, goal=goal, source=f"of a core, {columns} columns, as numpy arrays", failed=failed
        )
        rows.append([f"{rate_hz}", f"{columns}", f"{samples}", f"{lost}", f"{100 * share:.2f}"])
    output.table("A Python program that receives telemetry", ["Hz", "columns", "samples", "lost", "% of a core"], rows)


if __name__ == "__main__":
    main()
