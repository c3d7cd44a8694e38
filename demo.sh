#!/usr/bin/env bash
# Localizes every scan of MRPT's localization demo in its map, without any initial pose. Takes a bare Debian 12 machine
# (root, or a user with sudo, who is asked first) to a result; a second run starts at once.
set -euo pipefail
cd "$(dirname "$0")"
scripts/install_dependencies.sh build demo

log=$(mktemp)
trap 'rm -f "$log"' EXIT
quietly() { "$@" >"$log" 2>&1 || { cat "$log" >&2; exit 1; }; }
if [ ! -x build/release/apps/rawlog-localize/rawlog-localize ]; then
  echo "Building (a few minutes, the first time only) ..."
fi
[ -f build/release/cmake_install.cmake ] || quietly cmake --preset release -DBUILD_TESTING=OFF
quietly cmake --build --preset release -j "$(nproc)" --target rawlog-localize

datasets=/usr/share/mrpt/datasets
output=build/demo
command=(build/release/apps/rawlog-localize/rawlog-localize
  -m "$datasets/localization_demo.simplemap.gz" -i "$datasets/localization_demo.rawlog" -o "$output")
echo "${command[*]}"
"${command[@]}"

echo
echo "Where the robot was:   $PWD/$output/map.png"
echo "Frame by frame:        $PWD/$output/report.html  (in a browser)"
echo "The same in 3D:        $PWD/$output/scene.3Dscene  (SceneViewer3D, of package mrpt-apps)"
echo "Poses, frame by frame: $PWD/$output/frames.csv"
