#!/usr/bin/env bash
# The official MCAP reader (npm: @mcap/core) reads what the daemon records, finishes and repairs. Exit status 77 where
# node, npm or the packages are not to be had.
#
#   official_reader.sh FOLDER_OF_PROGRAMS FOLDER_FOR_PACKAGES
set -euo pipefail
bin=$1
packages=$2
here=$(cd "$(dirname "$0")" && pwd)

source "$here/../../support/npm_packages.sh"
npm_packages "$packages" @mcap/core@2 fzstd@0.1 protobufjs@7

work=$(mktemp -d)
daemon=
end() {
  [[ -z "$daemon" ]] || kill -9 "$daemon" 2>/dev/null || true
  rm -rf "$work"
}
trap end EXIT
cat >"$work/hapticd.toml" <<TOML
[loop]
fifo_priority = 0
lock_memory = false
keep_cpu_awake = false
[network]
listen = "127.0.0.1:0"
unix_socket = "$work/socket"
[recording]
folder = "$work/state"
keep_free_mb = 0.0
TOML
start() {
  "$bin/hapticd" --config "$work/hapticd.toml" --model-store :memory: --scene tap_1d --log-level error >"$work/out" &
  daemon=$!
  for _ in $(seq 100); do
    "$bin/hapticctl" --server "unix:$work/socket" status >/dev/null 2>&1 && return
    sleep 0.1
  done
  echo "official_reader.sh: the daemon does not answer" >&2
  exit 1
}
ctl() { "$bin/hapticctl" --server "unix:$work/socket" "$@" >/dev/null; }

start
ctl record start finished --note "größer"
ctl sim hand press --force 2
sleep 1.5
ctl record annotate "a note"
ctl stop
ctl record stop
ctl record start killed
sleep 2.7  # an incident is whole 2 s after its cause
kill -9 "$daemon"
wait "$daemon" 2>/dev/null || true
start
kill "$daemon"
wait "$daemon" || true
daemon=

mapfile -t files < <(find "$work/state" -name '*.mcap' | sort)
(( ${#files[@]} >= 4 )) || { echo "official_reader.sh: only ${#files[@]} files: ${files[*]}" >&2; exit 1; }
node "$here/official_reader.mjs" "$packages" "${files[@]}"
