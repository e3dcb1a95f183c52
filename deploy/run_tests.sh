#!/usr/bin/env bash
# Runs the tests of a built preset, two for each core, since most of them wait; those that fail once more, one at a time.
#
#   bash deploy/run_tests.sh PRESET [CTEST_OPTION ...]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

preset=$1
shift
if ! ctest --preset "$preset" -j"$((2 * $(nproc)))" "$@"; then
  echo "run_tests.sh: failed tests are run once more, one at a time" >&2
  exec ctest --preset "$preset" --rerun-failed
fi
