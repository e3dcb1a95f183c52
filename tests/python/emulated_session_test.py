"""A whole session on the emulated rig: device and sensor over their real transports, a late clock, a zero that drifts."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, Iterator

import pytest

from daemon import BINARIES

PROTOCOL = """
name = "short"
title = "a short session"
question = "Which felt harder? 1: the first, 2: the second"
participants = 1
[answers]
keys = { 1 = "first", 2 = "second" }
[reference]
scene = "press_late"
[comparison]
scene = "press_late"
[procedure]
kind = "constant"
level_shares = [1.2]
repetitions = 1
[trial]
highest_n_per_mm = 0.9
[session]
min_break_s = 0
white_noise = false
[presentation]
above_mm = [0, 0, 10]
[[condition]]
name = "sponge_05"
reference_n_per_mm = 0.5
object_n_per_mm = 0.37
"""
# A machine that runs the emulators as well is late: what a real one would be stopped for is tolerated here.
LATE = "\n[guard]\nsensor_stale_after_ms = 1000\nloop_gap_ms = 1000\n"
SCENE = 'name = "press_late"\nkind = "tap_1d"\n[target]\nstiffness_n_per_mm = 0.6\n[fixture]\n[watch]\n' + LATE
CEILINGS = "\n[guard]\nmax_sensor_stale_after_ms = 1000\nmax_loop_gap_ms = 1000\n"


def line_of(file: Path, pattern: str, process: subprocess.Popen[Any]) -> str:
    for _ in range(3000):
        if found := re.search(pattern, file.read_text()):
            return found.group(1)
        assert process.poll() is None, file.read_text()
        time.sleep(0.02)
    raise AssertionError(f"{file}: nothing like {pattern}: {file.read_text()}")


@pytest.fixture
def processes() -> Iterator[list[subprocess.Popen[Any]]]:
    started: list[subprocess.Popen[Any]] = []
    yield started
    for process in reversed(started):
        process.terminate()
        process.wait()


def test_a_session_with_a_late_clock_and_a_drifting_zero(tmp_path: Path, processes: list[subprocess.Popen[Any]]) -> None:
    def start(name: str, *command: Any) -> tuple[Path, subprocess.Popen[Any]]:
        output = tmp_path / f"{name}.out"
        with output.open("wb") as file:
            processes.append(subprocess.Popen([str(word) for word in command], cwd=tmp_path, stdout=file, stderr=file))
        return output, processes[-1]

    instructions = tmp_path / "instructions.jsonl"
    instructions.touch()
    emulator = start("emulator", BINARIES.resolve() / "hapticd_emulated_rig", "--instructions", instructions, "--late-ticks", "builtin",
                     "--drift-n-per-s", "0.001", "--write", "rig.toml")  # fmt: skip
    page_of_device = shlex.split(line_of(emulator[0], r"(HD_STAND_IN_PAGE=\S+)", emulator[1]))[0]
    with (tmp_path / "rig.toml").open("a") as file:
        file.write(CEILINGS)
    daemon = start("hapticd", "env", page_of_device, BINARIES.resolve() / "hapticd", "--config", "rig.toml", "--listen", "127.0.0.1:0",
                   "--model-store", tmp_path / "models.sqlite")  # fmt: skip
    address = line_of(daemon[0], r"listens on (\S+)", daemon[1])
    (tmp_path / "short.toml").write_text(PROTOCOL)
    (tmp_path / "scenes").mkdir()
    (tmp_path / "scenes" / "press_late.toml").write_text(SCENE)

    def control(*words: str) -> str:
        done = subprocess.run([BINARIES.resolve() / "hapticctl", "--server", address, *words], cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    time.sleep(2.0)  # until the sensor's stream is up
    control("sensor", "bias")
    control("experiment", "check", "./short.toml")
    control("clear")
    session = start("session", BINARIES.resolve() / "hapticctl", "--server", address, "experiment", "run", "./short.toml",
                    "--participant", "P01", "--folder", "sessions", "--port", "0")  # fmt: skip
    url = line_of(session[0], r"participant's page: +(\S+)", session[1])
    person = start("person", sys.executable, Path(__file__).parent / "answering_page.py", url, "--instructions", instructions, "--touch-s", "4")
    assert person[1].wait(timeout=500) == 0, session[0].read_text() + daemon[0].read_text()
    assert session[1].wait(timeout=60) == 0, session[0].read_text()

    events = [json.loads(line) for line in (tmp_path / "sessions" / "short_P01.jsonl").read_text().splitlines()]
    assert events[-1]["event"] == "end"
    shown = [event for event in events if event["event"] == "presentation"]
    valid = [event for event in shown if not event["flaws"]]
    assert len(valid) >= 2
    for event in shown:  # however late the clock is: no fast motion, and what is felt is an object
        assert set(event["flaws"]) <= {"ticks_lost"}, event
        assert event["contacts"] >= 1 and 0.3 < event["peak_force_n"] < 3.0, event
