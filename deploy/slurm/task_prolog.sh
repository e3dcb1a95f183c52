#!/usr/bin/env bash
# Slurm's TaskProlog: hands the rig's lease that the prolog took to the programs of the job.
set -euo pipefail
job=${HAPTICD_SLURM_FOLDER:-/run/hapticd-slurm}/${SLURM_JOB_ID:-none}
[[ -r $job ]] || exit 0
sed -n 's/^HAPTICD_/export &/p' "$job"
