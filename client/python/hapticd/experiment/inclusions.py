"""Inclusions of a scene's text: whether there are, and moved aside."""

from __future__ import annotations

import re
from typing import Sequence

_HEADER = re.compile(r"^\[\[ *inclusion *\]\][^\n]*\n", re.MULTILINE)


def are_in(scene_toml: str) -> bool:
    return _HEADER.search(scene_toml) is not None


def moved(scene_toml: str, x_mm: float, y_mm: float, object_centre_mm: Sequence[float] = ()) -> str:
    """The text with its inclusions moved so far; about the centre of a round object, so that their depth stays."""
    if x_mm == 0.0 and y_mm == 0.0:
        return scene_toml
    keys = f"moved_mm = [{x_mm:g}, {y_mm:g}]\n"
    if object_centre_mm:
        keys += f"object_centre_mm = [{', '.join(f'{one:g}' for one in object_centre_mm)}]\n"
    return _HEADER.sub(lambda header: header.group(0) + keys, scene_toml)
