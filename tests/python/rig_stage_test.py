"""Presentations on a simulated rig whose time runs fast: table, guide, press, judgement."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import hapticd
from hapticd.errors import BadFile
from hapticd.experiment import protocol
from hapticd.experiment.hands import SimulatedHand
from hapticd.experiment.rig_stage import RigStage
from hapticd.experiment.session import Trial
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
    infeasible = document()
    infeasible["condition"] = [{**document()["condition"][0], "object_n_per_mm": 5.0}]
    with hapticd.connect(daemon.address) as rig, RigStage(rig, SimulatedHand(1, "S1")) as stage:
        for changed, word in ((wrong, "sponge, ball, empty|ball, empty, sponge"), (infeasible, "not feasible")):
            with pytest.raises(BadFile, match=word):
                stage.check(protocol.of(changed, "test"))
        with pytest.raises(hapticd.HapticdError, match="no_such_scene"):
            stage.check(protocol.of(unknown, "test"))
