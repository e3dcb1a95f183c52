"""Signals end a session in order."""

from __future__ import annotations

import signal
import sys
import time

import pytest

from hapticd.experiment import ending


class SignalledWhenFinalised:
    """What is raised while an object is finalised is lost."""

    def __del__(self) -> None:
        signal.raise_signal(signal.SIGTERM)


def test_an_interruption_that_was_lost_is_raised_again(monkeypatch: pytest.MonkeyPatch) -> None:
    lost: list[object] = []
    monkeypatch.setattr(sys, "unraisablehook", lambda what: lost.append(what.exc_type))
    monkeypatch.setattr(ending, "AGAIN_AFTER_S", 0.05)
    before = signal.getsignal(signal.SIGTERM)
    with pytest.raises(KeyboardInterrupt), ending.by_signals():
        with ending.until_left():
            SignalledWhenFinalised()
            assert lost == [KeyboardInterrupt]
            until = time.monotonic() + 60.0
            while time.monotonic() < until:
                time.sleep(0.01)
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0) and signal.getsignal(signal.SIGTERM) is before


def test_the_end_is_not_disturbed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ending, "AGAIN_AFTER_S", 0.05)
    done = False
    with pytest.raises(KeyboardInterrupt), ending.by_signals():
        try:
            with ending.until_left():
                signal.raise_signal(signal.SIGTERM)
        finally:
            signal.raise_signal(signal.SIGTERM)  # one more
            time.sleep(0.2)  # the rig is given back
            done = True
    assert done
