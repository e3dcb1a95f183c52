"""Points of subjective equality from answers: by maximum likelihood with intervals, and as they were published."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, Optional, Sequence

import numpy as np
import numpy.typing as npt
from scipy.special import ndtr

from hapticd.experiment import seeds
from hapticd.experiment.observer import SAME_BAND, THRESHOLD_Z
from hapticd.experiment.procedures import Given, LimitsSeries, Series, UpDown

Array = npt.NDArray[np.float64]

#: A lapse is more likely the rarer it is: density of Beta(1, 20), up to 0.1. Prins 2012: fixed at 0 it biases the rest.
LAPSE_PRIOR = 19.0
MAX_LAPSE = 0.1
#: Deviation of stiffness: Weber fractions of 0.06 … 0.23 are published (D§3.4.2). Centre and width (of the logarithm)
#: of the prior.
TYPICAL_DEVIATION = 0.15
#: It is wide: a staircase of 30 trials says so little of the deviation that a narrow prior makes good observers' intervals too wide
#: and worse ones' too narrow (0.8: 99 and 93 % held at Weber fractions of 0.055 and 0.13; 2: 98 and 94 %).
DEVIATION_SPREAD = 2.0
#: Half of the 95 % quantile of chi-square with one degree of freedom: how far the logarithm of the profile falls.
PROFILE_FALL = 1.9207


@dataclass(frozen=True)
class Fit:
    """psi(x) = λ/2 + (1 − λ) Φ(ln(x/μ)/σ): the share of answers "the comparison is harder" at a level x, N/mm.

    In the logarithm of the level: by Weber's law equal shares are equal steps, and neither order of the intervals is
    preferred.
    """

    pse: float  #: μ, N/mm
    deviation: float  #: σ, over the level
    lapse: float  #: λ
    trials: int
    low: float = math.nan  #: of the 95 % interval of the PSE
    high: float = math.nan
    #: Difference threshold (75 %), N/mm; None if the procedure does not support one.
    dl: Optional[float] = None
    dl_low: float = math.nan
    dl_high: float = math.nan


def shares(level: Array, pse: Array, deviation: Array, lapse: Array, band: Optional[Array] = None) -> tuple[Array, Array, Array]:
    """Probabilities of the answers harder, same, softer. band: what counts as the same, over the deviation; None: there
    is no such answer. A lapse is any of the answers there are."""
    away = np.log(level / pse) / deviation
    if band is None:
        harder = 0.5 * lapse + (1.0 - lapse) * ndtr(away)
        return harder, np.zeros_like(harder), 1.0 - harder
    harder = lapse / 3.0 + (1.0 - lapse) * ndtr(away - band)
    softer = lapse / 3.0 + (1.0 - lapse) * ndtr(-away - band)
    return harder, 1.0 - harder - softer, softer


class _Posterior:
    """Posterior of μ, σ, λ, and the band of "same" if there is one, on a grid; for many sets of answers at the same
    levels at once."""

    MEAN_STEP = 0.01
    DEVIATIONS = np.geomspace(0.03, 0.6, 16)
    LAPSES = np.array([0.0, 0.02, 0.05, MAX_LAPSE])
    BANDS = np.array([0.15, 0.35, 0.6, 0.9, 1.4])

    def __init__(self, levels: Array, centre: float, has_same: bool) -> None:
        self.means = math.log(centre) + self.MEAN_STEP * np.arange(-60, 61)
        axes = [self.means, self.DEVIATIONS, self.LAPSES] + ([self.BANDS] if has_same else [])
        grid = np.meshgrid(*axes, indexing="ij", sparse=True)  # what does not depend on an axis is computed once
        self.shape = (len(self.means), len(self.DEVIATIONS), -1)
        each = levels.reshape(-1, *(1 for _ in axes))
        parts = shares(each, np.exp(grid[0]), grid[1], grid[2], grid[3] if has_same else None)
        self._logs = [np.log(np.clip(part, 1e-9, 1.0)).reshape(len(levels), -1) for part in (parts if has_same else (parts[0], parts[2]))]
        whole = [np.broadcast_to(one, parts[0].shape[1:]).ravel() for one in grid[1:3]]
        self._prior = LAPSE_PRIOR * np.log1p(-whole[1]) - 0.5 * (np.log(whole[0] / TYPICAL_DEVIATION) / DEVIATION_SPREAD) ** 2
        self._lapse = whole[1]

    def of(self, counts: Sequence[Array]) -> tuple[Array, Array, Array, Array]:
        """Marginals of N×levels counts of each answer: those of μ and σ and the logarithm of the profile over μ,
        N×grid, and the means of λ, N."""
        log = sum((count @ one for count, one in zip(counts, self._logs)), np.zeros(1)) + self._prior
        log -= log.max(axis=1, keepdims=True)
        weight = np.exp(log)
        weight /= weight.sum(axis=1, keepdims=True)
        cube = weight.reshape(len(weight), *self.shape)
        profile = log.reshape(len(log), *self.shape).max(axis=(2, 3))
        return cube.sum(axis=(2, 3)), cube.sum(axis=(1, 3)), profile, weight @ self._lapse

    def centres(self, marginals: Array, profiles: Array) -> Array:
        """ln μ, N: halfway between the mean of the marginal and the highest point of the profile."""
        top = np.clip(profiles.argmax(axis=1), 1, len(self.means) - 2)
        rows = np.arange(len(top))
        left, middle, right = (profiles[rows, top + i] for i in (-1, 0, 1))
        bend = np.minimum(left - 2.0 * middle + right, -1e-12)
        highest = self.means[top] + np.clip(0.5 * (left - right) / bend, -1.0, 1.0) * self.MEAN_STEP
        centres: Array = 0.5 * (marginals @ self.means + highest)
        return centres

    def interval(self, marginal: Array, profile: Array) -> tuple[float, float]:
        """95 %, N/mm: halfway between the marginal's quantiles and the profile's fall. Of simulated staircases the first is too wide for
        observers that are better than usual, the second too narrow for worse ones."""
        edges = np.concatenate([[0.0], np.cumsum(marginal)])
        places = np.concatenate([self.means - 0.5 * self.MEAN_STEP, [self.means[-1] + 0.5 * self.MEAN_STEP]])
        top = int(profile.argmax())
        below, above = profile[: top + 1], profile[top:][::-1]  # both rise to the top
        rises = np.maximum.accumulate(below), np.maximum.accumulate(above)
        fallen = (
            float(np.interp(-PROFILE_FALL, rises[0], self.means[: top + 1])),
            float(np.interp(-PROFILE_FALL, rises[1], self.means[top:][::-1])),
        )
        low, high = (0.5 * (float(np.interp(at, edges, places)) + one) for at, one in zip((0.025, 0.975), fallen))
        return math.exp(low), math.exp(high)


def supports_threshold(series: Series) -> bool:
    """A one-up-one-down staircase gathers its trials at the PSE and says nothing of the slope: its threshold would be half of
    the truth. Constant stimuli and QUEST+ do."""
    return not any(isinstance(one, (LimitsSeries, UpDown)) for one in series.members)


def of_series(series: Series, *, resamples: int = 0, seed: int = 0, names: Sequence[seeds.Name] = ()) -> Fit:
    """Fit of all trials of a condition, under weak priors of σ and λ: PSE and interval halfway between those of the
    marginal posterior and of the profile likelihood. NaN if all answers are alike.

    How the levels were chosen does not matter to it, so it holds for staircases. With `resamples` the interval is instead that of
    so many parametric bootstraps at the same levels: for constant stimuli.
    """
    given = [one for member in series.members for one in member.given]
    kinds = {one.answer for one in given}
    if len(given) < 4 or "harder" not in kinds or "softer" not in kinds:
        return Fit(math.nan, math.nan, math.nan, len(given))
    levels, index = np.unique([one.level for one in given], return_inverse=True)
    answers = np.array([one.answer for one in given])
    has_same = "same" in kinds
    categories = ("harder", "same", "softer") if has_same else ("harder", "softer")
    counts = [np.bincount(index, answers == one, len(levels)).astype(float)[None, :] for one in categories]
    presented = sum(counts, np.zeros((1, len(levels))))
    posterior = _Posterior(levels, _crossing(levels, counts[0][0], presented[0]), has_same)
    mean, deviation, profile, lapses = posterior.of(counts)
    pse = math.exp(float(posterior.centres(mean, profile)[0]))
    sigma, lapse = math.exp(float(deviation[0] @ np.log(posterior.DEVIATIONS))), float(lapses[0])
    low, high = posterior.interval(mean[0], profile[0])
    if resamples:
        random = seeds.generator(seed, *names, "bootstrap")
        truth = shares(levels, np.array(pse), np.array(sigma), np.array(lapse), np.array(SAME_BAND) if has_same else None)
        chances = np.stack([part for part, kept in zip(truth, (True, has_same, True)) if kept], axis=1)
        drawn = np.stack([random.multinomial(int(n), chance, resamples) for n, chance in zip(presented[0], chances)], axis=1)
        means, _, profiles, _ = posterior.of([drawn[:, :, i].astype(float) for i in range(len(categories))])
        low, high = np.exp(np.quantile(posterior.centres(means, profiles), [0.025, 0.975]))
    threshold = dl_low = dl_high = None
    if supports_threshold(series):
        edges = np.cumsum(deviation[0])
        at = [float(np.interp(one, edges, np.log(posterior.DEVIATIONS))) for one in (0.025, 0.975)]
        threshold, dl_low, dl_high = (pse * math.sinh(THRESHOLD_Z * one) for one in (sigma, math.exp(at[0]), math.exp(at[1])))
    return Fit(
        pse, sigma, lapse, len(given), float(low), float(high), threshold,
        math.nan if dl_low is None else dl_low, math.nan if dl_high is None else dl_high,
    )


def _crossing(levels: Array, harder: Array, presented: Array) -> float:
    """About where the answers change: as many "harder" below as others above."""
    below, above = np.cumsum(harder), np.cumsum((presented - harder)[::-1])[::-1]
    return float(levels[int(np.argmin(np.abs(below - above)))])


def by_thresholds(series: Series, crossing: Literal["first", "last"] = "first") -> float:
    """Threshold of D§3.4.1: of each series the mean of upper and lower threshold, each halfway between the two trials
    at which the answers changed; of the series the mean. NaN if no series has both.

    Answers that alternate cross a threshold several times: "first" and "last" are as the series was presented.
    """
    points = [_limits_point(one, crossing) for one in series.members if isinstance(one, LimitsSeries)]
    found = [one for one in points if one is not None]
    return float(np.mean(found)) if found else math.nan


def _limits_point(series: LimitsSeries, crossing: str) -> Optional[float]:
    order = {"harder": 1, "same": 0, "softer": -1}
    values = [order[one.answer] * (1 if series.is_descending else -1) for one in series.given]
    levels = [one.level for one in series.given]
    thresholds = []
    # From above nothing to the same, then from the same to below it.
    for lowest_before, highest_after in ((1, 0), (0, -1)):
        changes = [i for i in range(1, len(values)) if values[i - 1] >= lowest_before and values[i] <= highest_after]
        if not changes:
            return None
        at = changes[0] if crossing == "first" else changes[-1]
        thresholds.append(0.5 * (levels[at - 1] + levels[at]))
    return float(np.mean(thresholds))


def by_reversals(series: Series, discarded: int) -> float:
    """D§4.7.1: the mean of the levels at the reversals but the first `discarded`; of several staircases the mean."""
    means = [
        float(np.mean(one.reversals[discarded:])) for one in series.members if isinstance(one, UpDown) and len(one.reversals) > discarded
    ]
    return float(np.mean(means)) if means else math.nan
