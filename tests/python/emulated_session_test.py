"""A whole session on the emulated rig: device and sensor over their real transports, a late clock, a zero that drifts."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from emulated_rig import LATE

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
SCENE = 'name = "press_late"\nkind = "tap_1d"\n[target]\nstiffness_n_per_mm = 0.6\n[fixture]\n[watch]\n' + LATE


def test_a_session_with_a_late_clock_and_a_drifting_zero(tmp_path: Path, emulated_rig: Any) -> None:
    instructions = tmp_path / "instructions.jsonl"
    instructions.touch()
    rig = emulated_rig("--instructions", instructions)
    (tmp_path / "short.toml").write_text(PROTOCOL)
    (tmp_path / "scenes").mkdir()
    (tmp_path / "scenes" / "press_late.toml").write_text(SCENE)

    rig.control("sensor", "bias")
    rig.control("experiment", "check", "./short.toml")
    rig.control("clear")
    session = rig.start("session", *rig.command("experiment", "run", "./short.toml", "--participant", "P01", "--folder", "sessions",
                                                "--port", "0"))  # fmt: skip
    url = rig.line_of(session, r"participant's page: +(\S+)")
    person = rig.start("person", sys.executable, Path(__file__).parent / "answering_page.py", url, "--instructions", instructions)
    assert person.wait(timeout=500) == 0, rig.output_of("session").read_text() + rig.output_of("hapticd").read_text()
    assert session.wait(timeout=60) == 0, rig.output_of("session").read_text()

    events = [json.loads(line) for line in (tmp_path / "sessions" / "short_P01.jsonl").read_text().splitlines()]
    assert events[-1]["event"] == "end"
    shown = [event for event in events if event["event"] == "presentation"]
    valid = [event for event in shown if not event["flaws"]]
    assert len(valid) >= 2
    for event in shown:  # however late the clock is: no fast motion, and what is felt is an object
        assert set(event["flaws"]) <= {"ticks_lost"}, json.dumps(event)
        assert event["contacts"] >= 1 and 0.3 < event["peak_force_n"] < 3.0, json.dumps(event)
