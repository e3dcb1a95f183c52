#!/usr/bin/env bash
# Runs a program of tests under ThreadSanitizer. Fails if a process of it, also one that it started, reports a race or
# crashes, or if more than a tenth of its cases fail. Single cases may: they expect of a daemon what it does in time, and it
# is many times slower here. The other presets judge them.
#
#   bash races_only.sh COMMAND ...     of GoogleTest, or pytest -rA
set -uo pipefail
shopt -s nullglob

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
export TSAN_OPTIONS="${TSAN_OPTIONS:-} log_path=$folder/report"
"$@" | tee "$folder/output"
status=${PIPESTATUS[0]}

reports=("$folder"/report.*)
if ((${#reports[@]} > 0)); then
  cat "${reports[@]}"
  echo "races_only.sh: ${#reports[@]} processes reported the above" >&2
  exit 1
fi
passed=$(grep -cE '^\[       OK \]|^PASSED ' "$folder/output")
failed=$(grep -cE '^\[  FAILED  \] .* \([0-9]+ ms\)$|^FAILED ' "$folder/output")
((failed == 0)) || echo "races_only.sh: $failed of $((passed + failed)) cases failed without a race; up to a tenth may" >&2
((status < 128 && passed >= 9 * failed && passed > 0)) && ((status == 0 || failed > 0))
