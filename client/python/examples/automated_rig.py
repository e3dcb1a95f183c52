"""An automated test rig: three stiffnesses, each measured and judged; exit code 1 if one is wrong or the guard has latched."""

import sys

import numpy as np

import hapticd
from hapticd.v1 import rig_pb2


def end_if_latched(rig: hapticd.Rig) -> None:
    """Ends the program if the guard is latched: without force there is nothing to measure."""
    state = rig.get_rig_state(without_histograms=True)
    if state.guard_state == rig_pb2.GUARD_STATE_LATCHED:
        fault = rig_pb2.GuardFault.Name(state.guard_fault).removeprefix("GUARD_FAULT_")
        sys.exit(f"the guard is latched ({fault}): see to its cause, then hapticctl clear")


with hapticd.connect(sys.argv[1] if len(sys.argv) > 1 else None) as rig, rig.lease("automated test"):
    rig.load_scene("tap_1d")
    end_if_latched(rig)
    wrong = 0
    for target in (0.2, 0.3, 0.5):
        granted = rig.set_target(target).granted_n_per_mm
        press = {"kind": "press", "force_n": 1.0, "hold_s": 1.0, "repetitions": 1}
        data = rig.read_hand(press, ["control", "deformation"])
        end_if_latched(rig)
        depth_mm, force_n = data["deformation_displacement_mm"], data["control_hand_force_n"]
        held = depth_mm > 0.95 * depth_mm.max()
        felt = np.median(force_n[held] / depth_mm[held])
        wrong += not abs(felt / granted - 1.0) <= 0.1  # also if nothing was felt
        print(f"target {granted:.2f}, felt {felt:.3f} N/mm")
sys.exit(1 if wrong else 0)
