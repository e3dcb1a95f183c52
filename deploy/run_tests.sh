#!/usr/bin/env bash
# Runs the tests of a built preset, two for each core, since most of them wait; those that fail once more, one at a time.
#
#   bash deploy/run_tests.sh PRESET [CTEST_OPTION ...]
#
# The last line says how many passed and failed, and names the tests that passed only when they were run again alone.
# A test that fails twice has failed. Exit code 1: a test failed, or too many passed only alone.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# More tests than this that pass only alone are a defect of the tests or of what they test, not a busy machine.
readonly max_passed_alone=2

# failed_in FILE: the names under "The following tests FAILED:" in an output of ctest, one a line, without parameters.
failed_in() {
  sed -n '/^The following tests FAILED:/,$p' "$1" |
    sed -nE 's/^\s*[0-9]+ - (.*) \([^()]*\)( .*)?$/\1/p' | sed -E 's/\s*# GetParam\(\) = .*$//'
}
# tests_in FILE: how many tests ctest ran.
tests_in() {
  sed -nE 's/^[0-9]+% tests passed, [0-9]+ tests failed out of ([0-9]+)$/\1/p' "$1" | tail -1
}
# exactly: a pattern of the names that its input has, one a line. By their numbers (--rerun-failed) other tests would run: ctest
# counts only those that -E and -LE leave.
exactly() {
  echo "^($(sed -E 's/[][\\.*+?()^$|]/\\&/g' | paste -sd'|'))( |\$)"
}
# in_a_row: the lines of its input as "A, B, C".
in_a_row() {
  paste -sd, | sed 's/,/, /g'
}

preset=$1
shift
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

status=0
ctest --preset "$preset" -j"$((2 * $(nproc)))" "$@" | tee "$work/first" || status=$?
all=$(tests_in "$work/first")
failed_in "$work/first" >"$work/failed_once"
if [[ $status == 0 || ! -s $work/failed_once ]]; then
  [[ $status != 0 || -z $all ]] || echo "run_tests.sh: $all passed, 0 failed"
  exit "$status"
fi

echo "run_tests.sh: failed tests are run once more, one at a time" >&2
status=0
ctest --preset "$preset" -R "$(exactly <"$work/failed_once")" -j1 | tee "$work/second" || status=$?
failed_in "$work/second" >"$work/failed_twice"
again=$(tests_in "$work/second")
if [[ -n $again && $again -lt $(wc -l <"$work/failed_once") ]]; then
  echo "run_tests.sh: only $again of the failed tests were found to be run again"
  exit 1
fi
grep -vxFf "$work/failed_twice" "$work/failed_once" >"$work/passed_alone" || true
if [[ $status != 0 && ! -s $work/failed_twice ]]; then  # ctest ended without saying what failed: nothing is known to pass
  exit "$status"
fi

failed=$(wc -l <"$work/failed_twice")
passed_alone=$(wc -l <"$work/passed_alone")
echo "$((100 * (all - failed) / all))% tests passed, $failed tests failed out of $all"
line="run_tests.sh: $((all - failed)) passed, $failed failed"
[[ $failed == 0 ]] || line+=" ($(in_a_row <"$work/failed_twice"))"
[[ $passed_alone == 0 ]] || line+="; $passed_alone passed only when run again alone: $(in_a_row <"$work/passed_alone")"
((passed_alone <= max_passed_alone)) || line+="; more than $max_passed_alone of these are a failure"
echo "$line"
((failed == 0 && passed_alone <= max_passed_alone))
