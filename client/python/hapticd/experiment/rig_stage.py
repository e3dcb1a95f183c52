"""Stimuli on a rig: the table turns, the device leads the tool, the hand presses, the daemon judges."""

from __future__ import annotations

import contextlib
import dataclasses
import math
import time
from typing import Any, Callable, Iterator, Optional, Sequence

import numpy as np

import hapticd
from hapticd._requests import enum_word
from hapticd.block import Block
from hapticd.errors import HapticdError, LeaseLost, Refused, Stopped, TimedOut, Unreachable, from_detail
from hapticd.experiment import control, free_change, inclusions, readiness, seeds
from hapticd.experiment import protocol as protocols
from hapticd.experiment.hands import Hand, SimulatedHand
from hapticd.experiment.journal import Event
from hapticd.experiment.session import Role, Trial
from hapticd.experiment.stage import Aborted, Interrupted, Presentation, record_of
from hapticd.experiment.touch import GROUPS, GROUPS_OF_TRUTH, Touch
from hapticd.v1 import guide_pb2, presentation_pb2, recording_pb2, rig_pb2

#: Peaks of the summary, for the journal.
PEAKS = (
    "number",
    "begin_tick",
    "end_tick",
    "peak_press_speed_mm_per_s",
    "peak_contact_speed_mm_per_s",
    "peak_lateral_mm",
    "lateral_path_mm",
    "peak_force_n",
    "peak_displacement_mm",
    "time_in_contact_s",
    "contacts",
    "guard_limited_ticks",
    "late_ticks",
)
#: How long a participant waits for a stop to be cleared before the session ends, s.
WAIT_FOR_CLEAR_S = 600.0
#: How long a simulated hand takes to let go at most, s of this machine.
LET_GO_S = 10.0
#: Telemetry of a press, samples a second of the rig's time.
SAMPLES_HZ = 250.0


