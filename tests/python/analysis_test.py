"""The command line without a rig: simulate, analyse, export; and the protocols that ship."""

from __future__ import annotations

import csv
import json
import math
import subprocess
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any, Iterator

import pytest

from hapticd.errors import BadFile
from hapticd.experiment import analysis, export, plots, protocol, runner
from hapticd.experiment.__main__ import main
from hapticd.experiment.observer import Observer
from hapticd.experiment.simulated import SimulatedParticipant
from hapticd.experiment.stage import BareStage
from memory import memory_folder

SHIPPED = sorted(path.stem for path in protocol.SHIPPED.glob("*.toml"))


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_protocol_is_short_and_whole(name: str) -> None:
    assert len((protocol.SHIPPED / f"{name}.toml").read_text().splitlines()) <= 60
    chosen = protocol.read(name)
    assert chosen.name == name and len(chosen.conditions) == 4
    # What is not the daemon's own scene is in the document, and so in every journal.
    shipped_scenes = {"press_guided", "wall_guided", "explore_watched", "ball_watched"}
    for condition in chosen.conditions:
        for stimulus in (condition.reference, condition.comparison):
            assert stimulus.scene_toml or stimulus.scene in shipped_scenes


def test_each_experiment_has_a_corrected_variant() -> None:
    published = [name for name in SHIPPED if not name.endswith("_corrected")]
    assert published == ["stiffness_1d", "stiffness_3d", "tumour_realism"]
    assert all(f"{name}_corrected" in SHIPPED for name in published)


@pytest.fixture(scope="module")
def sessions() -> Iterator[Path]:
    with memory_folder() as folder:
        assert main(["simulate", "stiffness_3d", "--no-rig", "--participants", "3", "--folder", str(folder)]) == 0
        yield folder


