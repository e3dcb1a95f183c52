"""Two stimuli next to each other, and inclusions that are moved: without a rig."""

from __future__ import annotations

import math
import tomllib
from typing import Any

import pytest

from hapticd.errors import BadFile
from hapticd.experiment import free_change, inclusions, protocol
from hapticd.experiment.stage import Presentation


def visit(path_mm: float, felt: float = 0.3) -> Presentation:
    return Presentation((), {"lateral_path_mm": path_mm}, felt)


def test_a_path_is_that_of_all_touches_of_a_place() -> None:
    chosen = protocol.read("stiffness_3d")
    assert chosen.min_lateral_path_mm == 60.0
    enough = [("reference", visit(35.0)), ("comparison", visit(61.0)), ("reference", visit(26.0))]
    assert free_change.flaws_of_all(chosen, enough) == []  # type: ignore[arg-type]
    assert free_change.flaws_of_all(chosen, enough[:2]) == ["lateral_path"]  # type: ignore[arg-type]
    assert free_change.flaws_of_all(chosen, enough[1:2]) == ["no_contact"]  # type: ignore[arg-type]


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
