#!/bin/sh
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
# Cut a log, find the robot in its map without an initial pose, and let MRPT's unmodified pf-localization follow the
# same part from there:  rawlog-edit -> rawlog-localize -> pf-localization
#
#   localize_then_track.sh OUT_DIR [MAP] [RAWLOG] [LAST_OBJECT]
set -eu
out=${1:?usage: localize_then_track.sh OUT_DIR [MAP] [RAWLOG] [LAST_OBJECT]}
datasets=/usr/share/mrpt/datasets
map=${2:-$datasets/localization_demo.simplemap.gz}
rawlog=${3:-$datasets/localization_demo.rawlog}
last=${4:-49}
mkdir -p "$out"

rawlog-edit --cut --from-index 0 --to-index "$last" -i "$rawlog" -o "$out/part.rawlog" -w -q
"${RAWLOG_LOCALIZE:-rawlog-localize}" -m "$map" -i "$out/part.rawlog" -o "$out/localized" --write-pf-ini "$out/pf.ini"
# it waits for a key on errors, and has no file of poses: they are in what it prints
pf-localization "$out/pf.ini" < /dev/null > "$out/pf.log" 2>&1 ||
	{ echo "pf-localization failed: see $out/pf.log" >&2; exit 1; }
sed -n 's/.*PDF estimation: (\([^)]*\)).*/\1/p' "$out/pf.log" > "$out/pf_poses.txt"
echo "pf-localization: $(wc -l < "$out/pf_poses.txt") steps, the last at (x, y, phi) = $(tail -n 1 "$out/pf_poses.txt")"
