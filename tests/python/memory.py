"""Folders in memory: what writes and syncs many small files waits for no disk there."""

from __future__ import annotations

import contextlib
import os
import tempfile
from pathlib import Path
from typing import Iterator

MEMORY = Path("/dev/shm")


@contextlib.contextmanager
def memory_folder() -> Iterator[Path]:
    """A folder, in memory if the system has such a place; gone at the end."""
    with tempfile.TemporaryDirectory(prefix="hapticd_", dir=MEMORY if os.access(MEMORY, os.W_OK) else None) as folder:
        yield Path(folder)
