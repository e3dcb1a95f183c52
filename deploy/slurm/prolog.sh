#!/usr/bin/env bash
# Slurm's Prolog on a node that has a rig: takes the rig's lease for the job, before the job begins.
#
#   slurm.conf:  GresTypes=rig
#                NodeName=lab1 Gres=rig:1 …
#                PartitionName=rig Nodes=lab1 …
#                Prolog=/usr/share/hapticd/slurm/prolog.sh   Epilog=…/epilog.sh   TaskProlog=…/task_prolog.sh
#   a job:       sbatch --partition=rig --gres=rig:1 job.sh     its hapticctl commands control the rig
#
# Only jobs of a partition whose name begins with "rig" get it. A rig that someone else holds is not for Slurm to take:
# the prolog waits 20 s for it, then fails; Slurm then puts the job back and drains the node (scontrol update
# nodename=lab1 state=resume when the rig is free again).
#
# HAPTICD_SERVER, HAPTICD_SLURM_FOLDER: from /etc/hapticd/slurm.env; by default the rig of this node, and
# /run/hapticd-slurm for what the job must know.
set -euo pipefail

[[ ${SLURM_JOB_PARTITION:-} == rig* ]] || exit 0
settings=${HAPTICD_SLURM_SETTINGS:-/etc/hapticd/slurm.env}
# shellcheck disable=SC1090
[[ -r $settings ]] && . "$settings"
folder=${HAPTICD_SLURM_FOLDER:-/run/hapticd-slurm}
server=${HAPTICD_SERVER:-127.0.0.1:50051}
user=${SLURM_JOB_USER:-$(id -nu "${SLURM_JOB_UID:?}")}

mkdir -p "$folder"
chmod 755 "$folder"
export HAPTICD_JOB_FILE=$folder/$SLURM_JOB_ID
rm -f "$HAPTICD_JOB_FILE" "$HAPTICD_JOB_FILE.log"

# The lease lives as long as this program; the job's own programs use its token.
hold() {
  # shellcheck disable=SC2016
  setsid "${HAPTICCTL:-hapticctl}" --server "$server" lease hold --ttl 10 --on-expiry ramp_to_zero \
    --purpose "Slurm job $SLURM_JOB_ID of $user" -- bash -c '
      umask 077
      { echo "HAPTICD_LEASE=$HAPTICD_LEASE"; echo "HAPTICD_SERVER=$HAPTICD_SERVER"; echo "HOLDER=$$"; } \
        >"$HAPTICD_JOB_FILE.new"
      chown "$0" "$HAPTICD_JOB_FILE.new"
      mv "$HAPTICD_JOB_FILE.new" "$HAPTICD_JOB_FILE"
      exec sleep infinity' "$user" </dev/null >"$HAPTICD_JOB_FILE.log" 2>&1 &
  local holder=$!
  while kill -0 "$holder" 2>/dev/null; do
    [[ -e $HAPTICD_JOB_FILE ]] && exit 0
    sleep 0.1
  done
}
while ((SECONDS < 20)); do
  hold
  sleep 1
done
cat "$HAPTICD_JOB_FILE.log" >&2
echo "hapticd's prolog: the lease of $server was not to be had for job $SLURM_JOB_ID" >&2
exit 1
