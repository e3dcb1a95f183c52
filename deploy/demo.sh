#!/usr/bin/env bash
# hapticd from nothing to a sponge that feels softer and harder than it is: installs what is missing, builds, starts the
# daemon on the simulated rig, and runs the client session (hapticctl demo). Needs Debian 12, and root or sudo where
# packages are missing. Runs without a terminal, too.
#
#   bash deploy/demo.sh [--out DIR] [--keep]
#
#   --out DIR   where recording, plot and results go (default: out/demo)
#   --keep      leave the daemon running at the end
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

out=out/demo
keep=false
while (($#)); do
  case "$1" in
    --out) out=${2:?"--out needs a folder"}; shift 2 ;;
    --keep) keep=true; shift ;;
    -h | --help) sed -n '2,/^set /{/^#/s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}"; exit 0 ;;
    *) echo "demo.sh: unknown option '$1' (see --help)" >&2; exit 2 ;;
  esac
done

# step TEXT COMMAND...: says what is done, and how long it took.
step() {
  local text=$1 from=$SECONDS
  shift
  echo "== $text"
  "$@"
  echo "== done in $((SECONDS - from)) s"
}
cat <<TXT
This installs the packages that are missing, builds the daemon and what presses (some minutes on two cores the first
time, seconds after that), starts the daemon on a simulated rig and lets a simulated hand press a sponge at several target
stiffnesses (about half a minute). Then it builds what you go on with: the command line, and the page of the rig for your
browser (about a minute and a half).
TXT
step "1 of 4: packages" bash "$here/deploy/install_packages.sh" build libraries run
step "2 of 4: build" bash "$here/deploy/build.sh" release hapticd hapticd_demo
echo "== 3 of 4: a sponge at several target stiffnesses"
cd "$here"
bin=build/release/bin

# The daemon runs in a folder of its own and listens on a free port.
work=$(mktemp -d)
daemon=
stop_daemon() {
  local running=$daemon
  daemon=
  [[ -n $running ]] || return 0
  kill -TERM "$running" 2>/dev/null || true
  wait "$running"
}
clean_up() {
  stop_daemon || true
  rm -rf "$work"
}
trap clean_up EXIT

# nohup: with --keep it outlives this terminal.
nohup "$bin/hapticd" --rig sim:phantom_1_0 --listen 127.0.0.1:0 </dev/null >"$work/address" 2>"$work/log" &
daemon=$!
address=
for _ in {1..150}; do
  address=$(sed -n 's/^hapticd listens on //p' "$work/address")
  [[ -z $address ]] || break
  kill -0 "$daemon" 2>/dev/null || break
  sleep 0.1
done
if [[ -z $address ]]; then
  cat "$work/log" >&2
  echo "demo.sh: hapticd did not start; its log is above" >&2
  exit 1
fi
echo "hapticd runs on $address"

status=0
"$bin/hapticd_demo" --server "$address" demo --out "$out" || status=$?
if ((status != 0)); then
  echo "demo.sh: the client session ended with status $status; the daemon's log:" >&2
  tail -n 20 "$work/log" >&2
  exit "$status"
fi

step "4 of 4: command line and page" bash "$here/deploy/build.sh" release hapticctl hapticd_console

echo
if $keep; then
  trap - EXIT
  echo "The daemon keeps running (process $daemon, log $work/log). Connect by hand:"
  echo "  $bin/hapticctl --server $address status"
  echo "  $bin/hapticctl --server $address console        # the rig in your browser"
  echo "End it with: kill $daemon"
  exit 0
fi
if ! stop_daemon; then
  tail -n 20 "$work/log" >&2
  echo "demo.sh: hapticd did not end cleanly; its log is above" >&2
  exit 1
fi
echo "To go on by hand, in three terminals:"
echo "  $bin/hapticd --rig sim:phantom_1_0"
echo "  $bin/hapticctl telemetry watch        # and in a third: hapticctl scene load tap_1d, sim hand press, target set 0.3"
echo "  $bin/hapticctl console                # the rig in your browser"
