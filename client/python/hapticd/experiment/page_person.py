"""A participant at the page: what the page shows, and what its keys say."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass, field
from typing import Any, Callable, Mapping, Optional, Sequence

from hapticd.block import Block
from hapticd.errors import HapticdError
from hapticd.experiment.journal import Event
from hapticd.experiment.session import State, Trial
from hapticd.experiment.stage import Aborted, Interrupted, Presentation

#: A page that was not seen for so long is closed, s.
LOST_AFTER_S = 3.0
#: How long a session waits for a page, or for someone, before it ends, s.
PATIENCE_S = 1800.0
#: How long a warning is shown, s.
WARNING_S = 4.0

WARNINGS = {
    "press_speed": "That was too fast. Please press more slowly.",
    "lateral": "The tool moved too far aside. Please press straight down.",
    "contact_speed": "The object was struck too fast. Please touch it gently.",
    "contacts": "The object was touched too often. Please stay on it.",
    "lateral_path": "Please stroke a longer way along the surface.",
    "no_contact": "The object was not touched.",
    "contact_time": "The object was touched too briefly. Please press it for longer.",
    "guard": "The force was taken away for safety.",
    "force_cut": "The force was taken away for safety.",
    "ticks_lost": "A measurement was lost. This was not your doing.",
    "too_long": "That took too long.",
}


@dataclass
class Views:
    """What the two pages show; plain data, replaced as a whole."""

    participant: dict[str, Any] = field(default_factory=lambda: {"phase": "wait", "text": "Please wait."})
    experimenter: dict[str, Any] = field(default_factory=dict)
    version: int = 0


class PagePerson:
    """The runner's side is called by its thread; the page's side by those of the server."""

    def __init__(
        self, on_stop: Callable[[str], Any], patience_s: float = PATIENCE_S, lost_after_s: float = LOST_AFTER_S,
        on_clear: Callable[[], Any] = lambda: None,
    ) -> None:  # fmt: skip
        """on_clear: leaves a stop or a fault; its HapticdError is for the experimenter."""
        self._on_stop = on_stop
        self._on_clear = on_clear
        self._fault = ""
        self._patience_s = patience_s
        self._lost_after_s = lost_after_s
        self._changed = threading.Condition()
        self._views = Views()
        self._keys: list[tuple[str, Optional[float]]] = []
        self._noise: Mapping[str, Any] = {"state": "none", "gain": 0.0}
        self._seen_s = 0.0
        self._aborted = ""
        self._wants_noise = False
        self._touching = ""
        self._places: list[list[float]] = []  #: of the stimuli that lie next to each other

    # The page's side.

    def seen(self) -> None:
        """A participant's page is there."""
        with self._changed:
            self._seen_s = time.monotonic()
            self._changed.notify_all()

    def view(self, role: str, after: int, wait_s: float) -> tuple[int, dict[str, Any]]:
        """What a page shows, when it is newer than `after` or the time is over."""
        with self._changed:
            self._changed.wait_for(lambda: self._views.version != after, wait_s)
            views = self._views
            shown = dict(views.participant if role == "participant" else views.experimenter)
            if role == "experimenter":
                shown |= {"page": self._is_here(), "noise": dict(self._noise), "phase": views.participant["phase"]}
            return views.version, shown

    def key(self, name: str, after_ms: Optional[float]) -> None:
        with self._changed:
            if len(self._keys) < 100:
                self._keys.append((name, after_ms))
            self._changed.notify_all()

    def noise(self, state: str, gain: float) -> None:
        with self._changed:
            self._noise = {"state": state, "gain": round(gain, 3)}
            self._show_changed()

    def abort(self, who: str) -> None:
        """Stops the force at once; the session ends."""
        self._on_stop(f"experiment: ended by the {who}")
        with self._changed:
            self._aborted = f"by the {who}"
            self._changed.notify_all()

    def clear(self) -> None:
        """The experimenter has seen to the cause: the force may return."""
        refused = ""
        try:
            self._on_clear()
        except HapticdError as error:
            refused = str(error)
        with self._changed:
            self._views.experimenter = {**self._views.experimenter, "clear_refused": refused}
            self._show_changed()

    def force_is(self, fault: str) -> None:
        """Withheld for this fault; empty: it is there."""
        with self._changed:
            if fault == self._fault:
                return
            self._fault = fault
            self._views.experimenter = {**self._views.experimenter, "fault": fault, "clear_refused": ""}
            self._show_changed()

    def lost(self, what: str) -> None:
        """The session ends: nothing of the rig can be stopped or felt any more."""
        with self._changed:
            self._aborted = what
            self._changed.notify_all()

    # The runner's side.

    def ready(self, state: State, trial: Trial, interval: int) -> Sequence[Event]:
        self._wants_noise = state.protocol.white_noise
        self._progress(state, trial)
        early = self._early()
        events: list[Event] = []
        while True:
            name = "two" if state.protocol.change == "free" else "first" if interval == 1 else "second"
            self._show("ready", f"Press space to feel the {name}." + (" (Training)" if trial.is_training else ""), interval=interval)
            key, _ = self._wait_for_key(lambda: self._has_noise())
            if key == " ":
                break
            early.append({"event": "early", "key": key})
        if self._wants_noise:
            with self._changed:
                events.append({"event": "noise", "interval": interval, **self._noise})
        kind = state.protocol.touch
        self._touching = {"press": "Press straight down, then lift. Space when you are done."}.get(
            kind,
            "Press and stroke the object. Space when you are done."
            if kind == "stroke"
            else "Look for the lump. Keep the tool on it, and press space as soon as you have found it.",
        )
        if state.protocol.change == "free":
            self._touching = "Feel both objects, left and right, as often as you like. Space when you know your answer."
            condition = state.protocol.condition(trial.condition)
            self._places = [list(one.at_mm) for one in (condition.reference, condition.comparison)]
        guided = state.protocol.approach == "guided"
        self._show("guided", "Follow the tool." if guided else self._touching, interval=interval)
        return [*early, *events]

    def answer(self, state: State, trial: Trial, felt: Sequence[Presentation]) -> tuple[str, Sequence[Event]]:
        events = self._early()
        rate = state.protocol.kind == "rate"
        self._show("rate" if rate else "question", state.protocol.question, keys=dict(state.protocol.keys))
        while True:
            key, after_ms = self._wait_for_key()
            answer = self._rating(key) if rate else state.protocol.keys.get(key)
            if answer is not None:
                self._show("wait", "Thank you.")
                pressed: Event = {"event": "key", "key": key}
                return answer, [*events, pressed | ({} if after_ms is None else {"after_ms": round(after_ms, 1)})]

    @staticmethod
    def _rating(key: str) -> Optional[str]:
        try:
            value = float(key)
        except ValueError:
            return None
        return f"{value:g}" if 0.0 <= value <= 100.0 else None

    def warn(self, trial: Trial, flaws: Sequence[str]) -> None:
        text = " ".join(WARNINGS.get(flaw, flaw) for flaw in flaws)
        self._show("warning", f"{text} The pair is presented again.")
        self._pause(WARNING_S)

    def rest(self, seconds: float) -> None:
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0.0:
            self._show("rest", "Please rest.", seconds_left=round(left))
            self._pause(min(1.0, left))
        self._forget_keys()
        self._show("rest", "Press space when you want to go on.", seconds_left=0)
        while self._wait_for_key()[0] != " ":
            pass

    def notify(self, event: Event) -> None:
        with self._changed:
            shown = self._views.experimenter
            if event["event"] == "presentation":
                shown = {**shown, "flaws": list(event["flaws"]), "presented": shown.get("presented", 0) + 1}
            elif event["event"] == "discarded":
                shown = {**shown, "discarded": shown.get("discarded", 0) + 1}
            elif event["event"] == "answer":
                shown = {**shown, "answered": shown.get("answered", 0) + 1}
            self._views.experimenter = shown
            self._show_changed()

    def waits(self, text: str) -> None:
        """The rig waits for the experimenter; empty: it goes on."""
        if not text:
            self.force_is("")
        with self._changed:
            self._views.experimenter = {**self._views.experimenter, "rig": text}
        self._show("wait", "Please lift the tool and wait for the experimenter." if text else "Please wait.")
        self._raise_if_aborted()

    def goodbye(self) -> None:
        self._show("done", "That was all. Thank you very much!")

    # The hand's side, while a stimulus is presented.

    def begins(self) -> None:
        """The tool is at the object, or above it: the participant may touch."""
        self._forget_spaces()
        with self._changed:
            interval = self._views.participant.get("interval", 1)
        self._show("touch", self._touching, interval=interval, **({"places_mm": self._places} if self._places else {}))

    def says_done(self) -> bool:
        """Raises Interrupted if the page or its noise went away, Aborted if the session was ended."""
        self._raise_if_aborted()
        with self._changed:
            if self._fault:
                raise Interrupted("force_cut")
            if not self._is_here():
                raise Interrupted("the participant's page was closed")
            if not self._has_noise():
                raise Interrupted("the noise stopped")
            for index, (name, _) in enumerate(self._keys):
                if name == " ":
                    del self._keys[: index + 1]
                    return True
        return False

    def sees(self, block: Block) -> None:
        """Place of the tool, for a drawing that ends when the object is touched."""
        if not len(block):
            return
        of = "truth" if "truth_tip_position_x_mm" in block.names else "sample"
        place = [round(float(block[f"{of}_tip_position_{axis}_mm"][-1]), 1) for axis in "xyz"]
        touched = bool(block["contact_in_contact"][-1] > 0.5)
        with self._changed:
            self._views.participant = {**self._views.participant, "tool_mm": None if touched else place}
            self._show_changed()

    # Both.

    def _show(self, phase: str, text: str, **more: Any) -> None:
        with self._changed:
            kept = {key: self._views.participant[key] for key in ("progress", "training") if key in self._views.participant}
            self._views.participant = {**kept, "phase": phase, "text": text, "wants_noise": self._wants_noise, **more}
            self._show_changed()

    def _show_changed(self) -> None:
        self._views.version += 1
        self._changed.notify_all()

    def _progress(self, state: State, trial: Trial) -> None:
        done = sum(series.next_level() is None for series in state.series.values())
        with self._changed:
            self._views.participant = {**self._views.participant, "progress": done / len(state.order), "training": trial.is_training}
            self._views.experimenter = {
                **self._views.experimenter,
                "participant": state.participant,
                "condition": len(state.series),  # a number: the experimenter does not know which it is
                "conditions": len(state.order),
                "training": trial.is_training,
                "trial": trial.number + 1,
                "attempt": trial.attempt + 1,
            }
            self._show_changed()

    def _is_here(self) -> bool:
        return time.monotonic() - self._seen_s < self._lost_after_s

    def _has_noise(self) -> bool:
        return not self._wants_noise or self._noise["state"] == "running"

    def _raise_if_aborted(self) -> None:
        if self._aborted:
            raise Aborted(self._aborted)

    def _wait_for_key(self, when: Callable[[], bool] = lambda: True) -> tuple[str, Optional[float]]:
        """The next key, while the page is there and the condition holds."""
        until = time.monotonic() + self._patience_s
        while True:
            self._raise_if_aborted()
            with self._changed:
                if self._keys and self._is_here() and when():
                    return self._keys.pop(0)
                if not when():
                    self._keys.clear()
                self._changed.wait(0.2)
            if time.monotonic() > until:
                raise Aborted("no one answered")

    def _early(self) -> list[Event]:
        """Keys that were pressed before they were asked for: no answers, but not forgotten."""
        with self._changed:
            keys, self._keys = self._keys, []
        return [{"event": "early", "key": name} for name, _ in keys]

    def _forget_keys(self) -> None:
        with self._changed:
            self._keys.clear()

    def _forget_spaces(self) -> None:
        """A space that was pressed while the tool was led does not end the touch; other keys stay, and are noted as early."""
        with self._changed:
            self._keys = [one for one in self._keys if one[0] != " "]

    def _pause(self, seconds: float) -> None:
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0.0:
            self._raise_if_aborted()
            time.sleep(min(0.1, left))
