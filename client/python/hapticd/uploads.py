"""Recordings on their way to the daemon."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Iterator, Mapping

from hapticd._requests import build
from hapticd.errors import BadFile
from hapticd.v1 import identification_pb2

#: Well below the daemon's limit of 1 MiB a message.
PIECE_BYTES = 256 * 1024


def upload_pieces(path: Path, description: Mapping[str, Any]) -> Iterator[identification_pb2.UploadRecordingRequest]:
    """What upload_recording() sends of a file. Raises BadFile if it cannot be read."""
    described = build(identification_pb2.RecordingDescription, {"name": path.name, **description})
    try:
        file = path.open("rb")
    except OSError as error:
        raise BadFile(error.strerror or "it cannot be read", where=str(path)) from error
    return _pieces(file, described)


def _pieces(
    file: Any, description: identification_pb2.RecordingDescription
) -> Iterator[identification_pb2.UploadRecordingRequest]:
    with file:
        yield identification_pb2.UploadRecordingRequest(description=description, csv=file.read(PIECE_BYTES))
        while piece := file.read(PIECE_BYTES):
            yield identification_pb2.UploadRecordingRequest(csv=piece)
