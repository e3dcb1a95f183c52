"""Separate daemon on the simulated rig, on a free port, and the program that shows its page."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import time
from pathlib import Path

BINARIES = Path(os.environ.get("HAPTICD_BINARIES", "build/release/bin"))


class Daemon:
    """A process, and where it listens."""

    def __init__(self, folder: Path, *options: str, rig: str = "sim", speed: float = 1.0) -> None:
        """speed: how fast the rig's own time runs; other than 1 it is set by a configuration, so there is no other one."""
        self.log = folder / "hapticd.log"
        if speed != 1.0:
            configuration = folder / "speed.toml"
            configuration.write_text(f"[rig.sim]\nspeed = {speed}\n")
            options = (*options, "--config", str(configuration))
        with self.log.open("wb") as log:
            self.process = subprocess.Popen(
                [BINARIES / "hapticd", "--rig", rig, "--listen", "127.0.0.1:0", *options], stdout=log, stderr=log
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


class Console:
    """hapticd-console for all who sign in, and where its page is."""

    def __init__(self, folder: Path, server: str, *options: str, port: int = 0) -> None:
        """server: the daemon, as "unix:PATH". options that name another address take the place of the page's."""
        self.log = folder / "console.log"
        address = () if any(one.startswith("--listen") for one in options) else ("--listen", f"127.0.0.1:{port}")
        with self.log.open("wb") as log:
            self.process = subprocess.Popen(
                [BINARIES / "hapticd-console", "--server", server, *address, *options], stdout=log, stderr=log
            )
        self.port = 0
        while not self.port:
            found = re.search(r"listens on https?://127.0.0.1:(\d+)", self.log.read_text())
            if found:
                self.port = int(found.group(1))
            elif self.process.poll() is not None:
                raise RuntimeError(self.log.read_text())
            time.sleep(0.02)

    def end(self, how: int = signal.SIGTERM) -> None:
        if self.process.poll() is None:
            self.process.send_signal(how)
        self.process.wait()
