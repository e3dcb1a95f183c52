#!/usr/bin/env bash
# The unit is one that systemd understands, and is exposed little. Exit status 77: systemd-analyze is missing.
#
#   bash tests/unit/deploy/service_unit_test.sh UNIT
set -euo pipefail

unit=$1
if ! command -v systemd-analyze >/dev/null; then
  echo "SKIPPED: systemd-analyze is not installed (Debian package systemd); the unit is not checked" >&2
  exit 77
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# With a program that is there, and without a manual page that is not.
sed -e 's|^ExecStart=[^ ]*|ExecStart=/bin/true|' -e '/^Documentation=/d' "$unit" >"$work/hapticd.service"
said=$(systemd-analyze verify "$work/hapticd.service" 2>&1 | grep hapticd || true)
[[ -z $said ]] || { echo "$said" >&2; exit 1; }
# 2.5 of 10; what remains is the network and the hardware.
systemd-analyze security --offline=true --threshold=25 --no-pager "$work/hapticd.service" | tail -1

# What the service lives by.
for line in Type=notify WatchdogSec=5 LimitRTPRIO=99 LimitMEMLOCK=infinity User=hapticd StateDirectory=hapticd \
  CapabilityBoundingSet= Restart=on-failure; do
  grep -qx "$line" "$unit" || { echo "the unit lacks '$line'" >&2; exit 1; }
done
