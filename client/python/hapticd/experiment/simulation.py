"""Simulated participants, from the first to the last: on a rig of which each stimulus is felt a few times, on a rig at every trial, or
without one."""

from __future__ import annotations

import contextlib
import math
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Callable, Iterator, Mapping, Optional, Sequence, TypeVar

import hapticd
from hapticd._shown import say
from hapticd.errors import BadFile
from hapticd.experiment import journal as journals
from hapticd.experiment import protocol as protocols
from hapticd.experiment import readiness, runner, seeds, session, simulated
from hapticd.experiment.hands import SimulatedHand
from hapticd.experiment.journal import Event, Journal
from hapticd.experiment.observer import Observer
from hapticd.experiment.rig_stage import RigStage
from hapticd.experiment.session import Role, State, Trial
from hapticd.experiment.stage import BareStage, Interrupted, Presentation, Stage

#: How often a stimulus is felt, each time by another hand; and a search, which takes a minute of the rig's time.
HANDS, SEARCHES = 6, 2
#: Ratio of the levels of a comparison that are felt; what lies between them is interpolated.
LEVEL_RATIO = 1.2
#: Flaws of the machine, on which the rig's time runs fast: what has them is felt again, so often at most.
OF_THE_MACHINE, ATTEMPTS = {"too_long", "ticks_lost"}, 5
#: Between two lines about the progress, s.
PROGRESS_S = 10.0

Visits = Sequence[tuple[Role, Presentation]]
Felt = TypeVar("Felt", Presentation, Visits)


class Progress:
    """Lines for those who wait."""

    def __init__(self, participants: int) -> None:
        self._participants = participants
        self._said_s = time.monotonic()
        self._doing = ""
        self._answered = self._presented = 0

    def begins(self, number: int, observer: Observer) -> None:
        self._doing = f"{observer.name}, {number + 1} of {self._participants}"
        self._answered = 0

    def answered(self, condition: str) -> None:
        self._answered += 1
        self._say(condition)

    def presented(self, condition: str) -> None:
        self._presented += 1
        self._say(condition)

    def _say(self, condition: str) -> None:
        if time.monotonic() - self._said_s < PROGRESS_S:
            return
        self._said_s = time.monotonic()
        say(f"{self._doing}: {condition}, {self._answered} trials answered; {self._presented} presentations on the rig", sys.stderr)


class FeltStimuli:
    """What a simulated hand feels of each stimulus: measured on the rig when it is first needed, then kept for all participants."""

    def __init__(self, rig: RigStage, protocol: protocols.Protocol, progress: Progress) -> None:
        self._rig, self._protocol, self._progress = rig, protocol, progress
        self._kept: dict[tuple[str, str, float, int], Visits] = {}
        self.hands = SEARCHES if protocol.touch == "search" else HANDS

    def presented(self, trial: Trial, role: Role, hand: int) -> Presentation:
        """Presents at the trial's level."""

        def at(level: float) -> Presentation:
            return self._felt((role, level, hand), trial, lambda one: [(role, self._rig.present(one, role))])[0][1]

        return _between(trial.level, self._knots(trial) if role == "comparison" else (0.0, 0.0), at, _mixed)

    def explored(self, trial: Trial, hand: int) -> Visits:
        """Both stimuli; the comparison at the trial's level."""

        def at(level: float) -> Visits:
            return self._felt(("both", level, hand), trial, lambda one: list(self._rig.explore(one)))

        return _between(trial.level, self._knots(trial), at, _mixed_visits)

    def _felt(self, which: tuple[str, float, int], trial: Trial, feel: Callable[[Trial], Visits]) -> Visits:
        role, level, hand = which
        key = (trial.condition, *which)
        for attempt in range(ATTEMPTS if key not in self._kept else 0):
            try:
                visits = feel(replace(trial, level=level, number=hand, attempt=attempt, member=-1, is_training=False))
            except Interrupted as interrupted:
                visits = [("reference" if role == "both" else role, Presentation([str(interrupted)]))]  # type: ignore[list-item]
            self._kept[key] = visits
            self._progress.presented(trial.condition)
            if not any(set(one.flaws) & OF_THE_MACHINE for _, one in visits):
                break
        return self._kept[key]

    def _knots(self, trial: Trial) -> tuple[float, float]:
        """The levels next to the trial's that are measured."""
        if self._protocol.kind == "rate":
            return 0.0, 0.0
        reference = self._protocol.condition(trial.condition).reference_n_per_mm
        lowest = self._protocol.lowest_n_per_mm
        highest = min(self._protocol.highest_n_per_mm, self._rig.rendered.get(trial.condition, math.inf))
        step = math.floor(math.log(trial.level / reference) / math.log(LEVEL_RATIO) + 1e-9)
        low, high = (min(max(reference * LEVEL_RATIO ** (step + more), lowest), highest) for more in (0, 1))
        return low, high


def _between(level: float, knots: tuple[float, float], at: Callable[[float], Felt], mixed: Callable[[Felt, Felt, float], Felt]) -> Felt:
    low, high = knots
    if high <= low or level <= low * (1.0 + 1e-9):
        return at(low)
    if level >= high * (1.0 - 1e-9):
        return at(high)
    return mixed(at(low), at(high), math.log(level / low) / math.log(high / low))


def _mixed(low: Presentation, high: Presentation, share: float) -> Presentation:
    """The nearer one, with what was felt in between."""
    nearer = low if share < 0.5 else high
    one, other = low.felt_n_per_mm, high.felt_n_per_mm
    felt = one ** (1.0 - share) * other**share if one > 0.0 and other > 0.0 else nearer.felt_n_per_mm
    return replace(nearer, felt_n_per_mm=felt)


