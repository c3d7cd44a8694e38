#!/bin/bash
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
# MRPT's two localization demos over the whole map without an initial pose: rawlog-localize --fuse against the stock
# pf-localization (40,000 particles over all free cells, the ini that MRPT comes with), once a seed.
#
#   demos.sh RAWLOG_LOCALIZE [SEEDS]       prints two rows of a table a demo
set -euo pipefail
export LC_ALL=C  # numbers with points
localize=${1:?usage: demos.sh RAWLOG_LOCALIZE [SEEDS]}
seeds=${2:-20}
share=/usr/share/mrpt
for program in "$localize" pf-localization; do
	command -v "$program" > /dev/null || { echo "demos.sh: $program: no such program" >&2; exit 1; }
done
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# stdin: 'x y phi[deg] time[ms] particles' a run; arguments: name, the true last pose
row() {
	awk -v name="$1" -v x="$2" -v y="$3" -v phi="$4" '
		{
			turn = $3 - phi
			while (turn > 180) turn -= 360
			while (turn < -180) turn += 360
			if (($1 - x) ^ 2 + ($2 - y) ^ 2 < 0.25 && turn * turn < 100) right++
			time += $4
			if ($5 > most) most = $5
		}
		END { printf "| %s | %d of %d | %d | %.1f ms |\n", name, right, NR, most, time / NR }'
}

# arguments: name, map, rawlog, true last pose
demo() {
	for seed in $(seq "$seeds"); do
		"$localize" -q -m "$2" -i "$3" -o "$work/out" --fuse --seed "$seed"
		awk -F, 'NR > 1 { time += $14; if ($9 > most) most = $9; x = $3; y = $4; phi = $5 }
			END { print x, y, phi * 57.29578, time, most }' "$work/out/fused.csv"
	done | row "$1, fused" "$4" "$5" "$6"

	sed -e 's/\r//' -e 's/^SHOW_PROGRESS_3D_REAL_TIME.*/SHOW_PROGRESS_3D_REAL_TIME=false/' \
		-e 's/^3DSceneFrequency=.*/3DSceneFrequency=-1/' -e "s|^map_file=.*|map_file=$2|" \
		-e "s|^rawlog_file=.*|rawlog_file=$3|" -e "s|^logOutput_dir=.*|logOutput_dir=$work/log|" \
		-e 's/^init_PDF_min_\([xy]\)=.*/init_PDF_min_\1=-1000/' -e 's/^init_PDF_max_\([xy]\)=.*/init_PDF_max_\1=1000/' \
		"$share/config_files/pf-localization/localization_demo.ini" > "$work/stock.ini"
	for _ in $(seq "$seeds"); do
		pf-localization "$work/stock.ini" < /dev/null > "$work/stock.log" 2>&1
		awk '/PDF estimation: \(/ { pose = $0; sub(/.*PDF estimation: \(/, "", pose); gsub(/,|deg.*/, " ", pose) }
			/Done in / { value = $0; sub(/.*Done in /, "", value)
				time += value ~ /us,/ ? value / 1000 : value ~ /ms,/ ? value + 0 : value * 1000 }
			END { print pose, time, 40000 }' "$work/stock.log"
	done | row "$1, stock pf-localization" "$4" "$5" "$6"
}

echo "| demo | last pose right (0.5 m, 10 deg) | most particles | time in the filter |"
echo "| --- | --- | --- | --- |"
demo localization_demo "$share/datasets/localization_demo.simplemap.gz" "$share/datasets/localization_demo.rawlog" \
	15.91 -10.01 4.95
# index-based ground truth: x y phi[rad] of the last frame
read -r _ x y phi < <(tail -n 1 "$share/datasets/uwb_ro-localization_demo_GT.txt")
demo uwb_ro-localization_demo "$share/datasets/uwb_ro-localization_demo_map.gridmap.gz" \
	"$share/datasets/uwb_ro-localization_demo.rawlog" "$x" "$y" "$(awk "BEGIN { print $phi * 57.29578 }")"
