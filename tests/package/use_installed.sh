#!/usr/bin/env bash
# What is installed can be used by others, and uninstalling leaves nothing.
# Usage: use_installed.sh BUILD_FOLDER
set -euo pipefail
prefix=$(mktemp -d)
manifest=$1/install_manifest.txt
[ ! -e "$manifest" ] || cp -p "$manifest" "$prefix"  # of an installation that target uninstall may still remove
finish() { [ ! -e "$prefix/install_manifest.txt" ] || mv "$prefix/install_manifest.txt" "$manifest"; rm -rf "$prefix"; }
trap finish EXIT
cmake --install "$1" --prefix "$prefix" >/dev/null
for file in README.md CHANGELOG.md LICENSE; do [ -s "$prefix/share/doc/d2s1r/$file" ]; done
python3 "$(dirname "$0")/../documents/snippets.py" installed "$prefix/share/doc/d2s1r"
"$(dirname "$0")/use_prefix.sh" "$prefix"

cmake --build "$1" --target uninstall >/dev/null
left=$(find "$prefix" ! -type d ! -name install_manifest.txt -o -name d2s1r)
[ -z "$left" ] || { echo "uninstalling left $left" >&2; exit 1; }
