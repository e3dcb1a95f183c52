"""Two stimuli next to each other, and inclusions that are moved: without a rig."""

from __future__ import annotations

import math
import tomllib
from typing import Any

import numpy as np
import pytest

from hapticd.block import Block, Columns
from hapticd.errors import BadFile
from hapticd.experiment import free_change, inclusions, protocol
from hapticd.experiment.stage import Presentation
from hapticd.experiment.touch import Touch


def visit(path_mm: float, felt: float = 0.3, contact_s: float = 0.5) -> Presentation:
    return Presentation((), {"lateral_path_mm": path_mm, "time_in_contact_s": contact_s}, felt)


def test_a_path_is_that_of_all_touches_of_a_place() -> None:
    chosen = protocol.read("stiffness_3d")
    assert chosen.min_lateral_path_mm == 60.0
    enough = [("reference", visit(35.0)), ("comparison", visit(61.0)), ("reference", visit(26.0))]
    assert free_change.flaws_of_all(chosen, enough) == []  # type: ignore[arg-type]
    assert free_change.flaws_of_all(chosen, enough[:2]) == ["lateral_path"]  # type: ignore[arg-type]
    assert free_change.flaws_of_all(chosen, enough[1:2]) == ["no_contact"]  # type: ignore[arg-type]
    brief = [("reference", visit(70.0, contact_s=0.1)), ("comparison", visit(61.0)), ("reference", visit(5.0, contact_s=0.1))]
    assert free_change.flaws_of_all(chosen, brief) == ["contact_time"]  # type: ignore[arg-type]


def test_what_was_felt_is_the_mean_of_the_visits() -> None:
    visits = [("reference", visit(60.0, 0.2)), ("comparison", visit(60.0, 0.5)), ("reference", visit(60.0, 0.8))]
    assert free_change.joined(visits, "reference").felt_n_per_mm == pytest.approx(0.4)  # type: ignore[arg-type]
    assert math.isnan(free_change.joined(visits[:1], "comparison").felt_n_per_mm)  # type: ignore[arg-type]


def changed(**values: Any) -> dict[str, Any]:
    document = dict(protocol.read("stiffness_3d").document)
    for name, value in values.items():
        document[name] = {**document.get(name, {}), **value}
    return document


@pytest.mark.parametrize(
    "values, word",
    [
        ({"comparison": {"at_mm": [40, 0]}}, "too close"),
        ({"comparison": {"station": "empty"}}, "cannot bring"),
        ({"trial": {"order": "random"}}, "never change"),
        ({"presentation": {"approach": "guided"}}, "never change"),
        ({"presentation": {"change": "often"}}, "table, free"),
        ({"reference": {"station": "sponge", "stations": ["a"]}}, "one of the two"),
    ],
)
def test_what_cannot_be_changed_freely_is_said(values: dict[str, Any], word: str) -> None:
    document = changed(**values)
    if "reference" in values:
        for condition in document["condition"]:
            condition["reference"] = {}
    with pytest.raises(BadFile, match=word):
        protocol.of(document, "test")


def test_an_inclusion_is_moved_in_the_text_of_its_scene() -> None:
    condition = protocol.read("tumour_realism").condition("RhVh")
    assert inclusions.are_in(condition.comparison.scene_toml) and not inclusions.are_in(condition.reference.scene_toml)
    text = inclusions.moved(condition.comparison.scene_toml, 3.5, -2.0, (0.0, 0.0, -63.0))
    scene = tomllib.loads(text)
    assert scene["inclusion"] == [{"model": "tumour_hard", "moved_mm": [3.5, -2.0], "object_centre_mm": [0, 0, -63]}]
    assert inclusions.moved(condition.comparison.scene_toml, 0.0, 0.0) == condition.comparison.scene_toml


def touch_of(samples: list[tuple[float, bool, float]]) -> Touch:
    """samples: height, mm; whether there is contact; its evidence."""
    names = ("tick", "time_ns", *(f"sample_tip_position_{axis}_mm" for axis in "xyz"), "contact_in_contact", "contact_authority")
    columns = Columns(names, [""] * len(names), ["<i8", "<i8"] + ["<f8"] * 5)
    rows = np.zeros(len(samples), dtype=columns.dtype)
    rows["tick"], rows["time_ns"] = np.arange(len(samples)), 4_000_000 * np.arange(len(samples))
    rows["sample_tip_position_z_mm"], rows["contact_in_contact"], rows["contact_authority"] = np.array(samples).T
    touch = Touch(has_truth=False, from_contact=False)
    for at in range(0, len(rows), 3):
        touch.add(Block(columns, rows[at : at + 3]))
    return touch


def test_a_touch_begins_where_its_evidence_says() -> None:
    # On the way down the hand stops short, which is taken for a contact for a moment; the object is at 0 mm.
    way = [(8.0, False, 0.0), (8.0, True, 0.0), (7.9, True, 0.1), (7.8, False, 0.0), (4.0, False, 0.0)]
    touched = [(0.0, True, 0.0), (-0.2, True, 0.2), (-0.4, True, 0.6)]
    assert not touch_of(way).has_pressed
    assert not touch_of(way + touched).has_pressed
    assert touch_of(way + touched + [(-0.7, True, 1.0)]).has_pressed
    pressed = touch_of(way + touched + [(-2.0, True, 1.0), (-0.4, True, 0.5)])
    assert not pressed.is_lifted
    pressed.add(touch_of([(-0.2, False, 0.0)])._blocks[0])
    assert pressed.is_lifted
