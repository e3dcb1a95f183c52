"""State of an experiment: the fold of its journal; and what comes next: a function of that alone."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from typing import Any, Iterable, Literal, Mapping, Optional, Sequence, Union

from hapticd.errors import BadFile
from hapticd.experiment import protocol as protocols
from hapticd.experiment import seeds
from hapticd.experiment.journal import Event
from hapticd.experiment.procedures import Answer, Series

Role = Literal["reference", "comparison"]
ROLES: tuple[Role, Role] = ("reference", "comparison")

#: Shares of training trials: far from the reference, so that the answer is plain.
TRAINING_SHARES = (1.5, 0.6)


@dataclass(frozen=True)
class Trial:
    """A pair of presentations and a question."""

    condition: str
    number: int  #: answered trials of the condition before this one
    attempt: int  #: discarded attempts at this trial before this one
    member: int  #: of the series; -1 in training
    level: float  #: of the comparison, N/mm
    roles: tuple[Role, Role]  #: in the order of the intervals
    is_training: bool = False


@dataclass(frozen=True)
class Condition:
    """The participant begins a condition."""

    name: str


@dataclass(frozen=True)
class Break:
    """A rest between conditions."""

    seconds: float


@dataclass(frozen=True)
class End:
    """All conditions are done."""


Step = Union[Trial, Condition, Break, End]


@dataclass
class State:
    """State after the events so far."""

    protocol: protocols.Protocol
    participant: str
    number: int  #: of the participant, from 0: for the order of conditions
    seed: int
    order: list[str]
    rendered: Mapping[str, float] = field(default_factory=dict)  #: by condition, the highest level that the rig renders, N/mm
    series: dict[str, Series] = field(default_factory=dict)
    answered: int = 0  #: trials of the present condition
    attempts: int = 0  #: discarded attempts at the present trial
    discarded: int = 0  #: of the present condition
    trained: int = 0
    rested: bool = True
    ended: bool = False
    aborted: str = ""

    @property
    def condition(self) -> Optional[str]:
        """The one under way: begun last."""
        return next(reversed(self.series), None)


def begin(
    protocol: protocols.Protocol, participant: str, number: int, seed: int, versions: Mapping[str, str], rendered: Mapping[str, float] = {}
) -> Event:
    """The first event of a journal; it has all that the rest depends on. rendered: see State."""
    names = [one.name for one in protocol.conditions]
    if protocol.condition_order == "balanced":
        order = [names[index] for index in seeds.balanced_order(len(names), number)]
    elif protocol.condition_order == "random":
        order = seeds.shuffled(names, seed, participant, "conditions")
    else:
        order = names
    return {
        "event": "begin",
        "participant": participant,
        "number": number,
        "seed": seed,
        "order": order,
        "protocol_sha256": protocol.sha256,
        "versions": dict(versions),
        **({"rendered_n_per_mm": dict(rendered)} if rendered else {}),
        "protocol": protocol.document,
    }


def fold(events: Sequence[Event], where: str = "journal") -> State:
    """Raises BadFile if the events are none of an experiment."""
    if not events or events[0]["event"] != "begin":
        raise BadFile("a journal begins with the event 'begin'", where=where)
    first = events[0]
    try:
        protocol = protocols.of(first["protocol"], where)
        state = State(protocol, first["participant"], int(first["number"]), int(first["seed"]), list(first["order"]), _rendered(first))
        if protocol.sha256 != first["protocol_sha256"]:
            raise BadFile("the protocol in it was changed", where=where, remedy="take the journal as it was written")
        for event in events[1:]:
            apply(state, event)
    except (KeyError, TypeError, ValueError, AssertionError, StopIteration) as error:
        raise BadFile(f"its events do not follow from one another ({error!r})", where=where) from error
    return state


def _rendered(first: Event) -> dict[str, float]:
    return {name: float(level) for name, level in dict(first.get("rendered_n_per_mm", {})).items()}


def apply(state: State, event: Mapping[str, Any]) -> None:
    """One event later."""
    kind = event["event"]
    if kind in ("presentation", "answer", "discarded") and not isinstance(event["training"], bool):
        raise ValueError(f"training is {event['training']!r}")
    if kind == "answer" and event["comparison_felt"] not in ("harder", "same", "softer"):
        raise ValueError(f"comparison_felt is {event['comparison_felt']!r}")
    if kind == "condition":
        name = event["condition"]
        state.series[name] = state.protocol.series(
            state.protocol.condition(name), state.seed, state.participant, state.rendered.get(name, math.inf)
        )
        state.answered = state.attempts = state.discarded = 0
        state.rested = False
    elif kind == "answer":
        if event["training"]:
            state.trained += 1
        else:
            name = event["condition"]
            state.series[name] = state.series[name].answered(event["comparison_felt"])
            state.answered += 1
        state.attempts = 0
    elif kind == "discarded":
        state.attempts += 1
        state.discarded += 1
    elif kind == "rested":
        state.rested = True
    elif kind == "abort":
        state.aborted = event["why"]
    elif kind == "end":
        state.ended = True


def last_complete(events: Sequence[Event]) -> int:
    """How many events are kept when a program goes on: up to the last that does not belong to an open trial, and without
    an abort."""
    keep = 0
    for index, event in enumerate(events, 1):
        if event["event"] in ("begin", "condition", "answer", "discarded", "rested", "end"):
            keep = index
    return keep


def next_step(state: State) -> Step:
    """What comes next; the same for the same state."""
    if state.ended:
        return End()
    if state.trained < state.protocol.training_trials:
        return _training(state)
    name = state.condition
    if name is not None and state.series[name].next_level() is not None:
        return _trial(state, name)
    left = [one for one in state.order if one not in state.series]
    if not left:
        return End()
    if name is not None and not state.rested and state.protocol.min_break_s > 0.0:
        return Break(state.protocol.min_break_s)
    return Condition(left[0])


def _roles(state: State, condition: str, number: int) -> tuple[Role, Role]:
    if state.protocol.order == "reference_first":
        return ROLES
    swapped = seeds.generator(state.seed, state.participant, condition, "order", number).random() < 0.5
    return (ROLES[1], ROLES[0]) if swapped else ROLES


def _trial(state: State, name: str) -> Trial:
    series = state.series[name]
    member, level = series.current(), series.next_level()
    assert member is not None and level is not None
    return Trial(name, state.answered, state.attempts, member, level, _roles(state, name, state.answered))


def _training(state: State) -> Trial:
    protocol = state.protocol
    condition = protocol.condition(state.order[0])
    share = TRAINING_SHARES[state.trained % len(TRAINING_SHARES)]
    highest = min(protocol.highest_n_per_mm, state.rendered.get(condition.name, math.inf))
    level = min(max(condition.reference_n_per_mm * share, protocol.lowest_n_per_mm), highest)
    return Trial(
        condition.name, state.trained, state.attempts, -1, round(level, 9), _roles(state, "training", state.trained), is_training=True
    )


def comparison_felt(trial: Trial, answer: str) -> Answer:
    """What "the first felt harder" says of the comparison."""
    if answer == "same":
        return "same"
    harder = trial.roles[0] if answer == "first" else trial.roles[1]
    return "harder" if harder == "comparison" else "softer"


def trial_fields(trial: Trial) -> dict[str, Any]:
    """Fields as events have them."""
    fields = dataclasses.asdict(trial)
    return {
        "condition": fields["condition"],
        "training": fields["is_training"],
        "trial": fields["number"],
        "attempt": fields["attempt"],
        "member": fields["member"],
        "level_n_per_mm": fields["level"],
    }


def answers_of(events: Iterable[Event], condition: str) -> list[Event]:
    """The answers of a condition, without training."""
    return [one for one in events if one["event"] == "answer" and not one["training"] and one["condition"] == condition]
