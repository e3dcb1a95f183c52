"""A client of hapticd, the service that changes how stiff a real object feels.

    import hapticd

    with hapticd.connect() as rig:                      # or "host:port", "unix:/run/hapticd/hapticd.sock"
        rig.load_scene("tap_1d")
        with rig.lease("pilot"):
            print(rig.set_target(0.3).granted_n_per_mm, "N/mm")
            data = rig.read(5.0, ["contact", "control"])
    print(data["contact_reaction_force_n"].max(), data.unit("contact_reaction_force_n"))

Quantities carry their unit in their name: N, mm, s, N/mm. The messages are those of the contract (docs/contract.md);
every call that does not succeed raises HapticdError.
"""

from hapticd._client import Rig, connect
from hapticd._shown import printable
from hapticd._stop import StopOutcome, stop
from hapticd.block import Block
from hapticd.errors import (
    BadArgument,
    BadFile,
    Cancelled,
    HapticdError,
    LeaseLost,
    MissingPackage,
    NotAllowed,
    Refused,
    Stopped,
    TimedOut,
    Unreachable,
)
from hapticd.recordings import Recording, open_recording
from hapticd.telemetry import Telemetry

__all__ = [
    "BadArgument",
    "BadFile",
    "Block",
    "Cancelled",
    "HapticdError",
    "LeaseLost",
    "MissingPackage",
    "NotAllowed",
    "Recording",
    "Refused",
    "Rig",
    "StopOutcome",
    "Stopped",
    "Telemetry",
    "TimedOut",
    "Unreachable",
    "connect",
    "open_recording",
    "printable",
    "stop",
]
