#!/usr/bin/env bash
# What the tests try with some thousand inputs, with a million of them: every call of the contract, and the console's
# requests and sockets. Runs on what `bash deploy/build.sh release` has built, for some hours; stops at the first failure
# and prints how to repeat it.
#
#   bash tests/fuzz/nightly.sh [INPUTS [SEED]]     1000000, and the seconds since 1970
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

inputs=${1:-1000000} first=${2:-$(date +%s)}
readonly each=10000
for ((done = 0, seed = first; done < inputs; done += each, ++seed)); do
  build/release/bin/fuzz_rpc_calls "$each" "$seed" ||
    { echo "nightly: again: build/release/bin/fuzz_rpc_calls $each $seed" >&2; exit 1; }
done
export HAPTICD_INPUTS=$inputs HAPTICD_SEED=$first
PYTHONPATH=build/release/python HAPTICD_BINARIES=build/release/bin /usr/bin/python3 -m pytest -q -p no:cacheprovider \
  tests/python/console_attack_test.py -k spoiled_inputs ||
  { echo "nightly: again with HAPTICD_INPUTS=$inputs HAPTICD_SEED=$first" >&2; exit 1; }
