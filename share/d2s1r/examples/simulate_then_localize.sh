#!/bin/sh
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
# Simulate the laser scans of a path in a map, and localize them:  simul-gridmap -> rawlog-localize
#
#   simulate_then_localize.sh OUT_DIR MAP.gridmap.gz POSES.txt      (POSES: 'time x y phi' a line: s, m, m, rad)
#
# simul-gridmap starts at the first pose, scans at the others, and stamps them with times of its own.
set -eu
usage='usage: simulate_then_localize.sh OUT_DIR MAP.gridmap.gz POSES.txt'
out=${1:?$usage}
map=${2:?$usage}
poses=${3:?$usage}
mkdir -p "$out"

simul-gridmap -g "$map" -p "$poses" -o "$out/simulated.rawlog" -r 361 -s 180 -R 0.01
"${RAWLOG_LOCALIZE:-rawlog-localize}" -m "$map" -i "$out/simulated.rawlog" -o "$out/localized" --fuse
