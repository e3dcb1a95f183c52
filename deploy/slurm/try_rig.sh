#!/usr/bin/env bash
# Tries rigs as a Slurm resource on this one machine: two nodes with a simulated rig each. Each job gets a rig of its own
# and its lease, commands without it are refused, the lease is returned when the job ends or is cancelled, and a rig that
# someone holds outside Slurm is given to no job.
#
#   bash deploy/slurm/try_rig.sh
#
# As root. Needs bash deploy/install_packages.sh slurm, and hapticd and hapticctl (bash deploy/build.sh release).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
. deploy/slurm/cluster.sh
need_slurm
bin=$PWD/build/release/bin
[[ -x $bin/hapticd && -x $bin/hapticctl ]] || { echo "$script: no hapticd in $bin; bash deploy/build.sh release" >&2; exit 2; }
fail() {
  echo "$script: $*" >&2
  tail -n 20 "$work"/*.log >&2 || true
  exit 1
}

scripts=$PWD/deploy/slurm
here=$(hostname -s)
chmod 711 "$work"
for node in one two; do
  printf '[access]\nlease = "required"\n' >"$work/$node.toml"
  "$bin/hapticd" --rig sim --scene tap_1d --listen 127.0.0.1:0 --model-store :memory: --config "$work/$node.toml" \
    >"$work/rig_$node.log" 2>&1 &
  keep
  wait_for 20 "the rig of node $node" grep -q "listens on" "$work/rig_$node.log"
  server=$(sed -n 's/.*listens on \([0-9.:]*\).*/\1/p' "$work/rig_$node.log" | head -n 1)
  declare "server_$node=$server"
  # What a node's own /etc/hapticd/slurm.env says; here one file serves both.
  echo "[[ \$SLURMD_NODENAME != $node ]] || HAPTICD_SERVER=$server" >>"$work/slurm.env"
done
# The rig's programs as they are called where hapticd is installed; the scripts know this folder only.
for name in prolog task_prolog epilog; do
  cat >"$work/$name.sh" <<RUN
#!/bin/bash
export HAPTICD_SLURM_SETTINGS=$work/slurm.env HAPTICD_SLURM_FOLDER=$work/jobs HAPTICCTL=$bin/hapticctl
exec bash $scripts/$name.sh
RUN
  chmod 755 "$work/$name.sh"
done
start_cluster "GresTypes=rig
Prolog=%W/prolog.sh
TaskProlog=%W/task_prolog.sh
Epilog=%W/epilog.sh
PrologFlags=Alloc
NodeName=one NodeHostname=$here NodeAddr=127.0.0.1 Port=17701 CPUs=2 Gres=rig:1
NodeName=two NodeHostname=$here NodeAddr=127.0.0.1 Port=17702 CPUs=2 Gres=rig:1
PartitionName=rig Nodes=one,two MaxTime=INFINITE State=UP" "Name=rig Count=1"

submit() {  # NAME COMMAND: a job that asks for a rig; prints its number
  local name=$1
  shift
  sbatch --parsable --partition=rig --gres=rig:1 --job-name="$name" --output="$work/job_$name.log" \
    --export=NONE --wrap "$*"
}
ctl=$bin/hapticctl
purpose_of() { "$ctl" --server "$1" --json lease get | sed -n 's/.*"purpose" *: *"\([^"]*\)".*/\1/p'; }

# Two jobs at once: a rig each, and each commands its own.
first=$(submit first "$ctl lease get && $ctl target set 0.4 && sleep 6")
second=$(submit second "$ctl target set 0.5 && sleep 6")
third=$(submit third "$ctl target set 0.6")
both_run() { [[ $(squeue --noheader --states=running --partition=rig | wc -l) == 2 ]]; }
wait_for 30 "two jobs on two rigs" both_run
sleep 2
held="$(purpose_of "$server_one"); $(purpose_of "$server_two")"
[[ $held == *"job $first of"* && $held == *"job $second of"* ]] || fail "not both jobs hold a rig: $held"
squeue --noheader --jobs="$third" --format=%T | grep -q PENDING || fail "the third job does not wait for a rig"
# Another command, of no job, while a job holds the rig.
if "$ctl" --server "$server_one" target set 0.9 >"$work/stranger.log" 2>&1; then
  fail "a command without the lease was accepted"
fi
grep -q "lease" "$work/stranger.log" || fail "the refusal does not name the lease: $(cat "$work/stranger.log")"
echo "$script: two jobs, a rig and its lease each; without it: $(head -n 1 "$work/stranger.log")"
wait_for 60 "the first two jobs" done_with "$first,$second"
wait_for 60 "the third job" done_with "$third"
for name in first second third; do
  grep -qi "refused\|error" "$work/job_$name.log" && fail "job $name: $(cat "$work/job_$name.log")"
done
both_free() { [[ -z $(purpose_of "$server_one") && -z $(purpose_of "$server_two") ]]; }
wait_for 20 "the leases to be returned" both_free
echo "$script: the third job waited, ran, and all leases were returned"

# A job that is cancelled returns its lease, too.
cancelled=$(submit cancelled "sleep 300")
someone_holds() { [[ -n $(purpose_of "$server_one")$(purpose_of "$server_two") ]]; }
wait_for 30 "the lease of a job to be cancelled" someone_holds
scancel "$cancelled"
wait_for 30 "the lease of the cancelled job" both_free
echo "$script: a cancelled job returned its lease"

# Someone at the rig itself: no job gets it, and Slurm says why.
"$ctl" --server "$server_one" lease hold --purpose "by hand" -- sleep 300 2>/dev/null &
keep
"$ctl" --server "$server_two" lease hold --purpose "by hand" -- sleep 300 2>/dev/null &
keep
both_by_hand() { [[ "$(purpose_of "$server_one")$(purpose_of "$server_two")" == "by handby hand" ]]; }
wait_for 10 "both rigs in someone's hand" both_by_hand
refused=$(submit refused "echo it ran")
drained() { sinfo --noheader --format=%T | grep -q drain; }
wait_for 60 "the node without its rig to be drained" drained
[[ ! -s $work/job_refused.log ]] || fail "a job ran on a rig that someone else held"
scancel "$refused"
[[ "$(purpose_of "$server_one")$(purpose_of "$server_two")" == "by handby hand" ]] || fail "someone lost the rig to Slurm"
echo "$script: a rig that is held outside Slurm was given to no job; the node is drained: $(sinfo --noheader --states=drain --format=%E | head -n 1)"
