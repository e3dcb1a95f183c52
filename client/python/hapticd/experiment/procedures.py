"""Choice of the next stimulus: pure, without clock, files or a separate generator.

A procedure is a value. next_level() says what to present, None when it is over; answered() gives the procedure after an
answer. What was discarded never reaches it: the same level is presented again. An answer is about the comparison: it felt
"harder" or "softer" than the reference, or the "same".
"""

from __future__ import annotations

import dataclasses
import functools
import math
from dataclasses import dataclass
from typing import Any, Literal, Mapping, Optional, Sequence, Union

import numpy as np
import numpy.typing as npt
from scipy.special import ndtr

from hapticd.experiment import seeds, stops

Answer = Literal["harder", "same", "softer"]
Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Given:
    """A level that was presented, and the answer."""

    level: float
    answer: Answer


def _on_grid(level: float) -> float:
    """Level without what adding steps leaves behind."""
    return round(level, 9)


@dataclass(frozen=True)
class LimitsSeries:
    """One series of the method of limits: from `start` in equal steps, until the answer that the series leads to has come
    `end_after` times in succession (D§3.4.1: three), or the levels end.

    A negative step descends, from "harder" towards "softer".
    """

    start: float
    step: float
    end_after: int = 3
    lowest: float = 0.0
    highest: float = float("inf")
    given: tuple[Given, ...] = ()

    @property
    def is_descending(self) -> bool:
        return self.step < 0.0

    @property
    def last_answer(self) -> Answer:
        return "softer" if self.is_descending else "harder"

    def next_level(self) -> Optional[float]:
        last = [one.answer for one in self.given[-self.end_after :]]
        if len(last) == self.end_after and all(answer == self.last_answer for answer in last):
            return None
        level = _on_grid(self.start + self.step * len(self.given))
        return level if self.lowest <= level <= self.highest else None

    def answered(self, answer: Answer) -> LimitsSeries:
        level = self.next_level()
        assert level is not None
        return dataclasses.replace(self, given=(*self.given, Given(level, answer)))


@dataclass(frozen=True)
class UpDown:
    """A staircase: down after `down` answers "harder" in succession, up after `up` "softer"; "same" counts for neither.

    steps[i] holds until so many reversals as steps_after[i] says; the last one holds on. D§4.7: 0.1, then 0.02 after the
    fourth. Levels stay within lowest … highest; the rule goes on from the level that was presented.
    """

    start: float
    steps: tuple[float, ...]
    steps_after: tuple[int, ...]
    stop: stops.Rule
    up: int = 1
    down: int = 1
    lowest: float = 0.0
    highest: float = float("inf")
    given: tuple[Given, ...] = ()

    def _walk(self) -> tuple[float, list[float]]:
        """The level after all answers, and the levels at which the direction was reversed."""
        level, direction, run = self.start, 0, 0
        reversals: list[float] = []
        last: Optional[Answer] = None
        for one in self.given:
            level = one.level
            if one.answer == "same":
                continue
            run = run + 1 if one.answer == last else 1
            last = one.answer
            turn = -1 if one.answer == "harder" else 1
            if run < (self.down if turn < 0 else self.up):
                continue
            run = 0
            if direction and turn != direction:
                reversals.append(level)
            direction = turn
            size = self.steps[sum(len(reversals) >= after for after in self.steps_after)]
            level = _on_grid(min(max(level + turn * size, self.lowest), self.highest))
        return level, reversals

    @property
    def reversals(self) -> list[float]:
        """The levels at which a decreasing sequence became an increasing one, and vice versa."""
        return self._walk()[1]

    def next_level(self) -> Optional[float]:
        level, reversals = self._walk()
        if self.given and stops.is_met(self.stop, {"reversals": len(reversals), "trials": len(self.given)}):
            return None
        return level

    def answered(self, answer: Answer) -> UpDown:
        level = self.next_level()
        assert level is not None
        return dataclasses.replace(self, given=(*self.given, Given(level, answer)))


