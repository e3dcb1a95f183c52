#!/usr/bin/env bash
# The units are ones that systemd understands, and are exposed little. Exit status 77: systemd-analyze is missing.
#
#   bash tests/unit/deploy/service_unit_test.sh FOLDER
set -euo pipefail

folder=$1
if ! command -v systemd-analyze >/dev/null; then
  echo "SKIPPED: systemd-analyze is not installed (Debian package systemd); the units are not checked" >&2
  exit 77
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# check UNIT THRESHOLD LINE...: the lines are what the service lives by.
check() {
  local unit=$folder/$1 threshold=$2 said
  shift 2
  # With a program that is there, and without a manual page that is not.
  sed -e 's|^ExecStart=[^ ]*|ExecStart=/bin/true|' -e '/^Documentation=/d' "$unit" >"$work/$(basename "$unit")"
  said=$(systemd-analyze verify "$work/$(basename "$unit")" 2>&1 | grep hapticd || true)
  [[ -z $said ]] || { echo "$said" >&2; exit 1; }
  systemd-analyze security --offline=true --threshold="$threshold" --no-pager "$work/$(basename "$unit")" | tail -1
  for line; do
    grep -qx "$line" "$unit" || { echo "$unit lacks '$line'" >&2; exit 1; }
  done
}

# 2.5 of 10; what remains is the network and the hardware.
check hapticd.service 25 Type=notify WatchdogSec=5 LimitRTPRIO=99 LimitMEMLOCK=infinity User=hapticd StateDirectory=hapticd \
  CapabilityBoundingSet= Restart=on-failure "DeviceAllow=char-hidraw rw" Environment=GTDD_HOME=/etc/hapticd/3dsystems
# No hardware.
check hapticd-console.service 20 Type=notify WatchdogSec=10 User=hapticd-console StateDirectory=hapticd-console \
  CapabilityBoundingSet= Restart=always PrivateDevices=yes RestrictRealtime=yes
