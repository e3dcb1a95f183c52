#!/usr/bin/env python3
"""Points of subjective equality by hapticd and by psignifit 4 from the same simulated answers.

    psignifit_fits.py      needs psignifit 4 and numpy (pip install psignifit)
"""

import sys

try:
    import psignifit
except ImportError as missing:
    print(f"SKIPPED LOUDLY: {missing}", file=sys.stderr)
    sys.exit(77)

import numpy as np
from hapticd.experiment import fit
from hapticd.experiment.procedures import Constant, Given, Series

DATA_SETS, LEVELS, TRIALS = 70, 7, 20
PSE, DEVIATION, LAPSE = 0.5, 0.13, 0.02
#: Largest difference of the point of subjective equality; what was seen is 1.2 % at most.
MAX_DIFFERENCE = 0.03

levels = PSE * np.exp(np.linspace(-2.0, 2.0, LEVELS) * DEVIATION)
random = np.random.default_rng(1)
differences = []
for _ in range(DATA_SETS):
    harder, _, _ = fit.shares(levels, np.array(PSE), np.array(DEVIATION), np.array(LAPSE))
    counts = random.binomial(TRIALS, harder)
    given = [
        Given(float(level), "harder" if i < count else "softer") for level, count in zip(levels, counts) for i in range(TRIALS)
    ]
    ours = fit.of_series(Series((Constant(tuple(one.level for one in given), tuple(given)),))).pse
    table = np.column_stack([levels, counts, np.full(LEVELS, TRIALS)])
    theirs = float(psignifit.psignifit(table, experiment_type="yes/no", sigmoid="logn").threshold(0.5)[0])
    differences.append(ours / theirs - 1.0)
print(f"psignifit: {np.mean(differences):+.2%} ± {np.std(differences):.2%}, at most {np.max(np.abs(differences)):.2%}")
sys.exit(0 if np.max(np.abs(differences)) < MAX_DIFFERENCE else 1)
