"""The file that describes an experiment, checked as a whole before a participant sits down."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
import re
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Mapping

from hapticd.errors import BadFile
from hapticd.experiment import procedures, stops
from hapticd.experiment.reading import Table

#: Protocols of this package; named without ".toml".
SHIPPED = Path(__file__).resolve().parent / "protocols"

ANSWERS = ("first", "same", "second")
MAX_STIFFNESS = 1000.0
MAX_BYTES = 1 << 20  # of the file, and of each scene


@dataclass(frozen=True)
class Stimulus:
    """What is presented in one interval."""

    scene: str  #: name of a scene that the daemon knows; empty if there is a text
    scene_toml: str  #: text of a scene
    station: str  #: of the turntable; empty if it is not turned
    object: str  #: put under the tool on a simulated rig without a table; empty: as it is
    stations: tuple[str, ...] = ()  #: of which one is drawn for each trial, in place of `station`
    at_mm: tuple[float, ...] = (0.0, 0.0)  #: where it lies, rig frame; for a free change

    @property
    def all_stations(self) -> tuple[str, ...]:
        return self.stations or ((self.station,) if self.station else ())


@dataclass(frozen=True)
class Condition:
    name: str
    reference: Stimulus
    comparison: Stimulus
    reference_n_per_mm: float  #: target of the reference; 0: none is set
    starts_n_per_mm: tuple[float, ...]  #: of staircases; empty: by [procedure] start_shares
    hand_force_n: float  #: with which a participant presses, for the check of what the device can render
    object_n_per_mm: float  #: stiffness of the real object, for the same check; 0: none


@dataclass(frozen=True)
class Protocol:
    name: str
    title: str
    source: str
    question: str
    kind: str  #: "compare" (which felt harder) or "rate" (how alike, and how long until it was found)
    participants: int
    keys: Mapping[str, str]
    procedure: Mapping[str, Any]
    conditions: tuple[Condition, ...]
    order: str  #: of the intervals: "random" or "reference_first"
    condition_order: str
    min_break_s: float
    training_trials: int
    max_discarded: int
    lowest_n_per_mm: float
    highest_n_per_mm: float
    touch: str  #: how an object is felt: "press", "stroke", or "search" for what is in it
    stroke_path_mm: float  #: of a stroke, along the surface
    approach: str  #: "guided": the device leads the tool to the contact; "free": from above it, by the participant
    above_mm: tuple[float, ...]
    places_mm: tuple[float, ...]  #: along x, where a simulated hand searches
    rows_mm: tuple[float, ...]  #: along y, the same
    inclusion_within_mm: float  #: of the middle: where the inclusion lies is drawn for each presentation; 0: where it is
    object_centre_mm: tuple[float, ...]  #: of a round object, about which its inclusion is moved; empty: it is flat
    change: str  #: of the stimuli: "table": one after the other; "free": both lie there, the participant changes between them
    min_lateral_path_mm: float  #: of a free change: of each stimulus, over all touches of a trial
    start_jitter_mm: float  #: by how much a free touch begins aside of above_mm
    contact_within_mm: float
    guide_speed_mm_per_s: float
    max_press_s: float
    white_noise: bool
    document: Mapping[str, Any] = field(repr=False, default_factory=dict)

    @property
    def sha256(self) -> str:
        """Hash of the document in a canonical form: comments and layout do not count."""
        return hashlib.sha256(json.dumps(self.document, sort_keys=True).encode()).hexdigest()

    def condition(self, name: str) -> Condition:
        return next(one for one in self.conditions if one.name == name)

    @property
    def stimuli(self) -> list[Stimulus]:
        return [stimulus for one in self.conditions for stimulus in (one.reference, one.comparison)]

    def series(self, condition: Condition, seed: int, participant: str, rendered_n_per_mm: float = math.inf) -> procedures.Series:
        """The procedures of a condition for a participant. rendered_n_per_mm: the highest level of the comparison that the rig has."""
        settings = dict(self.procedure)
        if condition.starts_n_per_mm:
            settings["start_shares"] = [start / condition.reference_n_per_mm for start in condition.starts_n_per_mm]
        highest = min(self.highest_n_per_mm, rendered_n_per_mm)
        return procedures.make(settings, condition.reference_n_per_mm, self.lowest_n_per_mm, highest, seed, participant, condition.name)

    def needed_n_per_mm(self, condition: Condition) -> float:
        """The highest level of the comparison that a rig has to render; if the protocol gives no highest one, the rig
        does."""
        start, reached = procedures.highest_start_and_level(self.procedure, condition.reference_n_per_mm, condition.starts_n_per_mm)
        return min(reached if self.highest_n_per_mm < MAX_STIFFNESS else start, self.highest_n_per_mm)


def find(name: str) -> Path:
    """A file, or one of this package by its name."""
    path = Path(name)
    if path.suffix == ".toml" or path.exists():
        return path
    shipped = SHIPPED / f"{name}.toml"
    if shipped.exists():
        return shipped
    raise BadFile(
        "there is no such protocol", where=name, limit="a TOML file, or " + ", ".join(sorted(one.stem for one in SHIPPED.glob("*.toml")))
    )


def simulated_rig(name: str) -> Path:
    """The configuration of a rig with the stations of a shipped protocol; of another one, those of stiffness_1d."""
    path = SHIPPED / "rig" / f"{name.removesuffix('_corrected')}.toml"
    return path if path.exists() else path.with_name("stiffness_1d.toml")


def read(name: str) -> Protocol:
    """Raises BadFile with the key and what is accepted."""
    path = find(name)
    if path.exists() and not path.is_file():  # a pipe may never end
        raise BadFile("this is not a regular file", where=str(path))
    try:
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
        if len(content) > MAX_BYTES:
            raise BadFile("this is too large for a protocol", where=str(path), limit=f"at most {MAX_BYTES} bytes")
        document = tomllib.loads(content.decode("utf-8"))
    except OSError as error:
        raise BadFile(error.strerror or "it cannot be read", where=str(path)) from error
    except UnicodeDecodeError as error:
        raise BadFile("this is no UTF-8", where=str(path), value=f"byte {error.start}") from error
    except tomllib.TOMLDecodeError as error:
        raise BadFile(f"this is no TOML: {error}", where=str(path)) from error
    except RecursionError as error:
        raise BadFile("this is nested too deeply for a protocol", where=str(path)) from error
    _take_scenes(document, path.resolve().parent / "scenes")
    return of(document, str(path))


def _take_scenes(document: dict[str, Any], folder: Path) -> None:
    """Texts of the scenes in a folder next to the protocol, so that a journal has all that was presented."""
    stimuli = [
        one[role] for one in [document, *_mappings(document.get("condition"))] for role in ("reference", "comparison")
        if isinstance(one.get(role), Mapping)
    ]  # fmt: skip
    for name in sorted({stimulus["scene"] for stimulus in stimuli if isinstance(stimulus.get("scene"), str)}):
        path = folder / f"{name}.toml"
        if re.fullmatch(r"[A-Za-z0-9_-]+", name) and path.is_file():
            try:
                if path.stat().st_size > MAX_BYTES:
                    raise BadFile("this is too large for a scene", where=str(path), limit=f"at most {MAX_BYTES} bytes")
                document.setdefault("scenes", {}).setdefault(name, path.read_text("utf-8"))
            except (OSError, UnicodeDecodeError) as error:
                raise BadFile(f"it cannot be read: {error}", where=str(path)) from error


def _mappings(value: Any) -> list[Mapping[str, Any]]:
    return [one for one in value if isinstance(one, Mapping)] if isinstance(value, list) else []


def of(document: Mapping[str, Any], where: str) -> Protocol:
    """A protocol of a parsed document."""
    root = Table(document, where)
    answers, trial, session, presentation = (root.table(name) for name in ("answers", "trial", "session", "presentation"))
    kind = root.word("kind", ("compare", "rate"), "compare")
    protocol = Protocol(
        name=_code(root, "name"),
        title=root.text("title", limit=200),
        source=root.text("source", "", limit=200),
        question=root.text("question", limit=400),
        kind=kind,
        participants=root.count("participants", 1, 1000),
        keys=_keys(answers, kind),
        procedure=_procedure(root.table("procedure", needed=kind == "compare"), kind),
        conditions=_conditions(root, kind),
        order=trial.word("order", ("random", "reference_first"), "random"),
        max_discarded=trial.count("max_discarded", 1, 1000, 50),
        lowest_n_per_mm=trial.number("lowest_n_per_mm", 0.001, MAX_STIFFNESS, 0.001),
        highest_n_per_mm=trial.number("highest_n_per_mm", 0.001, MAX_STIFFNESS, MAX_STIFFNESS),
        condition_order=session.word("conditions", ("balanced", "random", "as_written"), "balanced"),
        min_break_s=session.number("min_break_s", 0.0, 3600.0, 60.0),
        training_trials=session.count("training_trials", 0, 100, 0),
        white_noise=session.flag("white_noise", True),
        touch="search" if kind == "rate" else presentation.word("touch", ("press", "stroke"), "press"),
        stroke_path_mm=presentation.number("stroke_path_mm", 10.0, 1000.0, 60.0),
        approach=presentation.word("approach", ("guided", "free"), "free" if kind == "rate" else "guided"),
        places_mm=presentation.numbers("places_mm", -500.0, 500.0, (-24.0, -12.0, 0.0, 12.0, 24.0)),
        rows_mm=presentation.numbers("rows_mm", -500.0, 500.0, (0.0,)),
        inclusion_within_mm=presentation.number("inclusion_within_mm", 0.0, 25.0, 0.0),
        object_centre_mm=presentation.numbers("object_centre_mm", -500.0, 500.0, count=3) if presentation.has("object_centre_mm") else (),
        change=presentation.word("change", ("table", "free"), "table"),
        min_lateral_path_mm=presentation.number("min_lateral_path_mm", 0.0, 10000.0, 0.0),
        start_jitter_mm=presentation.number("start_jitter_mm", 0.0, 50.0, 0.0),
        above_mm=presentation.numbers("above_mm", -500.0, 500.0, (0.0, 0.0, 30.0), count=3),
        contact_within_mm=presentation.number("contact_within_mm", 0.0, 200.0, 60.0),
        guide_speed_mm_per_s=presentation.number("guide_speed_mm_per_s", 1.0, 100.0, 15.0),
        max_press_s=presentation.number("max_press_s", 0.5, 600.0, 20.0),
        document=document,
    )
    for table in (answers, trial, session, presentation, root):
        table.done()
    if protocol.lowest_n_per_mm >= protocol.highest_n_per_mm:
        raise BadFile(
            "there is nothing between the levels' ends",
            where=f"{where} [trial] lowest_n_per_mm",
            value=f"{protocol.lowest_n_per_mm:g} … {protocol.highest_n_per_mm:g}",
        )
    _check_places(protocol, where)
    for condition in protocol.conditions:
        if kind == "compare" and not protocol.lowest_n_per_mm < condition.reference_n_per_mm < protocol.highest_n_per_mm:
            raise BadFile(
                "the reference is outside the levels of the comparison",
                where=f"{where} [[condition]] {condition.name}: reference_n_per_mm",
                value=f"{condition.reference_n_per_mm:g}",
                limit=f"{protocol.lowest_n_per_mm:g} … {protocol.highest_n_per_mm:g} N/mm",
            )
    return protocol


#: So far apart lie two stimuli at least between which the participant changes freely.
MIN_APART_MM = 60.0


def _check_places(protocol: Protocol, where: str) -> None:
    """Stimuli of a free change."""
    if protocol.change != "free":
        return
    if protocol.kind != "compare" or protocol.approach != "free" or protocol.order != "reference_first":
        raise BadFile(
            "a free change is for comparisons whose two places never change",
            where=f"{where} [presentation] change",
            value=f"kind = {protocol.kind!r}, approach = {protocol.approach!r}, order = {protocol.order!r}",
            limit="kind = 'compare', approach = 'free', [trial] order = 'reference_first'",
        )
    for condition in protocol.conditions:
        apart = math.dist(condition.reference.at_mm, condition.comparison.at_mm)
        if apart < MIN_APART_MM:
            raise BadFile(
                "the two stimuli lie too close to each other to change between them",
                where=f"{where} [[condition]] {condition.name}: at_mm", value=f"{apart:g} mm", limit=f"≥ {MIN_APART_MM:g} mm apart",
            )  # fmt: skip
        if condition.comparison.all_stations and condition.comparison.all_stations != condition.reference.all_stations:
            raise BadFile(
                "both stimuli lie there at once: the table cannot bring one of them",
                where=f"{where} [[condition]] {condition.name}: comparison station", value=condition.comparison.station,
                limit="none, or the reference's", remedy="change = 'table'",
            )  # fmt: skip


def _code(table: Table, key: str) -> str:
    value = table.text(key, limit=64)
    if not value or not all(letter.isascii() and (letter.isalnum() or letter in "_-") for letter in value):
        raise BadFile("a name is needed", where=f"{table.where}: {key}", value=repr(value), limit="letters, digits, '_' and '-'")
    return value


def _keys(table: Table, kind: str) -> Mapping[str, str]:
    if kind == "rate":
        return {}
    keys = table.take("keys")
    if not isinstance(keys, Mapping) or not {"first", "second"} <= set(keys.values()) <= set(ANSWERS):
        raise BadFile(
            "keys need an answer each, 'first' and 'second' among them", where=f"{table.where} keys", value=repr(keys), limit=", ".join(ANSWERS)
        )
    for key in keys:
        if len(key) != 1 or key == " ":
            raise BadFile("a key is one character, not the space bar", where=f"{table.where} keys", value=repr(key))
    return dict(keys)


def _procedure(table: Table, kind: str) -> Mapping[str, Any]:
    if kind == "rate":
        repetitions = table.count("repetitions", 1, 100, 1)
        table.done()
        return {"kind": "once", "repetitions": repetitions, "estimator": "none"}
    chosen = table.word("kind", ("limits", "up_down", "constant", "quest_plus"))
    settings: dict[str, Any] = {"kind": chosen}
    estimators: tuple[str, ...]
    if chosen == "limits":
        settings["descending"] = table.count("descending", 0, 100)
        settings["ascending"] = table.count("ascending", 0, 100)
        settings["step_n_per_mm"] = table.number("step_n_per_mm", 1e-4, 100.0)
        settings["start_distance_n_per_mm"] = table.number("start_distance_n_per_mm", 1e-3, 100.0)
        settings["start_jitter_n_per_mm"] = table.number("start_jitter_n_per_mm", 0.0, 100.0, 0.0)
        settings["end_after"] = table.count("end_after", 1, 100, 3)
        settings["crossing"] = table.word("crossing", ("first", "last"), "first")
        if settings["descending"] + settings["ascending"] == 0:
            raise BadFile("there is no series", where=table.where, limit="descending + ascending ≥ 1")
        estimators = ("thresholds", "likelihood")
    elif chosen == "up_down":
        settings["start_shares"] = list(table.numbers("start_shares", 0.05, 20.0, (1.5,)))
        settings["steps_n_per_mm"] = list(table.numbers("steps_n_per_mm", 1e-4, 100.0))
        settings["steps_after_reversals"] = [int(one) for one in table.take("steps_after_reversals", [])]
        settings["up"], settings["down"] = table.count("up", 1, 10, 1), table.count("down", 1, 10, 1)
        settings["interleaved"] = table.flag("interleaved", False)
        settings["discarded_reversals"] = table.count("discarded_reversals", 0, 1000, 0)
        settings["stop"] = _stop(table, {"reversals": 0, "trials": 0})
        if len(settings["steps_n_per_mm"]) != len(settings["steps_after_reversals"]) + 1:
            raise BadFile(
                "each step but the first needs the reversal after which it holds",
                where=f"{table.where} steps_after_reversals",
                value=repr(settings["steps_after_reversals"]),
                limit=f"{len(settings['steps_n_per_mm']) - 1} rising counts",
            )
        estimators = ("reversals", "likelihood")
    elif chosen == "constant":
        settings["level_shares"] = list(table.numbers("level_shares", 0.05, 20.0))
        settings["repetitions"] = table.count("repetitions", 1, 1000)
        estimators = ("likelihood",)
    else:
        settings["lowest_share"] = table.number("lowest_share", 0.05, 1.0, 0.5)
        settings["highest_share"] = table.number("highest_share", 1.0, 20.0, 1.5)
        settings["grid"] = table.count("grid", 5, 201, 41)
        settings["stop"] = _stop(table, {"trials": 0})
        estimators = ("likelihood",)
    settings["estimator"] = table.word("estimator", estimators, estimators[-1])
    table.done()
    return settings


def _stop(table: Table, known: Mapping[str, int]) -> stops.Rule:
    rule: stops.Rule = table.take("stop")
    if not isinstance(rule, Mapping):
        raise BadFile("a rule is needed", where=f"{table.where} stop", value=repr(rule), limit="e.g. { reversals = 15 }")
    stops.check(rule, known, f"{table.where} stop")
    return rule


def _stimulus(own: Table, shared: Mapping[str, Any], interval: str, scenes: Mapping[str, Any]) -> Stimulus:
    chosen = {key: own.take(key) for key in ("scene", "scene_toml", "station", "stations", "object", "at_mm") if own.has(key)}
    if "scene" in chosen or "scene_toml" in chosen:
        shared = {key: value for key, value in shared.items() if key not in ("scene", "scene_toml")}
    if "station" in chosen or "stations" in chosen:
        shared = {key: value for key, value in shared.items() if key not in ("station", "stations")}
    table = Table({**shared, **chosen}, own.where)
    stimulus = Stimulus(
        table.text("scene", "", limit=128),
        table.text("scene_toml", "", limit=65536),
        table.text("station", "", limit=128),
        table.text("object", "", limit=128),
        table.texts("stations") if table.has("stations") else (),
        table.numbers("at_mm", -500.0, 500.0, (0.0, 0.0), count=2),
    )
    if stimulus.station and stimulus.stations:
        raise BadFile("one of the two", where=own.where, value="station, stations", remedy="leave out one")
    own.done()
    table.done()
    if stimulus.scene in scenes:
        stimulus = dataclasses.replace(stimulus, scene="", scene_toml=scenes[stimulus.scene])
    if bool(stimulus.scene) == bool(stimulus.scene_toml):
        raise BadFile(f"the {interval} needs a scene", where=own.where, limit="scene or scene_toml, one of the two")
    return stimulus


def _conditions(root: Table, kind: str) -> tuple[Condition, ...]:
    shared = {name: root.take(name, {}) for name in ("reference", "comparison")}
    for name, values in shared.items():
        if not isinstance(values, Mapping):
            raise BadFile("a table is needed", where=f"{root.where}: {name}")
    scenes = root.take("scenes", {})
    if not isinstance(scenes, Mapping) or not all(isinstance(text, str) for text in scenes.values()):
        raise BadFile("texts of scenes are needed", where=f"{root.where}: scenes", limit='NAME = "…"')
    found: list[Condition] = []
    for table in root.tables("condition"):
        found.append(
            Condition(
                name=_code(table, "name"),
                reference=_stimulus(table.table("reference"), shared["reference"], "reference", scenes),
                comparison=_stimulus(table.table("comparison"), shared["comparison"], "comparison", scenes),
                reference_n_per_mm=table.number("reference_n_per_mm", 0.0, MAX_STIFFNESS, ... if kind == "compare" else 0.0),
                starts_n_per_mm=table.numbers("starts_n_per_mm", 0.001, MAX_STIFFNESS) if table.has("starts_n_per_mm") else (),
                hand_force_n=table.number("hand_force_n", 0.1, 30.0, 3.0),
                object_n_per_mm=table.number("object_n_per_mm", 0.0, MAX_STIFFNESS, 0.0),
            )
        )
        table.done()
    names = [one.name for one in found]
    for name in names:
        if names.count(name) > 1:
            raise BadFile("two conditions have the same name", where=root.where, value=name)
    return tuple(found)