def _mixed_visits(low: Visits, high: Visits, share: float) -> Visits:
    nearer = low if share < 0.5 else high
    if [role for role, _ in low] != [role for role, _ in high]:
        return nearer
    return [(role, _mixed(one, other, share)) for (role, one), (_, other) in zip(low, high)]


#: Fields of a presentation that was measured for others too: these would name another tick and another level.
NOT_OF_THE_TRIAL = ("number", "begin_tick", "end_tick", "granted_n_per_mm", "recording")


@dataclass
class FeltStage:
    """Presents what was felt, each time as one of the hands that felt it."""

    felt: FeltStimuli
    rig: RigStage
    seed: int
    participant: str

    def check(self, protocol: protocols.Protocol) -> None:
        pass  # it was, before the first participant

    def opening(self) -> Sequence[Event]:
        return ()

    def await_force(self) -> None:
        self.rig.await_force()

    def begin_condition(self, condition: protocols.Condition) -> None:
        pass

    def present(self, trial: Trial, role: Role) -> Presentation:
        return _of_the_trial(self.felt.presented(trial, role, self._hand(trial, role)))

    def explore(self, trial: Trial) -> Iterator[tuple[Role, Presentation]]:
        for role, presentation in self.felt.explored(trial, self._hand(trial, "both")):
            yield role, _of_the_trial(presentation)

    def time_s(self) -> Optional[float]:
        return None

    def _hand(self, trial: Trial, role: str) -> int:
        random = seeds.generator(
            self.seed, self.participant, "hand", trial.condition, int(trial.is_training), trial.number, trial.attempt, role
        )
        return int(random.integers(self.felt.hands))


def _of_the_trial(presentation: Presentation) -> Presentation:
    return replace(presentation, record={name: value for name, value in presentation.record.items() if name not in NOT_OF_THE_TRIAL})


@dataclass
class _Answers(simulated.SimulatedParticipant):
    progress: Progress

    def notify(self, event: Event) -> None:
        if event["event"] == "answer":
            self.progress.answered(event["condition"])


@dataclass(frozen=True)
class Group:
    """Persons to simulate, and where their journals are."""

    protocol: protocols.Protocol
    folder: Path
    observers: Mapping[int, Observer]  #: by number
    seed: int


#: Called after each session: how it ended, its journal, and whether it had ended before.
OnEnd = Callable[[State, Path, bool], None]


def run(group: Group, address: Optional[str], on_end: OnEnd, *, every_trial: bool, record: bool, no_rig: bool) -> None:
    """All of them. Those that have a journal go on with it. Raises BadFile, before anything is simulated, if one is of another seed."""
    for observer in group.observers.values():
        _require_seed(group, runner.path_of(group.folder, group.protocol, observer.name))
    progress = Progress(max(group.observers, default=0) + 1)
    with contextlib.ExitStack() as stack:
        rig = None if no_rig else stack.enter_context(hapticd.connect(address))
        felt: Optional[tuple[FeltStimuli, RigStage]] = None
        if rig is not None and not every_trial:
            stage = stack.enter_context(RigStage(rig, SimulatedHand(group.seed, "hand"), seed=group.seed, wait_for_clear_s=0.0))
            _check(rig, stage, group.protocol)
            felt = FeltStimuli(stage, group.protocol, progress), stage
        for number, observer in group.observers.items():
            progress.begins(number, observer)
            path = runner.path_of(group.folder, group.protocol, observer.name)
            with contextlib.ExitStack() as own:
                on: Stage
                if rig is None:
                    on = BareStage(group.protocol, group.seed, observer.name)
                elif felt is not None:
                    on = FeltStage(*felt, group.seed, observer.name)
                else:
                    hand = SimulatedHand.of(observer)
                    on = own.enter_context(RigStage(rig, hand, seed=group.seed, record_as=path.stem if record else "", wait_for_clear_s=0.0))
                    _check(rig, on, group.protocol)
                journal = _journal(group, number, observer, path, rig, felt[1] if felt else on)
                was_done = session.fold(journal.events, str(path)).ended
                on_end(_to_the_end(journal, on, _Answers(observer, progress)), path, was_done)


def _check(rig: hapticd.Rig, stage: RigStage, protocol: protocols.Protocol) -> None:
    """Checks before there is a journal."""
    stage.check(protocol)
    if (latched := readiness.latched_problem(rig)) is not None:
        raise latched
    if found := readiness.problems(rig, protocol):
        raise found[0]


def _require_seed(group: Group, path: Path) -> None:
    if not path.exists():
        return
    seed = session.fold(journals.read(path)[:1], str(path)).seed
    if seed != group.seed:
        raise BadFile(
            "this journal is of another seed", where=str(path), value=f"--seed {group.seed}", limit=f"--seed {seed}",
            remedy="go on with that seed, or name another --folder for the new one",
        )  # fmt: skip


def _journal(group: Group, number: int, observer: Observer, path: Path, rig: Optional[hapticd.Rig], stage: Any) -> Journal:
    if path.exists():
        return runner.resume(path, group.protocol)
    rendered = {} if rig is None else stage.rendered
    return runner.begin(group.folder, group.protocol, observer.name, number, group.seed, versions_of(rig), rendered)


def _to_the_end(journal: Journal, stage: Stage, participant: runner.Participant) -> State:
    """A session in which nothing was answered leaves no journal: there is nothing to go on with."""
    state = session.fold(journal.events)
    try:
        state = runner.Runner(journal, stage, participant).run()
        return state
    finally:
        journal.close()
        if not any(event["event"] == "answer" for event in journal.events):
            journal.path.unlink()


def versions_of(rig: Optional[hapticd.Rig]) -> dict[str, str]:
    if rig is None:
        return {}
    info = rig.get_rig_info()
    return {"hapticd": info.server_version, "rig": info.name}
