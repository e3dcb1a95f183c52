#!/usr/bin/env python3
"""Random staircases by hapticd and by PsychoPy's StairHandler with the same answers: levels, reversals and the end are the same.

    psychopy_staircases.py [NUMBER]      needs psychopy (pip install psychopy); NUMBER of staircases [3000]
"""

import random
import sys

try:
    from psychopy.data import StairHandler
except ImportError as missing:
    print(f"SKIPPED LOUDLY: {missing}", file=sys.stderr)
    sys.exit(77)

from hapticd.experiment.procedures import UpDown

FEWEST_TRIALS = 10


def differs(seed: int) -> str:
    """Returns where the two part; empty if they do not."""
    draw = random.Random(seed)
    start = round(draw.uniform(0.3, 1.5), 2)
    steps = (round(draw.uniform(0.05, 0.2), 2), round(draw.uniform(0.01, 0.05), 2))
    up, down, reversals = draw.randint(1, 2), draw.randint(1, 3), draw.randint(6, 15)
    lowest, highest = 0.05, 2.0
    ours = UpDown(
        start, steps, (1,), {"all_of": [{"reversals": reversals}, {"trials": FEWEST_TRIALS}]}, up=up, down=down, lowest=lowest,
        highest=highest,
    )
    theirs = StairHandler(
        startVal=start, nReversals=reversals, stepSizes=list(steps), nTrials=FEWEST_TRIALS, nUp=up, nDown=down, applyInitialRule=False,
        stepType="lin", minVal=lowest, maxVal=highest, autoLog=False,
    )
    for number, level in enumerate(theirs):
        own = ours.next_level()
        if own is None or abs(own - level) > 1e-9:
            return f"trial {number}: {own}, {level}"
        harder = draw.random() < 1.0 / (1.0 + 2.0 ** (-8.0 * (level - 0.7)))
        ours = ours.answered("harder" if harder else "softer")
        theirs.addResponse(int(harder))
    if ours.next_level() is not None:
        return "it goes on"
    pairs = zip(ours.reversals, theirs.reversalIntensities)
    same = len(ours.reversals) == len(theirs.reversalIntensities) and all(abs(a - b) < 1e-9 for a, b in pairs)
    return "" if same else f"reversals {ours.reversals}, {theirs.reversalIntensities}"


number = int(sys.argv[1]) if len(sys.argv) > 1 else 3000
wrong = {seed: found for seed in range(number) if (found := differs(seed))}
print(f"PsychoPy: {number - len(wrong)} of {number} staircases are the same", *list(wrong.items())[:3])
sys.exit(1 if wrong else 0)
