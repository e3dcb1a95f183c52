# For scripts that call a peer's program from npm; to be sourced.

skip() {
  echo "SKIPPED LOUDLY: $1" >&2
  exit 77
}
# npm_packages FOLDER PACKAGE@VERSION ...: in FOLDER/node_modules from then on; ends the script with status 77 where node, npm or
# the packages are not to be had. No script of a package is run.
npm_packages() {
  local folder=$1
  shift
  command -v node >/dev/null || skip "node is not installed"
  [[ "$(cat "$folder/installed" 2>/dev/null)" != "$*" ]] || return 0
  command -v npm >/dev/null || skip "npm is not installed"
  mkdir -p "$folder"
  echo '{"private": true}' >"$folder/package.json"
  timeout 120 npm install --silent --no-audit --no-fund --ignore-scripts --prefix "$folder" "$@" >"$folder/npm.log" 2>&1 ||
    skip "npm cannot fetch $*; see $folder/npm.log"
  echo "$*" >"$folder/installed"
}
