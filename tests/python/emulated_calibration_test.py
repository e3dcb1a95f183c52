"""An arm that was never calibrated, behind its vendor's library, and a tracker: calibrated while it pushes, and from files."""

from __future__ import annotations

import json
import threading
import time
from pathlib import Path
from typing import Any, Iterator

import numpy as np

import hapticd
from emulated_rig import LATE
from hapticd.v1 import calibration_pb2

SCENE = 'name = "corrected"\nkind = "tap_1d"\ncorrected_poses = true\n[target]\nstiffness_n_per_mm = 0.6\n[watch]\n' + LATE
LATENCY_MS = 22.0
# Period of the rig: its poses are stamped when the device's scheduler runs, up to a tick after the arm was there.
TICK_MS = 1.5
HELD_OUT_S = 12.0


def rows_of(file: Path, until: threading.Event) -> Iterator[list[float]]:
    """What a tracker writes, as it grows, without what was there before."""
    with file.open() as stream:
        stream.seek(0, 2)
        rest = ""
        while not until.is_set():
            rest += stream.read()
            *lines, rest = rest.split("\n")
            yield from ([float(word) for word in line.split(",")] for line in lines)
            time.sleep(0.02)


def rotation(w: float, x: float, y: float, z: float) -> Any:
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def messages(rows: Iterator[list[float]], ahead_ns: int) -> Iterator[calibration_pb2.PushReferencePosesRequest]:
    for row in rows:
        message = calibration_pb2.PushReferencePosesRequest()
        pose = message.poses.add(stamp_ns=int(row[0]) - ahead_ns)
        pose.position_mm.x, pose.position_mm.y, pose.position_mm.z = row[1:4]
        pose.orientation.w, pose.orientation.x, pose.orientation.y, pose.orientation.z = row[4:8]
        yield message


def marker_error_mm(rig: hapticd.Rig, tracker: Path, calibration: Any, ahead_ns: int) -> float:
    """Error of the marker where corrected poses have it, against what the tracker sees, in the median of motion not
    calibrated with."""
    enough = threading.Event()
    seen: list[list[float]] = []
    reader = threading.Thread(target=lambda: seen.extend(rows_of(tracker, enough)), daemon=True)
    reader.start()
    times_ns, places_mm = [], []
    marker_mm = calibration.tool_from_marker.translation_mm
    end = time.monotonic() + HELD_OUT_S
    for pose in rig.poses(250, frame="POSE_FRAME_REFERENCE"):
        p, q = pose.position_mm, pose.orientation
        place_mm = np.array([p.x, p.y, p.z]) + rotation(q.w, q.x, q.y, q.z) @ np.array([marker_mm.x, marker_mm.y, marker_mm.z])
        times_ns.append(pose.time.rig_ns)
        places_mm.append(place_mm)
        if time.monotonic() > end:
            break
    enough.set()
    reader.join()
    latency_ns = 1e6 * calibration.latency_ms
    at_ns = np.array([row[0] for row in seen]) - ahead_ns - latency_ns
    inside = (at_ns > times_ns[0]) & (at_ns < times_ns[-1])
    predicted = np.column_stack([np.interp(at_ns, times_ns, [place[i] for place in places_mm]) for i in range(3)])
    tracked = np.array([row[1:4] for row in seen])
    assert inside.sum() > 30 * HELD_OUT_S
    return float(np.median(np.linalg.norm(predicted - tracked, axis=1)[inside]))


def test_calibrates_while_the_tracker_pushes_and_from_a_recording(tmp_path: Path, emulated_rig: Any) -> None:
    tracker = tmp_path / "tracker.csv"
    emulated = emulated_rig("--program", "survey", "--object", "none", "--conditions", "arm", "--condition",
                            f"tracker_latency_ms={LATENCY_MS}", "--tracker", tracker)  # fmt: skip
    record = emulated.start("record", *emulated.command("telemetry", "record", "rig.csv", "--groups", "sample,angles", "--seconds", "60"))
    with hapticd.connect(emulated.address) as rig:
        clock = rig.exchange_clocks()
        ahead_ns = clock.rig.begun_ns - clock.rig.rig_time_ns  # both are CLOCK_MONOTONIC of this machine
        calibrate = emulated.start("calibrate", *emulated.command("--json", "calibrate", "kinematics", "--seconds", "50"))
        over = threading.Event()
        watch = threading.Thread(target=lambda: (calibrate.wait(), over.set()), daemon=True)
        watch.start()
        time.sleep(0.5)
        sent = rig.push_reference_poses(messages(rows_of(tracker, over), ahead_ns), deadline_s=100.0)
        watch.join()
        assert calibrate.returncode == 0, emulated.output_of("calibrate").read_text()
        assert sent.poses > 60 * 45
        live = json.loads(emulated.output_of("calibrate").read_text())
        assert abs(live["latency_ms"] - LATENCY_MS) < TICK_MS, live
        assert live["predicted_target_error_95_mm"] < 1.0 and live["tracker_noise_mm"] < 0.5

        record.wait(timeout=60)
        files = tmp_path / "reference.csv"
        files.write_text(tracker.read_text().rsplit("\n", 1)[0] + "\n")
        found = json.loads(emulated.control("--json", "--timeout", "120", "calibrate", "kinematics", "--recording", "rig.csv",
                                            "--reference", files, "--own-clock"))  # fmt: skip
        assert found["predicted_target_error_95_mm"] < 1.0

        emulated.control("calibration", "adopt", live["hash"])
        calibration = rig.get_calibration(hash=live["hash"])
        # The tracker's own noise is 0.3 mm an axis: 0.46 mm in the median.
        error_mm = marker_error_mm(rig, tracker, calibration, ahead_ns)
        print(f"marker off by {error_mm:.2f} mm, latency {live['latency_ms']:.2f} ms, predicted {live['predicted_target_error_95_mm']:.3f} mm")
        assert error_mm < 0.8

        with rig.lease("test"):
            rig.load_scene(toml=SCENE)
            assert any("corrected by calibration" in remark for remark in rig.explain_scene(toml=SCENE).remarks)
            block = rig.read(4.0, ["guard"])
            assert rig.get_rig_state(without_histograms=True).scene == "corrected"
            command_n = np.column_stack([block[f"guard_device_command_{axis}_n"] for axis in "xyz"])
            assert np.linalg.norm(command_n, axis=1).max() < 0.1  # it is waved in the air
