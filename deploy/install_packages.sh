#!/usr/bin/env bash
# The one list of the Debian 12 packages hapticd is built, tested and run with. Installs those that are missing, as root
# or with sudo; touches nothing, and needs neither, when all are there. Quiet unless it fails.
#
#   bash deploy/install_packages.sh [GROUP ...]     groups: build libraries run tests fuzz docs drawing packaging slurm;
#                                                   none = all but the last five
#   bash deploy/install_packages.sh --list [GROUP ...]
set -euo pipefail

declare -A packages=(
  [build]="cmake ninja-build g++ lld ccache pkg-config python3 help2man"
  # What the configuration of the build looks for, the test framework included.
  [libraries]="libgrpc++-dev protobuf-compiler-grpc libprotobuf-dev protobuf-compiler python3-protobuf
               libmodbus-dev libboost-dev libcpp-httplib-dev libpugixml-dev libcomedi-dev libeigen3-dev
               libtomlplusplus-dev libspdlog-dev libfmt-dev libcli11-dev nlohmann-json3-dev libkainjow-mustache-dev
               libsqlitecpp-dev libsqlite3-dev libssl-dev libsystemd-dev prometheus-cpp-dev zlib1g-dev libzstd-dev libhdf5-dev
               libgtest-dev libbenchmark-dev libceres-dev libopenigtlink-dev"
  # hapticctl plot and demo draw with the first; make_certificates.sh calls the second.
  [run]="gnuplot-nox openssl"
  # Instruction counts, the latency tool the loop is compared with, and independent peers for the drivers.
  [tests]="python3-h5py python3-numpy python3-grpcio python3-scipy python3-pandas python3-matplotlib python3-zstandard
           chromium chromium-driver python3-selenium python3-pytest python3-setuptools python3-wheel mypy valgrind rt-tests stress-ng socat mbpoll mono-mcs python3-pymodbus python3-serial python3-serial-asyncio"
  # The compiler of the preset asan, which also fuzzes; only when asked for.
  [fuzz]="clang libclang-rt-14-dev"
  # The documentation as HTML, and what the Python example needs; only when asked for.
  [docs]="mkdocs doxygen python3-grpcio python3-protobuf python3-numpy"
  # What draws the targets (deploy/draw_targets.py); only when asked for.
  [drawing]="graphviz"
  # A cluster on one machine, to try the report's job array; only when asked for.
  [slurm]="slurmctld slurmd slurm-client munge"
  # Debian packages and a fresh system to try them in; promtool, which checks the metrics; only when asked for.
  [packaging]="dpkg-dev debhelper dh-python fakeroot lintian mmdebstrap prometheus"
)
all_groups=(build libraries run tests)

list_only=false
if [[ "${1:-}" == --list ]]; then
  list_only=true
  shift
fi
groups=("$@")
((${#groups[@]})) || groups=("${all_groups[@]}")

wanted=()
for group in "${groups[@]}"; do
  if [[ -z "${packages[$group]:-}" ]]; then
    echo "install_packages.sh: no group '$group'; there are: ${all_groups[*]} fuzz docs drawing packaging slurm" >&2
    exit 2
  fi
  read -r -d '' -a names <<<"${packages[$group]}" || true
  wanted+=("${names[@]}")
done

# For the validator of BIDS data sets, which npm installs; sources of node other than Debian bring an npm with them.
is_for_tests=false
[[ " ${groups[*]} " != *" tests "* ]] || is_for_tests=true
if $is_for_tests && { $list_only || ! command -v npm >/dev/null; }; then wanted+=(npm); fi

if $list_only; then
  printf '%s\n' "${wanted[@]}"
  exit 0
fi

is_installed() {
  [[ "$(dpkg-query --show --showformat='${Status}' "$1" 2>/dev/null)" == "install ok installed" ]]
}

missing=()
for name in "${wanted[@]}"; do
  is_installed "$name" || missing+=("$name")
done
install_validator() {
  ! $is_for_tests || bash "$(dirname "${BASH_SOURCE[0]}")/bids_validator.sh" ||
    echo "install_packages.sh: without the validator, the test of the BIDS export is skipped" >&2
}
((${#missing[@]})) || { install_validator; exit 0; }

as_root=()
if ((EUID != 0)); then
  if ! command -v sudo >/dev/null; then
    echo "install_packages.sh: neither root nor sudo; please have these installed: ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
fi

echo "Installing ${#missing[@]} Debian packages: ${missing[*]}"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
apt() {
  # Another package manager may be at work on a machine that has just been started: wait for it.
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -y -o DPkg::Lock::Timeout=300 "$@" >>"$log" 2>&1
}
if ! { apt update && apt install --no-install-recommends "${missing[@]}"; }; then
  cat "$log" >&2
  echo "install_packages.sh: apt-get failed; its output is above" >&2
  exit 1
fi
install_validator
