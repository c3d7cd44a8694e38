#!/usr/bin/env bash
# Another project finds the installed package and localizes a scan with it; pf-localization runs the installed module.
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
# The robot starts at 3.5 m, -10.2 m, -29 deg, and the scan leaves no doubt about it.
[[ $answer =~ ^localized$'\n'(1|0\.9[0-9]*)\ at\ \(3\.[45][0-9]*,-10\.[123][0-9]*,-2[89] ]]

# What cannot be used is told in one line.
for arguments in "" "no.yaml $datasets/localization_demo.rawlog" "$datasets/localization_demo.simplemap.gz no.rawlog" \
	"$datasets/localization_demo.simplemap.gz $0"; do
	# shellcheck disable=SC2086  # the arguments are words
	if refusal=$("$prefix/build/one_scan" $arguments 2>&1); then exit 1; fi
	[[ $refusal != *$'\n'* && ( $refusal == usage:* || $refusal == *no.* || $refusal == *"$0"* ) ]]
done

module=$(find "$prefix/lib" -name libd2s1r-pf-init.so)
RAWLOG_LOCALIZE=$prefix/bin/rawlog-localize "$prefix/share/d2s1r/examples/track_with_signature_map.sh" "$prefix/out" "$module"
