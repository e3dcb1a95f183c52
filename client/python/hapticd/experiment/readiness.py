"""What would end a session in its first minute: found before anyone sits down."""

from __future__ import annotations

import math
import time
import tomllib
from typing import Callable, Optional

import hapticd
from hapticd._requests import enum_word
from hapticd.errors import BadFile, HapticdError, Refused, from_detail
from hapticd.experiment import protocol as protocols
from hapticd.v1 import rendering_pb2, rig_pb2, turntable_pb2

#: More than this on the tool is a hand, or a thing that lies on it, N; as the turntable's interlock has it.
MAX_LOAD_N = 0.5

#: A rig whose time runs faster than this is not for a person, seconds of it in one of the clock's.
MAX_SPEED = 1.5
#: Time between the two looks at it, s.
LOOK_S = 0.3

#: How long a drive may take to report its position, s.
CONNECT_S = 5.0
CONNECTING = (turntable_pb2.TURNTABLE_STATE_IDLE, turntable_pb2.TURNTABLE_STATE_CONNECTING)
#: What a turntable needs before it can turn, if the interlock does not say it.
TABLE_REMEDIES = {
    turntable_pb2.TURNTABLE_STATE_NOT_HOMED: "hapticctl turntable home",
    turntable_pb2.TURNTABLE_STATE_STALLED: "remove what holds it, then hapticctl turntable clear",
    turntable_pb2.TURNTABLE_STATE_ALARM: "see hapticctl turntable status, then hapticctl turntable clear",
    turntable_pb2.TURNTABLE_STATE_LOST: "look at cable and supply; see hapticctl doctor",
}


def check_scenes(rig: hapticd.Rig, protocol: protocols.Protocol) -> dict[str, float]:
    """Highest level of the comparison that the rig renders, by condition, N/mm. Raises BadFile for a station that there
    is not, a scene that cannot be loaded or watches nothing, a target that is too stiff."""
    stations, rendered = _stations(rig), {}
    for condition in protocol.conditions:
        for role, stimulus in (("reference", condition.reference), ("comparison", condition.comparison)):
            where = f"[[condition]] {condition.name} {role}"
            for station in (one for one in stimulus.all_stations if one not in stations):
                raise BadFile(
                    "there is no such station", where=f"{where}: station", value=station,
                    limit=", ".join(stations) or "this rig has no turntable",
                    remedy="name it in [rig.turntable.stations] of the daemon's configuration; for a simulated rig, "
                    "hapticctl experiment check PROTOCOL --write-rig FILE writes one",
                )  # fmt: skip
            outline = rig.explain_scene(stimulus.scene or None, toml=stimulus.scene_toml or None)
            if outline.HasField("obstacle"):
                raise BadFile(outline.obstacle.what, where=f"{where}: scene", limit=outline.obstacle.limit, remedy=outline.obstacle.remedy)
            if "watch" not in tomllib.loads(outline.resolved_toml):
                raise BadFile(
                    "the scene watches no presentation", where=f"{where}: scene", value=outline.name, limit="a scene with a section [watch]",
                    remedy="add the section to a copy of it (hapticctl scene show), or name another scene, such as press_guided",
                )  # fmt: skip
            most = outline.max_target_stiffness_n_per_mm
            if protocol.kind == "compare" and most > 0.0:
                _check_rendered(protocol, condition, role, most)
                if role == "comparison":
                    rendered[condition.name] = most
    return rendered


def _stations(rig: hapticd.Rig) -> list[str]:
    try:
        return [station.name for station in rig.get_turntable().stations]
    except Refused as refused:
        if refused.reason == "NO_HARDWARE":
            return []
        raise


def _check_rendered(protocol: protocols.Protocol, condition: protocols.Condition, role: str, most: float) -> None:
    wanted, remedy = condition.reference_n_per_mm, "a softer reference"
    if role == "comparison":
        wanted = protocol.needed_n_per_mm(condition)
        remedy += ", smaller levels of [procedure], or a lower [trial] highest_n_per_mm"
    if wanted > most * (1.0 + 1e-9):
        raise BadFile(
            "the rig does not render so stiff a target", where=f"[[condition]] {condition.name} {role}", value=f"{wanted:g} N/mm",
            limit=f"0 … {most:g} N/mm", remedy=remedy,
        )  # fmt: skip


