"""The emulated rig and a daemon on it: device and sensor over their real transports, a late clock, a zero that drifts."""

from __future__ import annotations

import re
import shlex
import subprocess
import time
from pathlib import Path
from typing import Any

from daemon import BINARIES

# A machine that runs the emulators as well is late: what a real one would be stopped for is tolerated here.
LATE = "\n[guard]\nsensor_stale_after_ms = 1000\nloop_gap_ms = 1000\n"
CEILINGS = "\n[guard]\nmax_sensor_stale_after_ms = 1000\nmax_loop_gap_ms = 1000\n"


class EmulatedRig:
    """Processes of the rig, each with its output in a file of the folder, and where the daemon listens."""

    def __init__(self, folder: Path, *options: Any) -> None:
        self.folder = folder
        self.processes: list[subprocess.Popen[Any]] = []
        try:
            emulator = self.start("emulator", BINARIES.resolve() / "hapticd_emulated_rig", "--late-ticks", "builtin", "--drift-n-per-s", "0.001",
                                  "--write", "rig.toml", *options)  # fmt: skip
            page_of_device = shlex.split(self.line_of(emulator, r"(HD_STAND_IN_PAGE=\S+)"))[0]
            with (folder / "rig.toml").open("a") as file:
                file.write(CEILINGS)
            self.daemon = self.start("hapticd", "env", page_of_device, BINARIES.resolve() / "hapticd", "--config", "rig.toml", "--listen",
                                     "127.0.0.1:0", "--model-store", folder / "models.sqlite")  # fmt: skip
            self.address = self.line_of(self.daemon, r"listens on (\S+)")
        except BaseException:
            self.end()
            raise
        time.sleep(2.0)  # until the sensor's stream is up

    def start(self, name: str, *command: Any) -> subprocess.Popen[Any]:
        with self.output_of(name).open("wb") as file:
            self.processes.append(subprocess.Popen([str(word) for word in command], cwd=self.folder, stdout=file, stderr=file))
        self.processes[-1].args = name
        return self.processes[-1]

    def output_of(self, name: str) -> Path:
        return self.folder / f"{name}.out"

    def line_of(self, process: subprocess.Popen[Any], pattern: str) -> str:
        file = self.output_of(str(process.args))
        for _ in range(3000):
            if found := re.search(pattern, file.read_text()):
                return found.group(1)
            assert process.poll() is None, file.read_text()
            time.sleep(0.02)
        raise AssertionError(f"{file}: nothing like {pattern}: {file.read_text()}")

    def command(self, *words: Any) -> list[Any]:
        return [BINARIES.resolve() / "hapticctl", "--server", self.address, *words]

    def control(self, *words: Any) -> str:
        done = subprocess.run(self.command(*words), cwd=self.folder, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    def end(self) -> None:
        for process in reversed(self.processes):
            process.terminate()
            process.wait()
