#!/usr/bin/env bash
# Tries the packages in a fresh Debian 12 in a folder: install, the service on the simulated rig, upgrade, remove, purge.
#
#   bash deploy/try_packages.sh PACKAGES [NEWER_PACKAGES] [--base TAR] [--keep] [--log FILE]
#
#   PACKAGES, NEWER_PACKAGES  folders of .deb files as deploy/package.sh makes them; with the second one, an upgrade
#   --base TAR                a Debian 12 as a tar file; made there by mmdebstrap where it does not exist
#   --keep                    leaves the folder of the fresh system
#   --log FILE                the whole output; PACKAGES/try.log otherwise
#
# As root. Needs mmdebstrap (deploy/install_packages.sh packaging) and a mirror of Debian. No systemd runs in the folder: the
# script starts the daemon as the unit says, with its user, groups and folders.
set -euo pipefail

base= keep=false log=
folders=()
while (($#)); do
  case $1 in
    --base | --log)
      (($# > 1)) || { echo "try_packages.sh: $1 needs a value" >&2; exit 2; }
      declare "${1#--}=$2"
      shift
      ;;
    --keep) keep=true ;;
    -*) echo "try_packages.sh: unknown option '$1'; there are --base TAR, --keep, --log FILE" >&2; exit 2 ;;
    *) folders+=("$(cd "$1" && pwd)") ;;
  esac
  shift