def check_feasible(rig: hapticd.Rig, protocol: protocols.Protocol, load: Callable[[protocols.Stimulus], None]) -> None:
    """Raises BadFile for a target that the device cannot render on the object. load: its scene."""
    for condition in protocol.conditions:
        if condition.object_n_per_mm <= 0.0 or condition.reference_n_per_mm <= 0.0:
            continue
        load(condition.reference)
        range_ = rig.get_feasible_range(condition.hand_force_n, object_stiffness_n_per_mm=condition.object_n_per_mm)
        if not range_.min_n_per_mm <= condition.reference_n_per_mm <= range_.max_n_per_mm:
            reason = enum_word(rendering_pb2.LimitingReason.DESCRIPTOR, range_.max_limited_by)
            raise BadFile(
                "the target is not feasible on this object",
                where=f"[[condition]] {condition.name}: reference_n_per_mm",
                value=f"{condition.reference_n_per_mm:g} N/mm",
                limit=f"{range_.min_n_per_mm:.3g} … {range_.max_n_per_mm:.3g} N/mm at {condition.hand_force_n:g} N on "
                f"{condition.object_n_per_mm:g} N/mm ({reason})",
            )


def problems(rig: hapticd.Rig, protocol: protocols.Protocol) -> list[HapticdError]:
    """Each with its remedy; none if a session can begin. A latched guard is none of them: the experimenter's page
    clears it."""
    found: list[HapticdError] = [
        HapticdError(one.text, where=one.topic, remedy=one.remedy)
        for one in rig.diagnose().findings
        if one.severity == rig_pb2.FINDING_SEVERITY_PROBLEM and one.topic != "guard"
    ]
    of_table = turntable_problem(rig) if any(one.all_stations for one in protocol.stimuli) else None
    load_n = _load_n(rig)
    if of_table is not None:
        found.append(of_table)
    elif load_n > MAX_LOAD_N:
        found.append(
            HapticdError(
                "the tool is under load", where="force sensor", value=f"{load_n:.2f} N", limit=f"at most {MAX_LOAD_N:g} N",
                remedy="let go of the tool, or, where no one holds it, hapticctl sensor bias (on a simulated rig: hapticctl sim hand rest)",
            )  # fmt: skip
        )
    return found


def too_fast(rig: hapticd.Rig) -> str:
    """A remark for a person who is to press keys on a simulated rig; empty if its time does not run faster than the clock."""
    if rig.get_rig_info().kind != rig_pb2.RIG_KIND_SIMULATED:
        return ""
    began_ns, began_s = rig.get_rig_state().time_ns, time.monotonic()
    time.sleep(LOOK_S)
    speed = 1e-9 * (rig.get_rig_state().time_ns - began_ns) / (time.monotonic() - began_s)
    if speed < MAX_SPEED:
        return ""
    times = f"{float(f'{speed:.2g}'):g}"
    return f"this rig runs {times} times as fast as the clock, which no person follows: remove speed from [rig.sim] of the daemon's configuration"


def latched(rig: hapticd.Rig) -> str:
    """The fault that keeps the force away, in a word; empty if none does."""
    state = rig.get_rig_state()
    is_latched = state.guard_state == rig_pb2.GUARD_STATE_LATCHED
    return enum_word(rig_pb2.GuardFault.DESCRIPTOR, state.guard_fault) if is_latched else ""


def latched_problem(rig: hapticd.Rig) -> Optional[HapticdError]:
    """Remedy for those who have no page to clear it."""
    fault = latched(rig)
    return HapticdError("there is no force", where="guard", value=fault, remedy="see to the cause, then hapticctl clear") if fault else None


def turntable_problem(rig: hapticd.Rig) -> Optional[HapticdError]:
    """Why the table would not turn now. Connects to its drive."""
    try:
        rig.engage_turntable()
        until = time.monotonic() + CONNECT_S
        while (table := rig.get_turntable()).status.state in CONNECTING and time.monotonic() < until:
            time.sleep(0.05)
    except Refused as refused:
        return refused
    state = table.status.state
    if state in TABLE_REMEDIES or not table.status.homed:
        word = enum_word(turntable_pb2.TurntableState.DESCRIPTOR, state)
        remedy = TABLE_REMEDIES.get(state, TABLE_REMEDIES[turntable_pb2.TURNTABLE_STATE_NOT_HOMED])
        return HapticdError("the table cannot turn", where="turntable", value=table.status.alarm_text or word, remedy=remedy)
    return from_detail(table.interlock) if table.HasField("interlock") else None


def _load_n(rig: hapticd.Rig) -> float:
    """0 on a rig that does not measure it."""
    block = rig.read(0.2, ["sample"])
    names = [f"sample_sensor_force_{axis}_n" for axis in "xyz"]
    if not len(block) or not set(names) <= set(block.names):
        return 0.0
    load_n = math.hypot(*(float(block[name].mean()) for name in names))
    return load_n if math.isfinite(load_n) else 0.0
