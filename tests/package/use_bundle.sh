#!/usr/bin/env bash
# The bundle is used in a root that holds the files of glibc, libstdc++, libgcc and a shell alone: it localizes the bag of
# the office that it brings, and d2s1r-live finds the robot of d2s1r-live-drive.
# Usage: use_bundle.sh BUNDLE.tar.xz [SECONDS [SYSTEM TRIPLET LOADER SHELL]]
#   SECONDS  that the robot drives
#   SYSTEM   the root of another system whose files are taken, with the names of the folder of its libraries, of its loader
#            and of a shell
set -euo pipefail
bundle=$1 seconds=${2:-10} system=${3:-} triplet=${4:-x86_64-linux-gnu} loader=${5:-/lib64/ld-linux-x86-64.so.2}
shell=${6:-/bin/dash}
own=(unshare --mount)
[ "$(id -u)" -eq 0 ] || own+=(--user --map-root-user)
"${own[@]}" true 2>/dev/null || { echo "skipped: this system gives no root of one's own"; exit 77; }
root=$(mktemp -d)
trap 'rm -rf --one-file-system "$root"' EXIT
mkdir -p "$root/bin" "$root/tmp" "$root/dev" "$root/proc" "$root$(dirname "$loader")" "$root/lib/$triplet"
touch "$root/dev/null"
cp -L "$system$loader" "$root$loader"
for library in libc.so.6 libm.so.6 libdl.so.2 libpthread.so.0 librt.so.1 libstdc++.so.6 libgcc_s.so.1; do
  cp -L "$system/lib/$triplet/$library" "$root/lib/$triplet"
done
cp "$system$shell" "$root/bin/sh"
tar -C "$root" -xJf "$bundle"
cat >"$root/use.sh" <<'end'
set -eu
cd /d2s1r-*
for program in bin/*; do "$program" --version >/dev/null; done
for page in doc/usage doc/live experiments/README experiments/results/README tests/benchmark/RESULTS; do
  [ -s share/doc/d2s1r/$page.md ]  # which README and its pages lead to
done
bin/rawlog-localize -m share/d2s1r/data/office.yaml -i share/d2s1r/data/office_bag -o /tmp/out
if bin/rawlog-localize -q -m share/d2s1r/data/office.yaml -i share/d2s1r/data/office.rawlog -o /tmp/out; then exit 1; fi
export ROS_DOMAIN_ID="$1" ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST
bin/d2s1r-live --seed watch &
live=$!
bin/d2s1r-live-drive share/d2s1r/data/office.yaml "$2" --kidnap 0
kill -TERM $live
wait $live
end
# The loader asks /proc where a program lies. Other tests use the domains from 20 on.
# shellcheck disable=SC2016  # the inner shell's
said=$("${own[@]}" sh -c 'mount --rbind /proc "$0/proc" && exec chroot "$0" /bin/sh /use.sh "$@"' \
  "$root" $((RANDOM % 19 + 1)) "$seconds" 2>&1) || { echo "$said" >&2; exit 1; }
echo "$said"
grep -qE '^status +localized +67 +100\.0 %' <<<"$said"
grep -qE '^left out .*d2s1r-tools' <<<"$said"
grep -q 'office.rawlog: is a rawlog of MRPT, which this program was built without; .*d2s1r-tools' <<<"$said"
[[ $said =~ ([0-9]+)' poses, of which right (0.1 m) '([0-9]+) ]]
[ "${BASH_REMATCH[1]}" -gt 20 ] && [ "${BASH_REMATCH[1]}" -eq "${BASH_REMATCH[2]}" ]
