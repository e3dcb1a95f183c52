#!/usr/bin/env bash
# Installs what is missing, builds everything and runs the tests; the last lines are ctest's summary.
# Needs Debian 12, and root or sudo where packages are missing.
#
#   bash deploy/check.sh [PRESET]     release, or one of the sanitizers: asan, tsan
#
# Studies and benchmarks (hapticd_study, hapticd_bench) are separate: bash deploy/build.sh measure. So are the
# identifications that an emulated person does live, some minutes in all: bash deploy/run_tests.sh release -L live.
# A test that fails while others run next to it is run once more by itself, and named in the last line: on a busy machine
# one that runs in wall-clock time may get too little of it. A test that fails twice has failed; so has a run in which more
# than two tests passed only by themselves.
#
# HAPTICD_RECORDINGS may name a folder with real recordings; the tests that need them skip without it, and say so.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

preset=${1:-release}
bash deploy/install_packages.sh
[[ $preset != asan ]] || bash deploy/install_packages.sh fuzz  # clang
# From the beginning it takes least time if many files are compiled as one; what is there keeps its number.
[[ -e build/$preset/CMakeCache.txt ]] || export HAPTICD_FILES_AT_ONCE=${HAPTICD_FILES_AT_ONCE:-12}
bash deploy/build.sh "$preset"
bash deploy/run_tests.sh "$preset" -LE live