@dataclass(frozen=True)
class Constant:
    """The method of constant stimuli: each level so many times, in an order drawn before."""

    levels: tuple[float, ...]
    given: tuple[Given, ...] = ()

    @staticmethod
    def drawn(levels: Sequence[float], repetitions: int, seed: int, *names: seeds.Name) -> Constant:
        return Constant(tuple(seeds.shuffled([level for level in levels for _ in range(repetitions)], seed, *names)))

    def next_level(self) -> Optional[float]:
        return self.levels[len(self.given)] if len(self.given) < len(self.levels) else None

    def answered(self, answer: Answer) -> Constant:
        level = self.next_level()
        assert level is not None
        return dataclasses.replace(self, given=(*self.given, Given(level, answer)))


@functools.lru_cache(maxsize=8)
def _quest_table(levels: tuple[float, ...], means: tuple[float, ...], deviations: tuple[float, ...], lapses: tuple[float, ...]) -> Array:
    """P("harder") for each level (rows) and each set of parameters (columns)."""
    level, mean, deviation, lapse = np.meshgrid(levels, means, deviations, lapses, indexing="ij")
    harder: Array = 0.5 * lapse + (1.0 - lapse) * ndtr(np.log(level / mean) / deviation)
    return harder.reshape(len(levels), -1)


@dataclass(frozen=True)
class QuestPlus:
    """QUEST+ (Watson 2017): the level that leaves the least expected entropy of mean, deviation and lapse rate.

    Grid of the function of fit.Fit; deviations are over the level. "same" counts as half of each answer. Flat prior
    over the grid.
    """

    levels: tuple[float, ...]
    means: tuple[float, ...]
    deviations: tuple[float, ...]
    stop: stops.Rule
    lapses: tuple[float, ...] = (0.0, 0.02, 0.05)
    given: tuple[Given, ...] = ()

    def _table(self) -> Array:
        return _quest_table(self.levels, self.means, self.deviations, self.lapses)

    def posterior(self) -> Array:
        """Posterior over means × deviations × lapses; sums to 1."""
        table = self._table()
        log = np.zeros(table.shape[1])
        for one in self.given:
            harder = np.clip(table[self.levels.index(one.level)], 1e-12, 1.0 - 1e-12)
            weight = {"harder": 1.0, "softer": 0.0, "same": 0.5}[one.answer]
            log += weight * np.log(harder) + (1.0 - weight) * np.log1p(-harder)
        probability: Array = np.exp(log - log.max())
        probability /= probability.sum()
        return probability.reshape(len(self.means), len(self.deviations), len(self.lapses))

    @property
    def mean(self) -> float:
        """Mean of the posterior: the point of subjective equality."""
        return float(np.dot(self.posterior().sum(axis=(1, 2)), self.means))

    def next_level(self) -> Optional[float]:
        if self.given and stops.is_met(self.stop, {"trials": len(self.given)}):
            return None
        table, prior = self._table(), self.posterior().ravel()
        expected = np.zeros(len(self.levels))
        for likelihood in (table, 1.0 - table):
            joint = likelihood * prior
            evidence = joint.sum(axis=1, keepdims=True)
            after = joint / np.maximum(evidence, 1e-300)
            entropy = -np.sum(after * np.log(np.maximum(after, 1e-300)), axis=1)
            expected += evidence[:, 0] * entropy
        return self.levels[int(np.argmin(np.round(expected, 12)))]

    def answered(self, answer: Answer) -> QuestPlus:
        level = self.next_level()
        assert level is not None
        return dataclasses.replace(self, given=(*self.given, Given(level, answer)))


@dataclass(frozen=True)
class Once:
    """One trial: a rating, or a search."""

    given: tuple[Given, ...] = ()

    def next_level(self) -> Optional[float]:
        return None if self.given else 0.0

    def answered(self, answer: Answer) -> Once:
        return Once((Given(0.0, answer),))


Single = Union[LimitsSeries, UpDown, Constant, QuestPlus, Once]


