"""Figures of an experiment. Need matplotlib."""

from __future__ import annotations

import math
from typing import Any, Sequence

import numpy as np

from hapticd._plot import new_figure
from hapticd.experiment import analysis
from hapticd.experiment.analysis import Estimate, Rating, Session
from hapticd.experiment.procedures import UpDown

#: The colour-blind can distinguish them too (Okabe and Ito).
BLUE, ORANGE, GREY = "#0072B2", "#D55E00", "#999999"


def series(one: Session, condition: str) -> Any:
    """The levels of a participant's trials and the answers, as D Fig. 4.18."""
    figure = new_figure(figsize=(8.0, 4.0))
    axis = figure.subplots()
    chosen = one.protocol.condition(condition)
    answers = [event for event in one.events if event["event"] == "answer" and not event["training"] and event["condition"] == condition]
    members = sorted({event["member"] for event in answers})
    for member in members:
        trials = [(index, event) for index, event in enumerate(answers, 1) if event["member"] == member]
        axis.plot([i for i, _ in trials], [event["level_n_per_mm"] for _, event in trials], color=GREY, linewidth=0.8, zorder=1)
    marks = {"harder": ("v", BLUE), "same": ("s", GREY), "softer": ("^", ORANGE)}
    for answer, (marker, colour) in marks.items():
        trials = [(index, event) for index, event in enumerate(answers, 1) if event["comparison_felt"] == answer]
        if trials:
            axis.scatter(
                [i for i, _ in trials], [event["level_n_per_mm"] for _, event in trials], marker=marker, color=colour, s=26,
                label=f"comparison felt {answer}" if answer != "same" else "felt the same", zorder=2,
            )  # fmt: skip
    axis.axhline(chosen.reference_n_per_mm, color="black", linewidth=1.0, label="target of the reference")
    found = next((e for e in analysis.estimates([one]) if e.condition == condition), None)
    if found is not None and math.isfinite(found.fit.pse):
        axis.axhspan(found.fit.low, found.fit.high, color=BLUE, alpha=0.12, linewidth=0)
        label = "PSE, extrapolated, and its 95 % interval" if found.is_extrapolated else "PSE and its 95 % interval"
        axis.axhline(found.fit.pse, color=BLUE, linewidth=1.0, linestyle="--", label=label)
    axis.set(xlabel="trial", ylabel="stiffness of the comparison, N/mm", title=f"{condition}, {one.participant}")
    if any(isinstance(member, UpDown) for member in one.state.series[condition].members):
        axis.set_title(f"{condition}, {one.participant}: staircase")
    axis.grid(True, linewidth=0.3)
    axis.legend(fontsize="small", frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def equality(found: Sequence[Estimate], conditions: Sequence[str]) -> Any:
    """PSE next to the target, and its error next to the published difference threshold, as D Fig. 3.12."""
    groups = analysis.groups(found, conditions)
    place = np.arange(len(groups))
    figure = new_figure(figsize=(8.5, 3.8))
    left, right = figure.subplots(1, 2)
    means, targets = np.array([one.mean for one in groups]), np.array([one.target for one in groups])
    # One participant alone has no interval.
    error = np.nan_to_num([[one.mean - one.low, one.high - one.mean] for one in groups]).reshape(-1, 2).T
    left.bar(place, means, width=0.6, color=BLUE, alpha=0.35, label="PSE")
    left.errorbar(place, means, yerr=error, fmt="none", ecolor=BLUE, capsize=4)
    left.hlines(targets, place - 0.4, place + 0.4, color="black", label="target")
    published = np.array([one.published for one in groups])
    if np.isfinite(published).any():
        left.scatter(place, published, marker="x", color=ORANGE, label="as published", zorder=3)
        right.scatter(place, published - targets, marker="x", color=ORANGE, zorder=3)
    left.set(ylabel="N/mm", title="Point of subjective equality")
    right.errorbar(place, means - targets, yerr=error, fmt="o", color=BLUE, capsize=4, label="PSE less target")
    for index, target in enumerate(targets):
        band = analysis.published_dl(target)
        right.fill_between(
            [index - 0.4, index + 0.4], -band, band, color=GREY, alpha=0.25, linewidth=0,
            label="± published difference threshold (9 %)" if index == 0 else None,
        )  # fmt: skip
    right.axhline(0.0, color="black", linewidth=0.8)
    right.set(ylabel="N/mm", title="Error of the rendered stiffness, as felt")
    for axis in (left, right):
        axis.set_xticks(place, [one.condition for one in groups], rotation=20)
        axis.grid(True, axis="y", linewidth=0.3)
        axis.legend(fontsize="small", frameon=False, loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=3)
    return figure


def similarity(rated: Sequence[Rating], conditions: Sequence[str]) -> Any:
    """Ratings by condition, and how long the search took by what was presented, as D Fig. 5.6 and 5.7."""
    figure = new_figure(figsize=(8.5, 3.8))
    left, right = figure.subplots(1, 2)
    _bars(left, {name: [one.similarity for one in rated if one.condition == name] for name in conditions})
    left.set(ylabel="similarity, 0 … 100", ylim=(0, 105), title="How alike they felt")
    _bars(right, analysis.found_times(rated))
    right.set(ylabel="s of touch", title="Until it was found")
    return figure


def _bars(axis: Any, values: dict[str, list[float]]) -> None:
    for index, ones in enumerate(values.values()):
        mean, low, high = analysis.mean_with_interval(ones)
        if math.isfinite(mean):
            axis.bar(index, mean, width=0.6, color=BLUE, alpha=0.35)
        if math.isfinite(low):
            axis.errorbar(index, mean, yerr=[[mean - low], [high - mean]], fmt="none", ecolor=BLUE, capsize=4)
        axis.scatter(index + np.linspace(-0.2, 0.2, len(ones)), ones, s=10, color=GREY, zorder=3)
    axis.set_xticks(range(len(values)), [name.replace(" ", "\n") for name in values], fontsize="small")
    axis.grid(True, axis="y", linewidth=0.3)
