"""Estimates from journals: of each participant in each condition, and of the group."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Iterable, Sequence

import numpy as np
from scipy import stats

from hapticd.errors import BadFile
from hapticd.experiment import fit as fits
from hapticd.experiment import journal as journals
from hapticd.experiment import protocol as protocols
from hapticd.experiment import session
from hapticd.experiment.journal import Event
from hapticd.experiment.procedures import Series

#: Weber fraction of stiffness for 0.3 … 1.2 N/mm, pressed with a PHANToM: 0.08 … 0.12; 0.09 at the published targets
#: (D§3.4.2 and [39] there).
LITERATURE_WEBER = 0.09


@dataclass(frozen=True)
class Session:
    """A journal, read."""

    path: Path
    events: Sequence[Event]
    state: session.State

    @property
    def protocol(self) -> protocols.Protocol:
        return self.state.protocol

    @property
    def participant(self) -> str:
        return self.state.participant

    def is_done(self, condition: str) -> bool:
        series = self.state.series.get(condition)
        return series is not None and series.next_level() is None


@dataclass(frozen=True)
class Estimate:
    """Results of one participant in one condition whose trials are all answered."""

    participant: str
    condition: str
    target: float  #: reference_n_per_mm
    fit: fits.Fit
    published: float  #: by the protocol's own estimator, N/mm; NaN if that is the likelihood
    discarded: int
    minutes: float  #: of the rig's time; NaN without a rig
    lowest_presented: float  #: of the comparison's levels, N/mm
    highest_presented: float

    @property
    def is_extrapolated(self) -> bool:
        """True if the PSE lies beyond all levels that were presented: the answers alone do not hold it there."""
        return self.fit.pse < self.lowest_presented or self.fit.pse > self.highest_presented


@dataclass(frozen=True)
class Rating:
    """Results of a pair of stimuli."""

    participant: str
    condition: str
    similarity: float
    #: Seconds of touch until found, by what was presented: station and scene.
    found_s: Sequence[tuple[str, float]]


@dataclass(frozen=True)
class Group:
    """A condition over all participants: a mean, and its 95 % interval by Student's t."""

    condition: str
    target: float
    participants: int
    mean: float
    low: float
    high: float
    published: float  #: mean of the protocol's own estimates


def read(paths: Iterable[Path]) -> list[Session]:
    """Journals, and those of folders. Raises BadFile if one is damaged, or if two are of different protocols."""
    found: list[Session] = []
    for path in paths:
        files = sorted(path.glob("*.jsonl")) if path.is_dir() else [path]
        if not files:
            raise BadFile("there is no journal", where=str(path), limit="*.jsonl")
        for file in files:
            events = journals.read(file)
            found.append(Session(file, events, session.fold(events, str(file))))
    for one in found[1:]:
        if one.protocol.sha256 != found[0].protocol.sha256:
            raise BadFile(
                "these journals are of different protocols",
                where=str(one.path),
                value=f"{one.protocol.name}, {one.protocol.sha256[:12]}",
                limit=f"{found[0].protocol.name}, {found[0].protocol.sha256[:12]}",
                remedy="analyse one experiment at a time",
            )
    return found


def published_estimate(protocol: protocols.Protocol, series: Series) -> float:
    """Estimate by the protocol's own estimator, N/mm; NaN if it has none."""
    settings = protocol.procedure
    if settings["estimator"] == "thresholds":
        return fits.by_thresholds(series, settings["crossing"])
    if settings["estimator"] == "reversals":
        return fits.by_reversals(series, settings["discarded_reversals"])
    return math.nan


def estimates(sessions: Sequence[Session], *, resamples: int = 0) -> list[Estimate]:
    """Results of the conditions that are done."""
    found = []
    for one in sessions:
        if one.protocol.kind != "compare":
            continue
        for condition in one.protocol.conditions:
            if not one.is_done(condition.name):
                continue
            series = one.state.series[condition.name]
            levels = [given.level for member in series.members for given in member.given]
            found.append(
                Estimate(
                    one.participant,
                    condition.name,
                    condition.reference_n_per_mm,
                    fits.of_series(series, resamples=resamples, seed=one.state.seed, names=(one.participant, condition.name)),
                    published_estimate(one.protocol, series),
                    sum(event["event"] == "discarded" and event["condition"] == condition.name for event in one.events),
                    _minutes(one.events, condition.name),
                    min(levels, default=math.nan),
                    max(levels, default=math.nan),
                )
            )
    return found


def _minutes(events: Sequence[Event], condition: str) -> float:
    times = [event["time_s"] for event in events if event.get("condition") == condition and "time_s" in event]
    return float(times[-1] - times[0]) / 60.0 if len(times) > 1 else math.nan


def ratings(sessions: Sequence[Session]) -> list[Rating]:
    found = []
    for one in sessions:
        if one.protocol.kind != "rate":
            continue
        for event in one.events:
            if event["event"] != "answer" or event["training"]:
                continue
            condition = one.protocol.condition(event["condition"])
            times = []
            for role, stimulus in (("reference", condition.reference), ("comparison", condition.comparison)):
                seconds = event.get(f"found_{role}_s")
                times.append((stimulus_name(stimulus), math.nan if seconds is None else float(seconds)))
            found.append(Rating(one.participant, condition.name, float(event["similarity"]), times))
    return found


def stimulus_name(stimulus: protocols.Stimulus) -> str:
    """Place of a stimulus, and what is rendered there."""
    place = stimulus.station or stimulus.object
    scene = stimulus.scene or next(
        (line.split('"')[1] for line in stimulus.scene_toml.splitlines() if line.startswith("name") and line.count('"') >= 2), "scene"
    )
    return f"{place} {scene}".strip()


