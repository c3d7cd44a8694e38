#!/bin/sh
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
# Localize a CARMEN log in a map of ROS's map_server:  carmen2rawlog -> rawlog-localize
#
#   carmen_log_in_ros_map.sh OUT_DIR MAP.yaml LOG.carmen
set -eu
usage='usage: carmen_log_in_ros_map.sh OUT_DIR MAP.yaml LOG.carmen'
out=${1:?$usage}
map=${2:?$usage}
log=${3:?$usage}
mkdir -p "$out"

carmen2rawlog -q -w -i "$log" -o "$out/carmen.rawlog"
"${RAWLOG_LOCALIZE:-rawlog-localize}" -m "$map" -i "$out/carmen.rawlog" -o "$out/localized"
