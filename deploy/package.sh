#!/usr/bin/env bash
# Builds the Debian packages of a commit and checks them with lintian.
#
#   bash deploy/package.sh [--out DIR] [--commit COMMIT] [--suffix TEXT]
#
#   --out DIR        where the packages go; build/packages otherwise
#   --commit COMMIT  what is built; HEAD otherwise. Changes that are not committed are left out
#   --suffix TEXT    behind the version of the project, e.g. +lab1: a later package of the same version
#
# Needs: bash deploy/install_packages.sh build libraries packaging. The build takes minutes, its log is DIR/build.log.
set -euo pipefail

root=$(cd "$(dirname "$0")/.." && pwd)
out=$root/build/packages
commit=HEAD
suffix=
while (($#)); do
  case $1 in
    --out | --commit | --suffix)
      (($# > 1)) || { echo "package.sh: $1 needs a value" >&2; exit 2; }
      declare "${1#--}=$2"
      shift 2
      ;;
    *)
      echo "package.sh: unknown argument '$1'; there are --out DIR, --commit COMMIT, --suffix TEXT" >&2
      exit 2
      ;;
  esac
done
for tool in dpkg-buildpackage dh help2man lintian; do
  command -v "$tool" >/dev/null ||
    { echo "package.sh: '$tool' is missing; remedy: bash deploy/install_packages.sh build libraries packaging" >&2; exit 2; }
done

mkdir -p "$out"
out=$(cd "$out" && pwd)
work=$out/work
rm -rf "$work"
mkdir -p "$work/hapticd"
trap 'rm -rf "$work"' EXIT
git -C "$root" archive "$commit" | tar -x -C "$work/hapticd"
cd "$work/hapticd"
cp -r deploy/debian debian
cp deploy/service/hapticd.service deploy/service/hapticd.sysusers deploy/service/hapticd.avahi.service \
  deploy/service/hapticd-console.service deploy/service/hapticd-console.sysusers deploy/service/rig.toml \
  deploy/service/console.toml debian/
cp deploy/service/60-hapticd.rules debian/hapticd.udev
version=$(sed -n 's/^project(hapticd VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)$suffix
# The date of the commit: the same commit gives the same packages.
cat >debian/changelog <<END
hapticd ($version) unstable; urgency=medium

  * Packaged from the sources of the project; see CHANGELOG.md.

 -- hapticd maintainers <maintainers@hapticd.invalid>  $(git -C "$root" log -1 --format=%cD "$commit")
END

echo "Building the packages of hapticd $version; the log is $out/build.log"
DEB_BUILD_OPTIONS="${DEB_BUILD_OPTIONS:-nocheck parallel=$(nproc)}" \
  dpkg-buildpackage --build=binary --no-sign >"$out/build.log" 2>&1 || {
  tail -40 "$out/build.log" >&2
  echo "package.sh: the build failed; the whole log is $out/build.log" >&2
  exit 1
}
mv "$work"/*.deb "$work"/*.changes "$work"/*.buildinfo "$out"
status=0
lintian --allow-root --fail-on error,warning --profile debian "$out/hapticd_${version}_"*.changes >"$out/lintian.log" 2>&1 || status=1
cat "$out/lintian.log"
ls -l "$out"/*"_${version}_"*.deb
((status == 0)) || { echo "package.sh: lintian found something (above)" >&2; exit 1; }
