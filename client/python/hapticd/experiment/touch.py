"""What the telemetry says of a touch: how deep it is, whether it is over, what was felt, how long the object was touched."""

from __future__ import annotations

import math
from typing import Optional

import numpy as np
import numpy.typing as npt

from hapticd.block import Block
from hapticd.experiment.observer import felt_stiffness

Array = npt.NDArray[np.float64]

#: What counts as pressed, and as lifted again.
PRESSED_MM, LIFTED_SHARE = 0.5, 0.15
#: The share of the force that the evidence of a contact allows, from which on it is one for sure.
EVIDENT = 0.5
#: A hand that is so far aside of where it touched no longer presses only: it strokes.
STROKES_MM = 1.5

#: Groups of the telemetry that are needed.
GROUPS_OF_TRUTH = ["truth", "contact"]
GROUPS = ["sample", "contact"]


class Touch:
    """Touch from its first sample, and by blocks as they come.

    from_contact: the tool is at the object when it begins, so that depth counts from there; else from where the first
    contact begins that the rig has evidence of.
    """

    def __init__(self, has_truth: bool, from_contact: bool) -> None:
        self._of = "truth" if has_truth else "sample"
        self._has_truth = has_truth
        self._from_contact = from_contact
        self._blocks: list[Block] = []
        self._zero: Optional[tuple[float, float, float]] = None
        self._is_sure = False
        self._begun_ns: Optional[int] = None
        self._deepest = 0.0
        self._depth = 0.0

    def add(self, block: Block) -> None:
        if not len(block):
            return
        self._blocks.append(block)
        self._begun_ns = int(block["time_ns"][0]) if self._begun_ns is None else self._begun_ns
        self._find_zero(block)
        depth = self._depth_of(block)
        self._deepest = max(self._deepest, float(np.nanmax(depth, initial=0.0)))
        self._depth = float(depth[-1])

    def _find_zero(self, block: Block) -> None:
        """Point at which the contact began that the tool had evidence of: a hand that stops short in the air is taken
        for one for a moment."""
        if self._is_sure:
            return
        touches, evidence = block["contact_in_contact"] > 0.5, block["contact_authority"] > EVIDENT
        for at in range(len(block)):
            if self._from_contact or (touches[at] and self._zero is None):
                x, y, z = (float(block[f"{self._of}_tip_position_{axis}_mm"][at]) for axis in "xyz")
                self._zero = x, y, z
            elif not touches[at]:
                self._zero = None
            self._is_sure = self._from_contact or bool(touches[at] and evidence[at])
            if self._is_sure:
                return

    def _depth_of(self, block: Block) -> Array:
        """Depth below where it was touched first."""
        height = np.asarray(block[f"{self._of}_tip_position_z_mm"], dtype=np.float64)
        return self._zero[2] - height if self._is_sure and self._zero is not None else np.zeros_like(height)

    @property
    def has_pressed(self) -> bool:
        return self._deepest > PRESSED_MM

    @property
    def is_lifted(self) -> bool:
        return self._depth < LIFTED_SHARE * self._deepest

    @property
    def duration_s(self) -> float:
        return 0.0 if self._begun_ns is None else 1e-9 * (int(self._blocks[-1]["time_ns"][-1]) - self._begun_ns)

    @property
    def end_tick(self) -> int:
        return int(self._blocks[-1].ticks[-1]) if self._blocks else -1

    def contact_s(self) -> float:
        """Time in contact, s of the rig's time."""
        total = 0.0
        for block in self._blocks:
            if len(block) > 1:
                total += float(np.sum(np.diff(block["time_ns"]) * 1e-9 * (block["contact_in_contact"][1:] > 0.5)))
        return total

    def felt(self) -> float:
        """Stiffness that a simulated hand felt where it pressed first, N/mm; NaN on a real rig, where that is the question."""
        if not self._has_truth or not self._is_sure or self._zero is None:
            return math.nan
        rows = Block.joined(self._blocks)
        aside = np.hypot(rows["truth_tip_position_x_mm"] - self._zero[0], rows["truth_tip_position_y_mm"] - self._zero[1])
        depth = self._depth_of(rows)
        strokes = np.flatnonzero((aside > STROKES_MM) & (depth > 0.0))
        end = int(strokes[0]) if len(strokes) else len(rows)
        return felt_stiffness(-rows["truth_hand_force_z_n"][:end], depth[:end])
