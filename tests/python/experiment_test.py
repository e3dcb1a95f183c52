"""Procedures, journals and their analysis, without a rig."""

from __future__ import annotations

import json
import math
import os
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hapticd.errors import BadArgument, BadFile
from hapticd.experiment import fit, journal, procedures, protocol, runner, scan, seeds, session
from hapticd.experiment.observer import Observer, felt_stiffness
from hapticd.experiment.procedures import LimitsSeries, Series, UpDown
from hapticd.experiment.simulated import SimulatedParticipant
from hapticd.experiment.stage import BareStage


def test_a_descending_series_ends_after_three_softer_answers() -> None:
    series = LimitsSeries(0.5, -0.02)
    levels = []
    for answer in ("harder", "same", "softer", "same", "softer", "softer", "softer"):
        levels.append(series.next_level())
        series = series.answered(answer)  # type: ignore[arg-type]
    assert levels == [0.5, 0.48, 0.46, 0.44, 0.42, 0.4, 0.38]
    assert series.next_level() is None


def test_the_thresholds_are_halfway_between_the_trials() -> None:
    series = LimitsSeries(0.40, -0.02)
    for answer in ("harder", "harder", "same", "same", "softer", "softer", "softer"):
        series = series.answered(answer)  # type: ignore[arg-type]
    # 0.40 0.38 | 0.36 0.34 | 0.32: thresholds 0.37 and 0.33.
    assert fit.by_thresholds(Series((series,))) == pytest.approx(0.35)


def test_the_staircase_is_that_of_the_dissertation() -> None:
    stairs = UpDown(0.7, (0.1, 0.02), (4,), {"reversals": 15}, lowest=0.02)
    truth = 0.33
    while (level := stairs.next_level()) is not None:
        stairs = stairs.answered("harder" if level > truth else "softer")
    assert len(stairs.reversals) == 15
    assert stairs.reversals[:4] == pytest.approx([0.3, 0.4, 0.3, 0.4])
    assert np.ptp(stairs.reversals[5:]) == pytest.approx(0.02)
    assert fit.by_reversals(Series((stairs,)), 4) == pytest.approx(truth, abs=0.02)


def simulate(settings: dict[str, Any], count: int, reference: float, weber: float, lapse: float) -> list[Series]:
    done = []
    for number in range(count):
        observer = Observer("o", number, weber, lapse)
        series = procedures.make(settings, reference, 0.02, 2.0, number, "test")
        trial = 0
        while (level := series.next_level()) is not None:
            answer = observer.answer(reference, level, settings["kind"] == "limits", trial)
            series = series.answered({"second": "harder", "first": "softer", "same": "same"}[answer])  # type: ignore[arg-type]
            trial += 1
        done.append(series)
    return done


STAIRCASE = {
    "kind": "up_down", "start_shares": [0.7 / 0.3], "steps_n_per_mm": [0.1, 0.02], "steps_after_reversals": [4],
    "stop": {"reversals": 15}, "up": 1, "down": 1, "interleaved": False,
}  # fmt: skip
LIMITS = {
    "kind": "limits", "descending": 4, "ascending": 4, "step_n_per_mm": 0.02, "start_distance_n_per_mm": 0.2,
    "start_jitter_n_per_mm": 0.04, "end_after": 3,
}  # fmt: skip
CONSTANT = {"kind": "constant", "level_shares": [0.7, 0.8, 0.9, 1.0, 1.1, 1.25, 1.4], "repetitions": 12}


def test_the_published_staircase_is_biased_and_ours_is_not() -> None:
    done = simulate(STAIRCASE, 150, 0.3, 0.09, 0.0)
    published = np.mean([fit.by_reversals(one, 3) for one in done]) / 0.3 - 1.0
    ours = np.mean([fit.of_series(one).pse for one in done]) / 0.3 - 1.0
    assert 0.02 < published < 0.045
    assert abs(ours) < 0.012  # three standard errors of the mean


@pytest.mark.parametrize("settings", [STAIRCASE, LIMITS, CONSTANT], ids=["up_down", "limits", "constant"])
def test_the_intervals_hold_the_truth(settings: dict[str, Any]) -> None:
    fits = [fit.of_series(one) for one in simulate(settings, 60, 0.3, 0.09, 0.02)]
    covered = np.mean([one.low <= 0.3 <= one.high for one in fits])
    assert covered > 0.87  # 0.95 less three standard errors
    assert all((one.dl is not None) == (settings is CONSTANT) for one in fits)


