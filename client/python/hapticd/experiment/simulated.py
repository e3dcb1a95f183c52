"""Participants that are simulated observers, and their groups."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Sequence

from hapticd.experiment import seeds
from hapticd.experiment.journal import Event
from hapticd.experiment.observer import Observer
from hapticd.experiment.session import State, Trial
from hapticd.experiment.stage import Presentation


@dataclass
class SimulatedParticipant:
    """Answers as its observer feels; never rests, never errs with a key."""

    observer: Observer

    def ready(self, state: State, trial: Trial, interval: int) -> Sequence[Event]:
        return ()

    def answer(self, state: State, trial: Trial, felt: Sequence[Presentation]) -> tuple[str, Sequence[Event]]:
        if state.protocol.kind == "rate":
            return f"{self._similarity(trial, felt):.1f}", ()
        first, second = (one.felt_n_per_mm for one in felt)
        may_be_same = "same" in state.protocol.keys.values()
        names: tuple[seeds.Name, ...] = (trial.condition, int(trial.is_training), trial.number)
        return self.observer.answer(first, second, may_be_same, *names, trials=trial.number), ()

    def _similarity(self, trial: Trial, felt: Sequence[Presentation]) -> float:
        """100 less what the stiffnesses differ by, in difference thresholds of 20 points; an own scale, with noise."""
        first, second = (one.felt_n_per_mm for one in felt)
        if not (math.isfinite(first) and math.isfinite(second) and first + second > 0.0):
            return 0.0
        random = seeds.generator(self.observer.seed, self.observer.name, "rating", trial.condition, trial.number)
        apart = abs(first - second) / (self.observer.weber * 0.5 * (abs(first) + abs(second)))
        return float(min(max(100.0 - 20.0 * apart - abs(random.normal(0.0, 8.0)), 0.0), 100.0))

    def warn(self, trial: Trial, flaws: Sequence[str]) -> None:
        pass

    def rest(self, seconds: float) -> None:
        pass

    def notify(self, event: Event) -> None:
        pass


def group(count: int, seed: int) -> list[Observer]:
    """Observers as different as people are: Weber fractions 0.06 … 0.12, up to 3 % lapses, a bias of 0 ± 1 %."""
    found = []
    for number in range(count):
        random = seeds.generator(seed, "observer", number)
        found.append(
            Observer(f"S{number + 1:02d}", seed, random.uniform(0.06, 0.12), random.uniform(0.0, 0.03), random.normal(0.0, 0.01))
        )
    return found
