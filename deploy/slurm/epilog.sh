#!/usr/bin/env bash
# Slurm's Epilog: returns the rig's lease that the prolog took for the job.
set -euo pipefail
settings=${HAPTICD_SLURM_SETTINGS:-/etc/hapticd/slurm.env}
# shellcheck disable=SC1090
[[ -r $settings ]] && . "$settings"
job=${HAPTICD_SLURM_FOLDER:-/run/hapticd-slurm}/${SLURM_JOB_ID:?}
[[ -e $job ]] || exit 0
# The program under the lease ends, and hapticctl returns it; where hapticctl is gone, it expires.
kill "$(sed -n 's/^HOLDER=//p' "$job")" 2>/dev/null || true
rm -f "$job" "$job.log"
