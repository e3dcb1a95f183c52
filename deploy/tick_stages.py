#!/usr/bin/env python3
"""Prints where the instructions of a tick go: a table of stages and scenes, in Markdown.

    deploy/tick_stages.py [--bench build/release/bin/hapticd_bench] [SCENE...]

Counts with callgrind what `hapticd_bench tick` counts, so the columns add up to its figures. An instruction counts for the
folder of rt/ whose source it comes from; vectors, containers and the like count for the stage whose instructions they
are among. Needs valgrind, and the benchmarks built (deploy/build.sh measure).
"""
import argparse
import collections
import pathlib
import re
import subprocess
import sys
import tempfile

TICKS = 4000  # as in tests/measure/bench/tick/tick_instructions.cpp
STAGES = {  # folder: what it does, in the order of a tick
    "rt/scene": "scene: passes the sample from stage to stage, fills the record",
    "load watch": "guard: whether the sensor bears a load, zeros that jump",
    "rt/guard": "guard: faults, bounds, oscillation",
    "rt/signal": "velocity and acceleration, filters, tool weight",
    "rt/contact": "contact, its evidence, the sensor's zero",
    "rt/friction": "friction",
    "rt/deformation": "direction and displacement",
    "rt/target": "target force",
    "rt/modulation": "what else adds a force",
    "rt/inclusion": "inclusions",
    "rt/control": "controller, compensation",
    "rt/assist": "guide and fixture",
    "rest": "record passed on, library functions",
}
SAME = {"rt/explore": "rt/scene", "rt/contribution": "rt/modulation", "rt/arm": "rt/signal"}
NAME = re.compile(r"\((\d+)\)(?: (.*))?")
COST = re.compile(r"(0x[0-9a-f]+|[+*-]\d*) [+*-]?\d* \d+$")  # in the order of addresses within a function


def stage_of(path):
    if "/load_monitor" in path or path.startswith("rt/guard/load_monitor") or "stiffness_fit" in path:
        return "load watch"
    found = re.search(r"(?:^|/)(rt/[a-z]+)/", path)
    stage = SAME.get(found.group(1), found.group(1)) if found else None
    return stage if stage in STAGES else None


def instructions(profile):
    """Returns {stage: instructions} of a callgrind file."""
    names, costs = {}, collections.defaultdict(collections.Counter)  # of each function, by the stage of the source
    function = source = ""
    last = None  # the stage of the instruction before, in the same function
    is_call = False
    for line in profile.read_text(errors="replace").splitlines():
        key, equals, value = line.partition("=")
        if equals and key in ("fl", "fi", "fe", "cfi", "cfl", "fn", "cfn"):
            number, name = NAME.match(value).groups()
            name = names.setdefault((key[-2:] == "fn", number), name or "")
            if key == "fn":
                function, last = name, None
            elif key[0] == "f":
                source = name
        elif line.startswith("calls="):
            is_call = True  # the next line has what the called function cost
        elif COST.match(line):
            if not is_call:
                last = stage_of(source) or last
                costs[function][last] += int(line.split()[2])
            is_call = False
    sums = collections.Counter()
    for of in costs.values():
        elsewhere = of.pop(None, 0)  # what is before any stage counts for the stage that has most of the function
        sums.update(of)
        sums[max(of, key=of.get, default="rest")] += elsewhere
    return sums


def count(bench, scene, folder):
    profile = pathlib.Path(folder) / scene
    command = ["valgrind", "--tool=callgrind", "--dump-instr=yes", f"--callgrind-out-file={profile}",
               "--toggle-collect=hapticd::bench::run_counted*", bench, "tick-child", "--scene", scene, "--ticks", str(TICKS)]
    try:
        subprocess.run(command, check=True, capture_output=True, env={})
    except FileNotFoundError:
        sys.exit("tick_stages.py: valgrind is not installed; apt-get install valgrind")
    except subprocess.CalledProcessError as error:
        sys.exit(f"tick_stages.py: {scene}: {error.stderr.decode()[-400:]}")
    return instructions(profile)


def main():
    parser = argparse.ArgumentParser(description="Prints where the instructions of a tick go.")
    parser.add_argument("--bench", default="build/release/bin/hapticd_bench", help="the benchmarks' program")
    parser.add_argument("scenes", nargs="*", metavar="SCENE", default=["wall", "tap_1d", "explore_rod"])
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        sums = [count(str(pathlib.Path(arguments.bench).resolve()), scene, folder) for scene in arguments.scenes]
    print(f"| stage | {' | '.join(f'`{scene}`' for scene in arguments.scenes)} |\n|{'---|' * (len(sums) + 1)}")
    for stage, text in STAGES.items():
        if any(of[stage] for of in sums):
            print(f"| {text} | {' | '.join(str(round(of[stage] / TICKS)) for of in sums)} |")
    print(f"| all | {' | '.join(str(round(sum(of.values()) / TICKS)) for of in sums)} |")


if __name__ == "__main__":
    main()
