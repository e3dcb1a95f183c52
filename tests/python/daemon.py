"""Separate daemon on the simulated rig, on a free port, and the program that shows its page."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import time
from pathlib import Path
from typing import Optional, Union

BINARIES = Path(os.environ.get("HAPTICD_BINARIES", "build/release/bin"))


class Program:
    """A process that says where it listens."""

    def __init__(self, log: Path, command: list[Union[str, Path]], says: str, errors: Optional[int] = None) -> None:
        """says: a pattern whose first group is the place. errors: a descriptor in the place of the log, for the standard error."""
        self.log = log
        with log.open("wb") as output:
            self.process = subprocess.Popen(command, stdout=output, stderr=output if errors is None else errors)
        self.place = self.await_log(says)

    def await_log(self, pattern: str) -> str:
        """Returns the first group of a pattern, once the log has it: another thread writes it."""
        while not (found := re.search(pattern, self.log.read_text())):
            if self.process.poll() is not None:
                raise RuntimeError(self.log.read_text())
            time.sleep(0.02)
        return found.group(1)

    def end(self, how: int = signal.SIGTERM) -> None:
        if self.process.poll() is None:
            self.process.send_signal(how)
        self.process.wait()


class Daemon(Program):
    """hapticd, and where it listens."""

    def __init__(self, folder: Path, *options: str, rig: str = "sim", speed: float = 1.0) -> None:
        """speed: how fast the rig's own time runs. Any but 1 takes the place of a configuration, so none may be given then."""
        if speed != 1.0:
            configuration = folder / "speed.toml"
            configuration.write_text(f"[rig.sim]\nspeed = {speed}\n")
            options = (*options, "--config", str(configuration))
        super().__init__(
            folder / "hapticd.log", [BINARIES / "hapticd", "--rig", rig, "--listen", "127.0.0.1:0", *options], r"listens on (\S+)"
        )
        self.address = self.place


class Console(Program):
    """hapticd-console for all who sign in, and where its page is."""

    def __init__(self, folder: Path, server: str, *options: str, port: int = 0, errors: Optional[int] = None) -> None:
        """server: the daemon, as "unix:PATH". options that name another address take the place of the page's."""
        address = () if any(one.startswith("--listen") for one in options) else ("--listen", f"127.0.0.1:{port}")
        command = [BINARIES / "hapticd-console", "--server", server, *address, *options]
        super().__init__(folder / "console.log", command, r"listens on https?://127.0.0.1:(\d+)", errors)
        self.port = int(self.place)
