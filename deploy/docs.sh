#!/usr/bin/env bash
# Builds the documentation as HTML: the Markdown pages by mkdocs, the reference of the C++ headers by doxygen. A warning
# of either is an error. Uses no network.
#
#   bash deploy/docs.sh [OUT]     into OUT (default build/docs); begin at OUT/index.html
#
# Needs mkdocs and doxygen: bash deploy/install_packages.sh docs
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

out=${1:-build/docs}
for program in mkdocs doxygen; do
  command -v "$program" >/dev/null ||
    { echo "docs.sh: there is no $program; bash deploy/install_packages.sh docs" >&2; exit 2; }
done
python3 deploy/check_links.py
python3 deploy/check_blocks.py

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# The pages and what they link to, each at its own place, so that every link leads where it leads in the repository.
mkdir "$work/pages"
{ python3 deploy/check_links.py --pages; python3 deploy/check_links.py --targets; } |
  xargs -d '\n' cp --parents -t "$work/pages"
cp deploy/docs/mkdocs.yml "$work"

mkdir "$work/pages/reference"
{ cat deploy/docs/Doxyfile; echo "OUTPUT_DIRECTORY = $work/pages"; echo "HTML_OUTPUT = reference"; } >"$work/Doxyfile"
doxygen "$work/Doxyfile"
printf '\n**Reference**\n\n- [C++ headers](../reference/index.html): client library, hardware interfaces, the tick\n' \
  >>"$work/pages/docs/index.md"

mkdocs --quiet build --strict --config-file "$work/mkdocs.yml"
rm -rf "$out"
mkdir -p "$(dirname "$out")"
mv "$work/site" "$out"
echo "documentation: $out/index.html"
