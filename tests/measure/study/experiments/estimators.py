"""How far estimates of a point of subjective equality are off, and how often their intervals hold it: simulated observers, no rig."""

from __future__ import annotations

import math
import multiprocessing
from typing import Any, NamedTuple, Sequence

import numpy as np

from hapticd.experiment import fit, procedures, protocol
from hapticd.experiment.observer import Observer
from hapticd.experiment.procedures import Series

import study_output

REFERENCE = 0.3
#: Difference thresholds over the stiffness, and shares of lapses, of people.
CELLS = [(weber, lapse) for weber in (0.06, 0.09, 0.12) for lapse in (0.0, 0.02, 0.05)]
TO_FELT = {"second": "harder", "first": "softer", "same": "same"}


#: What a 95 % interval is to hold.
GOAL = (0.93, 0.97)
#: Observers of a cell whose share is too near to an edge of the goal to tell on which side it is, over the others'.
MORE = 4


class Cell(NamedTuple):
    procedure: str
    weber: float
    lapse: float


class Observed(NamedTuple):
    """One observer."""

    error: float
    published_error: float  #: NaN if the protocol's own estimator is the likelihood
    is_held: bool


class Result(NamedTuple):
    """All observers of a cell."""

    observers: int
    bias: float
    published_bias: float
    coverage: float

    @property
    def coverage_deviation(self) -> float:
        """One standard deviation, by the number of observers."""
        return math.sqrt(self.coverage * (1.0 - self.coverage) / self.observers)

    @property
    def is_near_an_edge(self) -> bool:
        return any(abs(self.coverage - edge) < 2.0 * self.coverage_deviation for edge in GOAL)


def summary(observed: Sequence[Observed]) -> Result:
    errors, published, held = (np.array(column) for column in zip(*observed))
    return Result(
        len(observed), float(np.nanmean(errors)), math.nan if np.isnan(published).all() else float(np.nanmean(published)), float(held.mean())
    )


def settings_of(name: str) -> tuple[dict[str, Any], float]:
    """Steps of a shipped protocol, and the level at which its first staircase starts, over the reference."""
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


def observe(cell: Cell, number: int) -> Observed:
    settings, highest = settings_of(cell.procedure)
    series = run(settings, highest, Observer("o", number, cell.weber, cell.lapse), number)
    found = fit.of_series(series)
    published = math.nan
    if settings["estimator"] == "reversals":
        published = fit.by_reversals(series, settings["discarded_reversals"]) / REFERENCE - 1.0
    elif settings["estimator"] == "thresholds":
        published = fit.by_thresholds(series, settings["crossing"]) / REFERENCE - 1.0
    return Observed(found.pse / REFERENCE - 1.0, published, found.low <= REFERENCE <= found.high)


def main() -> None:
    options = study_output.options(__doc__)
    output = study_output.Output(options.out, "estimators", "Estimates of simulated observers")
    observers = 60 if options.quick else 1000
    names = ("stiffness_1d", "stiffness_1d_corrected", "stiffness_3d", "stiffness_3d_corrected")
    rows = []
    with multiprocessing.Pool() as pool:
        for cell in (Cell(name, weber, lapse) for name in names for weber, lapse in CELLS):
            observed = pool.starmap(observe, [(cell, number) for number in range(observers)], chunksize=10)
            if not options.quick and summary(observed).is_near_an_edge:
                observed += pool.starmap(observe, [(cell, number) for number in range(observers, MORE * observers)], chunksize=10)
            result = summary(observed)
            case = {"procedure": cell.procedure, "weber": cell.weber, "lapse": cell.lapse}
            output.figure("pse_bias", result.bias, {**case, "estimator": "likelihood"}, goal=0.01, source="over the reference")
            if math.isfinite(result.published_bias):
                output.figure(
                    "pse_bias", result.published_bias, {**case, "estimator": "published"},
                    reference=0.033 if "3d" in cell.procedure else None, source="over the reference",
                )  # fmt: skip
            output.figure(
                "interval_coverage", result.coverage, {**case, "estimator": "likelihood"}, goal=0.95,
                source=f"{GOAL[0]} … {GOAL[1]}; {result.observers} observers",
            )  # fmt: skip
            published = "" if math.isnan(result.published_bias) else f"{100 * result.published_bias:+.1f}"
            rows.append(
                [
                    cell.procedure, f"{cell.weber}", f"{cell.lapse}", f"{100 * result.bias:+.2f}", published,
                    f"{100 * result.coverage:.1f} ± {100 * result.coverage_deviation:.1f}", f"{result.observers}",
                ]  # fmt: skip
            )
    output.table(
        "Error of the estimated equality, and how often the 95 % interval held it",
        ["protocol", "Weber fraction", "lapses", "error %", "error as published %", "held % (± one deviation)", "observers"],
        rows,
        "Simulated observers that compare the logarithms of two stiffnesses. Published: mean of the thresholds, or of the reversals. "
        f"Held: the goal is {100 * GOAL[0]:.0f} … {100 * GOAL[1]:.0f} %. Where the share of {observers} observers is within two "
        f"deviations of an edge, {MORE} times as many are simulated, and all of them count; not in the quick form.",
    )


if __name__ == "__main__":
    main()
