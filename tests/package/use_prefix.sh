#!/usr/bin/env bash
# Another project finds what is installed below PREFIX, with CMake and with pkg-config, and localizes a scan with it;
# pf-localization runs the installed module; the examples build and run.
# Usage: use_prefix.sh PREFIX
set -euo pipefail
prefix=$1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
example=$prefix/share/d2s1r/examples/one_scan
datasets=/usr/share/mrpt/datasets
demo=("$datasets/localization_demo.simplemap.gz" "$datasets/localization_demo.rawlog")

cmake -S "$example" -B "$folder/build" -DCMAKE_PREFIX_PATH="$prefix" >/dev/null
cmake --build "$folder/build"
answer=$("$folder/build/one_scan" "${demo[@]}")
echo "$answer"
# The robot starts at 3.5 m, -10.2 m, -29 deg, and the scan leaves no doubt about it.
[[ $answer =~ ^localized$'\n'(1|0\.9[0-9]*)\ at\ \(3\.[45][0-9]*,-10\.[123][0-9]*,-2[89] ]]

pc_file=$(find "$prefix/lib" -name d2s1r-mrpt.pc)
read -ra flags < <(PKG_CONFIG_PATH=$(dirname "$pc_file") pkg-config --cflags --libs d2s1r-mrpt)
g++ -std=c++17 "$example/one_scan.cpp" -o "$folder/one_scan" "${flags[@]}"
libraries=$(dirname "$(find "$prefix/lib" -name libd2s1r.so)")
[ "$(LD_LIBRARY_PATH=$libraries:${LD_LIBRARY_PATH:-} "$folder/one_scan" "${demo[@]}")" = "$answer" ]

# What cannot be used is told in one line.
for arguments in "" "no y" "no.yaml ${demo[1]}" "${demo[0]} no.rawlog" "${demo[0]} $0"; do
	# shellcheck disable=SC2086  # the arguments are words
	if refusal=$("$folder/build/one_scan" $arguments 2>&1); then exit 1; fi
	[[ $refusal != *$'\n'* && ( $refusal == usage:* || $refusal == *no[.:]* || $refusal == *"$0"* ) ]]
done

# A particle filter of one's own, seeded by the first scan, follows the drive of the office to its end.
if [ -d /usr/include/mrpt/slam ]; then
	cmake -S "$prefix/share/d2s1r/examples/own_filter" -B "$folder/filter" -DCMAKE_PREFIX_PATH="$prefix" >/dev/null
	cmake --build "$folder/filter" >/dev/null
	office=$prefix/share/d2s1r/data/office
	poses=$("$folder/filter/own_filter" "$office.yaml" "$office.rawlog")
	[ "$(wc -l <<<"$poses")" = "$(wc -l <"${office}_truth.txt")" ]
	[[ ${poses##*$'\n'} =~ \(17\.[3-5][0-9]*,3\.[01][0-9]*,-4[12]\. ]]
	[ "$("$folder/filter/own_filter" "${demo[0]}" "${demo[1]}" | wc -l)" -gt 30 ]  # of actions and frames
	for log in no.rawlog "$office.yaml"; do
		if refusal=$("$folder/filter/own_filter" "$office.yaml" "$log" 2>&1); then exit 1; fi
		[[ ${refusal##*$'\n'} =~ ^"$log: cannot be read" ]]  # MRPT may speak before
	done
fi

module=$(find "$prefix/lib" -name libd2s1r-pf-init.so)
program=$(command -v pf-localization)
mrpt_of() { ldd "$1" | grep -o 'libmrpt.obs\.so[.0-9]*' | head -n 1; }
if [ "$(mrpt_of "$program")" != "$(mrpt_of "$module")" ]; then
	echo "pf-localization is of another version of MRPT than the module, which is not tried"
	exit
fi
RAWLOG_LOCALIZE=$prefix/bin/rawlog-localize \
	"$prefix/share/d2s1r/examples/track_with_signature_map.sh" "$folder/out" "$module"