def test_answers_that_are_all_alike_have_no_equality() -> None:
    series = Series((procedures.Constant((0.3,) * 6),))
    for _ in range(6):
        series = series.answered("harder")
    assert math.isnan(fit.of_series(series).pse)


def test_an_observer_feels_the_slope() -> None:
    depth = np.concatenate([np.linspace(0, 5, 200), np.linspace(5, 0, 100)])
    assert felt_stiffness(0.4 * depth + 0.1, depth) == pytest.approx(0.4)
    assert math.isnan(felt_stiffness(depth, 0.0 * depth))
    assert math.isnan(felt_stiffness(np.full(10, np.nan), np.zeros(10)))


def test_orders_are_balanced() -> None:
    rows = [seeds.balanced_order(4, participant) for participant in range(4)]
    assert all(sorted(column) == [0, 1, 2, 3] for column in zip(*rows))
    pairs = [(row[i], row[i + 1]) for row in rows for i in range(3)]
    assert len(set(pairs)) == 12


def document() -> dict[str, Any]:
    """Two short conditions."""
    return {
        "name": "short", "title": "t", "question": "q", "participants": 2,
        "answers": {"keys": {"1": "first", "2": "same", "3": "second"}},
        "reference": {"scene": "press_guided"}, "comparison": {"scene": "wall_guided"},
        "procedure": {"kind": "limits", "descending": 1, "ascending": 1, "step_n_per_mm": 0.05, "start_distance_n_per_mm": 0.1},
        "session": {"training_trials": 2},
        "condition": [{"name": "soft", "reference_n_per_mm": 0.3}, {"name": "hard", "reference_n_per_mm": 0.7}],
    }  # fmt: skip


def run(journal_: journal.Journal, stop_after: int = 10**9) -> None:
    chosen = session.fold(journal_.events).protocol
    stage = BareStage(chosen, 7, "S1", flawed_share=0.15)
    started = len(journal_.events)

    class Killed(Exception):
        pass

    class Participant(SimulatedParticipant):
        def notify(self, event: journal.Event) -> None:
            if len(journal_.events) - started >= stop_after:
                raise Killed

    try:
        runner.Runner(journal_, stage, Participant(Observer("S1", 7))).run()
    except Killed:
        pass
    finally:
        journal_.close()


def test_a_session_that_was_killed_anywhere_ends_as_if_it_had_not(memory_path: Path) -> None:
    chosen = protocol.of(document(), "test")
    run(runner.begin(memory_path / "whole", chosen, "S1", 0, 7, {}))
    path = memory_path / "whole" / "short_S1.jsonl"
    whole = path.read_bytes()
    kinds = {json.loads(line)["event"] for line in whole.splitlines()}
    assert {"begin", "condition", "presentation", "discarded", "answer", "rested", "end"} <= kinds
    for events in range(1, whole.count(b"\n")):
        for torn in (b"", b'{"event":"answ'):
            place = memory_path / f"{events}_{len(torn)}" / "short_S1.jsonl"
            place.parent.mkdir()
            place.write_bytes(b"\n".join(whole.split(b"\n")[:events]) + b"\n" + torn)
            run(runner.resume(place))
            assert place.read_bytes() == whole, events


def test_a_session_is_killed_twice(tmp_path: Path) -> None:
    chosen = protocol.of(document(), "test")
    run(runner.begin(tmp_path / "whole", chosen, "S1", 0, 7, {}))
    run(runner.begin(tmp_path / "cut", chosen, "S1", 0, 7, {}), stop_after=9)
    path = tmp_path / "cut" / "short_S1.jsonl"
    run(runner.resume(path), stop_after=12)
    run(runner.resume(path))
    assert path.read_bytes() == (tmp_path / "whole" / "short_S1.jsonl").read_bytes()


