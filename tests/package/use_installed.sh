#!/usr/bin/env bash
# Another project finds the installed package and localizes a scan with it.
# Usage: use_installed.sh BUILD_FOLDER
set -euo pipefail
prefix=$(mktemp -d)
trap 'rm -rf "$prefix"' EXIT
cmake --install "$1" --prefix "$prefix" >/dev/null
cmake -S "$prefix/share/d2s1r/examples/one_scan" -B "$prefix/build" -DCMAKE_PREFIX_PATH="$prefix" >/dev/null
cmake --build "$prefix/build"
datasets=/usr/share/mrpt/datasets
answer=$("$prefix/build/one_scan" "$datasets/localization_demo.simplemap.gz" "$datasets/localization_demo.rawlog")
echo "$answer"
# A status and at least one hypothesis, the probability of which is a number.
[[ $answer =~ ^(localized|ambiguous)$'\n'(1|0\.[0-9]+)\ at\ \( ]]
