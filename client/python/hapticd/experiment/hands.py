"""Hands: a person's, or the simulated hand of a simulated rig."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Callable, Generator, Optional, Protocol as Interface, Sequence

import hapticd
from hapticd.block import Block
from hapticd.experiment import seeds
from hapticd.experiment.observer import Observer
from hapticd.experiment.protocol import Condition
from hapticd.experiment.session import Role, Trial

#: Aside of the usual place, along x and y, mm.
Place = tuple[float, float]

#: A search: yields where it presses next (None: where the hand likes), is sent what it felt there, N/mm, and returns whether
#: it found.
Search = Generator[Optional[Place], float, bool]


class Hand(Interface):
    """Around one presentation."""

    def follow(self, rig: hapticd.Rig) -> None:
        """Holds the tool while the device leads it."""

    def press(self, rig: hapticd.Rig, trial: Trial, role: Role, at_mm: Optional[Place] = None) -> None:
        """Begins to press; at_mm: lightly, as in a search, so far aside."""

    def stroke(self, rig: hapticd.Rig, trial: Trial, role: Role, path_mm: float) -> None:
        """Begins to press and stroke, so far in all."""

    def search(self, trial: Trial, role: Role, places_mm: Sequence[Place]) -> Search:
        """Looks for the inclusion."""

    def explore(self, rig: hapticd.Rig, trial: Trial, condition: Condition, path_mm: float) -> None:
        """Begins to feel two stimuli that lie next to each other, and to change between them at will."""

    def has_explored(self, rig: hapticd.Rig, at: Role, has_pressed: bool, lifted: bool) -> bool:
        """Whether both were felt enough. at: where the tool is; has_pressed, lifted: there, since it came."""

    def is_done(self, has_pressed: bool, lifted: bool) -> bool:
        """Whether the touch is over. has_pressed: half a millimetre, once; lifted: no longer."""

    def sees(self, block: Block) -> None:
        """What the rig measures meanwhile."""


@dataclass
class Person:
    """Follows by itself, and says when it is done."""

    says_done: Callable[[], bool]
    begins: Callable[[], None] = lambda: None
    looks: Callable[[Block], None] = lambda block: None

    def follow(self, rig: hapticd.Rig) -> None:
        pass

    def press(self, rig: hapticd.Rig, trial: Trial, role: Role, at_mm: Optional[Place] = None) -> None:
        self.begins()

    def stroke(self, rig: hapticd.Rig, trial: Trial, role: Role, path_mm: float) -> None:
        self.begins()

    def explore(self, rig: hapticd.Rig, trial: Trial, condition: Condition, path_mm: float) -> None:
        self.begins()

    def has_explored(self, rig: hapticd.Rig, at: Role, has_pressed: bool, lifted: bool) -> bool:
        return self.says_done()

    def search(self, trial: Trial, role: Role, places_mm: Sequence[Place]) -> Search:
        self.begins()
        yield None
        return True

    def sees(self, block: Block) -> None:
        self.looks(block)

    def is_done(self, has_pressed: bool, lifted: bool) -> bool:
        return self.says_done()


@dataclass
class SimulatedHand:
    """Presses once, as hard and as fast as people do: 3 ± 0.5 N, built up at 6 … 12 N/s, held for a moment. Strokes as hard, and
    begins more gently. Changes between two places once, or goes back to the first, or to both. Searches place after place, in
    its own order, lightly, until one is harder than the others by more than it takes for noise.

    weber: of what it feels, as of an Observer.
    """

    seed: int
    participant: str
    weber: float = 0.09
    _visits: list[Role] = field(default_factory=list, init=False, repr=False)
    _visited: int = field(default=0, init=False, repr=False)
    _touches: bool = field(default=False, init=False, repr=False)
    _plan: Any = field(default=None, init=False, repr=False)

    #: Sweeps over all places, at most.
    MAX_SWEEPS = 4
    #: The hardest place must be harder than the one in the middle for sure, not by chance: of five places the hardest is
    #: 1.2 standard deviations above the middle by noise alone.
    SURE_Z = 2.5

    @staticmethod
    def of(observer: Observer) -> SimulatedHand:
        return SimulatedHand(observer.seed, observer.name, observer.weber)

    def _force(self, trial: Trial, role: Role, *names: seeds.Name) -> tuple[float, float]:
        """N, N/s."""
        random = seeds.generator(
            self.seed, self.participant, "press", trial.condition, int(trial.is_training), trial.number, trial.attempt, role, *names
        )
        return min(max(random.normal(3.0, 0.5), 1.5), 4.5), random.uniform(6.0, 12.0)

    def follow(self, rig: hapticd.Rig) -> None:
        rig.set_hand_program({"kind": "follow"})

    def press(self, rig: hapticd.Rig, trial: Trial, role: Role, at_mm: Optional[Place] = None) -> None:
        force_n, rate = self._force(trial, role, *([] if at_mm is None else [round(one * 1e3) for one in at_mm]))
        if at_mm is not None:
            force_n, rate = 0.4 * force_n, 0.4 * rate
        rig.set_hand_program(
            {
                "kind": "press", "force_n": force_n, "force_rate_n_per_s": rate, "hold_s": 0.1, "repetitions": 1,
                "place_mm": (*(at_mm or (0.0, 0.0)), 0.0),
            }  # fmt: skip
        )

    def stroke(self, rig: hapticd.Rig, trial: Trial, role: Role, path_mm: float) -> None:
        self._stroke(rig, path_mm, (0.0, 0.0), *self._force(trial, role))

    def _stroke(self, rig: hapticd.Rig, path_mm: float, at_mm: Sequence[float], force_n: float, rate: float) -> None:
        length_mm = 20.0
        # From the middle to one end, then back and forth; a quarter more than asked, for the tip lags behind where it sinks deep.
        repetitions = max(1, math.ceil(0.5 * (1.0 + (1.25 * path_mm - 0.5 * length_mm) / length_mm)))
        rig.set_hand_program(
            {
                "kind": "stroke", "force_n": force_n, "force_rate_n_per_s": 0.4 * rate, "speed_mm_per_s": 80.0,
                "stroke_length_mm": length_mm, "repetitions": repetitions, "place_mm": (at_mm[0], at_mm[1], 0.0),
            }  # fmt: skip
        )

    def explore(self, rig: hapticd.Rig, trial: Trial, condition: Condition, path_mm: float) -> None:
        random = seeds.generator(
            self.seed, self.participant, "change", trial.condition, int(trial.is_training), trial.number, trial.attempt
        )
        # One, the other; sometimes the first again, sometimes both.
        roles: list[Role] = ["reference", "comparison", "reference", "comparison"]
        self._visits = roles[: 2 + int(random.choice(3, p=(0.6, 0.2, 0.2)))]
        self._plan = (trial, condition, path_mm)
        self._visited = 0
        self._go(rig)

    def _go(self, rig: hapticd.Rig, touches: bool = False) -> None:
        trial, condition, path_mm = self._plan
        role = self._visits[self._visited]
        stimulus = condition.reference if role == "reference" else condition.comparison
        x, y = stimulus.at_mm
        if not touches:  # above it, until what is there is presented
            rig.set_hand_program({"kind": "rest", "place_mm": (x, y, 0.0)})
        else:
            self._stroke(rig, path_mm, (x, y), *self._force(trial, role, "visit", self._visited))
        self._touches = touches

    def has_explored(self, rig: hapticd.Rig, at: Role, has_pressed: bool, lifted: bool) -> bool:
        if at == self._visits[self._visited] and not self._touches:
            self._go(rig, touches=True)
            return False
        if at != self._visits[self._visited] or not (has_pressed and lifted):
            return False
        self._visited += 1
        if self._visited == len(self._visits):
            return True
        self._go(rig)
        return False

    def search(self, trial: Trial, role: Role, places_mm: Sequence[Place]) -> Search:
        random = seeds.generator(self.seed, self.participant, "search", trial.condition, trial.number, trial.attempt, role)
        noise = self.weber / 0.6744897501960817
        felt: dict[Place, list[float]] = {}
        for _ in range(self.MAX_SWEEPS):
            for index in random.permutation(len(places_mm)):
                place = places_mm[index]
                stiffness = yield place
                if math.isfinite(stiffness) and stiffness > 0.0:
                    felt.setdefault(place, []).append(math.log(stiffness) + noise * random.standard_normal())
                if self._is_sure(felt, noise, len(places_mm)):
                    return True
        return False

    def _is_sure(self, felt: dict[Place, list[float]], noise: float, places: int) -> bool:
        if len(felt) < min(places, 3):
            return False
        means = sorted(((sum(ones) / len(ones), len(ones)) for ones in felt.values()), reverse=True)
        (hardest, times), (usual, usual_times) = means[0], means[len(means) // 2]
        return hardest - usual > self.SURE_Z * noise * math.sqrt(1.0 / times + 1.0 / usual_times)

    def is_done(self, has_pressed: bool, lifted: bool) -> bool:
        return has_pressed and lifted

    def sees(self, block: Block) -> None:
        pass


@dataclass
class PersonOnSimulatedRig(SimulatedHand):
    """A person who answers, on a rig where the simulated hand touches: to try an experiment out."""

    person: Person = field(default_factory=lambda: Person(lambda: False))

    def press(self, rig: hapticd.Rig, trial: Trial, role: Role, at_mm: Optional[Place] = None) -> None:
        self.person.begins()
        super().press(rig, trial, role, at_mm)

    def stroke(self, rig: hapticd.Rig, trial: Trial, role: Role, path_mm: float) -> None:
        self.person.begins()
        super().stroke(rig, trial, role, path_mm)

    def explore(self, rig: hapticd.Rig, trial: Trial, condition: Condition, path_mm: float) -> None:
        self.person.begins()
        super().explore(rig, trial, condition, path_mm)

    def has_explored(self, rig: hapticd.Rig, at: Role, has_pressed: bool, lifted: bool) -> bool:
        self.person.says_done()  # raises if the page is gone
        return super().has_explored(rig, at, has_pressed, lifted)

    def is_done(self, has_pressed: bool, lifted: bool) -> bool:
        self.person.says_done()  # raises if the page is gone
        return super().is_done(has_pressed, lifted)

    def sees(self, block: Block) -> None:
        self.person.looks(block)
