"""Who presses: a person, or the simulated hand of a simulated rig."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Protocol as Interface

import hapticd
from hapticd.experiment import seeds
from hapticd.experiment.session import Role, Trial


class Hand(Interface):
    """Around one presentation."""

    def follow(self, rig: hapticd.Rig) -> None:
        """Holds the tool while the device leads it."""

    def press(self, rig: hapticd.Rig, trial: Trial, role: Role) -> None:
        """Begins to press."""

    def is_done(self, has_pressed: bool, lifted: bool) -> bool:
        """Whether the presentation is over. has_pressed: a millimetre or half a newton, once; lifted: no longer."""


@dataclass
class Person:
    """Follows by itself, and says when it is done."""

    says_done: Callable[[], bool]

    def follow(self, rig: hapticd.Rig) -> None:
        pass

    def press(self, rig: hapticd.Rig, trial: Trial, role: Role) -> None:
        pass

    def is_done(self, has_pressed: bool, lifted: bool) -> bool:
        return self.says_done()


@dataclass
class SimulatedHand:
    """Presses once, as hard and as fast as people do: 3 ± 0.5 N, built up at 6 … 12 N/s, held for a moment."""

    seed: int
    participant: str

    def follow(self, rig: hapticd.Rig) -> None:
        rig.set_hand_program({"kind": "follow"})

    def press(self, rig: hapticd.Rig, trial: Trial, role: Role) -> None:
        random = seeds.generator(
            self.seed, self.participant, "press", trial.condition, int(trial.is_training), trial.number, trial.attempt, role
        )
        force_n = min(max(random.normal(3.0, 0.5), 1.5), 4.5)
        rig.set_hand_program(
            {"kind": "press", "force_n": force_n, "force_rate_n_per_s": random.uniform(6.0, 12.0), "hold_s": 0.1, "repetitions": 1}
        )

    def is_done(self, has_pressed: bool, lifted: bool) -> bool:
        return has_pressed and lifted
