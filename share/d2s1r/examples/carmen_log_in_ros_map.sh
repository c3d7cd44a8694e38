#!/bin/sh
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
# Localize a CARMEN log in a map of ROS's map_server:  carmen2rawlog -> rawlog-localize
#
#   carmen_log_in_ros_map.sh OUT_DIR MAP.yaml LOG.carmen [DEGREES]      (DEGREES between two beams; 1 if not given)
set -eu
usage='usage: carmen_log_in_ros_map.sh OUT_DIR MAP.yaml LOG.carmen [DEGREES]'
out=${1:?$usage}
map=${2:?$usage}
log=${3:?$usage}
degrees=${4:-1}
mkdir -p "$out"

# carmen2rawlog takes beams to be 0.5 deg apart unless the log says otherwise, and most logs do not; a PARAM line of the
# log itself comes later and wins. The field of view becomes that number times the beams, one gap too many.
LC_ALL=C awk -v degrees="$degrees" '
	$1 == "FLASER" && !known {
		known = 1
		printf "PARAM laser_front_laser_resolution %.9f\n", degrees * ($2 - 1) / $2
	}
	{ print }' "$log" > "$out/carmen.log"
carmen2rawlog -q -w -i "$out/carmen.log" -o "$out/carmen.rawlog"
"${RAWLOG_LOCALIZE:-rawlog-localize}" -m "$map" -i "$out/carmen.rawlog" -o "$out/localized"
