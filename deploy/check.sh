#!/usr/bin/env bash
# Installs what is missing, builds everything and runs the tests; the last lines are ctest's summary.
# Needs Debian 12, and root or sudo where packages are missing.
#
#   bash deploy/check.sh
#
# HAPTICD_RECORDINGS may name a folder with real recordings; the tests that need them skip without it, and say so.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

bash deploy/install_packages.sh
bash deploy/build.sh release
exec ctest --preset release -j2
