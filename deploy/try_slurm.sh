#!/usr/bin/env bash
# Tries the report's sweep as a Slurm job array on this one machine: a controller and two nodes, one of which is killed
# while it computes. What is merged must be byte for byte what one process computes.
#
#   bash deploy/try_slurm.sh [OUT]     into OUT (default build/slurm)
#
# As root. Needs bash deploy/install_packages.sh slurm, and hapticd_study (bash deploy/build.sh release measure).
# Everything runs in a folder of its own and ends with the script; nothing of the machine's own Slurm is touched.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

out=${1:-build/slurm}
study=$PWD/build/release/bin/hapticd_study
readonly parts=(maps inclusions sensitivity wood extremes) shards=6
((EUID == 0)) || { echo "try_slurm.sh: not root; remedy: sudo bash deploy/try_slurm.sh" >&2; exit 2; }
for program in munged slurmctld slurmd sbatch squeue; do
  command -v "$program" >/dev/null ||
    { echo "try_slurm.sh: there is no $program; bash deploy/install_packages.sh slurm" >&2; exit 2; }
done
[[ -x $study ]] || { echo "try_slurm.sh: there is no $study; bash deploy/build.sh release measure" >&2; exit 2; }

rm -rf "$out"
mkdir -p "$out"
out=$(cd "$out" && pwd)
work=$(mktemp -d)
chmod 755 "$work"
started=()
finish() {
  for pid in "${started[@]}"; do kill -9 "$pid" 2>/dev/null || true; done
  pkill -9 -f "slurmstepd.*$work" 2>/dev/null || true
  rm -rf "$work"
}
trap finish EXIT
keep() {
  started+=("$!")
  disown
}
wait_for() {  # SECONDS WHAT COMMAND...: until it succeeds
  local seconds=$1 what=$2
  shift 2
  for ((i = 0; i < 5 * seconds; ++i)); do
    "$@" >/dev/null 2>&1 && return
    sleep 0.2
  done
  echo "try_slurm.sh: waited in vain for $what; logs were in $work" >&2
  tail -n 20 "$work"/*.log >&2
  exit 1
}

# Who is who: munge, with a key and a socket of its own.
mkdir -m 755 "$work/munge"
head -c 128 /dev/urandom >"$work/munge/key"
chmod 600 "$work/munge/key"
munged --foreground --force --key-file="$work/munge/key" --socket="$work/munge/socket" \
  --pid-file="$work/munge/pid" --log-file="$work/munge/munged.log" --seed-file="$work/munge/seed" 2>/dev/null &
keep

mkdir -p "$work"/{state,spool1,spool2}
cat >"$work/slurm.conf" <<CONF
ClusterName=try
SlurmctldHost=$(hostname -s)(127.0.0.1)
AuthType=auth/munge
AuthInfo=socket=$work/munge/socket
CredType=cred/munge
MpiDefault=none
SlurmUser=root
SlurmctldPort=17700
SlurmctldPidFile=$work/slurmctld.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdPidFile=$work/slurmd_%n.pid
SlurmdLogFile=$work/slurmd_%n.log
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool_%n
SlurmdTimeout=10
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
JobRequeue=1
ReturnToService=2
NodeName=one NodeHostname=$(hostname -s) NodeAddr=127.0.0.1 Port=17701 CPUs=1
NodeName=two NodeHostname=$(hostname -s) NodeAddr=127.0.0.1 Port=17702 CPUs=1
PartitionName=lab Nodes=one,two Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF=$work/slurm.conf
wait_for 10 "munge" munge --socket="$work/munge/socket" -n
slurmctld -D -f "$SLURM_CONF" 2>/dev/null &
keep
for node in one two; do
  slurmd -D -f "$SLURM_CONF" -N "$node" 2>/dev/null &
  keep
done
second_node=${started[-1]}
both_idle() { [[ $(sinfo --noheader --states=idle --format=%D) == 2 ]]; }
wait_for 30 "two idle nodes" both_idle

options="--quick --only ${parts[*]}"
"$study" report --out "$out/whole" --quick --only "${parts[@]}" >"$out/whole.log" 2>&1

export out study options
job=$(sbatch --parsable --requeue --cpus-per-task=1 --array=1-$shards --output="$out/job_%a.log" --export=ALL \
  deploy/report_sweep.sbatch)
runs_on_two() { squeue --noheader --states=running --nodelist=two --jobs="$job" | grep -q .; }
wait_for 60 "a job on the second node" runs_on_two
sleep 0.3
# All of it at once, as a machine ends: the node's daemon, the keeper of its job, the job.
read -r id task < <(squeue --noheader --nodelist=two --states=running --jobs="$job" --format="%A %K")
kill -9 "$second_node"
pkill -9 -f "^slurmstepd: \\[$id\\." || true
pkill -9 -f "report --out $out/shard-$task " || true
echo "try_slurm.sh: the second node was killed while it computed shard $task"
done_with() { ! squeue --noheader --jobs="$1" | grep -q .; }
wait_for 300 "the array" done_with "$job"
merge=$(sbatch --parsable --cpus-per-task=1 --output="$out/merge.log" --export=ALL,shards=$shards \
  deploy/report_sweep.sbatch)
wait_for 120 "the merging job" done_with "$merge"

[[ -d $out/merged ]] || { cat "$out/merge.log" >&2; echo "try_slurm.sh: nothing was merged" >&2; exit 1; }
# The page says when and where it was made.
if ! diff -r --brief --exclude=report.html --exclude=provenance.json "$out/whole" "$out/merged"; then
  echo "try_slurm.sh: what was merged is not what one process computes" >&2
  exit 1
fi
echo "try_slurm.sh: $shards shards on two nodes, one killed: $(find "$out/merged" -type f | wc -l) files, byte for byte the same"
