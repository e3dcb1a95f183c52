# A Slurm cluster of this one machine for the scripts that try something on it; sourced by them. Everything runs in a
# folder of its own and ends with the script; nothing of the machine's own Slurm is touched.
#
#   need_slurm               ends the script where something is missing
#   start_cluster [LINES [GRES]]   LINES: further lines of slurm.conf, which may name %W for the folder, $work; GRES:
#                            gres.conf. Nodes "one" and "two", of one core where LINES do not describe them;
#                            node_pids: their processes
#   wait_for SECONDS WHAT COMMAND...   until it succeeds

script=$(basename "$0")

need_slurm() {
  ((EUID == 0)) || { echo "$script: not root; remedy: sudo bash $0" >&2; exit 2; }
  local program
  for program in munged slurmctld slurmd sbatch squeue; do
    command -v "$program" >/dev/null ||
      { echo "$script: there is no $program; bash deploy/install_packages.sh slurm" >&2; exit 2; }
  done
}

started=()
keep() {
  started+=("$!")
  disown
}
finish() {
  for pid in "${started[@]}"; do kill -9 "$pid" 2>/dev/null || true; done
  pkill -9 -f "slurmstepd.*$work" 2>/dev/null || true
  rm -rf "$work"
}
work=$(mktemp -d)
chmod 755 "$work"
trap finish EXIT

wait_for() {
  local seconds=$1 what=$2
  shift 2
  for ((i = 0; i < 5 * seconds; ++i)); do
    "$@" >/dev/null 2>&1 && return
    sleep 0.2
  done
  echo "$script: waited in vain for $what; logs were in $work" >&2
  tail -n 20 "$work"/*.log >&2
  exit 1
}

start_cluster() {
  local lines=${1:-}
  # Who is who: munge, with a key and a socket of its own.
  mkdir -m 755 "$work/munge"
  head -c 128 /dev/urandom >"$work/munge/key"
  chmod 600 "$work/munge/key"
  munged --foreground --force --key-file="$work/munge/key" --socket="$work/munge/socket" \
    --pid-file="$work/munge/pid" --log-file="$work/munge/munged.log" --seed-file="$work/munge/seed" 2>/dev/null &
  keep

  mkdir -p "$work"/{state,spool_one,spool_two}
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
PartitionName=lab Nodes=one,two Default=YES MaxTime=INFINITE State=UP
${lines//%W/$work}
CONF
  grep -q '^NodeName=' "$work/slurm.conf" || cat >>"$work/slurm.conf" <<CONF
NodeName=one NodeHostname=$(hostname -s) NodeAddr=127.0.0.1 Port=17701 CPUs=1
NodeName=two NodeHostname=$(hostname -s) NodeAddr=127.0.0.1 Port=17702 CPUs=1
CONF
  [[ -z ${2:-} ]] || echo "$2" >"$work/gres.conf"
  export SLURM_CONF=$work/slurm.conf
  wait_for 10 "munge" munge --socket="$work/munge/socket" -n
  slurmctld -D -f "$SLURM_CONF" 2>/dev/null &
  keep
  node_pids=()
  local node
  for node in one two; do
    slurmd -D -f "$SLURM_CONF" -N "$node" 2>/dev/null &
    keep
    node_pids+=("${started[-1]}")
  done
  wait_for 30 "two idle nodes" both_idle
}
both_idle() { [[ $(sinfo --noheader --states=idle --format=%D) == 2 ]]; }
done_with() { ! squeue --noheader --jobs="$1" | grep -q .; }
