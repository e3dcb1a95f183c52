"""Presentations on a simulated rig whose time runs fast: table, guide, press, judgement."""

from __future__ import annotations

import re
import signal
import subprocess
from pathlib import Path
from typing import Any, Callable

import pytest

import hapticd
from daemon import BINARIES
from hapticd.errors import BadFile, Refused
from hapticd.experiment import journal, protocol, runner, simulation
from hapticd.experiment.__main__ import main
from hapticd.experiment.hands import SimulatedHand
from hapticd.experiment.observer import Observer
from hapticd.experiment.rig_stage import RigStage
from hapticd.experiment.session import Trial
from hapticd.experiment.simulated import SimulatedParticipant
from hapticd.v1 import rig_pb2

CONFIGURATION = """
[rig.sim]
speed = 20
[rig.turntable]
kind = "sim"
speed_deg_per_s = 360
acceleration_deg_per_s2 = 4000
settle_s = 0.01
[rig.turntable.sim]
homed = true
[rig.turntable.stations.sponge]
angle_deg = 0
object = "sponge_block"
[rig.turntable.stations.ball]
angle_deg = 4
object = "rubber_ball"
[rig.turntable.stations.empty]
angle_deg = 8
object = "none"
"""


def document() -> dict[str, Any]:
    return dict(protocol.read("stiffness_1d").document)


def test_what_is_felt_follows_the_level(start_daemon: Any, tmp_path: Path) -> None:
    configuration = tmp_path / "rig.toml"
    configuration.write_text(CONFIGURATION)
    daemon = start_daemon("--model-store", ":memory:", "--config", str(configuration))
    chosen = protocol.read("stiffness_1d")
    with hapticd.connect(daemon.address) as rig, RigStage(rig, SimulatedHand(1, "S1"), wait_for_clear_s=0.0) as stage:
        stage.check(chosen)
        felt = {}
        for number, (role, level) in enumerate((("reference", 0.3), ("comparison", 0.2), ("comparison", 0.6))):
            trial = Trial("ball_03", number, 0, 0, level, ("reference", "comparison"))
            presentation = stage.present(trial, role)  # type: ignore[arg-type]
            assert presentation.record["end_tick"] > presentation.record["begin_tick"]
            felt[role, level] = presentation.felt_n_per_mm
        assert felt["comparison", 0.2] < felt["reference", 0.3] < felt["comparison", 0.6]

        rig.stop("test")
        while rig.get_rig_state().guard_state != rig_pb2.GUARD_STATE_LATCHED:
            pass
        with pytest.raises(Exception, match="no one cleared it"):
            stage.present(Trial("ball_03", 9, 0, 0, 0.3, ("reference", "comparison")), "reference")
        rig.clear()


def test_what_cannot_be_run_is_said_before(start_daemon: Any, tmp_path: Path) -> None:
    configuration = tmp_path / "rig.toml"
    configuration.write_text(CONFIGURATION)
    daemon = start_daemon("--model-store", ":memory:", "--config", str(configuration))
    wrong = document()
    wrong["condition"] = [{**document()["condition"][0], "reference": {"station": "foam"}}]
    unknown = document()
    unknown["comparison"] = {"scene": "no_such_scene"}
    unwatched = document()
    unwatched["reference"] = {"scene": "tap_1d"}
    infeasible = document()
    infeasible["condition"] = [{**document()["condition"][0], "object_n_per_mm": 5.0}]
    with hapticd.connect(daemon.address) as rig, RigStage(rig, SimulatedHand(1, "S1")) as stage:
        for changed, word in ((wrong, "sponge, ball, empty|ball, empty, sponge"), (unwatched, r"reference: scene.*tap_1d.*\[watch\]"), (infeasible, "not feasible")):
            with pytest.raises(BadFile, match=word):
                stage.check(protocol.of(changed, "test"))
        with pytest.raises(hapticd.HapticdError, match="no_such_scene"):
            stage.check(protocol.of(unknown, "test"))


def written(tmp_path: Path, *changes: tuple[str, str]) -> Path:
    text = CONFIGURATION
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    configuration = tmp_path / "rig.toml"
    configuration.write_text(text)
    return configuration


def press_steadily(rig: hapticd.Rig) -> None:
    rig.set_object("sponge_block")
    rig.set_hand_program({"kind": "press", "force_n": 2.0, "force_rate_n_per_s": 6.0, "hold_s": 3600.0, "repetitions": 1})
    while abs(rig.read(0.1, ["sample"])["sample_sensor_force_z_n"][-1]) < 1.0:
        pass


