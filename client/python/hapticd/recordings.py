"""Recordings of the daemon, MCAP or HDF5, as tables of numbers."""

from __future__ import annotations

import re
import struct
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Iterator, Optional, Union

import numpy as np

from hapticd._requests import enum_word
from hapticd.block import Block, Columns
from hapticd.errors import BadFile, MissingPackage
from hapticd.v1 import recording_pb2, telemetry_pb2


@dataclass(frozen=True)
class Event:
    """Something that happened while it was recorded."""

    tick: int
    time_s: float  #: by the rig's clock
    kind: str  #: "target", "fault", "annotation" …: RecordingEventKind of the contract
    text: str
    by: str  #: identity of the client; empty if it was none


@dataclass(frozen=True)
class Recording:
    """A recording or an incident, whole in memory."""

    path: Path
    #: Every sample, every column.
    data: Block
    events: list[Event]
    #: Texts by name: "recording", "configuration", "scene", "clock_anchor", "end", each name with its keys; of several scenes the last.
    metadata: dict[str, dict[str, str]]
    #: Empty, or why the file's end is missing.
    damage: str = ""


def open_recording(path: Union[str, Path]) -> Recording:
    """FILE.mcap of the daemon, or FILE.h5 of an export. Raises BadFile, or MissingPackage (h5py; zstandard).

    A file without an end, e.g. of a daemon that was killed, is read up to its last whole chunk; `damage` says so.
    """
    path = Path(path)
    try:
        if path.exists() and not path.is_file():
            raise BadFile("the path is not a regular file", where=str(path))
        with path.open("rb") as file:
            start = file.read(8)
    except OSError as error:
        raise BadFile(error.strerror or "it cannot be read", where=str(path)) from error
    if start == _MAGIC:
        return _read_mcap(path)
    if start == b"\x89HDF\r\n\x1a\n":
        return _read_hdf5(path)
    raise BadFile("this is no recording", where=str(path), limit="an MCAP file of the daemon, or its export as HDF5")


# MCAP, https://mcap.dev/spec: records of an operation code, a length and a content.
_MAGIC = b"\x89MCAP0\r\n"
#: Limits of an inflated chunk, as hapticd-export has it, and of all inflated chunks together, in bytes.
MAX_CHUNK, MAX_TOTAL = 256 << 20, 8 << 30
_CHANNEL, _MESSAGE, _CHUNK, _METADATA, _DATA_END = 0x04, 0x05, 0x06, 0x0C, 0x0F


class _Bytes:
    """Reads a record's content, part by part."""

    def __init__(self, content: bytes) -> None:
        self._content = content
        self._at = 0

    def number(self, form: str) -> int:
        (value,) = struct.unpack_from("<" + form, self._content, self._at)
        self._at += struct.calcsize(form)
        return int(value)

    def raw(self, size: int) -> bytes:
        if size > len(self._content) - self._at:
            raise struct.error("too short")
        self._at += size
        return self._content[self._at - size : self._at]

    def text(self) -> str:
        return self.raw(self.number("I")).decode("utf-8", "replace")

    def texts(self) -> dict[str, str]:
        inner = _Bytes(self.raw(self.number("I")))
        found = {}
        while inner.left():
            name = inner.text()
            found[name] = inner.text()
        return found

    def left(self) -> int:
        return len(self._content) - self._at

    def rest(self) -> bytes:
        return self.raw(self.left())


class _Truncated(Exception):
    pass


def _records(content: bytes) -> Iterator[tuple[int, bytes]]:
    at = 0
    while at < len(content):
        if at + 9 > len(content):
            raise _Truncated
        code, size = struct.unpack_from("<BQ", content, at)
        at += 9
        if size > len(content) - at:
            raise _Truncated
        yield code, content[at : at + size]
        at += size


def _inflate(compression: str, data: bytes, size: int) -> bytes:
    if size > MAX_CHUNK:
        raise struct.error(f"a chunk of {size} bytes, at most {MAX_CHUNK} are read")
    if compression == "":
        return data
    if compression != "zstd":
        raise struct.error(f"compressed with {compression}")
    try:
        import zstandard
    except ImportError:
        raise MissingPackage(
            "zstandard is not installed", where="open_recording", remedy="apt install python3-zstandard, or export the recording as HDF5"
        ) from None
    try:
        # The size that the frame states would count, not max_output_size.
        if zstandard.frame_content_size(data) not in (size, -1):
            raise struct.error("a chunk has another size than it says")
        inflated: bytes = zstandard.ZstdDecompressor().decompress(data, max_output_size=size)
    except zstandard.ZstdError as error:
        raise struct.error(str(error)) from error
    return inflated


