"""Stage on which stimuli are presented."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Iterator, Mapping, Optional, Protocol as Interface, Sequence

from hapticd.experiment import protocol as protocols
from hapticd.experiment import seeds
from hapticd.experiment.journal import Event
from hapticd.experiment.session import Role, Trial


class Aborted(Exception):
    """The experiment ends here: the participant, the experimenter or the rig ended it."""


class Interrupted(Exception):
    """A presentation ended before it was one; it is presented again."""


@dataclass(frozen=True)
class Presentation:
    """What a presentation was like."""

    flaws: Sequence[str] = ()
    #: For the journal: ticks, peaks, what was granted, where it is recorded.
    record: Mapping[str, Any] = field(default_factory=dict)
    #: For simulated observers: what a hand felt, N/mm.
    felt_n_per_mm: float = math.nan
    #: Seconds of touch in a search until the inclusion was found; NaN if it was not.
    found_after_s: float = math.nan


class Stage(Interface):
    """Presents stimuli, one after the other."""

    def check(self, protocol: protocols.Protocol) -> None:
        """Raises HapticdError if the experiment cannot be run as it is written."""

    def opening(self) -> Sequence[Event]:
        """Begins; the events are for the journal: what is recorded from now on."""

    def await_force(self) -> None:
        """Returns when there can be force. Raises Aborted if nothing takes care of that."""

    def begin_condition(self, condition: protocols.Condition) -> None:
        """Prepares a condition before its first trial."""

    def present(self, trial: Trial, role: Role) -> Presentation:
        """Raises Interrupted, Aborted or HapticdError."""

    def explore(self, trial: Trial) -> Iterator[tuple[Role, Presentation]]:
        """Both stimuli at once: each visit of one of them, as it ends. Raises the same."""

    def time_s(self) -> Optional[float]:
        """Time by the rig's clock; None if there is none."""


@dataclass
class BareStage:
    """No rig: what is felt is the level. For procedures and their analysis alone.

    flawed_share: of the presentations that are to be discarded.
    """

    protocol: protocols.Protocol
    seed: int
    participant: str
    flawed_share: float = 0.0

    def check(self, protocol: protocols.Protocol) -> None:
        pass

    def opening(self) -> Sequence[Event]:
        return ()

    def await_force(self) -> None:
        pass

    def begin_condition(self, condition: protocols.Condition) -> None:
        pass

    def present(self, trial: Trial, role: Role) -> Presentation:
        random = seeds.generator(
            self.seed, self.participant, "flaw", trial.condition, int(trial.is_training), trial.number, trial.attempt, role
        )
        flaws = ("press_speed",) if random.random() < self.flawed_share else ()
        level = trial.level if role == "comparison" else self.protocol.condition(trial.condition).reference_n_per_mm
        return Presentation(flaws, {}, level)

    def explore(self, trial: Trial) -> Iterator[tuple[Role, Presentation]]:
        for role in trial.roles:
            presentation = self.present(trial, role)
            path = {"lateral_path_mm": self.protocol.min_lateral_path_mm}
            yield role, Presentation(presentation.flaws, path, presentation.felt_n_per_mm)

    def time_s(self) -> Optional[float]:
        return None


def record_of(message: Any, names: Sequence[str]) -> dict[str, Any]:
    """Fields of a message, for the journal; numbers that are not finite are left out."""
    values = {name: getattr(message, name) for name in names}
    return {name: value for name, value in values.items() if not (isinstance(value, float) and not math.isfinite(value))}


def without_nan(values: Mapping[str, Any]) -> dict[str, Any]:
    return {name: None if isinstance(value, float) and not math.isfinite(value) else value for name, value in values.items()}


def as_record(presentation: Presentation) -> dict[str, Any]:
    felt = {"felt_n_per_mm": round(presentation.felt_n_per_mm, 6)} if math.isfinite(presentation.felt_n_per_mm) else {}
    return {"flaws": list(presentation.flaws), **without_nan(presentation.record), **felt}