@dataclass(frozen=True)
class Series:
    """Several procedures of one condition: one after the other, or interleaved at random."""

    members: tuple[Single, ...]
    interleaved: bool = False
    seed: int = 0
    names: tuple[seeds.Name, ...] = ()
    trials: int = 0

    def current(self) -> Optional[int]:
        """Index of the member that presents next."""
        open_members = [index for index, one in enumerate(self.members) if one.next_level() is not None]
        if not open_members:
            return None
        if not self.interleaved:
            return open_members[0]
        return open_members[int(seeds.generator(self.seed, *self.names, "interleave", self.trials).integers(len(open_members)))]

    def next_level(self) -> Optional[float]:
        index = self.current()
        return None if index is None else self.members[index].next_level()

    def answered(self, answer: Answer) -> Series:
        index = self.current()
        assert index is not None
        members = tuple(one.answered(answer) if i == index else one for i, one in enumerate(self.members))
        return dataclasses.replace(self, members=members, trials=self.trials + 1)


def make(settings: Mapping[str, Any], reference: float, lowest: float, highest: float, seed: int, *names: seeds.Name) -> Series:
    """The procedures of one condition, of a protocol's [procedure], whose keys protocol.py has checked.

    Levels in N/mm, between lowest and highest. What is drawn depends on the seed and the names alone.
    """
    kind = settings["kind"]
    if kind == "limits":
        directions = seeds.shuffled(["descending"] * settings["descending"] + ["ascending"] * settings["ascending"], seed, *names, "directions")
        members: list[Single] = []
        for number, direction in enumerate(directions):
            # In whole steps, so that the series share their levels.
            spread = int(settings["start_jitter_n_per_mm"] / settings["step_n_per_mm"] + 1e-9)
            jitter = int(seeds.generator(seed, *names, "start", number).integers(-spread, spread + 1)) * settings["step_n_per_mm"]
            away = max(settings["start_distance_n_per_mm"] + jitter, settings["step_n_per_mm"])
            sign = 1.0 if direction == "descending" else -1.0
            start = _on_grid(min(max(reference + sign * away, lowest), highest))
            members.append(
                LimitsSeries(start, -sign * settings["step_n_per_mm"], settings["end_after"], lowest=lowest, highest=highest)
            )
        return Series(tuple(members))
    if kind == "up_down":
        stop = settings["stop"]
        starts = [_on_grid(min(max(reference * share, lowest), highest)) for share in settings["start_shares"]]
        staircases: list[Single] = [
            UpDown(
                start, tuple(settings["steps_n_per_mm"]), tuple(settings["steps_after_reversals"]), stop,
                settings["up"], settings["down"], lowest, highest,
            )
            for start in starts
        ]
        return Series(tuple(staircases), settings["interleaved"], seed, names)
    if kind == "constant":
        levels = [_on_grid(min(max(reference * share, lowest), highest)) for share in settings["level_shares"]]
        return Series((Constant.drawn(levels, settings["repetitions"], seed, *names, "levels"),))
    if kind == "quest_plus":
        span = np.linspace(settings["lowest_share"], settings["highest_share"], settings["grid"])
        levels = sorted({_on_grid(min(max(reference * float(share), lowest), highest)) for share in span})
        means = tuple(_on_grid(reference * float(share)) for share in span)
        deviations = tuple(float(one) for one in np.geomspace(0.03, 0.4, 12))
        return Series((QuestPlus(tuple(levels), means, deviations, settings["stop"]),))
    return Series((Once(),) * settings["repetitions"])


def highest_start_and_level(settings: Mapping[str, Any], reference: float, starts: Sequence[float] = ()) -> tuple[float, float]:
    """The highest level without which a procedure makes no sense, and that to which it may come (infinite if the
    answers decide), N/mm."""
    kind = settings["kind"]
    if kind == "limits":
        return reference + settings["start_distance_n_per_mm"] + settings["start_jitter_n_per_mm"], math.inf
    if kind == "up_down":
        return max(starts or [reference * share for share in settings["start_shares"]]), math.inf
    if kind == "quest_plus":
        return reference, reference * settings["highest_share"]
    highest = reference * max(settings.get("level_shares", [0.0]))
    return highest, highest