class _Mcap:
    """What has been read so far."""

    def __init__(self) -> None:
        self.topics: dict[int, str] = {}
        self.columns: Optional[Columns] = None
        self.parts: list[Any] = []
        self.events: list[Event] = []
        self.metadata: dict[str, dict[str, str]] = {}
        self.inflated = 0

    def take(self, code: int, content: bytes, *, is_inner: bool = False) -> None:
        part = _Bytes(content)
        if code == _CHUNK:
            if is_inner:
                raise struct.error("a chunk within a chunk")
            part.raw(16)  # its times
            size, checksum, compression = part.number("Q"), part.number("I"), part.text()
            inflated = _inflate(compression, part.raw(part.number("Q")), size)
            if checksum and zlib.crc32(inflated) != checksum:
                raise struct.error("a chunk's checksum is wrong")
            self.inflated += len(inflated)
            if self.inflated > MAX_TOTAL:
                raise struct.error(f"more than {MAX_TOTAL} bytes: export it in parts")
            for inner_code, inner in _records(inflated):
                self.take(inner_code, inner, is_inner=True)
        elif code == _CHANNEL:
            number = part.number("H")
            part.number("H")
            self.topics[number] = part.text()
        elif code == _MESSAGE:
            topic = self.topics.get(part.number("H"), "")
            part.raw(20)  # sequence and times
            self._message(topic, part.rest())
        elif code == _METADATA:
            name = part.text()
            self.metadata.setdefault(name, {}).update(part.texts())

    def _message(self, topic: str, data: bytes) -> None:
        if topic == "telemetry":
            block = telemetry_pb2.TelemetryBlock.FromString(data)
            if block.columns:
                columns = Columns.of(block.columns)
                if self.columns is not None and columns.dtype != self.columns.dtype:
                    raise struct.error("its columns change")
                self.columns = columns
            if self.columns is not None:
                self.parts.append(np.frombuffer(block.rows, dtype=self.columns.dtype))
        elif topic == "events":
            event = recording_pb2.RecordingEvent.FromString(data)
            kind = enum_word(recording_pb2.RecordingEventKind.DESCRIPTOR, event.kind)
            self.events.append(Event(event.tick, event.time_ns * 1e-9, kind, event.text, event.by))


def _read_mcap(path: Path) -> Recording:
    from google.protobuf.message import DecodeError

    content = path.read_bytes()[len(_MAGIC) :]
    read = _Mcap()
    damage = "the file has no end: it is read up to its last whole chunk"
    try:
        for code, record in _records(content):
            if code == _DATA_END:
                damage = ""
                break
            read.take(code, record)
    except _Truncated:
        pass
    except (struct.error, DecodeError, ValueError) as error:
        damage = f"it is damaged ({error}): read up to there"
    columns = read.columns or Columns([], [], [])
    rows = np.concatenate(read.parts) if read.parts else np.empty(0, dtype=columns.dtype)
    if read.columns is None and damage:
        raise BadFile(damage, where=str(path), limit="a recording of hapticd with at least one whole chunk")
    return Recording(path, Block(columns, rows), read.events, read.metadata, damage)


def _read_hdf5(path: Path) -> Recording:
    try:
        import h5py
    except ImportError:
        raise MissingPackage("h5py is not installed", where="open_recording", remedy="apt install python3-h5py") from None
    try:
        with h5py.File(path, "r") as file:
            return _from_hdf5(path, file)
    except (OSError, KeyError, ValueError) as error:
        raise BadFile(f"this is no recording of hapticd ({error})", where=str(path)) from error


def _text(value: Any) -> str:
    """Texts of h5py; those of recordings of earlier versions are bytes too, and numbers are given as texts."""
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


#: "scene_toml", and "scene_toml_2" of the second scene, as an export joins name, key and number.
_JOINED = re.compile(r"(?P<name>configuration|clock_anchor|scene)_(?P<key>.+?)(?:_(?P<number>[0-9]+))?")


def _from_hdf5(path: Path, file: Any) -> Recording:
    table = file["telemetry"]
    names = list(table)
    columns = Columns(
        names,
        [_text(table[name].attrs.get("unit", "1")) for name in names],
        ["<i8" if table[name].dtype.kind in "iu" else "<f8" for name in names],
    )
    rows = np.empty(len(table[names[0]]) if names else 0, dtype=columns.dtype)
    for name in names:
        rows[name] = table[name][:]
    happened = file["events"]
    events = [
        Event(int(tick), float(time_ns) * 1e-9, _text(kind), _text(text), _text(by))
        for tick, time_ns, kind, text, by in zip(*(happened[name][:] for name in ("tick", "time_ns", "kind", "text", "by")))
    ]
    metadata: dict[str, dict[str, str]] = {}
    for name, value in file.attrs.items():
        metadata.setdefault("end" if name.startswith("end_") else "recording", {})[name.removeprefix("end_")] = _text(value)
    joined = [_JOINED.fullmatch(name) for name in file.get("metadata", {})]
    for found in sorted(filter(None, joined), key=lambda one: int(one["number"] or 1)):
        metadata.setdefault(found["name"], {})[found["key"]] = _text(file["metadata"][found[0]][()])
    return Recording(path, Block(columns, rows), events, metadata)