@pytest.mark.parametrize(
    "changes, presses, stops, words",
    [
        ([("homed = true", "homed = false")], False, False, ["turntable", "turntable home"]),
        ([], True, False, ["under load"]),
        ([], False, True, ["guard", "stopped", "hapticctl clear"]),
        ([("object = \"rubber_ball\"", "object = \"rubber_ball\"\n[rig.turntable.stations.other]\nangle_deg = 12"),
          ("stations.ball]", "stations.bal]")], False, False, ["no such station", "--write-rig"]),
    ],
    ids=["not_homed", "load", "latched", "no_station"],
)  # fmt: skip
def test_what_would_end_a_session_is_found_before(
    start_daemon: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
    changes: list[tuple[str, str]], presses: bool, stops: bool, words: list[str],
) -> None:  # fmt: skip
    daemon = start_daemon("--model-store", ":memory:", "--config", str(written(tmp_path, *changes)))
    monkeypatch.setenv("HAPTICD_SERVER", daemon.address)
    with hapticd.connect(daemon.address) as rig:
        if presses:
            press_steadily(rig)
        if stops:
            rig.stop("test")
        assert main(["check", "stiffness_1d"]) == 1
        said = capsys.readouterr().err
        assert all(word in said for word in words), said
        for command in (["simulate", "--participants", "1"], ["run", "--participant", "P1", "--no-record", "--port", "0"]):
            if command[0] == "run" and stops:
                continue  # the experimenter's page clears it
            assert main([command[0], "stiffness_1d", "--folder", str(tmp_path / "sessions"), *command[1:]]) in (1, 5)
        assert not list(tmp_path.glob("sessions/*.jsonl")) and not rig.get_lease().HasField("lease")


def test_a_session_waits_until_the_tool_is_let_go(start_daemon: Any, tmp_path: Path) -> None:
    daemon = start_daemon("--model-store", ":memory:", "--config", str(written(tmp_path)))
    waits: list[str] = []
    with hapticd.connect(daemon.address) as rig:

        class Presses(SimulatedHand):
            """Lets go when it is asked to."""

            def follow(self, rig: hapticd.Rig) -> None:
                if waits:
                    super().follow(rig)

        def waited(text: str) -> None:
            waits.append(text)
            rig.set_hand_program({"kind": "rest"})

        press_steadily(rig)
        with RigStage(rig, Presses(1, "S1"), on_wait=waited) as stage:
            stage.check(protocol.read("stiffness_1d"))
            presentation = stage.present(Trial("ball_03", 0, 0, 0, 0.3, ("reference", "comparison")), "reference")
            assert presentation.record["contacts"] >= 1 and "load" in waits[0] and waits[-1] == ""


PAGE = Path(__file__).resolve().parents[2] / "docs" / "experiments.md"


