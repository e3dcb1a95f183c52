"""What a Python client pays to get all numbers of a tick.

    decode_batches.py PROTO_FOLDER FOLDER

FOLDER holds samples.bin and blocks.bin, each message behind its length. Prints {"samples_us": ..., "blocks_us": ...},
the best of five, in µs a sample. Both end in columns of numbers: the fields of each sample one by one, and the rows of a
block as they are.
"""

import json
import pathlib
import struct
import subprocess
import sys
import time

import numpy


def messages(path):
    data = path.read_bytes()
    found, at = [], 0
    while at < len(data):
        (length,) = struct.unpack_from("<I", data, at)
        found.append(data[at + 4 : at + 4 + length])
        at += 4 + length
    return found


def paths_of(message, before=()):
    """Of all numbers in a message, by the names of the fields that lead to them."""
    found = []
    for field, value in message.ListFields():
        if field.label == field.LABEL_REPEATED:
            continue
        if field.message_type is not None:
            found += paths_of(value, before + (field.name,))
        else:
            found.append(before + (field.name,))
    return found


def by_samples(batch_type, raw):
    first = batch_type.FromString(raw[0])
    paths = paths_of(first.samples[0])
    columns = {path: [] for path in paths}
    for data in raw:
        for sample in batch_type.FromString(data).samples:
            for path, column in columns.items():
                value = sample
                for name in path:
                    value = getattr(value, name)
                column.append(value)
    arrays = {path: numpy.array(column) for path, column in columns.items()}
    return len(next(iter(arrays.values())))


def by_blocks(batch_type, raw, types):
    parts, kind = [], None
    for data in raw:
        block = batch_type.FromString(data).block
        if kind is None:
            kind = numpy.dtype([(c.name, "<i8" if c.type == types["COLUMN_TYPE_INT64"] else "<f8") for c in block.columns])
        parts.append(block.rows)
    table = numpy.frombuffer(b"".join(parts), dtype=kind)
    columns = {name: table[name] for name in kind.names}
    return len(columns["tick"])


def best_us(decode):
    best = float("inf")
    for _ in range(5):
        began = time.perf_counter()
        count = decode()
        best = min(best, 1e6 * (time.perf_counter() - began) / count)
    return best


def main():
    proto, folder = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    generated = folder / "python"
    generated.mkdir(exist_ok=True)
    files = sorted(str(path.relative_to(proto)) for path in proto.glob("hapticd/v1/*.proto"))
    subprocess.run(["protoc", f"--proto_path={proto}", f"--python_out={generated}", *files], check=True)
    sys.path.insert(0, str(generated))
    from hapticd.v1 import telemetry_pb2

    types = dict(telemetry_pb2.ColumnType.items())
    samples, blocks = messages(folder / "samples.bin"), messages(folder / "blocks.bin")
    cost = {
        "samples_us": best_us(lambda: by_samples(telemetry_pb2.TelemetryBatch, samples)),
        "blocks_us": best_us(lambda: by_blocks(telemetry_pb2.TelemetryBatch, blocks, types)),
    }
    print(json.dumps(cost))


if __name__ == "__main__":
    main()
