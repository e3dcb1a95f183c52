#!/usr/bin/env bash
# The community's validator of BIDS data sets, of which there is no Debian package: installed once from npm, for this user.
#
#   bash deploy/bids_validator.sh            installs it where it is missing
#   bash deploy/bids_validator.sh FOLDER     validates a data set; the report is JSON; exit code 1: there are errors, 77: it is not installed
set -euo pipefail

readonly version=1.15.0
folder=${XDG_CACHE_HOME:-$HOME/.cache}/hapticd/bids-validator-$version
program=$folder/node_modules/.bin/bids-validator

if (($#)); then
  [[ -x $program ]] || { echo "bids_validator.sh: not installed: bash deploy/bids_validator.sh" >&2; exit 77; }
  exec "$program" --json "$1"
fi
[[ ! -x $program ]] || exit 0
mkdir -p "$folder"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
# No script of a package is run.
if ! npm install --silent --no-audit --no-fund --ignore-scripts --prefix "$folder" "bids-validator@$version" >"$log" 2>&1; then
  cat "$log" >&2
  echo "bids_validator.sh: npm could not install bids-validator@$version; its output is above" >&2
  exit 1
fi