class RigStage:
    """Stage on a daemon that this program controls: it holds the lease meanwhile. Use as a context manager."""

    def __init__(self, rig: hapticd.Rig, hand: Hand, *, seed: int = 0, record_as: str = "", wait_for_clear_s: float = WAIT_FOR_CLEAR_S, on_wait: Callable[[str], None] = lambda text: None) -> None:
        self._rig = rig
        self._hand = hand
        self._seed = seed
        self._record_as = record_as
        self._wait_for_clear_s = wait_for_clear_s
        self._on_wait = on_wait
        #: A person sees the tool; a simulated hand does not mind.
        self._latency_s = 0.1 if isinstance(hand, SimulatedHand) else 0.03
        self._recording = ""
        #: By condition, the highest level of the comparison that is rendered, N/mm; known after check().
        self.rendered: dict[str, float] = {}
        self._scene = ""
        self._station: Optional[str] = None
        self._protocol: Optional[protocols.Protocol] = None
        info = rig.get_rig_info()
        self._is_simulated = info.kind == rig_pb2.RIG_KIND_SIMULATED
        self._has_truth, self._rate_hz = info.has_truth, info.loop_rate_hz
        self._stack = contextlib.ExitStack()
        self._blocks: Iterator[Block] = iter(())
        self._time_ns = 0

    def __enter__(self) -> RigStage:
        with contextlib.ExitStack() as stack:  # if a part of it fails, the rest is given back
            stack.enter_context(control.of_session(self._rig))
            groups = GROUPS_OF_TRUTH if self._has_truth else GROUPS
            stream = stack.enter_context(self._rig.telemetry(groups, hz=SAMPLES_HZ, latency_s=self._latency_s, queue_s=60.0))
            self._blocks = iter(stream)
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        with contextlib.suppress(HapticdError):
            self._rig.unload_scene()
        self._stack.close()

    def opening(self) -> Sequence[Event]:
        if not self._record_as:
            return ()
        self._recording = self._rig.start_recording(self._record_as, note=control.PURPOSE, until_lease_ends=True).id
        self._stack.callback(self._end_recording)
        self._time_ns = self._rig.get_rig_state().time_ns
        return ({"event": "recording", "recording": self._recording},)

    def _end_recording(self) -> None:
        with contextlib.suppress(HapticdError):
            running = (one for one in self._rig.list_recordings().recordings if one.id == self._recording)
            if any(one.state == recording_pb2.RECORDING_STATE_RUNNING for one in running):
                self._rig.stop_recording()

    def time_s(self) -> Optional[float]:
        return self._time_ns * 1e-9

    # Before a participant sits down.

    def check(self, protocol: protocols.Protocol) -> None:
        """Raises BadFile for a station that there is not, a scene that cannot be loaded, a target that cannot be rendered."""
        self._protocol = protocol
        self.rendered = readiness.check_scenes(self._rig, protocol)
        readiness.check_feasible(self._rig, protocol, self._load)

    # One presentation after the other.

    def begin_condition(self, condition: protocols.Condition) -> None:
        pass

    def present(self, trial: Trial, role: Role) -> Presentation:
        protocol = self._protocol
        assert protocol is not None
        condition = protocol.condition(trial.condition)
        stimulus = condition.reference if role == "reference" else condition.comparison
        target = condition.reference_n_per_mm if role == "reference" else trial.level
        try:
            self.await_force()
            self._place(stimulus, trial, role)
            drawn = self._put_inclusion(stimulus, trial, role)
            self._load(stimulus, *drawn)
            granted = self._rig.set_target(target).granted_n_per_mm if target > 0.0 else 0.0
            return self._touched(protocol, trial, role, granted, drawn)
        except (LeaseLost, Unreachable, TimedOut) as error:
            raise Aborted(str(error)) from error
        except Stopped as error:
            raise Interrupted("force_cut") from error

    def explore(self, trial: Trial) -> Iterator[tuple[Role, Presentation]]:
        protocol = self._protocol
        assert protocol is not None
        condition = protocol.condition(trial.condition)
        try:
            self.await_force()
            self._place(condition.reference, trial, "reference")
            self._hand.explore(self._rig, trial, condition, protocol.stroke_path_mm)
            yield from self._visits(protocol, trial, condition)
        except (LeaseLost, Unreachable, TimedOut) as error:
            raise Aborted(str(error)) from error
        except Stopped as error:
            raise Interrupted("force_cut") from error
        except Refused as error:
            raise Interrupted(error.what) from error

    def _visits(self, protocol: protocols.Protocol, trial: Trial, condition: protocols.Condition) -> Iterator[tuple[Role, Presentation]]:
        """Each of them is judged by itself; the scene is exchanged on the way, in free air."""
        side = free_change.Side(condition)
        of = "truth" if self._has_truth else "sample"
        began_ns = self._lifted(side, of, protocol.max_press_s)
        is_over = False
        while not is_over:
            at = side.role
            self._load(condition.reference if at == "reference" else condition.comparison)
            granted = self._rig.set_target(condition.reference_n_per_mm if at == "reference" else trial.level).granted_n_per_mm
            begin_tick = self._rig.begin_presentation().begin_tick
            touch = Touch(self._has_truth, False)
            for block in self._blocks:
                self._hand.sees(block)
                block = block.between(begin_tick, 2**62)
                if not len(block):
                    continue
                touch.add(block)
                self._time_ns = int(block["time_ns"][-1])
                is_late = self._time_ns - began_ns > protocol.max_press_s * 1e9
                is_over = is_late or self._hand.has_explored(self._rig, at, touch.has_pressed, touch.is_lifted)
                if is_over or side.sees(block, of):
                    break
            else:
                raise Unreachable("the telemetry ended", where=self._rig.address)
            summary = self._rig.end_presentation()
            presentation = self._presentation(summary, granted, touch.felt())
            own = [flaw for flaw in presentation.flaws if flaw not in free_change.OF_ALL_TOUCHES]
            if is_over and is_late:
                own.append("too_long")
            if summary.contacts or own:
                yield at, dataclasses.replace(presentation, flaws=own)

    def _lifted(self, side: free_change.Side, of: str, max_s: float) -> int:
        """Time at which the tool is in free air, ns, and at which of the two places it is then."""
        began_ns: Optional[int] = None
        for block in self._blocks:
            self._hand.sees(block)
            if not len(block):
                continue
            self._time_ns = int(block["time_ns"][-1])
            began_ns = self._time_ns if began_ns is None else began_ns
            if not block["contact_in_contact"][-1] > 0.5:  # NaN: there is no scene yet
                side.sees(block, of)
                return self._time_ns
            if self._time_ns - began_ns > max_s * 1e9:
                raise Interrupted("the tool was not lifted")
        raise Unreachable("the telemetry ended", where=self._rig.address)

    def await_force(self) -> None:
        """A stop, or a fault, is for the experimenter to clear."""
        self._await(lambda: readiness.latched(self._rig), "the force was taken away ({}), and no one cleared it", self._wait_for_clear_s)
        self._time_ns = self._rig.get_rig_state().time_ns

    def _await(self, obstacle: Callable[[], str], aborted: str, wait_s: float) -> None:
        """Returns when there is no obstacle any more; meanwhile it is shown."""
        until = time.monotonic() + wait_s
        has_waited = False
        while why := obstacle():
            self._on_wait(why)
            has_waited = True
            if time.monotonic() > until:
                raise Aborted(aborted.format(why))
            time.sleep(0.2)
        if has_waited:
            self._on_wait("")

    def _place(self, stimulus: protocols.Stimulus, trial: Trial, role: Role) -> None:
        station = stimulus.station
        if stimulus.stations:
            station = stimulus.stations[int(self._drawn("station", trial, role).integers(len(stimulus.stations)))]
        if station and station != self._station:
            # Someone who still presses is waited for; the simulated hand lets go.
            self._hand.follow(self._rig)
            self._await(self._load_on_tool, "the table could not turn: {}", max(self._wait_for_clear_s, LET_GO_S))
            try:
                self._rig.move_turntable(station=station).last()
            except Stopped:
                raise
            except Refused as refused:
                raise Aborted(str(refused)) from refused
            self._station = station
        elif stimulus.object and stimulus.object != self._station:
            self._rig.set_object(stimulus.object)
            self._station = stimulus.object

    def _load_on_tool(self) -> str:
        table = self._rig.get_turntable()
        return str(from_detail(table.interlock)) if table.HasField("interlock") else ""

    def _load(self, stimulus: protocols.Stimulus, x_mm: float = 0.0, y_mm: float = 0.0) -> None:
        """x_mm, y_mm: by how much its inclusion is moved."""
        assert self._protocol is not None
        text = inclusions.moved(stimulus.scene_toml, x_mm, y_mm, self._protocol.object_centre_mm)
        wanted = stimulus.scene or text
        if wanted != self._scene:
            self._rig.load_scene(stimulus.scene or None, toml=text or None)
            self._scene = wanted

    def _drawn(self, what: str, trial: Trial, role: Role) -> np.random.Generator:
        return seeds.generator(self._seed, what, trial.condition, int(trial.is_training), trial.number, trial.attempt, role)

    def _put_inclusion(self, stimulus: protocols.Stimulus, trial: Trial, role: Role) -> tuple[float, float]:
        """Offset of the inclusion in this presentation from where it lay when it was identified, mm. A rendered one is
        rendered there; on a simulated rig a real one is put there. A real object on a real rig takes several stations."""
        assert self._protocol is not None
        within_mm = self._protocol.inclusion_within_mm
        if within_mm <= 0.0:
            return 0.0, 0.0
        random = self._drawn("inclusion", trial, role)
        away_mm, angle = within_mm * math.sqrt(random.uniform()), random.uniform(0.0, 2.0 * math.pi)
        x_mm, y_mm = round(away_mm * math.cos(angle), 3), round(away_mm * math.sin(angle), 3)
        if inclusions.are_in(stimulus.scene_toml):
            return x_mm, y_mm
        if not self._is_simulated:
            return 0.0, 0.0
        self._rig.set_object(self._rig.get_simulation().object, inclusion_x_mm=x_mm, inclusion_y_mm=y_mm)
        return x_mm, y_mm

    def _touched(
        self, protocol: protocols.Protocol, trial: Trial, role: Role, granted: float, drawn: tuple[float, float]
    ) -> Presentation:
        above_mm = self._above(protocol, trial, role)
        self._hand.follow(self._rig)
        self._guide(point_mm=above_mm, max_speed_mm_per_s=protocol.guide_speed_mm_per_s)
        if protocol.approach == "guided":
            end = self._guide(until_contact_mm=protocol.contact_within_mm, max_speed_mm_per_s=protocol.guide_speed_mm_per_s)
            if end != "contact":
                self._up(protocol, above_mm)
                raise Interrupted("nothing was touched")
        begun = self._rig.begin_presentation()
        if protocol.touch == "search":
            felt, found_after_s, in_time = self._searched(protocol, trial, role, begun.begin_tick)
        else:
            found_after_s = math.nan
            if protocol.touch == "stroke":
                self._hand.stroke(self._rig, trial, role, protocol.stroke_path_mm)
            else:
                self._hand.press(self._rig, trial, role)
            touch = self._until_done(begun.begin_tick, protocol.approach == "guided", protocol.max_press_s)
            felt, in_time = (math.nan, False) if touch is None else (touch.felt(), True)
        summary = self._rig.end_presentation()
        self._up(protocol, above_mm)
        return self._presentation(summary, granted, felt, found_after_s, in_time, drawn)

    def _presentation(
        self, summary: Any, granted: float, felt: float, found_after_s: float = math.nan, in_time: bool = True,
        drawn: tuple[float, float] = (0.0, 0.0),
    ) -> Presentation:  # fmt: skip
        flaws = [enum_word(presentation_pb2.PresentationFlaw.DESCRIPTOR, one) for one in summary.flaws]
        if not in_time:
            flaws.append("too_long")
        record: dict[str, Any] = {
            "granted_n_per_mm": round(granted, 6),
            "duration_s": round((summary.end_tick - summary.begin_tick + 1) / self._rate_hz, 4),
            **record_of(summary, PEAKS),
        }
        if drawn != (0.0, 0.0):
            record["inclusion_mm"] = list(drawn)
        if self._recording:
            record["recording"] = self._recording
        return Presentation(flaws, record, felt, found_after_s)

    def _above(self, protocol: protocols.Protocol, trial: Trial, role: Role) -> tuple[float, ...]:
        """Place at which the tool is let go; aside at random, so that it says nothing of what is sought."""
        if protocol.start_jitter_mm <= 0.0:
            return protocol.above_mm
        x, y, z = protocol.above_mm
        dx, dy = protocol.start_jitter_mm * self._drawn("start", trial, role).uniform(-1.0, 1.0, 2)
        return x + float(dx), y + float(dy), z

    def _searched(self, protocol: protocols.Protocol, trial: Trial, role: Role, begin_tick: int) -> tuple[float, float, bool]:
        """The greatest stiffness that was felt, N/mm; how long the object was touched until what is sought was found; whether
        it took no longer than it may."""
        search = self._hand.search(trial, role, [(x, y) for y in protocol.rows_mm for x in protocol.places_mm])
        contact_s, felt, began_ns = 0.0, math.nan, self._time_ns
        place = next(search)
        while self._time_ns - began_ns < protocol.max_press_s * 1e9:
            if place is not None:
                self._hand.press(self._rig, trial, role, place)
            touch = self._until_done(begin_tick, False, protocol.max_press_s)
            if touch is None:
                break
            begin_tick = touch.end_tick + 1
            contact_s += touch.contact_s()
            felt = float(np.fmax(felt, touch.felt()))
            try:
                place = search.send(touch.felt())
            except StopIteration as end:
                return felt, contact_s if end.value else math.nan, True
        return felt, math.nan, False

    def _guide(self, **destination: Any) -> str:
        """The state in which the motion ended."""
        try:
            status = self._rig.move_tool(**destination).last()
        except Refused as refused:
            if refused.reason == "STATE_CHANGED":
                raise Interrupted(refused.what) from refused
            raise
        return enum_word(guide_pb2.GuideState.DESCRIPTOR, status.state)

    def _up(self, protocol: protocols.Protocol, above_mm: Sequence[float]) -> None:
        self._hand.follow(self._rig)
        self._guide(point_mm=above_mm, max_speed_mm_per_s=protocol.guide_speed_mm_per_s)

    def _until_done(self, begin_tick: int, from_contact: bool, max_s: float) -> Optional[Touch]:
        """The touch, when the hand is done with it; None if it took too long."""
        touch = Touch(self._has_truth, from_contact)
        for block in self._blocks:
            self._hand.sees(block)
            touch.add(block.between(begin_tick, 2**62))
            self._time_ns = int(block["time_ns"][-1]) if len(block) else self._time_ns
            if self._hand.is_done(touch.has_pressed, touch.is_lifted):
                return touch
            if touch.duration_s > max_s:
                return None
        raise Unreachable("the telemetry ended", where=self._rig.address)
