#!/usr/bin/env python3
"""Measures what a build costs, from fresh clones without a compiler cache, and writes OUT/figures.jsonl.

    deploy/build_times.py OUT [--before COMMIT] [--gate LOG]

For HEAD, and for COMMIT to compare with: processor time and wall time of what the demo needs to press, then of the rest;
the objects that take longest, compiled again one at a time; and, for HEAD, an edit of one file in each of some folders
until its test program is linked. LOG is what .ci/run printed. The machine should do nothing else. Half an hour each.
"""
import argparse
import json
import os
import pathlib
import re
import resource
import shutil
import subprocess
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
# What is edited, and the target that has its tests.
EDITS = {
    "rt": ("rt/guard/guard.cpp", "test_rt"),
    "server/grpc": ("server/grpc/services/safety_service.cpp", "test_service"),
    "client/console": ("client/console/socket_session.cpp", "test_client"),
    "client/console/socket": ("client/console/socket/web_socket_accept.cpp", "test_client"),
    "server/calibration": ("server/calibration/estimate/arm_fit.cpp", "test_identification"),
    "client/cli": ("client/cli/commands/status_command.cpp", "test_client"),
    "tests": ("tests/unit/rt/guard/guard_test.cpp", "test_rt"),
}
LARGEST = 5


def run(command, folder):
    """Seconds of wall and of all processors."""
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    result = subprocess.run(command, cwd=folder, capture_output=True, text=True,
                            env={**os.environ, "CCACHE_DISABLE": "1"})
    if result.returncode:
        raise SystemExit(f"build_times.py: failed: {' '.join(command)}\n{result.stdout[-4000:]}{result.stderr[-4000:]}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return (time.monotonic() - begin,
            after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)


def demo_targets(folder):
    """What the commit's demonstration builds before a sponge is pressed."""
    return re.search(r'build\.sh" release ([\w ]+)', (folder / "deploy/demo.sh").read_text())[1].split()


def build(folder, *targets):
    command = ["cmake", "--build", "--preset", "release"]
    return run(command + (["--target", *targets] if targets else []), folder)


def largest_objects(folder):
    """Seconds of the objects that took longest, compiled again one at a time."""
    took = {}
    for line in (folder / "build/release/.ninja_log").read_text().splitlines()[1:]:
        begin, end, _, output, _ = line.split("\t")
        if output.endswith((".o", ".gch")):
            took[output] = int(end) - int(begin)
    alone = {}
    for name in sorted(took, key=took.get, reverse=True)[:LARGEST]:
        (folder / "build/release" / name).unlink()
        alone[name] = run(["ninja", "-C", "build/release", name], folder)[0]
    return alone


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--before")
    parser.add_argument("--gate", type=pathlib.Path)
    options = parser.parse_args()
    records = []

    def record(figure, value, **case):
        records.append({"figure": figure, "case": case, "value": round(value, 1), "unit": "s", "goal": None,
                        "reference": None, "source": "deploy/build_times.py"})
        print(f"{figure} {case}: {value:.1f} s", flush=True)

    for commit in filter(None, (options.before, "HEAD")):
        name = subprocess.run(["git", "rev-parse", "--short", commit], cwd=ROOT, capture_output=True, text=True,
                              check=True).stdout.strip()
        folder = pathlib.Path(tempfile.mkdtemp()) / "hapticd"
        subprocess.run(["git", "clone", "-q", str(ROOT), str(folder)], check=True)
        subprocess.run(["git", "checkout", "-q", name], cwd=folder, check=True)
        run(["cmake", "--preset", "release"], folder)
        for what, targets in (("demo", demo_targets(folder)), ("everything else", [])):
            wall, processors = build(folder, *targets)
            record("build_s", wall, what=what, commit=name)
            record("build_cpu_s", processors, what=what, commit=name)
        for object_name, seconds in largest_objects(folder).items():
            record("largest_object_s", seconds, object=object_name, commit=name)
        if commit == "HEAD":
            build(folder)
            for area, (source, target) in EDITS.items():
                with (folder / source).open("a") as file:
                    file.write("\n// edited\n")
                record("edit_to_test_s", build(folder, target)[0], folder=area, commit=name)
        shutil.rmtree(folder.parent)
    if options.gate:
        for line in options.gate.read_text().splitlines():
            words = line.removeprefix(".ci/run:").split(maxsplit=2)
            if line.startswith(".ci/run:") and len(words) == 3 and words[0].isdigit() and words[1] == "s":
                record("gate_s", float(words[0]), part=words[2])
    options.out.mkdir(parents=True, exist_ok=True)
    with (options.out / "figures.jsonl").open("w") as file:
        for line in records:
            file.write(json.dumps(line) + "\n")


if __name__ == "__main__":
    main()