def test_a_session_of_another_seed_is_not_taken_for_one_of_this(memory_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    begun = ["simulate", "stiffness_1d", "--no-rig", "--folder", str(memory_path)]
    assert main([*begun, "--participants", "2", "--only", "1", "--seed", "7"]) == 0
    path = memory_path / "stiffness_1d_S02.jsonl"
    assert capsys.readouterr().out == f"{path}: done\n"
    assert main([*begun, "--participants", "2", "--seed", "5"]) == 1
    said = capsys.readouterr()
    assert said.err == (
        f"hapticctl: {path}: this journal is of another seed (got --seed 5); accepted: --seed 7; "
        "go on with that seed, or name another --folder for the new one\n"
    )
    # Nothing was simulated for those before it either: the folder would hold both seeds.
    assert not said.out and [one.name for one in memory_path.iterdir()] == [path.name]
    assert main([*begun, "--participants", "2", "--seed", "7"]) == 0
    assert [line.partition(": ")[2] for line in capsys.readouterr().out.splitlines()] == ["done", "was done already"]
    assert main([*begun, "--participants", "1", "--seed", "7", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["was_done_already"] is True


def test_the_analysis_finds_the_targets(sessions: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["analyse", str(sessions), "--json", "--figures", str(tmp_path / "figures")]) == 0
    found = json.loads(capsys.readouterr().out)
    assert len(found["estimates"]) == 12 and len(found["conditions"]) == 4
    for one in found["conditions"]:
        # What is felt is the level: three observers with Weber fractions up to 0.12.
        assert one["mean"] == pytest.approx(one["target"], rel=0.15)
        assert one["low"] < one["mean"] < one["high"]
    assert {path.name for path in (tmp_path / "figures").iterdir()} >= {"equality.svg", "series_S01_ball_03.svg"}


def test_an_equality_beyond_the_presented_levels_is_called_an_extrapolation(memory_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    chosen = protocol.read("stiffness_3d")
    rendered = {"sponge_08": 0.75}  # by a device that renders less than the target
    journal = runner.begin(memory_path, chosen, "S1", 0, 7, {}, rendered)
    runner.Runner(journal, BareStage(chosen, 7, "S1"), SimulatedParticipant(Observer("S1", 7))).run()
    journal.close()
    beyond, *others = sorted(analysis.estimates(analysis.read([memory_path])), key=lambda one: one.condition != "sponge_08")
    assert beyond.fit.pse > beyond.highest_presented == 0.75 and not any(one.is_extrapolated for one in others)
    assert main(["analyse", str(memory_path)]) == 0
    remarks = [line for line in capsys.readouterr().out.splitlines() if line.startswith("remark: ")]
    assert remarks == [
        f"remark: S1, sponge_08: the PSE of {beyond.fit.pse:.3f} N/mm is an extrapolation: levels of "
        f"{beyond.lowest_presented:.3f} … 0.750 N/mm were presented; the mean counts it as it is"
    ]
    assert main(["analyse", str(memory_path), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [f"remark: {one}" for one in found["remarks"]] == remarks
    assert next(one for one in found["conditions"] if one["condition"] == "sponge_08")["mean"] == beyond.fit.pse


def test_a_session_that_was_not_ended_counts_with_what_is_done(sessions: Path, tmp_path: Path) -> None:
    whole = (sessions / "stiffness_3d_S01.jsonl").read_bytes().splitlines(keepends=True)
    begun = [i for i, line in enumerate(whole) if json.loads(line)["event"] == "condition"]
    cut = tmp_path / "stiffness_3d_S01.jsonl"
    cut.write_bytes(b"".join(whole[: begun[2] + 3]))
    read = analysis.read([cut])
    assert len(analysis.estimates(read)) == 2
    assert "not at the end: S01" in analysis.text_of(read, analysis.estimates(read), [])


def test_journals_of_two_protocols_are_not_mixed(sessions: Path, memory_path: Path) -> None:
    assert main(["simulate", "stiffness_1d_corrected", "--no-rig", "--participants", "1", "--folder", str(memory_path)]) == 0
    with pytest.raises(BadFile, match="different protocols"):
        analysis.read([sessions, memory_path])
    with pytest.raises(BadFile, match="no journal"):
        empty = memory_path / "empty"
        empty.mkdir()
        analysis.read([empty])


def test_bids_has_all_rows_and_says_what_they_are(sessions: Path, tmp_path: Path) -> None:
    out = tmp_path / "dataset"
    assert main(["export", str(sessions), "--out", str(out), "--author", "A. Author", "--author", "B. Author"]) == 0
    table = (out / "sub-S01" / "beh" / "sub-S01_task-stiffness3d_beh.tsv").read_text().splitlines()
    header = table[0].split("\t")
    assert all(len(line.split("\t")) == len(header) for line in table)
    sidecar = json.loads((out / "sub-S01" / "beh" / "sub-S01_task-stiffness3d_beh.json").read_text())
    assert set(header) | {"TaskName"} <= set(sidecar) and all("Description" in sidecar[name] for name in header)
    assert "onset" not in header  # without a rig there is no clock
    read = analysis.read([sessions])[0]
    rows: list[dict[str, Any]] = [dict(zip(header, line.split("\t"))) for line in table[1:]]
    answers = [event for event in read.events if event["event"] == "answer"]
    assert [row["answer"] for row in rows if row["trial_type"] == "answer"] == [event["answer"] for event in answers]
    people = (out / "participants.tsv").read_text().splitlines()
    assert people[0].startswith("participant_id") and len(people) == 4
    assert set(json.loads((out / "participants.json").read_text())) == set(people[0].split("\t")[1:])
    assert json.loads((out / "dataset_description.json").read_text())["Authors"] == ["A. Author", "B. Author"]
    assert main(["export", str(sessions), "--out", str(out)]) == 1  # nothing is overwritten


#: Times of journals: of the rig with a recording, without one, and with one begun again after a pause.
TIMES = {
    "recorded": [("recording", 100.0, None), ("presentation", 104.0, 3.0), ("answer", 105.0, None)],
    "not_recorded": [("presentation", 104.0, 3.0), ("answer", 105.0, None)],
    "resumed": [("recording", 100.0, None), ("answer", 105.0, None), ("recording", 20.0, None), ("answer", 21.0, None)],
}


@pytest.mark.parametrize("case, onsets", [("recorded", [1.0, 5.0]), ("not_recorded", [0.0, 1.0]), ("resumed", [5.0, 1.0])])
def test_onsets_count_from_the_recording(sessions: Path, case: str, onsets: list[float]) -> None:
    whole = analysis.read([sessions])[0]
    answer = next(event for event in whole.events if event["event"] == "answer")
    presented = next(event for event in whole.events if event["event"] == "presentation")
    events = []
    for number, (kind, time_s, duration_s) in enumerate(TIMES[case]):
        event = {"presentation": presented, "answer": answer, "recording": {"recording": f"r{number}"}}[kind]
        events.append({**event, "event": kind, "time_s": time_s, **({} if duration_s is None else {"duration_s": duration_s})})
    assert [row["onset"] for row in export.rows(replace(whole, events=events))] == onsets


@pytest.mark.parametrize("protocol_name", [name for name in SHIPPED if name.startswith("stiffness")])
def test_the_bids_validator_finds_no_fault(protocol_name: str, tmp_path: Path, memory_path: Path) -> None:
    command = ["simulate", protocol_name, "--no-rig", "--participants", "2", "--folder", str(memory_path)]
    assert main(command) == 0 and main(["export", str(memory_path), "--out", str(tmp_path / "dataset"), "--author", "A", "--author", "B"]) == 0
    script = Path(__file__).resolve().parents[2] / "deploy" / "bids_validator.sh"
    done = subprocess.run(["bash", str(script), str(tmp_path / "dataset")], capture_output=True, text=True)
    if done.returncode == 77:
        pytest.skip(done.stderr)
    issues = json.loads(done.stdout)["issues"]
    assert not issues["errors"] and not issues["warnings"], [(one["key"], one["reason"]) for kind in issues.values() for one in kind]


def test_the_table_has_each_participants_equality(sessions: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["analyse", str(sessions)]) == 0
    lines = capsys.readouterr().out.splitlines()
    for one in analysis.estimates(analysis.read([sessions])):
        wanted = f"{one.fit.pse:.3f} ({one.fit.low:.3f} … {one.fit.high:.3f})"
        assert any(line.split()[:2] == [one.participant, one.condition] and wanted in line for line in lines)


def test_figures_of_one_participant_are_drawn_without_a_warning(tmp_path: Path) -> None:
    assert main(["simulate", "stiffness_1d", "--no-rig", "--participants", "1", "--folder", str(tmp_path)]) == 0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert main(["analyse", str(tmp_path), "--figures", str(tmp_path / "figures")]) == 0
        plots.similarity([analysis.Rating("P1", "one", 50.0, [("a", 2.0), ("b", math.nan)])], ["one", "two"]).savefig(tmp_path / "s.svg")


@pytest.mark.parametrize("command", [["check", "stiffness_1d", "--no-rig"], ["check", "no_such"], ["analyse", "/no/such"]])
def test_json_is_all_that_is_said(command: list[str], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    status = main([*command, "--json"])
    said = capsys.readouterr()
    answer = json.loads(said.out)
    assert ("error" in answer) == (status == 1) and not said.err
    monkeypatch.setenv("HAPTICD_JSON", "1")  # as `hapticctl --json` has it
    assert main(command) == status and json.loads(capsys.readouterr().out) == answer


def test_one_table_for_other_programs(sessions: Path, tmp_path: Path) -> None:
    assert main(["export", str(sessions), "--out", str(tmp_path / "all.csv")]) == 0
    assert main(["export", str(sessions), "--out", str(tmp_path / "psychopy.csv"), "--psychopy"]) == 0
    with (tmp_path / "psychopy.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    read = analysis.read([sessions])
    answers = sum(event["event"] == "answer" for one in read for event in one.events)
    assert len(rows) == answers and set(export.PSYCHOPY) == set(rows[0])
    assert all(math.isfinite(float(row["trials.intensity"])) for row in rows)
    # Every column of a quantity ends in its unit: nothing beside the table says it.
    with (tmp_path / "all.csv").open(newline="") as file:
        head = next(csv.reader(file))
    suffixes = {"s": "_s", "N": "_n", "mm": "_mm", "N/mm": "_n_per_mm", "mm/s": "_mm_per_s"}
    units = [None, *(about.get("Units") for about in export.COLUMNS.values())]
    assert [name for name, unit in zip(head, units, strict=True) if unit and not name.endswith(suffixes[unit])] == []
    assert {"onset_s", "duration_s"} <= set(head)
    assert main(["export", str(sessions), "--out", str(tmp_path / "folder"), "--psychopy"]) == 1


def test_a_scan_without_touches_names_the_file_and_what_a_touch_is(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    h5py = pytest.importorskip("h5py")
    recording = tmp_path / "scan.h5"
    contact = [1.0, 1.0, 0.0, 1.0, 0.0]  # in contact from the start, which does not count; then a touch
    with h5py.File(recording, "w") as file:
        for name in ("contact_in_contact", *(f"sample_tip_position_{axis}_mm" for axis in "xyz")):
            file[f"telemetry/{name}"] = contact
        for name in ("tick", "time_ns", "kind", "text", "by"):
            file[f"events/{name}"] = []
    assert main(["scan", str(recording), "--out", str(tmp_path / "surface.toml")]) == 1
    said = capsys.readouterr().err
    assert said.startswith(f"hapticctl: {recording}: too few touches (got 1); accepted: ≥ 9; ")
    assert "a touch is each contact that begins in free air" in said
    assert not (tmp_path / "surface.toml").exists()
