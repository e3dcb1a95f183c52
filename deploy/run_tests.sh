#!/usr/bin/env bash
# Runs the tests of a built preset, two at a time; those that fail once more, one at a time.
#
#   bash deploy/run_tests.sh PRESET [CTEST_OPTION ...]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

preset=$1
shift
if ! ctest --preset "$preset" -j2 "$@"; then
  echo "run_tests.sh: failed tests are run once more, one at a time" >&2
  exec ctest --preset "$preset" --rerun-failed
fi
