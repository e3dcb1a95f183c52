"""How a session goes on, for those who watch the rig: reported to the daemon, as the experimenter's page shows it."""

from __future__ import annotations

import contextlib
import threading
import time
from typing import Any

import hapticd
from hapticd.errors import HapticdError, TimedOut, Unreachable
from hapticd.experiment import readiness
from hapticd.experiment.page_person import PagePerson

#: No more often, s; and no less often than the page hears of it.
PAUSE_S, HEARTBEAT_S = 0.2, 1.0

#: A daemon that no report reached for so long is lost, s.
LOST_AFTER_S = 5.0

PHASES = {
    "wait": "waiting",
    "ready": "ready",
    "guided": "guided",
    "touch": "touch",
    "question": "question",
    "rate": "question",
    "warning": "discarded",
    "rest": "rest",
    "done": "done",
}


def progress_of(protocol: str, shown: dict[str, Any]) -> dict[str, Any]:
    """What the experimenter's page shows, as fields of ExperimentProgress."""
    numbers = ("condition", "conditions", "trial", "attempt", "answered", "presented", "discarded")
    return {
        "protocol": protocol,
        "participant": shown.get("participant", ""),
        "phase": PHASES[shown["phase"]],
        "training": bool(shown.get("training", False)),
        **{name: int(shown.get(name, 0)) for name in numbers},
        "last_flaws": list(shown.get("flaws", [])),
        "page_is_open": bool(shown.get("page", False)),
        "noise": str(shown.get("noise", {}).get("state", "")),
        "rig_waits_for": str(shown.get("fault") or shown.get("rig", "")),
    }


class Reporter:
    """Reports while the block runs; the rig's lease must be held. Use as a context manager."""

    def __init__(self, rig: hapticd.Rig, protocol: str, person: PagePerson) -> None:
        self._rig, self._protocol, self._person = rig, protocol, person
        self._ending = threading.Event()
        self._end: dict[str, Any] = {"phase": "aborted", "ended_because": "interrupted"}
        self._thread = threading.Thread(target=self._run, name="reports", daemon=True)

    def __enter__(self) -> Reporter:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ending.set()
        self._thread.join()
        self._report(self._person.view("experimenter", -1, 0.0)[1], self._end)

    def ended(self, aborted: str) -> None:
        """How; empty: in good order."""
        self._end = {"phase": "aborted", "ended_because": aborted} if aborted else {"phase": "done"}

    def _run(self) -> None:
        version = -1
        arrived_s = time.monotonic()
        while not self._ending.wait(PAUSE_S):
            version, shown = self._person.view("experimenter", version, HEARTBEAT_S)
            with contextlib.suppress(HapticdError):
                self._person.force_is(readiness.latched(self._rig))
            if self._report(shown, {}):
                arrived_s = time.monotonic()
            elif time.monotonic() - arrived_s > LOST_AFTER_S:
                self._person.lost("the daemon no longer answers")

    def _report(self, shown: dict[str, Any], end: dict[str, Any]) -> bool:
        """Whether the daemon was there. One that refuses a report is; the session goes on."""
        with contextlib.suppress(HapticdError):
            try:
                self._rig.report_experiment(**{**progress_of(self._protocol, shown), **end})
            except (TimedOut, Unreachable):
                return False
        return True
