"""How far estimates of a point of subjective equality are off, and how often their intervals hold it: simulated observers, no rig."""

from __future__ import annotations

import math
import multiprocessing
from typing import Any, NamedTuple

import numpy as np

from hapticd.experiment import fit, procedures, protocol
from hapticd.experiment.observer import Observer
from hapticd.experiment.procedures import Series

import study_output

REFERENCE = 0.3
#: Difference thresholds over the stiffness, and shares of lapses, of people.
CELLS = [(weber, lapse) for weber in (0.06, 0.09, 0.12) for lapse in (0.0, 0.02, 0.05)]
TO_FELT = {"second": "harder", "first": "softer", "same": "same"}


class Cell(NamedTuple):
    procedure: str
    weber: float
    lapse: float
    observers: int


class Result(NamedTuple):
    bias: float
    published_bias: float
    coverage: float


def settings_of(name: str) -> tuple[dict[str, Any], float]:
    """Those of a shipped protocol, and the level at which its first staircase starts, over the reference."""
    chosen = protocol.read(name)
    settings = dict(chosen.procedure)
    condition = chosen.conditions[0]
    if condition.starts_n_per_mm:
        settings["start_shares"] = [start / condition.reference_n_per_mm for start in condition.starts_n_per_mm]
    return settings, chosen.highest_n_per_mm


def run(settings: dict[str, Any], highest: float, observer: Observer, number: int) -> Series:
    series = procedures.make(settings, REFERENCE, 0.02, highest, number, "study")
    trial = 0
    while (level := series.next_level()) is not None:
        answer = observer.answer(REFERENCE, level, settings["kind"] == "limits", trial)
        series = series.answered(TO_FELT[answer])  # type: ignore[arg-type]
        trial += 1
    return series


def measure(cell: Cell) -> Result:
    settings, highest = settings_of(cell.procedure)
    bias, published, held = [], [], 0
    for number in range(cell.observers):
        series = run(settings, highest, Observer("o", number, cell.weber, cell.lapse), number)
        found = fit.of_series(series)
        bias.append(found.pse / REFERENCE - 1.0)
        held += found.low <= REFERENCE <= found.high
        if settings["estimator"] == "reversals":
            published.append(fit.by_reversals(series, settings["discarded_reversals"]) / REFERENCE - 1.0)
        elif settings["estimator"] == "thresholds":
            published.append(fit.by_thresholds(series, settings["crossing"]) / REFERENCE - 1.0)
    return Result(float(np.nanmean(bias)), float(np.nanmean(published)) if published else math.nan, held / cell.observers)


def main() -> None:
    options = study_output.options(__doc__)
    output = study_output.Output(options.out, "estimators", "Estimates of simulated observers")
    observers = 60 if options.quick else 1000
    names = ("stiffness_1d", "stiffness_1d_corrected", "stiffness_3d", "stiffness_3d_corrected")
    cells = [Cell(name, weber, lapse, observers) for name in names for weber, lapse in CELLS]
    with multiprocessing.Pool() as pool:
        results = pool.map(measure, cells, chunksize=1)
    rows = []
    for cell, result in zip(cells, results):
        case = {"procedure": cell.procedure, "weber": cell.weber, "lapse": cell.lapse}
        output.figure("pse_bias", result.bias, {**case, "estimator": "likelihood"}, goal=0.01, source="over the reference")
        if math.isfinite(result.published_bias):
            output.figure(
                "pse_bias", result.published_bias, {**case, "estimator": "published"}, reference=0.033 if "3d" in cell.procedure else None,
                source="over the reference",
            )  # fmt: skip
        output.figure("interval_coverage", result.coverage, {**case, "estimator": "likelihood"}, goal=0.95, source="0.93 … 0.97")
        published = "" if math.isnan(result.published_bias) else f"{100 * result.published_bias:+.1f}"
        rows.append([cell.procedure, f"{cell.weber}", f"{cell.lapse}", f"{100 * result.bias:+.2f}", published, f"{100 * result.coverage:.1f}"])
    output.table(
        f"Error of the estimated equality, and how often the 95 % interval held it ({observers} observers each)",
        ["protocol", "Weber fraction", "lapses", "error %", "error as published %", "held %"],
        rows,
        "Simulated observers that compare the logarithms of two stiffnesses. Published: mean of the thresholds, or of the reversals.",
    )


if __name__ == "__main__":
    main()
