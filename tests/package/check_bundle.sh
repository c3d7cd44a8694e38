#!/usr/bin/env bash
# The bundle that a build makes is whole, and used without anything that is installed.
# Usage: check_bundle.sh BUILD_FOLDER
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
tests=$(dirname "$0")
XZ_OPT=-0 "$tests/../../scripts/make_bundle.sh" --build "$1" "$folder"
"$tests/use_bundle.sh" "$folder"/d2s1r-*-linux-amd64.tar.xz