def test_a_code_is_used_once_and_a_journal_keeps_its_protocol(tmp_path: Path) -> None:
    chosen = protocol.of(document(), "test")
    runner.begin(tmp_path, chosen, "S1", 0, 7, {}).close()
    with pytest.raises(BadFile, match="already"):
        runner.begin(tmp_path, chosen, "S1", 0, 7, {})
    with pytest.raises(BadFile, match="code"):
        runner.begin(tmp_path, chosen, "../S1", 0, 7, {})
    other = document() | {"title": "another"}
    with pytest.raises(BadFile, match="another protocol"):
        runner.resume(tmp_path / "short_S1.jsonl", protocol.of(other, "test"))
    held = runner.resume(tmp_path / "short_S1.jsonl")
    with pytest.raises(BadFile, match="another program"):
        runner.resume(tmp_path / "short_S1.jsonl")
    held.close()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"tile": "x"}, ["unknown key", "tile", "title"]),
        ({"participants": 0}, ["participants", "1 … 1000"]),
        ({"participants": "two"}, ["number is needed"]),
        ({"answers": {"keys": {"1": "first"}}}, ["second"]),
        ({"procedure": {"kind": "guess"}}, ["unknown word", "limits"]),
        ({"condition": [{"name": "a", "reference_n_per_mm": 2000.0}]}, ["2000", "1000"]),
        ({"condition": [{"name": "a b", "reference_n_per_mm": 0.3}]}, ["a b"]),
        ({"reference": {"scene": "a", "scene_toml": "b"}}, ["one of the two"]),
        ({"trial": {"lowest_n_per_mm": 0.5, "highest_n_per_mm": 0.4}}, ["between"]),
    ],
)
def test_a_wrong_protocol_names_the_key(change: dict[str, Any], words: list[str]) -> None:
    with pytest.raises(BadFile) as raised:
        protocol.of(document() | change, "test.toml")
    assert "test.toml" in str(raised.value)
    for word in words:
        assert word in str(raised.value)


def test_shipped_protocols_are_read_and_short() -> None:
    shipped = sorted(protocol.SHIPPED.glob("*.toml"))
    assert shipped
    for path in shipped:
        assert protocol.read(path.stem).name == path.stem
        assert len(path.read_text().splitlines()) <= 60, path


def test_a_ball_that_was_touched_becomes_a_surface() -> None:
    random = np.random.default_rng(3)
    x, y = random.uniform(-25.0, 25.0, (2, 120))
    z = np.sqrt(50.0**2 - x**2 - y**2) - 50.0 + random.normal(0.0, 0.05, x.size)
    touches = np.stack([x, y, z], axis=1)
    touches[::30, 2] += 8.0  # touched something else
    surface = tomllib.loads(scan.surface_toml(touches))["wall"]["surface"]
    heights = np.array(surface["heights_mm"]).reshape(-1, surface["columns"])
    grid_x = surface["from_mm"][0] + surface["step_mm"] * np.arange(heights.shape[1])
    grid_y = surface["from_mm"][1] + surface["step_mm"] * np.arange(heights.shape[0])
    inside = np.hypot(*np.meshgrid(grid_x, grid_y)) < 22.0
    truth = np.sqrt(50.0**2 - grid_x[None, :] ** 2 - grid_y[:, None] ** 2) - 50.0
    assert np.abs(heights - truth)[inside].max() < 0.25
    with pytest.raises(BadArgument, match="too few"):
        scan.surface_toml(touches[:5])
    with pytest.raises(BadArgument, match="on a line"):
        scan.surface_toml(touches * [1.0, 0.0, 1.0])
    with pytest.raises(BadArgument, match="too fine"):
        scan.surface_toml(touches, 0.1)


def test_a_journal_that_is_no_file_or_cannot_be_written_again_is_refused(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.jsonl"
    os.mkfifo(pipe)
    for endless in (pipe, Path("/dev/zero")):
        with pytest.raises(BadFile, match="not a regular file"):
            journal.read(endless)
        with pytest.raises(BadFile, match="not a regular file"):
            protocol.read(str(endless))
    for line in (b'{"event": "\\ud800"}\n', b'{"event": "begin", "seed": NaN}\n', b'{"event": "begin", "seed": 1e999}\n'):
        with pytest.raises(BadFile, match="no event"):
            journal.parse(line, "a journal")


def test_an_answer_that_no_one_gives_is_refused() -> None:
    one = protocol.read("stiffness_3d")
    begin = session.begin(one, "P01", 1, 7, {})
    answer = {"event": "answer", "condition": "a", "training": True, "comparison_felt": "harder"}
    session.fold([begin, answer])
    for wrong in ({"comparison_felt": "hard"}, {"comparison_felt": None}, {"training": 1}, {"training": "no"}):
        with pytest.raises(BadFile, match="do not follow"):
            session.fold([begin, {**answer, **wrong}])