done
((${#folders[@]} >= 1 && ${#folders[@]} <= 2)) ||
  { echo "try_packages.sh: give one or two folders of packages; remedy: bash deploy/package.sh" >&2; exit 2; }
((EUID == 0)) || { echo "try_packages.sh: not root; remedy: sudo bash deploy/try_packages.sh ..." >&2; exit 2; }
command -v mmdebstrap >/dev/null || [[ -s $base ]] ||
  { echo "try_packages.sh: 'mmdebstrap' is missing; remedy: bash deploy/install_packages.sh packaging" >&2; exit 2; }
[[ -n $log ]] || log=${folders[0]}/try.log

work=$(mktemp -d)
system=$work/system
cleanup() {
  umount -q "$system/proc" "$system/dev" 2>/dev/null || true
  if $keep; then echo "the system is in $system"; else rm -rf --one-file-system "$work"; fi
}
trap cleanup EXIT
say() { echo "$(date +%T) $*" | tee -a "$log"; }
fail() {
  say "FAILED: $*"
  tail -20 "$log" >&2
  exit 1
}
inside() { chroot "$system" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive "$@"; }
apt() { inside apt-get -q -y --no-install-recommends "$@" >>"$log" 2>&1; }

: >"$log"
mkdir "$system"
if [[ ! -s $base ]]; then
  say "making a fresh Debian 12"
  mmdebstrap --variant=minbase bookworm "${base:=$work/base.tar}" >>"$log" 2>&1 || fail "no fresh Debian 12: is a mirror reachable?"
fi
tar -x -C "$system" --exclude='./dev/*' -f "$base"
cp /etc/resolv.conf "$system/etc/resolv.conf"
mount -t proc proc "$system/proc"
mount --bind /dev "$system/dev"
printf '#!/bin/sh\nexit 101\n' >"$system/usr/sbin/policy-rc.d"
chmod +x "$system/usr/sbin/policy-rc.d"
apt update || fail "no mirror of Debian is reachable"
# What the packages bring into a system that has systemd anyway.
apt install systemd udev || fail "systemd cannot be installed"
# All that is left behind later must have been there now.
listing() {
  (cd "$system" && find . -xdev \( -path ./proc -o -path ./dev -o -path ./tmp -o -path ./packages -o -path ./var/cache -o -path ./var/log \
    -o -path ./var/lib/apt -o -path ./var/lib/dpkg -o -path ./etc/ssl -o -path ./run \) -prune -o -print | sort)
}

put() {  # the packages of a folder into the system
  rm -rf "$system/packages"
  mkdir "$system/packages"
  cp "$1"/*.deb "$system/packages/"
}

# Starts the daemon as the unit says, in a network of its own, asks it, and ends it.
try_service() {
  local unit=$system/lib/systemd/system/hapticd.service line groups
  line=$(sed -n 's/^ExecStart=//p' "$unit")
  groups=$(sed -n 's/^SupplementaryGroups=//p' "$unit" | tr ' ' ,)
  # The limits of the unit, as far as this machine lets root raise them.
  local raise=
  for limit in --rtprio=99 --memlock=unlimited; do
    if prlimit "$limit" true 2>/dev/null; then raise+="prlimit $limit "; else say "  not tried: the unit's limit $limit cannot be raised here"; fi
  done
  inside install -d -o hapticd -g hapticd /run/hapticd /var/lib/hapticd
  cat >"$system/packages/try.sh" <<END
set -e
cd /
$raise setpriv --reuid=hapticd --regid=hapticd --groups=hapticd,$groups \\
  --no-new-privs --bounding-set=-all \\
  env STATE_DIRECTORY=/var/lib/hapticd $line &
daemon=\$!
for i in \$(seq 300); do
  hapticctl status >/packages/status.txt 2>&1 && break
  kill -0 \$daemon || exit 1
  sleep 0.1
done
hapticctl --server unix:/run/hapticd/hapticd.sock status
hapticctl doctor || true
if [ -x /usr/bin/hapticd-console ]; then
  setpriv --reuid=hapticd-console --regid=hapticd-console --groups=hapticd --no-new-privs --bounding-set=-all \\
    $(sed -n 's/^ExecStart=//p' "$system/lib/systemd/system/hapticd-console.service") &
  console=\$!
  for i in \$(seq 100); do
    hapticctl console --print >/packages/console.txt 2>&1 && grep -q 127.0.0.1:50080 /packages/console.txt && break
    kill -0 \$console || exit 1
    sleep 0.1
  done
  grep -q 127.0.0.1:50080 /packages/console.txt
  kill -TERM \$console
  wait \$console
fi
ps -o user=,rss= -p \$daemon 2>/dev/null || grep -E '^(Uid|VmRSS|VmLck)' /proc/\$daemon/status
kill -TERM \$daemon
wait \$daemon
END
  local began=$SECONDS
  unshare --net sh -c "ip link set lo up 2>/dev/null; exec chroot '$system' sh /packages/try.sh" >>"$log" 2>&1 || return 1
  ((SECONDS - began < 30)) || return 1
  say "  status answered, the daemon ended in order; $((SECONDS - began)) s in all"
}

before=$(listing)
put "${folders[0]}"
say "install"
began=$SECONDS
began_ms=$(date +%s%3N)
apt install $(cd "$system" && ls ./packages/*.deb | grep -v python3- | sed 's|^\./|/|') || fail "the packages cannot be installed"
say "  installed in $((SECONDS - began)) s"
inside getent passwd hapticd >>"$log" || fail "the user hapticd is missing"
inside hapticd --config /etc/hapticd/rig.toml --check-config >>"$log" 2>&1 || fail "the packaged configuration is refused"
inside bash -n /usr/share/bash-completion/completions/hapticctl || fail "the completion is no bash"
[[ -s $system/usr/share/man/man1/hapticctl.1.gz ]] || fail "the manual page of hapticctl is missing"
try_service || fail "the service does not answer within 30 s"
# From 'apt install' to the end of the first daemon, which had answered before.
say "install_to_status_s $(awk "BEGIN { print ($(date +%s%3N) - $began_ms) / 1000 }")"
apt install $(cd "$system" && ls ./packages/python3-*.deb | sed 's|^\./|/|') || fail "the Python package cannot be installed"
inside hapticctl experiment check stiffness_1d --no-rig >>"$log" 2>&1 || fail "hapticctl experiment does not find the Python package"
say "  the Python package is found"

if ((${#folders[@]} == 2)); then
  put "${folders[1]}"
  say "upgrade"
  echo "# changed by the administrator" >>"$system/etc/hapticd/rig.toml"
  apt -o Dpkg::Options::=--force-confold install $(cd "$system" && ls ./packages/*.deb | sed 's|^\./|/|') || fail "no upgrade"
  grep -q "changed by the administrator" "$system/etc/hapticd/rig.toml" || fail "the upgrade overwrote rig.toml"
  try_service || fail "the service does not answer after the upgrade"
  put "${folders[0]}"
  say "downgrade"
  apt --allow-downgrades -o Dpkg::Options::=--force-confold install $(cd "$system" && ls ./packages/*.deb | sed 's|^\./|/|') ||
    fail "no downgrade"
  try_service || fail "the service does not answer after the downgrade"
fi

say "remove"
apt remove hapticd || fail "cannot be removed"
[[ ! -e $system/usr/bin/hapticd ]] || fail "the program is still there"
[[ -s $system/etc/hapticd/rig.toml && -d $system/var/lib/hapticd ]] || fail "removing took configuration or models away"
say "purge"
apt purge hapticd hapticd-console hapticd-tools hapticd-igtl python3-hapticd libhapticd-client-dev hapticd-doc || fail "cannot be purged"
apt autoremove --purge || fail "cannot be purged"
left=$(comm -13 <(echo "$before") <(listing) | grep -i hapticd || true)
[[ -z $left ]] || fail "left behind: $left"
say "install, service, $( ((${#folders[@]} == 2)) && echo "upgrade, downgrade, ")remove and purge are clean; the log is $log"
