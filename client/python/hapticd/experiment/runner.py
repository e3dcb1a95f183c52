"""Runs an experiment: asks what comes next, presents it, has it answered, and writes each event before the next.

The journal is the only state. A program that ends anywhere goes on where its journal ends.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Callable, Mapping, Optional, Protocol as Interface, Sequence

from hapticd.errors import BadFile
from hapticd.experiment import free_change
from hapticd.experiment import journal as journals
from hapticd.experiment import protocol as protocols
from hapticd.experiment import session
from hapticd.experiment.journal import Event, Journal
from hapticd.experiment.stage import Aborted, Interrupted, Presentation, Stage, as_record, without_nan
from hapticd.experiment.session import Break, Condition, End, Role, State, Trial


class Participant(Interface):
    """Answers: of a person at the page, or of a simulated observer."""

    def ready(self, state: State, trial: Trial, interval: int) -> Sequence[Event]:
        """Returns when the next presentation may begin; the events are for the journal, e.g. early keys."""

    def answer(self, state: State, trial: Trial, felt: Sequence[Presentation]) -> tuple[str, Sequence[Event]]:
        """"first", "second" or "same"; of a rating: its number as text. With events for the journal."""

    def warn(self, trial: Trial, flaws: Sequence[str]) -> None:
        """The trial is discarded."""

    def rest(self, seconds: float) -> None:
        """Returns when the rest is over."""

    def notify(self, event: Event) -> None:
        """Called after each event, for views."""


def path_of(folder: Path, protocol: protocols.Protocol, participant: str) -> Path:
    """FOLDER/PROTOCOL_PARTICIPANT.jsonl. Raises BadFile if the code is none."""
    if not participant or not all(one.isascii() and (one.isalnum() or one in "_-") for one in participant) or len(participant) > 64:
        raise BadFile("this is no participant's code", value=repr(participant), limit="1 … 64 letters, digits, '_' and '-'")
    return folder / f"{protocol.name}_{participant}.jsonl"


def begin(
    folder: Path, protocol: protocols.Protocol, participant: str, number: int, seed: int, versions: dict[str, str],
    rendered: Mapping[str, float] = {},
) -> Journal:  # fmt: skip
    """A new journal. Raises BadFile if this code was used. rendered: see session.State."""
    journal = Journal.create(path_of(folder, protocol, participant))
    journal.append(session.begin(protocol, participant, number, seed, versions, rendered))
    return journal


def resume(path: Path, protocol: Optional[protocols.Protocol] = None) -> Journal:
    """A journal, to go on after its last complete trial. Raises BadFile if it is of another protocol."""
    events = journals.read(path)
    state = session.fold(events[: session.last_complete(events)] or events, str(path))
    if protocol is not None and state.protocol.sha256 != protocol.sha256:
        raise BadFile(
            "the journal is of another protocol",
            where=str(path),
            value=f"{state.protocol.name}, {state.protocol.sha256[:12]}",
            limit=f"{protocol.name}, {protocol.sha256[:12]}",
            remedy="resume it without naming a protocol: it has its own",
        )
    return Journal.reopen(path, session.last_complete(events))


class Runner:
    """One participant's session."""

    def __init__(self, journal: Journal, stage: Stage, participant: Participant) -> None:
        self._journal = journal
        self._stage = stage
        self._participant = participant
        self._state = session.fold(journal.events, str(journal.path))

    @property
    def state(self) -> State:
        return self._state

    def run(self, until: Optional[Callable[[State], bool]] = None) -> State:
        """Runs to the end, or until it is aborted; `until`: asked before each step."""
        self._stage.check(self._state.protocol)
        for event in self._stage.opening():
            self._write(event)
        if self._state.condition is not None:
            self._stage.begin_condition(self._state.protocol.condition(self._state.condition))
        while not self._state.ended and not (until is not None and until(self._state)):
            step = session.next_step(self._state)
            try:
                self._take(step)
            except Aborted as aborted:
                self._write({"event": "abort", "why": str(aborted)})
                break
        return self._state

    def _take(self, step: session.Step) -> None:
        if isinstance(step, End):
            self._write({"event": "end"})
        elif isinstance(step, Break):
            self._participant.rest(step.seconds)
            self._write({"event": "rested"})
        elif isinstance(step, Condition):
            self._stage.begin_condition(self._state.protocol.condition(step.name))
            self._write({"event": "condition", "condition": step.name})
        else:
            self._trial(step)

    def _trial(self, trial: Trial) -> None:
        fields = session.trial_fields(trial)
        felt = self._explored(trial, fields) if self._state.protocol.change == "free" else self._presented(trial, fields)
        if felt is None:
            return
        answer, events = self._participant.answer(self._state, trial, felt)
        for event in events:
            self._write(event)
        self._write({"event": "answer", **fields, **self._answered(trial, answer, felt)})

    def _presented(self, trial: Trial, fields: dict[str, Any]) -> Optional[list[Presentation]]:
        """One after the other; None if the trial is discarded."""
        felt: list[Presentation] = []
        for interval, role in enumerate(trial.roles, 1):
            self._stage.await_force()
            for event in self._participant.ready(self._state, trial, interval):
                self._write(event)
            try:
                presentation = self._stage.present(trial, role)
            except Interrupted as interrupted:
                self._discard(trial, fields, [str(interrupted)])
                return None
            self._write({"event": "presentation", **fields, "interval": interval, "role": role, **as_record(presentation)})
            if presentation.flaws:
                self._discard(trial, fields, presentation.flaws)
                return None
            felt.append(presentation)
        return felt

    def _explored(self, trial: Trial, fields: dict[str, Any]) -> Optional[list[Presentation]]:
        """Both at once, changed between at will; an event for each visit. None if the trial is discarded."""
        self._stage.await_force()
        for event in self._participant.ready(self._state, trial, 1):
            self._write(event)
        visits: list[tuple[Role, Presentation]] = []
        try:
            for role, presentation in self._stage.explore(trial):
                visits.append((role, presentation))
                self._write({"event": "presentation", **fields, "interval": len(visits), "role": role, **as_record(presentation)})
        except Interrupted as interrupted:
            self._discard(trial, fields, [str(interrupted)])
            return None
        flaws = [flaw for _, one in visits for flaw in one.flaws] + free_change.flaws_of_all(self._state.protocol, visits)
        if flaws:
            self._discard(trial, fields, list(dict.fromkeys(flaws)))
            return None
        return [free_change.joined(visits, role) for role in trial.roles]

    def _answered(self, trial: Trial, answer: str, felt: Sequence[Presentation]) -> dict[str, Any]:
        if self._state.protocol.kind == "rate":
            found = {f"found_{role}_s": one.found_after_s for role, one in zip(trial.roles, felt)}
            return {"similarity": float(answer), "comparison_felt": "same", **without_nan(found)}
        return {"answer": answer, "comparison_felt": session.comparison_felt(trial, answer)}

    def _discard(self, trial: Trial, fields: dict[str, Any], flaws: Sequence[str]) -> None:
        self._participant.warn(trial, flaws)
        self._write({"event": "discarded", **fields, "why": list(flaws)})
        if self._state.discarded > self._state.protocol.max_discarded:
            raise Aborted(f"more than {self._state.protocol.max_discarded} trials of a condition were discarded")

    def _write(self, event: Event) -> None:
        time_s = self._stage.time_s()
        if time_s is not None:
            event = {**event, "time_s": round(time_s, 4)}
        self._journal.append(event)
        session.apply(self._state, event)
        self._participant.notify(event)


def numbers_used(folder: Path, protocol: protocols.Protocol) -> int:
    """How many participants of a protocol have a journal in the folder."""
    return len(list(folder.glob(f"{protocol.name}_*.jsonl"))) if folder.exists() else 0
