#!/usr/bin/env bash
# Installs into an empty folder, builds the examples against what is there and runs them with the installed daemon.
#
#   bash tests/integration/package/installed_package.sh BUILD_FOLDER
set -euo pipefail

build=$1
work=$(mktemp -d)
daemon=
cleanup() {
  [[ -z $daemon ]] || { kill "$daemon" 2>/dev/null && wait "$daemon"; } || true
  rm -rf "$work"
}
trap cleanup EXIT

cmake --install "$build" --prefix "$work/usr" >"$work/install.log" || { cat "$work/install.log" >&2; exit 1; }
# Only what was installed: a copy of the examples, far from the sources.
cp -r "$work"/usr/share/doc/*/examples/cpp "$work/examples"
cmake -S "$work/examples" -B "$work/build" -DCMAKE_PREFIX_PATH="$work/usr" -DCMAKE_BUILD_TYPE=Debug >"$work/configure.log" 2>&1 ||
  { cat "$work/configure.log" >&2; exit 1; }
cmake --build "$work/build"

address=unix:$work/hapticd.sock
"$work/usr/bin/hapticd" --rig sim --listen 127.0.0.1:0 --unix "$work/hapticd.sock" --model-store :memory: \
  --log-level error &
daemon=$!
for _ in {1..200}; do
  [[ -S $work/hapticd.sock ]] && break
  sleep 0.05
done
"$work/usr/bin/hapticctl" --server "$address" status >/dev/null
"$work/build/first_client" "$address"
"$work/build/automated_rig" "$address"
"$work/build/record_telemetry" "$address" "$work/run.csv"
test "$(wc -l <"$work/run.csv")" -gt 1000