def mean_with_interval(values: Sequence[float]) -> tuple[float, float, float]:
    """Mean and 95 % interval by Student's t; NaN values are left out."""
    finite = np.array([one for one in values if math.isfinite(one)])
    if not len(finite):
        return math.nan, math.nan, math.nan
    mean = float(finite.mean())
    if len(finite) < 2:
        return mean, math.nan, math.nan
    half = float(stats.t.ppf(0.975, len(finite) - 1) * finite.std(ddof=1) / math.sqrt(len(finite)))
    return mean, mean - half, mean + half


def groups(found: Sequence[Estimate], conditions: Sequence[str]) -> list[Group]:
    """Conditions in the protocol's order; those without a trial are left out."""
    result = []
    for name in conditions:
        members = [one for one in found if one.condition == name]
        if members:
            mean, low, high = mean_with_interval([one.fit.pse for one in members])
            published, _, _ = mean_with_interval([one.published for one in members])
            result.append(Group(name, members[0].target, len(members), mean, low, high, published))
    return result


def remarks(found: Sequence[Estimate]) -> list[str]:
    """What the numbers alone do not say: which of them are extrapolated."""
    return [
        f"{one.participant}, {one.condition}: the PSE of {one.fit.pse:.3f} N/mm is an extrapolation: levels of "
        f"{one.lowest_presented:.3f} … {one.highest_presented:.3f} N/mm were presented; the mean counts it as it is"
        for one in sorted(found, key=lambda one: one.participant)
        if one.is_extrapolated
    ]


def text_of(sessions: Sequence[Session], found: Sequence[Estimate], rated: Sequence[Rating]) -> str:
    """Text for the terminal."""
    protocol = sessions[0].protocol
    source = f" ({protocol.source})" if protocol.source else ""
    lines = [f"{protocol.title}{source}: {len(sessions)} participant{'s' if len(sessions) != 1 else ''}"]
    unfinished = [one.participant for one in sessions if not one.state.ended]
    if unfinished:
        lines.append(f"not at the end: {', '.join(unfinished)}; only conditions that are done count")
    if protocol.kind == "compare":
        lines += _lines_of_participants(found)
        lines.append("condition         target   mean PSE and its 95 % interval   error      as published   discarded")
        lines.append("                  N/mm     N/mm, over participants          N/mm       N/mm           a participant")
        for group in groups(found, [one.name for one in protocol.conditions]):
            discarded = float(np.mean([one.discarded for one in found if one.condition == group.condition]))
            interval = _interval(group.mean, group.low, group.high, 3)
            published = "" if math.isnan(group.published) else f"{group.published:.3f}"
            lines.append(
                f"{group.condition:<17} {group.target:<8g} {interval:<32} {group.mean - group.target:<+10.3f} {published:<14} {discarded:.1f}"
            )
        lines += [f"remark: {one}" for one in remarks(found)]
    else:
        lines.append("condition         similarity and its 95 % interval")
        for condition in protocol.conditions:
            mean, low, high = mean_with_interval([one.similarity for one in rated if one.condition == condition.name])
            lines.append(f"{condition.name:<17} {_interval(mean, low, high, 1)}")
        lines.append("")
        lines.append("presented                          s of touch until found     not found")
        for name, times in found_times(rated).items():
            mean, low, high = mean_with_interval(times)
            missed = sum(math.isnan(one) for one in times)
            lines.append(f"{name:<34} {_interval(mean, low, high, 1):<26} {missed} of {len(times)}")
    return "\n".join(lines)


def _lines_of_participants(found: Sequence[Estimate]) -> list[str]:
    lines = ["participant   condition         target   PSE and its 95 % interval   as published   trials   discarded"]
    lines.append("                                N/mm     N/mm                        N/mm")
    for one in sorted(found, key=lambda one: one.participant):
        interval, published = _interval(one.fit.pse, one.fit.low, one.fit.high, 3), "" if math.isnan(one.published) else f"{one.published:.3f}"
        lines.append(
            f"{one.participant:<13} {one.condition:<17} {one.target:<8g} {interval:<27} {published:<14} {one.fit.trials:<8} {one.discarded}"
        )
    return [*lines, ""]


def _interval(mean: float, low: float, high: float, digits: int) -> str:
    if math.isnan(mean):
        return "–"
    return f"{mean:.{digits}f}" + ("" if math.isnan(low) else f" ({low:.{digits}f} … {high:.{digits}f})")


def found_times(rated: Sequence[Rating]) -> dict[str, list[float]]:
    """Seconds of touch until found, by what was presented."""
    times: dict[str, list[float]] = {}
    for one in rated:
        for name, seconds in one.found_s:
            times.setdefault(name, []).append(seconds)
    return times


def published_dl(target: float) -> float:
    """Difference threshold of the literature, N/mm (D Fig. 3.12 and 4.19)."""
    return LITERATURE_WEBER * target


def as_json(sessions: Sequence[Session], found: Sequence[Estimate], rated: Sequence[Rating]) -> dict[str, Any]:
    """All of it, for programs; None for what is not known."""
    protocol = sessions[0].protocol
    values = {
        "protocol": protocol.name,
        "sha256": protocol.sha256,
        "participants": [{"participant": one.participant, "finished": one.state.ended} for one in sessions],
        "estimates": [_plain(dataclasses.asdict(one)) for one in found],
        "conditions": [_plain(dataclasses.asdict(one)) for one in groups(found, [one.name for one in protocol.conditions])],
        "ratings": [_plain(dataclasses.asdict(one)) for one in rated],
        "remarks": remarks(found),
    }
    return values


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
