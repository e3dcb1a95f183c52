"""Observers that are simulated: what they feel, and how they answer."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hapticd.experiment import seeds

Array = npt.NDArray[np.float64]

#: Φ⁻¹(0.75): the difference threshold is where three of four answers are right.
THRESHOLD_Z = 0.6744897501960817

#: What counts as the same, over the deviation of a comparison.
SAME_BAND = 0.5


@dataclass(frozen=True)
class Observer:
    """Compares the logarithms of two stiffnesses, with noise.

    weber: difference threshold (75 % right) over the reference; 0.06 … 0.12 for stiffness. lapse: share of answers that
    are guesses. bias: by how much the second interval feels harder. drift: by how much more, after 300 trials.
    """

    name: str
    seed: int
    weber: float = 0.09
    lapse: float = 0.0
    bias: float = 0.0
    drift: float = 0.0

    def answer(self, first: float, second: float, may_be_same: bool, *names: seeds.Name, trials: int = 0) -> str:
        """"first", "second" or "same": which felt harder. The names make the answer repeatable: those of the trial."""
        random = seeds.generator(self.seed, self.name, "answer", *names)
        deviation = self.weber / THRESHOLD_Z
        shift = self.bias + self.drift * trials / 300.0
        difference = math.log(max(second, 1e-6) / max(first, 1e-6)) + shift + deviation * random.standard_normal()
        guess = random.random()
        if random.random() < self.lapse:
            choices = ("first", "same", "second") if may_be_same else ("first", "second")
            return choices[int(guess * len(choices))]
        if may_be_same and abs(difference) < SAME_BAND * deviation:
            return "same"
        return "second" if difference > 0.0 else "first"


def felt_stiffness(force_n: Array, depth_mm: Array) -> float:
    """Slope of force over depth while it is pressed, N/mm, weighted to its first rise (D§3.4.2, [70] there).

    force_n, depth_mm: of one presentation, in time; positive into the object. Least squares of a line; a sample at a
    share s of the greatest depth counts exp(-2 s). NaN if nothing was pressed.
    """
    force, depth = np.asarray(force_n, dtype=float), np.asarray(depth_mm, dtype=float)
    finite = np.isfinite(force) & np.isfinite(depth)
    force, depth = force[finite], depth[finite]
    if depth.size < 3 or depth.max() <= 0.05:
        return math.nan
    deepest = depth.max()
    # The first press: up to where it is deepest, or nearly.
    end = int(np.argmax(depth >= 0.98 * deepest)) + 1
    begin = end - int(np.argmax(depth[:end][::-1] <= 0.01 * deepest)) if (depth[:end] <= 0.01 * deepest).any() else 0
    force, depth = force[begin:end], depth[begin:end]
    if depth.size < 3:
        return math.nan
    # Each part of the way counts alike, however slowly it was pressed.
    weight = np.exp(-2.0 * depth / deepest) * np.gradient(depth).clip(min=0.0)
    total = weight.sum()
    if total <= 0.0:
        return math.nan
    mean_depth, mean_force = (weight * depth).sum() / total, (weight * force).sum() / total
    spread = (weight * (depth - mean_depth) ** 2).sum()
    return float((weight * (depth - mean_depth) * (force - mean_force)).sum() / spread) if spread > 0.0 else math.nan
