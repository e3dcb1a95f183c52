#!/usr/bin/env bash
# Force in free air, live: the daemon on the emulated rig (vendor's library, Net F/T box over UDP and HTTP), in
# wall-clock time, under load. The tool is waved in free air, then presses an object that vanishes again and again,
# with a drifting sensor and a scheduler that is late.
#
#   bash tests/measure/study/trust/live.sh BIN_FOLDER OUT_FOLDER [SECONDS_OF_WAVING] [SECONDS_OF_PRESSING]
#
# Prints the largest force commanded where nothing was touched. `stress-ng` loads the machine where it is installed.
set -euo pipefail

bin=$1
out=$2
waving_s=${3:-600}
pressing_s=${4:-120}
mkdir -p "$out"
# In memory: a page of a file on a busy disk is held for seconds while it is written back, and the scheduler with it.
pages=$(mktemp -d -p "$([[ -w /dev/shm ]] && echo /dev/shm || echo "${TMPDIR:-/tmp}")")
cat >"$out/tap_under_load.toml" <<'TOML'
name = "tap_under_load"
kind = "tap_1d"
[tool]
mass_g = 12.6
[guard]
sensor_stale_after_ms = 5
TOML
cleanup() {
  jobs -pr | xargs -r kill 2>/dev/null || true
  wait 2>/dev/null || true
  rm -rf "$pages"
}
trap cleanup EXIT

# run NAME SECONDS SCENE OPTIONS...: OUT/NAME.csv
run() {
  local name=$1 seconds=$2 scene=$3
  shift 3
  rm -f "$out/$name.toml" "$pages/$name.page"
  "$bin/hapticd_emulated_rig" --write "$out/$name.toml" --page "$pages/$name.page" --drift-n-per-s 0.001 \
    --late-ticks builtin "$@" >"$out/$name.rig.log" 2>&1 &
  local rig=$!
  until [[ -s $out/$name.toml ]]; do sleep 0.1; done
  HD_STAND_IN_PAGE=$pages/$name.page "$bin/hapticd" --config "$out/$name.toml" --listen 127.0.0.1:50177 \
    >"$out/$name.daemon.log" 2>&1 &
  local daemon=$!
  local ctl=("$bin/hapticctl" --server 127.0.0.1:50177)
  until "${ctl[@]}" status >/dev/null 2>&1; do
    kill -0 "$daemon" 2>/dev/null || { cat "$out/$name.daemon.log" >&2; exit 1; }
    sleep 0.2
  done
  # The loaded machine bunches the sensor's records: as much as the daemon's ceiling allows, or nothing is rendered.
  "${ctl[@]}" scene load "$out/$scene.toml" >/dev/null
  "${ctl[@]}" target set 0.7 >/dev/null
  local load=
  if command -v stress-ng >/dev/null; then
    stress-ng --quiet --cpu 2 --io 1 --timeout "$((seconds + 5))s" &
    load=$!
  fi
  # A latch is not what is looked for: whatever cuts the force is cleared, so that it may come back.
  (while sleep 1; do "${ctl[@]}" clear >/dev/null 2>&1 || true; done) &
  local clearer=$!
  "${ctl[@]}" telemetry record "$out/$name.csv" --groups sample,contact,guard,timing,zero --seconds "$seconds" >/dev/null ||
    echo "$name: the recording ended early" >&2
  "${ctl[@]}" status >"$out/$name.status.txt" 2>&1 || true
  kill "$clearer" "$daemon" "$rig" ${load:+"$load"} 2>/dev/null || true
  wait "$clearer" "$daemon" "$rig" ${load:+"$load"} 2>/dev/null || true
}

# report NAME: largest command, ticks above 0.05 and 0.3 N, time in which force was allowed.
report() {
  awk -F, -v name="$1" '
    /^#/ { next }
    !head { for (i = 1; i <= NF; ++i) at[$i] = i; head = 1; next }
    NF > 5 {
      f = sqrt($(at["guard_device_command_x_n"])^2 + $(at["guard_device_command_y_n"])^2 + $(at["guard_device_command_z_n"])^2)
      ++ticks; if (f > max) max = f; if (f > 0.05) ++above; if (f > 0.3) ++high
      if ($(at["guard_authority"]) > 0) ++allowed
      contacts = $(at["contact_count"]); withdrawn = $(at["contact_withdrawn_count"])
    }
    END { printf "%-10s %d ticks, force allowed in %.1f %% of them: largest command %.3f N, above 0.05 N %d ticks, above 0.3 N %d; %d contacts, %d withdrawn\n",
          name, ticks, 100 * allowed / ticks, max, above, high, contacts, withdrawn }' "$out/$1.csv"
}

run waving "$waving_s" tap_under_load --object none --program wave --tool-mass-g 12.6
report waving
run pressing "$pressing_s" tap_under_load --object sponge_block --program press --hold-s 1 --tool-mass-g 12.6 --vanish-every-s 7
report pressing