def test_the_protocol_of_the_page_runs_as_it_is_printed(start_daemon: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    printed = re.findall(r"## A protocol file\n\n```toml\n(.*?)```", PAGE.read_text(), re.DOTALL)
    (tmp_path / "pilot.toml").write_text(printed[0].replace("trials = 40", "trials = 3"))
    monkeypatch.setattr(simulation, "HANDS", 2)
    file, rig_file = str(tmp_path / "pilot.toml"), tmp_path / "rig.toml"
    assert main(["check", file, "--write-rig", str(rig_file)]) == 0
    rig_file.write_text(rig_file.read_text().replace("speed = 25", "speed = 10"))  # for a machine that does much else
    daemon = start_daemon("--model-store", ":memory:", "--config", str(rig_file))
    monkeypatch.setenv("HAPTICD_SERVER", daemon.address)
    assert main(["check", file]) == 0
    assert "()" not in capsys.readouterr().out
    assert main(["simulate", file, "--participants", "2", "--folder", str(tmp_path / "pilot")]) == 0
    journals = sorted((tmp_path / "pilot").glob("*.jsonl"))
    events = [journal.read(path) for path in journals]
    assert len(events) == 2 and all(one[-1]["event"] == "end" for one in events)
    assert events[0][0]["rendered_n_per_mm"]["ball"] > 0.5  # what the rig has, if the protocol says nothing
    # Measured twice, and used by both participants.
    felt = [{event.get("felt_n_per_mm") for event in one if event["event"] == "presentation" and event["role"] == "reference"} for one in events]
    assert len(felt[0] | felt[1]) <= simulation.HANDS


@pytest.mark.parametrize("name", sorted(path.stem for path in protocol.SHIPPED.glob("*.toml")))
def test_the_shipped_rig_has_the_stations_of_a_protocol(start_daemon: Any, tmp_path: Path, name: str) -> None:
    daemon = start_daemon("--model-store", ":memory:", "--config", str(protocol.simulated_rig(name)))
    with hapticd.connect(daemon.address) as rig:
        there = {station.name for station in rig.get_turntable().stations}
    assert {station for one in protocol.read(name).stimuli for station in one.all_stations} <= there


class Killer(SimulatedHand):
    """Does something in the middle of a press."""

    def __init__(self, act: Callable[[], None]) -> None:
        super().__init__(1, "S1")
        self._act = act
        self._acted = False

    def is_done(self, has_pressed: bool, lifted: bool) -> bool:
        if has_pressed and not self._acted:
            self._acted = True
            self._act()
        return super().is_done(has_pressed, lifted)


def journal_of(tmp_path: Path) -> Any:
    chosen = {**document(), "session": {"min_break_s": 0}, "condition": [{**document()["condition"][2]}]}
    return runner.begin(tmp_path, protocol.of(chosen, "test"), "S1", 0, 1, {})


def test_a_session_whose_lease_is_taken_ends_and_says_so(start_daemon: Any, tmp_path: Path) -> None:
    configuration = tmp_path / "rig.toml"
    configuration.write_text(CONFIGURATION)
    daemon = start_daemon("--model-store", ":memory:", "--config", str(configuration))
    other = hapticd.connect(daemon.address)
    hand = Killer(lambda: other.take_lease("the rig is needed", purpose="test", ttl_s=5.0))
    with hapticd.connect(daemon.address) as rig, RigStage(rig, hand, wait_for_clear_s=0.0) as stage:
        state = runner.Runner(journal_of(tmp_path), stage, SimulatedParticipant(Observer("S1", 1))).run()
    assert not state.ended and "lease" in state.aborted.lower()
    other.close()


def test_a_stop_in_mid_press_discards_the_trial(start_daemon: Any, tmp_path: Path) -> None:
    configuration = tmp_path / "rig.toml"
    configuration.write_text(CONFIGURATION)
    daemon = start_daemon("--model-store", ":memory:", "--config", str(configuration))
    with hapticd.connect(daemon.address) as rig, hapticd.connect(daemon.address) as other:
        hand = Killer(lambda: other.stop("test") and None)
        waits: list[str] = []

        def cleared(text: str) -> None:
            waits.append(text)
            if text:
                rig.clear()

        with RigStage(rig, hand, on_wait=cleared) as stage:
            opened = journal_of(tmp_path)
            answered = runner.Runner(opened, stage, SimulatedParticipant(Observer("S1", 1))).run(until=lambda state: state.answered >= 1)
    assert answered.answered == 1
    discarded = [event for event in opened.events if event["event"] == "discarded"]
    assert len(discarded) == 1 and any("guard" in why or "force" in why for why in discarded[0]["why"])
    assert waits[0] and waits[-1] == ""


def test_a_daemon_that_dies_in_mid_press_ends_the_session_and_another_goes_on(start_daemon: Any, tmp_path: Path) -> None:
    configuration = tmp_path / "rig.toml"
    configuration.write_text(CONFIGURATION)
    daemon = start_daemon("--model-store", ":memory:", "--config", str(configuration))
    hand = Killer(lambda: daemon.end(signal.SIGKILL))
    with hapticd.connect(daemon.address) as rig:
        with RigStage(rig, hand, wait_for_clear_s=0.0) as stage:
            opened = journal_of(tmp_path)
            state = runner.Runner(opened, stage, SimulatedParticipant(Observer("S1", 1))).run()
    assert not state.ended and state.aborted and state.answered == state.trained == 0
    opened.close()
    other = start_daemon("--model-store", ":memory:", "--config", str(configuration))
    resumed = runner.resume(opened.path)
    with hapticd.connect(other.address) as rig, RigStage(rig, SimulatedHand(1, "S1"), wait_for_clear_s=0.0) as stage:
        after = runner.Runner(resumed, stage, SimulatedParticipant(Observer("S1", 1))).run(until=lambda one: one.answered >= 1)
    assert after.answered == 1 and not after.aborted


def test_a_table_that_stalls_ends_the_session(start_daemon: Any, tmp_path: Path) -> None:
    drive = subprocess.Popen([BINARIES / "hapticd_emulated_drive", "--tcp", "0"], stdout=subprocess.PIPE, text=True)
    try:
        assert drive.stdout is not None
        port = int(re.findall(r":(\d+)", drive.stdout.readline())[0])
        configuration = tmp_path / "rig.toml"
        modbus = f'[rig.turntable.modbus]\ntransport = "tcp"\nhost = "127.0.0.1"\nport = {port}\nmap = "plain_drive"\n'
        table = CONFIGURATION.replace('kind = "sim"', 'kind = "modbus"').replace("[rig.turntable.sim]\nhomed = true\n", modbus)
        configuration.write_text(table.replace("speed_deg_per_s = 360", "speed_deg_per_s = 90").replace("= 4000", "= 180"))
        daemon = start_daemon("--model-store", ":memory:", "--config", str(configuration))
        with hapticd.connect(daemon.address) as rig:
            with rig.lease("test"):
                rig.home_turntable().last()
            hand = Killer(lambda: drive.send_signal(signal.SIGSTOP))
            with RigStage(rig, hand, wait_for_clear_s=0.0) as stage:
                state = runner.Runner(journal_of(tmp_path), stage, SimulatedParticipant(Observer("S1", 1))).run()
        assert not state.ended and "turntable" in state.aborted
    finally:
        drive.send_signal(signal.SIGCONT)
        drive.kill()
        drive.wait()


FREE = """
[rig.sim]
speed = 20
object_edge_mm = 60
"""


def of_free_change(path_mm: float) -> protocol.Protocol:
    """D§4.7 without a table: the object is under the tool already, and ends before the virtual one begins."""
    chosen = {**protocol.read("stiffness_3d").document}
    condition = {**chosen["condition"][0], "reference": {"object": "sponge_cut", "scene": "explore_sponge_watched"}}
    chosen["presentation"] = {**chosen["presentation"], "min_lateral_path_mm": path_mm, "max_press_s": 600.0}  # the rig's time runs on while a busy machine does not
    return protocol.of({**chosen, "session": {"min_break_s": 0}, "condition": [condition]}, "test")


def test_a_participant_changes_between_two_places(start_daemon: Any, tmp_path: Path) -> None:
    configuration = tmp_path / "rig.toml"
    configuration.write_text(FREE)
    daemon = start_daemon("--model-store", ":memory:", "--config", str(configuration), rig="sim:phantom_1_5_high_force")
    chosen = of_free_change(60.0)
    with hapticd.connect(daemon.address) as rig, RigStage(rig, SimulatedHand(1, "S1"), wait_for_clear_s=0.0) as stage:
        opened = runner.begin(tmp_path, chosen, "S1", 0, 1, {})
        runner.Runner(opened, stage, SimulatedParticipant(Observer("S1", 1))).run(until=lambda state: state.answered >= 2)
        shown = [event for event in opened.events if event["event"] == "presentation"]
        felt: dict[str, list[float]] = {"reference": [], "comparison": []}
        for event in shown:
            assert event["flaws"] == [] and event["contacts"] >= 1 and event["lateral_path_mm"] >= 60.0
            felt[event["role"]].append(event["felt_n_per_mm"])
        assert len(felt["reference"]) >= 2 and len(felt["comparison"]) >= 2
        # 0.3 N/mm on the left; on the right 0.7, then 0.1 less: there is no real object, and nothing but the wall is felt.
        assert all(one < 0.45 for one in felt["reference"]) and all(one > 0.45 for one in felt["comparison"])
        assert [event["interval"] for event in shown if event["trial"] == 0][:2] == [1, 2]

        # Too short a path, over all touches of a place, discards the trial.
        strict = runner.begin(tmp_path / "strict", of_free_change(5000.0), "S1", 0, 1, {})
        runner.Runner(strict, stage, SimulatedParticipant(Observer("S1", 1))).run(until=lambda state: state.attempts >= 1)
        assert [event["why"] for event in strict.events if event["event"] == "discarded"] == [["lateral_path"]]


def test_a_tumour_lies_elsewhere_each_time(start_daemon: Any, tmp_path: Path) -> None:
    configuration = tmp_path / "rig.toml"
    configuration.write_text("[rig.sim]\nspeed = 20\n")
    daemon = start_daemon("--model-store", ":memory:", "--config", str(configuration), rig="sim:phantom_1_5_high_force")
    with hapticd.connect(daemon.address) as rig, rig.lease("test"):
        rig.set_object("phantom_hard", inclusion_x_mm=-6.0, inclusion_y_mm=8.0)
        with pytest.raises(Refused, match="no inclusion"):
            rig.set_object("phantom", inclusion_x_mm=1.0)
        with pytest.raises(Refused, match="too far aside"):
            rig.set_object("phantom_hard", inclusion_x_mm=-60.0)
