#!/usr/bin/env bash
# Configures and builds one preset.
#
#   bash deploy/build.sh PRESET [TARGET ...]     no target = all
#
# On a terminal the build shows its progress; elsewhere only a failure is shown.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

preset=$1
shift
targets=()
(($# == 0)) || targets=(--target "$@")

log=$(mktemp)
trap 'rm -f "$log"' EXIT
quietly() {
  "$@" >"$log" 2>&1 && return
  cat "$log" >&2
  echo "build.sh: failed: $*" >&2
  exit 1
}

echo "Building ($preset; the first time takes some minutes) ..."
quietly cmake --preset "$preset"
if [[ -t 1 ]]; then
  cmake --build --preset "$preset" "${targets[@]}"
else
  quietly cmake --build --preset "$preset" "${targets[@]}"
fi
