"""Signals that end a program in order, as Ctrl-C does."""

from __future__ import annotations

import contextlib
import signal
import threading
from typing import Any, Iterator

#: An exception that is raised while an object is finalised is lost, so it is raised again after this time, s.
AGAIN_AFTER_S = 1.0


@contextlib.contextmanager
def by_signals() -> Iterator[None]:
    """SIGTERM, and SIGHUP of a terminal or a connection that is closed, raise KeyboardInterrupt; once, so that the end is not disturbed."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {one: signal.getsignal(one) for one in (signal.SIGTERM, signal.SIGHUP)}
    taken = [one for one, handler in before.items() if handler == signal.SIG_DFL]  # nohup ignores one of them

    def end(number: int, frame: Any) -> None:
        for one in taken:
            signal.signal(one, signal.SIG_IGN)
        if signal.getsignal(signal.SIGALRM) is _raise_again:
            signal.setitimer(signal.ITIMER_REAL, AGAIN_AFTER_S, AGAIN_AFTER_S)
        raise KeyboardInterrupt

    for one in taken:
        signal.signal(one, end)
    try:
        yield
    finally:
        for one in taken:
            signal.signal(one, before[one])


@contextlib.contextmanager
def until_left() -> Iterator[None]:
    """Raises the interruption of by_signals() again until this body is left. What gives the rig back is outside of it."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGALRM, _raise_again)
    try:
        try:
            yield
        finally:
            signal.signal(signal.SIGALRM, signal.SIG_IGN)  # from here on by_signals() does not set the timer
    finally:  # also if it was raised again just before
        signal.signal(signal.SIGALRM, signal.SIG_IGN)
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def _raise_again(number: int, frame: Any) -> None:
    raise KeyboardInterrupt
