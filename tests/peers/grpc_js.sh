#!/usr/bin/env bash
# A client of grpc-js (npm), made of the contract's files alone, without any code of hapticd. Exit status 77 where node, npm or
# the packages are not to be had.
#
#   grpc_js.sh FOLDER_OF_PROGRAMS FOLDER_FOR_PACKAGES
set -euo pipefail
bin=$1
packages=$2
here=$(cd "$(dirname "$0")" && pwd)
source "$here/../support/npm_packages.sh"
npm_packages "$packages" @grpc/grpc-js@1.14.7 @grpc/proto-loader@0.8 protobufjs@7

work=$(mktemp -d)
daemon=
end() {
  [[ -z "$daemon" ]] || kill -9 "$daemon" 2>/dev/null || true
  rm -rf "$work"
}
trap end EXIT
"$bin/hapticd" --rig sim --model-store :memory: --listen 127.0.0.1:0 --log-level info >"$work/out" 2>&1 &
daemon=$!
address=
for _ in $(seq 200); do
  address=$(sed -n 's/.*listens on \(127[^ ,]*\).*/\1/p' "$work/out" | head -n 1)
  [[ -z "$address" ]] || break
  sleep 0.1
done
[[ -n "$address" ]] || { cat "$work/out" >&2; exit 1; }
node "$here/grpc_js.mjs" "$packages" "$here/../../proto" "$address"
