"""Two stimuli that lie next to each other, and a participant who changes between them at will (D§4.7)."""

from __future__ import annotations

import math
from typing import Optional, Sequence

import numpy as np

from hapticd.block import Block
from hapticd.experiment.protocol import Condition, Protocol
from hapticd.experiment.session import ROLES, Role
from hapticd.experiment.stage import Presentation

#: Flaws that only all touches of a stimulus together have.
OF_ALL_TOUCHES = ("lateral_path", "no_contact", "contact_time")
#: A stimulus is felt for so long at least, over all its touches, s.
MIN_CONTACT_S = 0.3
#: The tool has changed when it is so far on its way from one to the other: not in the middle, so that it does not flicker.
CHANGED_SHARE = 0.6


class Side:
    """Place, of the two, at which the tool is."""

    def __init__(self, condition: Condition) -> None:
        self._from = np.array(condition.reference.at_mm)
        self._way = np.array(condition.comparison.at_mm) - self._from
        self.role: Role = "reference"

    def sees(self, block: Block, of: str) -> bool:
        """Whether it has changed, as of the end of a block; it does not while it touches."""
        if not len(block) or block["contact_in_contact"][-1] > 0.5:
            return False
        place = np.array([float(block[f"{of}_tip_position_{axis}_mm"][-1]) for axis in "xy"])
        share = float((place - self._from) @ self._way / (self._way @ self._way))
        other: Optional[Role] = None
        if self.role == "reference" and share > CHANGED_SHARE:
            other = "comparison"
        elif self.role == "comparison" and share < 1.0 - CHANGED_SHARE:
            other = "reference"
        self.role = other or self.role
        return other is not None


def flaws_of_all(protocol: Protocol, visits: Sequence[tuple[Role, Presentation]]) -> list[str]:
    """What the touches of a trial lack together; each visit's own flaws are its own."""
    flaws: list[str] = []
    for role in ROLES:
        own = [one.record for visited, one in visits if visited == role]
        if not own:
            flaws.append("no_contact")
            continue
        if sum(float(one.get("time_in_contact_s", math.inf)) for one in own) < MIN_CONTACT_S:
            flaws.append("contact_time")
        if sum(float(one.get("lateral_path_mm", 0.0)) for one in own) < protocol.min_lateral_path_mm:
            flaws.append("lateral_path")
    return list(dict.fromkeys(flaws))


def joined(visits: Sequence[tuple[Role, Presentation]], role: Role) -> Presentation:
    """What was felt of a stimulus, over all visits: the geometric mean."""
    felt = [math.log(one.felt_n_per_mm) for visited, one in visits if visited == role and one.felt_n_per_mm > 0.0]
    return Presentation((), {}, math.exp(sum(felt) / len(felt)) if felt else math.nan)
