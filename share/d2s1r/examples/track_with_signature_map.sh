#!/bin/sh
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
# MRPT's unmodified pf-localization with d2s1r's CSignatureMap2D as its only map. pf-localization has no flag for
# plug-ins, so the module is preloaded; the map comes from any file that d2s1r reads.
#
#   track_with_signature_map.sh OUT_DIR MODULE.so [MAP] [RAWLOG]
#
set -eu
usage='usage: track_with_signature_map.sh OUT_DIR MODULE.so [MAP] [RAWLOG]
MODULE.so is libd2s1r-pf-init.so: /usr/lib/*/d2s1r/ of the packages, or build/release/apps/rawlog-localize/'
out=${1:?$usage}
module=${2:?$usage}
datasets=/usr/share/mrpt/datasets
map=${3:-$datasets/localization_demo.simplemap.gz}
rawlog=${4:-$datasets/localization_demo.rawlog}
[ -f "$module" ] || { echo "$module: is no file; give the path of libd2s1r-pf-init.so as MODULE" >&2; exit 1; }
mkdir -p "$out"

# where to start: the box round the first pose, from the one-shot localizer
"${RAWLOG_LOCALIZE:-rawlog-localize}" -q -m "$map" -i "$rawlog" -o "$out/localized" --write-pf-ini "$out/start.ini"
# that ini, without its map and with ours
grep -v -e '^map_file' -e '^occupancyGrid_count' -e '^\[MetricMap' -e '^likelihoodMethod' -e '^LF_' "$out/start.ini" \
	> "$out/signature_map.ini"
cat >> "$out/signature_map.ini" << END
[MetricMap]
signatureMap_count = 1
[MetricMap_signatureMap_00_creationOpts]
map_file = $map
[MetricMap_signatureMap_00_likelihoodOpts]
sigma = 0.10
END
# LD_PRELOAD is split at blanks and colons, so that the module needs a path without any; its folder is linked, not the
# file, because the module finds its library from there
link=$(mktemp -d)
trap 'rm -r "$link"' EXIT
module=$(realpath "$module")
ln -s "$(dirname "$module")" "$link/modules"
LD_PRELOAD=$link/modules/$(basename "$module") pf-localization "$out/signature_map.ini" < /dev/null > "$out/pf.log" 2>&1 ||
	{ echo "pf-localization failed: see $out/pf.log" >&2; exit 1; }
# without the class of the map, pf-localization reckons by the odometry alone
if grep -q 'the 0 internal maps' "$out/pf.log"; then
	echo "$module: brings no CSignatureMap2D; name libd2s1r-pf-init.so" >&2
	exit 1
fi
sed -n 's/.*PDF estimation: (\([^)]*\)).*/\1/p' "$out/pf.log" > "$out/pf_poses.txt"
echo "pf-localization: $(wc -l < "$out/pf_poses.txt") steps, the last at (x, y, phi) = $(tail -n 1 "$out/pf_poses.txt")"
