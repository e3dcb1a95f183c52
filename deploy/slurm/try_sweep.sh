#!/usr/bin/env bash
# Tries the report's sweep as a Slurm job array on this one machine: a controller and two nodes, one of which is killed
# while it computes. What is merged must be byte for byte what one process computes.
#
#   bash deploy/slurm/try_sweep.sh [OUT]     into OUT (default build/slurm)
#
# As root. Needs bash deploy/install_packages.sh slurm, and hapticd_study (bash deploy/build.sh measure).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
. deploy/slurm/cluster.sh

out=${1:-build/slurm}
study=$PWD/build/release/bin/hapticd_study
readonly parts=(maps inclusions sensitivity extremes) shards=6
need_slurm
[[ -x $study ]] || { echo "$script: there is no $study; bash deploy/build.sh measure" >&2; exit 2; }

rm -rf "$out"
mkdir -p "$out"
out=$(cd "$out" && pwd)
start_cluster
second_node=${node_pids[1]}

options="--quick --only ${parts[*]}"
"$study" report --out "$out/whole" --quick --only "${parts[@]}" >"$out/whole.log" 2>&1

export out study options
job=$(sbatch --parsable --requeue --cpus-per-task=1 --array=1-$shards --output="$out/job_%a.log" --export=ALL \
  deploy/slurm/report_sweep.sbatch)
runs_on_two() { squeue --noheader --states=running --nodelist=two --jobs="$job" | grep -q .; }
wait_for 60 "a job on the second node" runs_on_two
sleep 0.3
# All of it at once, as a machine ends: the node's daemon, the keeper of its job, the job.
read -r id task < <(squeue --noheader --nodelist=two --states=running --jobs="$job" --format="%A %K")
kill -9 "$second_node"
pkill -9 -f "^slurmstepd: \\[$id\\." || true
pkill -9 -f "report --out $out/shard-$task " || true
echo "$script: the second node was killed while it computed shard $task"
wait_for 300 "the array" done_with "$job"
merge=$(sbatch --parsable --cpus-per-task=1 --output="$out/merge.log" --export=ALL,shards=$shards \
  deploy/slurm/report_sweep.sbatch)
wait_for 120 "the merging job" done_with "$merge"

[[ -d $out/merged ]] || { cat "$out/merge.log" >&2; echo "$script: nothing was merged" >&2; exit 1; }
# The page says when and where it was made.
if ! diff -r --brief --exclude=report.html --exclude=provenance.json "$out/whole" "$out/merged"; then
  echo "$script: what was merged is not what one process computes" >&2
  exit 1
fi
echo "$script: $shards shards on two nodes, one killed: $(find "$out/merged" -type f | wc -l) files, byte for byte the same"
