#!/usr/bin/env bash
# Searches for inputs that break a parser, from the corpus on. What it finds stays in build/fuzz/findings.
#
#   bash tests/fuzz/run.sh SECONDS [NAME ...]     so long for each, as many at a time as there are processors; no name = all
#
# rpc_calls is no parser: it calls every method of the running service (release build), from a seed that it prints.
# With HAPTICD_SEED set, each search begins with that seed: the same inputs in each run, as far as the time allows.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

seconds=${1:?how many seconds for each}
shift
bash deploy/install_packages.sh build libraries fuzz
bash deploy/build.sh asan fuzz
names=("$@")
((${#names[@]})) || for source in tests/fuzz/corpus/*/; do names+=("$(basename "$source")"); done

mkdir -p build/fuzz/findings
broken=0
if [[ -n ${HAPTICD_SEED:-} ]]; then rm -rf build/fuzz/corpus; fi
# search_calls: calls of a new seed each, until the time is over.
search_calls() {
  local program=build/release/bin/fuzz_rpc_calls until=$((SECONDS + seconds))
  local seed=${HAPTICD_SEED:-$((RANDOM * 32768 + RANDOM))}
  [[ -x $program ]] || bash deploy/build.sh release fuzz_rpc_calls
  while ((SECONDS < until)); do
    if ! "$program" 2000 "$seed" >build/fuzz/rpc_calls.log 2>&1; then
      tail -40 build/fuzz/rpc_calls.log >&2
      echo "fuzz: rpc_calls broke; again: $program 2000 $seed" >&2
      return 1
    fi
    tail -1 build/fuzz/rpc_calls.log
    seed=$((seed + 1))
  done
}
if [[ " ${names[*]} " == *" rpc_calls "* ]] || { (($# == 0)) && [[ -x build/release/bin/fuzz_rpc_calls ]]; }; then
  search_calls || broken=1
  names=("${names[@]/rpc_calls/}")
fi
# search_inputs NAME: of one parser.
search_inputs() {
  local name=$1 grown=build/fuzz/corpus/$1 log=build/fuzz/$1.log words=(-seed="${HAPTICD_SEED:-0}")
  mkdir -p "$grown"
  case $name in
    configuration | scene_file | model_file | turntable_map) words+=(-dict=tests/fuzz/dictionaries/toml.dict) ;;
    model_json | stored_calibration) words+=(-dict=tests/fuzz/dictionaries/json.dict) ;;
    netft_configuration | cal_file) words+=(-dict=tests/fuzz/dictionaries/xml.dict) ;;
  esac
  if ! "build/asan/bin/fuzz_$name" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=2048 -print_final_stats=1 \
    "${words[@]}" -artifact_prefix="build/fuzz/findings/$name-" "$grown" "tests/fuzz/corpus/$name" >"$log" 2>&1; then
    tail -40 "$log" >&2
    echo "fuzz: $name broke; the input is in build/fuzz/findings" >&2
    return 1
  fi
  echo "fuzz: $name: $(sed -n 's/^stat::number_of_executed_units: *//p' "$log") inputs in $seconds s, none broke it"
}
export -f search_inputs
export seconds
printf '%s\n' "${names[@]}" | sed '/^$/d' | xargs -r -n 1 -P "$(nproc)" bash -c 'search_inputs "$0"' || broken=1
exit $broken
