#!/usr/bin/env bash
# Measures again every number that README.md, docs/ and hal/sim/README.md print with a mark, and compares the texts.
#
#   bash deploy/figures.sh [--quick] OUT
#
# Builds and runs every study and benchmark (half an hour and more on two cores; --quick: fewer cases, a quarter of
# an hour), collects OUT/RUN/figures.jsonl as OUT/figures.jsonl with the run's name in each record, and calls
# deploy/check_figures.py, whose status it ends with. A run that fails twice ends the script. OUT/times.txt
# says what each run took; OUT/RUN.log is what it printed.
#
# HAPTICD_RECORDINGS names the folder of real recordings; without it their figures are missing, and reported as such.
# Not included: tests/measure/study/trust/live.sh, which needs a rig of its own for half an hour.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

quick=()
out=
for argument in "$@"; do
  case "$argument" in
    --quick) quick=(--quick) ;;
    -h | --help) sed -n '2,/^set /{/^#/s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}"; exit 0 ;;
    -*) echo "figures.sh: unknown option '$argument' (see --help)" >&2; exit 2 ;;
    *) out=$argument ;;
  esac
done
[[ $out == /* || -z $out ]] || out=$OLDPWD/$out
[[ -n $out ]] || { echo "figures.sh: it needs a folder for what is measured (see --help)" >&2; exit 2; }
check=("${quick[@]}")
if [[ -z "${HAPTICD_RECORDINGS:-}" ]]; then
  check+=(--without-recordings)
  echo "figures.sh: HAPTICD_RECORDINGS is not set: nothing is measured on real recordings" >&2
fi

bash deploy/build.sh measure hapticd_study hapticd_bench
readonly bin=build/release/bin
mkdir -p "$out"
rm -f "$out/times.txt" "$out/figures.jsonl" "$out"/*/figures.jsonl

# measure RUN PROGRAM COMMAND OPTION...: into OUT/RUN, from nothing; once more where a busy machine disturbed it.
measure() {
  once "$@" || { echo "figures.sh: $1 is run once more" >&2; once "$@"; } || exit 1
}
once() {
  local run=$1 program=$2 status=0
  shift 2
  rm -rf "${out:?}/$run"
  local TIMEFORMAT="$run: %R s, of the processors %U + %S s"
  { time "$bin/$program" "$@" --out "$out/$run" >"$out/$run.log" 2>&1; } 2>>"$out/times.txt" || status=$?
  ((status == 0)) && return
  tail -n 30 "$out/$run.log" >&2
  echo "figures.sh: failed: $program $*" >&2
  return "$status"
}

# studies NAME...: one after the other.
studies() {
  local study
  for study; do
    measure "$study" hapticd_study "$study" "${quick[@]}"
  done
}
# in_background COMMAND...: runs it while the script goes on; wait_for_background waits for it.
in_background() {
  "$@" &
  background=$!
  trap wait EXIT
}
wait_for_background() {
  wait "$background"
  trap - EXIT
}
# In virtual time, and all but `trust` on one core each: two rows next to one another, about as long as each other.
in_background studies identify trust friction tumour
studies rig explore loading onset transients stability uncertainty
wait_for_background
# These are live and mostly wait. A quick run has two of them at a time: no text is held to its times.
mostly_waiting() {
  measure recording hapticd_bench recording "${quick[@]}"
  studies registration faults
  measure decode hapticd_bench decode "${quick[@]}"
  measure console hapticd_bench console "${quick[@]}"
}
if ((${#quick[@]})); then
  in_background measure experiments hapticd_study experiments --quick
  mostly_waiting
  wait_for_background
else
  studies experiments
  mostly_waiting
fi
# These measure run times or use every core; the report runs `scenes` and `realtime` of the benchmarks.
studies report
if ((${#quick[@]})); then
  measure tick hapticd_bench tick --seconds 0.5 --hours 0.05
  measure netft hapticd_bench netft --seconds 3
else
  measure tick hapticd_bench tick
  measure netft hapticd_bench netft --seconds 15
  measure rig_transport hapticd_study rig --transport emulated
  measure identify_transport hapticd_study identify --transport emulated
fi
measure onset_transport hapticd_study onset --transport emulated "${quick[@]}"
measure attack hapticd_bench attack "${quick[@]}"

for folder in "$out"/*/; do
  run=$(basename "$folder")
  sed "s/^{/{\"run\":\"$run\",/" "$folder/figures.jsonl"
done >"$out/figures.jsonl"
cat "$out/times.txt"
echo "figures: $out/figures.jsonl"
python3 deploy/check_figures.py --figures "$out/figures.jsonl" "${check[@]}"
