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
fail() {
  echo "installed_package.sh: $*" >&2
  exit 1
}

cmake --install "$build" --prefix "$work/usr" >"$work/install.log" || { cat "$work/install.log" >&2; exit 1; }
# Only what was installed: a copy of the examples, far from the sources.
cp -r "$work"/usr/share/doc/*/examples/cpp "$work/examples"
# Neither optimised nor with what a debugger needs: that takes time, and finds nothing more.
cmake -S "$work/examples" -B "$work/build" -DCMAKE_PREFIX_PATH="$work/usr" -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG=-O0 \
  >"$work/configure.log" 2>&1 || { cat "$work/configure.log" >&2; exit 1; }
cmake --build "$work/build" --parallel "$(nproc)"

# What is no target: the contract, completion, and files to start from.
share=$work/usr/share
for file in hapticd/proto/hapticd/v1/telemetry.proto hapticd/proto/google/rpc/status.proto \
  doc/hapticd/examples/scenes/tap_1d.toml doc/hapticd/examples/models/sponge_cut.toml \
  doc/hapticd/examples/turntable_maps/plain_drive.toml doc/hapticd/docs/tutorial_client.md doc/hapticd/LICENSE; do
  [[ -s $share/$file ]] || fail "not installed: share/$file"
done
for program in "$work"/usr/bin/*; do
  page=$share/man/man1/$(basename "$program").1
  [[ -s $page ]] || fail "$(basename "$program") has no manual page"
  grep -q -- '-help' "$page" || fail "$page does not have the options"
done
# The Python client, and the command that needs it: found from the prefix, by a user who has set nothing.
check_experiment() { env -u PYTHONPATH "$work/usr/bin/hapticctl" experiment "$@"; }
check_experiment --help >/dev/null
check_experiment simulate stiffness_1d --help >"$work/help" || fail "hapticctl experiment does not find the Python client"
grep -q -- --participants "$work/help" || fail "hapticctl experiment does not hand over"
bash -n "$share/bash-completion/completions/hapticctl"
"$work/usr/bin/hapticd" --config "$share/doc/hapticd/examples/hapticd.toml" --check-config >/dev/null
# Headers that are internal to the library stay inside.
internal=$(find "$work/usr/include" -name '*_state.h' -o -name server_stream.h)
[[ -z $internal ]] || fail "installed, but internal: $internal"

# Where no daemon is, a program says so and fails.
for program in first_client automated_rig; do
  if "$work/build/$program" "unix:$work/no.sock" 2>"$work/errors"; then fail "$program succeeds without a daemon"; fi
  grep -q "no daemon answers" "$work/errors" || fail "$program does not say that no daemon answers"
done

address=unix:$work/hapticd.sock
printf '[rig.sim]\nspeed = 2\n' >"$work/rig.toml"
"$work/usr/bin/hapticd" --config "$work/rig.toml" --rig sim --listen 127.0.0.1:0 --unix "$work/hapticd.sock" --model-store :memory: \
  --log-level error &
daemon=$!
for _ in {1..200}; do
  [[ -S $work/hapticd.sock ]] && break
  sleep 0.05
done
"$work/usr/bin/hapticctl" --server "$address" status >/dev/null
"$work/build/record_telemetry" "$address" "$work/run.csv" &  # ten seconds, in which the others press
recording=$!
"$work/build/first_client" "$address"
"$work/build/automated_rig" "$address"
wait "$recording"
test "$(wc -l <"$work/run.csv")" -gt 1000
PYTHONPATH=$work/usr/lib/python3/dist-packages /usr/bin/python3 "$share/doc/hapticd/examples/python/lab_control.py" "$address" 0.5 \
  >/dev/null || fail "the Python client does not work as it is installed"
if "$work/build/record_telemetry" "$address" "$work/no_folder/run.csv" 2>/dev/null; then fail "wrote into no folder"; fi
