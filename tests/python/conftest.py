"""Daemons for the tests: each its own, on a free port, on the simulated rig."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import time
from pathlib import Path
from typing import Callable, Iterator, Optional

import pytest

import hapticd

BINARIES = Path(os.environ.get("HAPTICD_BINARIES", "build/release/bin"))


class Daemon:
    """A process, and where it listens."""

    def __init__(self, folder: Path, *options: str) -> None:
        self.log = folder / "hapticd.log"
        with self.log.open("wb") as log:
            self.process = subprocess.Popen(
                [BINARIES / "hapticd", "--rig", "sim", "--listen", "127.0.0.1:0", *options], stdout=log, stderr=log
            )
        self.address = ""
        while not self.address:
            found = re.search(r"listens on (\S+)", self.log.read_text())
            if found:
                self.address = found.group(1)
            elif self.process.poll() is not None:
                raise RuntimeError(self.log.read_text())
            time.sleep(0.02)

    def end(self, how: int = signal.SIGTERM) -> None:
        if self.process.poll() is None:
            self.process.send_signal(how)
        self.process.wait()


@pytest.fixture
def start_daemon(tmp_path: Path) -> Iterator[Callable[..., Daemon]]:
    daemons: list[Daemon] = []

    def start(*options: str, folder: Optional[Path] = None) -> Daemon:
        place = folder or tmp_path / f"daemon_{len(daemons)}"
        place.mkdir(exist_ok=True)
        daemons.append(Daemon(place, *(options or ("--model-store", ":memory:"))))
        return daemons[-1]

    yield start
    for daemon in daemons:
        daemon.end()


@pytest.fixture(scope="module")
def shared_daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Daemon]:
    daemon = Daemon(tmp_path_factory.mktemp("daemon"), "--model-store", ":memory:")
    yield daemon
    daemon.end()


@pytest.fixture
def rig(shared_daemon: Daemon) -> Iterator[hapticd.Rig]:
    with hapticd.connect(shared_daemon.address) as connected:
        yield connected
