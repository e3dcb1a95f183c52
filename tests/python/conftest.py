"""Daemons for the tests."""

from __future__ import annotations

import itertools
import sys
from pathlib import Path
from typing import Any, Callable, Iterator, Optional

import pytest

import hapticd

sys.path.insert(0, str(Path(__file__).resolve().parent))
from daemon import Console, Daemon  # noqa: E402
from emulated_rig import EmulatedRig  # noqa: E402
from memory import memory_folder  # noqa: E402


def socket_of(folder: Path) -> Path:
    """The daemon's unix socket in a test's folder. Its name is short: so is the longest that the system allows."""
    return folder / "d.sock"


@pytest.fixture
def memory_path() -> Iterator[Path]:
    """Folder as tmp_path, but in memory."""
    with memory_folder() as folder:
        yield folder


@pytest.fixture
def start_daemon(tmp_path: Path) -> Iterator[Callable[..., Daemon]]:
    daemons: list[Daemon] = []

    def start(*options: str, folder: Optional[Path] = None, rig: str = "sim", speed: float = 1.0) -> Daemon:
        place = folder or tmp_path / f"daemon_{len(daemons)}"
        place.mkdir(exist_ok=True)
        daemons.append(Daemon(place, *(options or ("--model-store", ":memory:")), rig=rig, speed=speed))
        return daemons[-1]

    yield start
    for daemon in daemons:
        daemon.end()


@pytest.fixture
def start_console(tmp_path: Path) -> Iterator[Callable[..., Console]]:
    """The console of a daemon that was started with --unix SOCKET, where SOCKET is socket_of(tmp_path)."""
    consoles: list[Console] = []
    numbers = itertools.count()

    def start(*options: str, port: int = 0, server: str = "", errors: Optional[int] = None) -> Console:
        place = tmp_path / f"console_{next(numbers)}"
        place.mkdir()
        consoles.append(Console(place, server or f"unix:{socket_of(tmp_path)}", *options, port=port, errors=errors))
        return consoles[-1]

    yield start
    for console in consoles:
        console.end()


@pytest.fixture
def emulated_rig(tmp_path: Path) -> Iterator[Callable[..., EmulatedRig]]:
    rigs: list[EmulatedRig] = []

    def start(*options: Any) -> EmulatedRig:
        rigs.append(EmulatedRig(tmp_path, *options))
        return rigs[-1]

    yield start
    for rig in rigs:
        rig.end()


@pytest.fixture(scope="module")
def shared_daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Daemon]:
    daemon = Daemon(tmp_path_factory.mktemp("daemon"), "--model-store", ":memory:")
    yield daemon
    daemon.end()


@pytest.fixture(scope="module")
def rig(shared_daemon: Daemon) -> Iterator[hapticd.Rig]:
    with hapticd.connect(shared_daemon.address) as connected:
        yield connected
