"""How fast the guide leads the tool, how softly it lets go, and what the fixture adds along a press: every tick of guided presses."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

import hapticd
from hapticd.block import Block
from hapticd.v1 import guide_pb2

import study_output
from daemon import Daemon

SPEED_MM_PER_S = 15.0
GROUPS = ["truth", "assist", "contact"]
OBJECTS = ("sponge_block", "rubber_ball")


def guided_presses(rig: hapticd.Rig, count: int) -> Block:
    """All ticks of so many: led up, led down until contact, pressed, led up."""
    blocks = []
    with rig.telemetry(GROUPS, queue_s=60.0) as stream:
        rows = iter(stream)

        def wait(seconds: float) -> None:
            end_ns = rig.get_rig_state().time_ns + seconds * 1e9
            while not blocks or blocks[-1]["time_ns"][-1] < end_ns:
                blocks.append(next(rows))

        for _ in range(count):
            rig.set_hand_program({"kind": "follow"})
            wait(1.0)  # the fixture draws back a tool that was held against it: no motion of the guide's
            rig.move_tool(point_mm=(4.0, -3.0, 25.0), max_speed_mm_per_s=SPEED_MM_PER_S).last()
            rig.move_tool(point_mm=(0.0, 0.0, 12.0), max_speed_mm_per_s=SPEED_MM_PER_S).last()
            rig.move_tool(until_contact_mm=60.0, max_speed_mm_per_s=SPEED_MM_PER_S).last()
            rig.set_hand_program({"kind": "press", "force_n": 3.0, "force_rate_n_per_s": 9.0, "hold_s": 0.2, "repetitions": 1})
            wait(3.0)
    return Block.joined(blocks)


def main() -> None:
    options = study_output.options(__doc__)
    output = study_output.Output(options.out, "assistance", "Guide and fixture")
    table = []
    with tempfile.TemporaryDirectory() as folder:
        configuration = Path(folder) / "rig.toml"
        configuration.write_text("[rig.sim]\nspeed = 10\n")
        daemon = Daemon(Path(folder), "--model-store", ":memory:", "--config", str(configuration), "--scene", "press_guided")
        try:
            with hapticd.connect(daemon.address) as rig, rig.lease("study"):
                rig.set_target(0.5)
                for name in OBJECTS:
                    rig.set_object(name)
                    block = guided_presses(rig, 3 if options.quick else 20)
                    failed = f"{block.lost} samples were lost" if block.lost else ""
                    step = np.sqrt(sum(np.diff(block[f"assist_guide_force_{axis}_n"]) ** 2 for axis in "xyz"))
                    dt = np.diff(block["time_ns"]) * 1e-9
                    speed = np.sqrt(sum(np.diff(block[f"truth_tip_position_{axis}_mm"]) ** 2 for axis in "xyz")) / dt
                    led = speed[block["assist_guide_state"][1:] == guide_pb2.GUIDE_STATE_UNDER_WAY]
                    along = np.abs(block["assist_fixture_force_z_n"])
                    pressed = along[block["truth_in_contact"] > 0.5]
                    case = {"object": name}
                    output.figure(
                        "guide_speed_max_mm_per_s", float(led.max()), case, unit="mm/s", goal=1.05 * SPEED_MM_PER_S, source="true, set to 15 mm/s",
                        failed=failed,
                    )  # fmt: skip
                    output.figure("guide_force_step_n", float(step.max()), case, unit="N", goal=0.05, source="from tick to tick", failed=failed)
                    output.figure(
                        "fixture_force_along_press_n", float(pressed.max()), case, unit="N", goal=0.02, source="in contact", failed=failed
                    )
                    table.append([name, f"{len(block)}", f"{led.max():.2f}", f"{step.max():.4f}", f"{pressed.max():.4f}"])
        finally:
            daemon.end()
    output.table(
        f"Guided presses, set to {SPEED_MM_PER_S:g} mm/s",
        ["object", "ticks", "fastest while led mm/s", "largest step of the guide's force N", "largest force of the fixture along the press N"],
        table,
    )


if __name__ == "__main__":
    main()
