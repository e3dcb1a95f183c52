"""What a Python client pays to get all numbers of a tick.

    decode_batches.py PROTO_FOLDER FOLDER

FOLDER holds samples.bin and blocks.bin, each message behind its length. Prints {"samples_us": ..., "blocks_us": ...},
the best of five, in µs a sample, and how many numbers each side has (the block also has columns of groups that do not
exist in the scene). Both end in the same kind of table, one for each batch, whose columns have names.
"""

import json
import operator
import pathlib
import struct
import subprocess
import sys
import time

import numpy


WHOLE_NUMBERS = ("tick", "time_ns", "scene_generation")


def messages(path):
    data = path.read_bytes()
    found, at = [], 0
    while at < len(data):
        (length,) = struct.unpack_from("<I", data, at)
        found.append(data[at + 4 : at + 4 + length])
        at += 4 + length
    return found


def paths_of(message, before=""):
    """Paths to all numbers in a message and in the messages it has, by the names of the fields that lead to them. A
    number that is zero counts too, although it is not sent."""
    found = []
    for field in message.DESCRIPTOR.fields:
        if field.message_type is None:
            found.append(before + field.name)
        elif message.HasField(field.name):
            found += paths_of(getattr(message, field.name), before + field.name + ".")
    return found


def by_samples(batch_type, raw):
    """A table of each batch with a named column for each number, from the fields of its samples."""
    paths = paths_of(batch_type.FromString(raw[0]).samples[0])
    numbers_of = operator.attrgetter(*paths)
    kind = numpy.dtype([(path, "<i8" if path in WHOLE_NUMBERS else "<f8") for path in paths])
    count = 0
    for data in raw:
        rows = [numbers_of(sample) for sample in batch_type.FromString(data).samples]
        table = numpy.array(rows, dtype=kind)
        count += len(table["tick"])
    return count, len(paths)


def by_blocks(batch_type, raw, types):
    """Table as a view into the bytes of the batch's block."""
    columns = batch_type.FromString(raw[0]).block.columns
    kind = numpy.dtype([(c.name, "<i8" if c.type == types["COLUMN_TYPE_INT64"] else "<f8") for c in columns])
    count = 0
    for data in raw:
        table = numpy.frombuffer(batch_type.FromString(data).block.rows, dtype=kind)
        count += len(table["tick"])
    return count, len(kind)


def best_us(decode):
    """Best time of five, in µs a sample, and of how many numbers."""
    best = float("inf")
    for _ in range(5):
        began = time.perf_counter()
        count, numbers = decode()
        best = min(best, 1e6 * (time.perf_counter() - began) / count)
    return best, numbers


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
    samples_us, fields = best_us(lambda: by_samples(telemetry_pb2.TelemetryBatch, samples))
    blocks_us, columns = best_us(lambda: by_blocks(telemetry_pb2.TelemetryBatch, blocks, types))
    print(json.dumps({"samples_us": samples_us, "blocks_us": blocks_us, "fields": fields, "columns": columns}))


if __name__ == "__main__":
    main()
