"""Waiting for the simulated hand."""

from __future__ import annotations

from hapticd.errors import TimedOut

#: Between two questions whether the hand is done.
HAND_POLL_S = 0.05


def hand_goes_on(timeout_s: float) -> TimedOut:
    return TimedOut(
        "the simulated hand has not ended its program",
        where="wait_for_hand",
        value=f"{timeout_s:g} s",
        remedy="set a program that ends, or a longer timeout_s; negative hold_s or repetitions go on for ever",
    )
