"""Control of the rig for a session, and what a session whose program died has left: its lease, its recording, its fault."""

from __future__ import annotations

import contextlib
import math
import time
from typing import Iterator

import hapticd
from hapticd.errors import Refused
from hapticd.v1 import access_pb2, recording_pb2, rig_pb2

#: Purpose of the lease and of recordings, by which those of a session are known.
PURPOSE = "experiment"


@contextlib.contextmanager
def of_session(rig: hapticd.Rig) -> Iterator[None]:
    """The rig's lease while the block runs. A session of the same identity that is no longer heard of is waited for until
    its lease is over, its recording is ended, and the fault that its loss has raised is cleared.

    Raises NotAllowed (LEASE_HELD) if another client, or a session that is alive, controls the rig.
    """
    own = rig.get_access().identity
    before = _when_no_dead_session_holds(rig, own)
    with rig.lease(PURPOSE, on_expiry="ramp_to_zero"):
        _end_recording(rig, own)
        if before.change == access_pb2.LEASE_CHANGE_EXPIRED and before.changed_by == own:
            _clear_own_loss(rig)
        yield


def _when_no_dead_session_holds(rig: hapticd.Rig, own: str) -> access_pb2.LeaseState:
    """Returns as soon as the lease is free, or is not that of an own session, or is renewed."""
    remaining_s = math.inf
    while True:
        state = rig.get_lease()
        lease = state.lease
        is_own = state.HasField("lease") and lease.holder == own and lease.purpose == PURPOSE
        if not is_own or lease.remaining_s > remaining_s:
            return state
        remaining_s = lease.remaining_s
        time.sleep(0.1)


def _end_recording(rig: hapticd.Rig, own: str) -> None:
    with contextlib.suppress(Refused):  # the daemon keeps no recordings
        for one in rig.list_recordings().recordings:
            if one.state == recording_pb2.RECORDING_STATE_RUNNING and one.by == own and one.note == PURPOSE:
                rig.stop_recording()


def _clear_own_loss(rig: hapticd.Rig) -> None:
    """Clears without a scene, so that no force returns by it."""
    if rig.get_rig_state().guard_fault == rig_pb2.GUARD_FAULT_CLIENT_LOST:
        rig.unload_scene()
        rig.clear()
