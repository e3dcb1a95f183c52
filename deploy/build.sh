#!/usr/bin/env bash
# Configures and builds one preset.
#
#   bash deploy/build.sh PRESET [TARGET ...]     no target = all
#
# HAPTICD_FILES_AT_ONCE sets how many files are compiled as one, in place of the preset's number.
#
# A terminal shows the build's progress; without one a line every 30 s says how far it is and how long it will take.
# What the compiler says is shown if the build fails.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

preset=${1:?"which preset (cmake --list-presets)"}
shift
targets=()
(($# == 0)) || targets=(--target "$@")

log=$(mktemp)
progress=
clean_up() {
  [[ -z $progress ]] || kill "$progress" 2>/dev/null || true
  rm -f "$log"
}
trap clean_up EXIT
quietly() {
  "$@" >"$log" 2>&1 && return
  cat "$log" >&2
  echo "build.sh: failed: $*" >&2
  exit 1
}

# Ninja writes [done/all] before each step.
show_progress() {
  local step done all
  while sleep 30; do
    step=$(grep -o '^\[[0-9]*/[0-9]*\]' "$log" | tail -n 1) || continue
    IFS=/ read -r done all <<<"${step//[\[\]]/}"
    ((0 < done && done < all)) || continue
    echo "... $done of $all after $SECONDS s, about $(((all - done) * SECONDS / done)) s to go"
  done
}

echo "Building ($preset) ..."
at_once=${HAPTICD_FILES_AT_ONCE:-}
quietly cmake --preset "$preset" ${at_once:+"-DHAPTICD_FILES_AT_ONCE=$at_once"}
if [[ -t 1 ]]; then
  cmake --build --preset "$preset" "${targets[@]}"
else
  SECONDS=0
  show_progress &
  progress=$!
  quietly cmake --build --preset "$preset" "${targets[@]}"
fi
