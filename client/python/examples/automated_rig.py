"""An automated test rig: three stiffnesses, each measured and judged; exit code 1 if one is wrong."""

import sys

import numpy as np

import hapticd

with hapticd.connect(sys.argv[1] if len(sys.argv) > 1 else None) as rig, rig.lease("automated test"):
    rig.load_scene("tap_1d")
    wrong = 0
    for target in (0.2, 0.3, 0.5):
        granted = rig.set_target(target).granted_n_per_mm
        press = {"kind": "press", "force_n": 1.0, "hold_s": 1.0, "repetitions": 1}
        data = rig.read_hand(press, ["control", "deformation"])
        depth_mm, force_n = data["deformation_displacement_mm"], data["control_hand_force_n"]
        held = depth_mm > 0.95 * depth_mm.max()
        felt = np.median(force_n[held] / depth_mm[held])
        wrong += abs(felt / granted - 1.0) > 0.1
        print(f"target {granted:.2f}, felt {felt:.3f} N/mm")
sys.exit(1 if wrong else 0)
