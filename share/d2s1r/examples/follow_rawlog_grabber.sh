#!/usr/bin/env bash
# d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
# Localize the scans of a live laser while MRPT's unmodified rawlog-grabber records them, and print a line of JSON for
# each:  rawlog-grabber -> its file, which grows -> rawlog-localize.  Ctrl-C ends both, and the files are complete.
#
#   follow_rawlog_grabber.sh OUT_DIR MAP GRABBER.ini
#
# GRABBER.ini is what rawlog-grabber takes; those for many lasers are in /usr/share/mrpt/config_files/rawlog-grabber.
set -eu
usage="usage: follow_rawlog_grabber.sh OUT_DIR MAP GRABBER.ini"
out=${1:?$usage}
map=${2:?$usage}
ini=${3:?$usage}
mkdir -p "$out"
rm -f "$out"/log_*.rawlog "$out/keys"
mkfifo "$out/keys"

# scans come sooner if they are not packed
{ cat "$ini"; printf '\n[global]\nrawlog_prefix = %s/log\nrawlog_GZ_compress_level = 0\n' "$out"; } > "$out/grabber.ini"
rawlog-grabber "$out/grabber.ini" <> "$out/keys" > "$out/grabber.log" 2>&1 &
programs=($!)
finish() {
	echo 1<> "$out/keys"  # rawlog-grabber ends when a key is pressed, and completes its file
	wait "${programs[0]}" || true
	kill "${programs[@]}" 2> /dev/null || true
	wait
	rm "$out/keys"
}
trap finish EXIT
trap 'exit 130' INT TERM
until log=$(ls "$out"/log_*.rawlog 2> /dev/null); do
	kill -0 "${programs[0]}" 2> /dev/null || { echo "rawlog-grabber failed: see $out/grabber.log" >&2; exit 1; }
	sleep 0.1
done
"${RAWLOG_LOCALIZE:-rawlog-localize}" -m "$map" -i "$log" --follow --stream -o "$out/localized" &
programs+=($!)
wait -n  # for the first to end
