"""What happened, one line of JSON for each event, on the disk before anything else happens.

The state of an experiment is the fold of its journal (session.py). A line that was being written when the program died is
cut; so are the events of a trial that was not answered, for it is presented again. What is cut goes to NAME.cut, so that
nothing is lost, and the journal goes on as if it had never been written.
"""

from __future__ import annotations

import fcntl
import json
import os
from pathlib import Path
from typing import Any, Iterable, Mapping, Sequence

from hapticd.errors import BadFile

Event = dict[str, Any]

#: Bytes of an event: the largest is the protocol with the texts of its scenes.
MAX_LINE = 4 << 20
#: Bytes of a journal: some hundred thousand events.
MAX_BYTES = 256 << 20


def to_line(event: Mapping[str, Any]) -> bytes:
    return json.dumps(event, ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode() + b"\n"


def parse(content: bytes, where: str) -> tuple[list[Event], int]:
    """Events, and how many bytes of whole lines they are. Raises BadFile if a whole line is none."""
    events: list[Event] = []
    used = 0
    for number, line in enumerate(content.split(b"\n")[:-1], 1):
        try:
            if len(line) > MAX_LINE:
                raise ValueError
            event = json.loads(line.decode("utf-8"))
            to_line(event)  # half a character, NaN and 1e999 could not be written again
        except (ValueError, RecursionError) as error:  # the latter: brackets a thousand deep
            limit = f"JSON, at most {MAX_LINE} bytes"
            raise BadFile("this line is no event", where=f"{where}, line {number}", value=repr(line[:80]), limit=limit) from error
        if not isinstance(event, dict) or not isinstance(event.get("event"), str):
            raise BadFile("this line is no event", where=f"{where}, line {number}", value=repr(line[:80]), limit='{"event": …}')
        events.append(event)
        used += len(line) + 1
    return events, used


def read(path: Path) -> list[Event]:
    """The whole events of a journal."""
    try:
        if path.exists() and not path.is_file():  # a pipe may never end
            raise BadFile("this is not a regular file", where=str(path))
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
        if len(content) > MAX_BYTES:
            raise BadFile("this is too large for a journal", where=str(path), limit=f"at most {MAX_BYTES} bytes")
    except OSError as error:
        raise BadFile(error.strerror or "it cannot be read", where=str(path)) from error
    return parse(content, str(path))[0]


class Journal:
    """Open for writing, by one program at a time."""

    def __init__(self, path: Path, events: Sequence[Event], file: int) -> None:
        self.path = path
        self.events = list(events)
        self._file = file

    @staticmethod
    def create(path: Path) -> Journal:
        """Raises BadFile if the file is there already: a participant's code is used once."""
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            file = os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY | os.O_APPEND, 0o644)
        except FileExistsError:
            raise BadFile(
                "there is a journal of this participant already", where=str(path), remedy="choose another code, or resume it"
            ) from None
        _lock(file, path)
        _sync_folder(path.parent)
        return Journal(path, [], file)

    @staticmethod
    def reopen(path: Path, keep: int) -> Journal:
        """Goes on after the first `keep` events; the rest goes to NAME.cut."""
        try:
            file = os.open(path, os.O_WRONLY | os.O_APPEND)
        except OSError as error:
            raise BadFile(error.strerror or "it cannot be opened", where=str(path)) from error
        _lock(file, path)
        content = path.read_bytes()
        events, _ = parse(content, str(path))
        kept = sum(len(line) + 1 for line in content.split(b"\n")[:keep])
        if kept < len(content):
            with path.with_name(path.name + ".cut").open("ab") as cut:
                cut.write(content[kept:] if content.endswith(b"\n") else content[kept:] + b"\n")
                cut.flush()
                os.fsync(cut.fileno())
            os.ftruncate(file, kept)
            os.fsync(file)
        return Journal(path, events[:keep], file)

    def append(self, event: Mapping[str, Any]) -> None:
        """Returns when it is on the disk. Raises OSError if it is full: the experiment stops there."""
        line = to_line(event)
        written = os.write(self._file, line)
        if written != len(line):  # the next start cuts it
            raise OSError(f"{self.path}: the disk took {written} of {len(line)} bytes")
        os.fsync(self._file)
        self.events.append(json.loads(line))

    def close(self) -> None:
        os.close(self._file)


def _lock(file: int, path: Path) -> None:
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(file)
        raise BadFile("another program writes this journal", where=str(path), remedy="end it first") from None


def _sync_folder(folder: Path) -> None:
    """Syncs the folder, so that the new file's name survives a loss of power."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def written(events: Iterable[Mapping[str, Any]]) -> bytes:
    """The bytes of a journal with these events."""
    return b"".join(to_line(event) for event in events)
