#!/usr/bin/env bash
# Makes the Debian packages in a bare root of each given release of Debian, installs them in another bare one, uses them
# there (demo, Python module, tests of what is installed), removes them, and looks for what is left.
# Usage, as root, with mmdebstrap: scripts/test_packages.sh [--tests] [--arm64] [RELEASE...]
#   --tests  run all tests as well, in the root that the packages were made in
#   --arm64  make those of arm64 as well by Debian's cross compiler, use them in QEMU (qemu-user-static), and compare files
#            and results with those of amd64
#   RELEASE  bookworm or trixie; both if none is given
# The roots are folders in $D2S1R_ROOTS (/var/tmp/d2s1r-roots). Tests of recorded data run if D2S1R_DATA is set.
set -euo pipefail
cd "$(dirname "$0")/.."
# What is mounted below is unmounted when this process ends.
[ "${D2S1R_MOUNTS:-}" = own ] || exec env D2S1R_MOUNTS=own unshare --mount --propagation private "$0" "$@"

with_tests='' with_arm64=''
while [ $# -gt 0 ]; do
  case "$1" in --tests) with_tests=yes ;; --arm64) with_arm64=yes ;; -*)
    echo "usage: scripts/test_packages.sh [--tests] [--arm64] [RELEASE...]" >&2
    exit 1 ;;
  *) break ;; esac
  shift
done
if [ -n "$with_arm64" ] && ! grep -qs enabled /proc/sys/fs/binfmt_misc/qemu-aarch64; then
  echo "--arm64: programs of arm64 do not run here; install qemu-user-static and binfmt-support, and mount binfmt_misc" >&2
  exit 1
fi
[ $# -gt 0 ] || set -- bookworm trixie
roots=${D2S1R_ROOTS:-/var/tmp/d2s1r-roots}
mkdir -p "$roots"

say() { echo "$(date +%H:%M:%S) $release: $*"; }
# in_root ROOT COMMAND...: runs a command in $roots/ROOT, where `environment` is all that it knows of this one.
environment=(PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 HOME=/root
  DEBIAN_FRONTEND=noninteractive)
in_root() { chroot "$roots/$1" env -i "${environment[@]}" "${@:2}"; }
# quietly COMMAND...: shows what the command prints only if it fails.
quietly() { "$@" >"$roots/log" 2>&1 || { tail -n 100 "$roots/log" >&2; echo "failed: $*" >&2; exit 1; }; }
install() { quietly in_root "$1" apt-get -y install --no-install-recommends "${@:2}"; }

# new_root RELEASE ROOT [ARCHITECTURE]: a bare system, from an archive that is made once.
new_root() {
  local architecture=${3:-amd64} archive
  archive=$roots/$1-$architecture.tar
  if [ ! -e "$archive" ]; then
    quietly mmdebstrap --variant=minbase --architectures="$architecture" --include=ca-certificates "$1" "$roots/new.tar" \
      http://deb.debian.org/debian
    mv "$roots/new.tar" "$archive"
  fi
  rm -rf "${roots:?}/$2"
  mkdir "$roots/$2"
  tar -xf "$archive" -C "$roots/$2" --exclude='./dev/*'
  mount -t proc proc "$roots/$2/proc"
  mount --rbind /dev "$roots/$2/dev"
  cp /etc/resolv.conf "$roots/$2/etc/"
  quietly in_root "$2" apt-get update
}

# make_packages RELEASE: leaves them in $roots/RELEASE-build/d2s1r/build/package/packages.
make_packages() {
  new_root "$1" "$1-build"
  mkdir "$roots/$1-build/d2s1r"
  git ls-files -z | tar -c --null -T - | tar -x -C "$roots/$1-build/d2s1r"
  quietly in_root "$1-build" d2s1r/scripts/install_dependencies.sh build
  install "$1-build" dpkg-dev file lintian
  quietly in_root "$1-build" sh -c \
    "cd d2s1r && cmake --preset package && cmake --build --preset package -j $(nproc)"
  in_root "$1-build" sh -c "lintian --fail-on error --allow-root d2s1r/build/package/packages/*.deb"
}

# cross_dependencies ROOT: prints what is needed to build, as packages of arm64 unless it runs while building.
cross_dependencies() {
  local package purpose
  echo crossbuild-essential-arm64 libmrpt-common-dev:arm64 libpython3-dev:arm64
  while read -r package purpose _; do
    [ "$purpose" = build ] || continue
    case "$package" in
      g++) ;;
      libtf2-dev) echo libtf2-dev libtf2-2d:arm64 libroscpp-core-dev:arm64 libconsole-bridge-dev:arm64 ;;
      cmake | ninja-build | pkg-config | python3-* | cyclonedds-tools) echo "$package" ;;
      *) if in_root "$1" apt-cache show "$package" | grep -q '^Architecture: all'; then echo "$package"; else echo "$package:arm64"; fi ;;
    esac
  done <dependencies.txt
}

# make_arm64_packages RELEASE: leaves them in $roots/RELEASE-arm64-build/d2s1r/build/package/packages.
make_arm64_packages() {
  local root=$1-arm64-build
  new_root "$1" "$root"
  quietly in_root "$root" sh -c "dpkg --add-architecture arm64 && apt-get update"
  mkdir "$roots/$root/d2s1r"
  git ls-files -z | tar -c --null -T - | tar -x -C "$roots/$root/d2s1r"
  # shellcheck disable=SC2046  # the names are words
  install "$root" $(cross_dependencies "$root") dpkg-dev file lintian
  # it depends on a generator of messages that is not to be had for two architectures; its headers are the same
  quietly in_root "$root" sh -c "cd /tmp && apt-get download libtf2-dev:arm64 && dpkg -x libtf2-dev_*_arm64.deb /"
  quietly in_root "$root" sh -c "cd d2s1r && cmake --preset package --toolchain packaging/arm64.cmake &&
    env DEB_HOST_ARCH=arm64 DEB_HOST_GNU_TYPE=aarch64-linux-gnu cmake --build --preset package -j $(nproc)"
  in_root "$root" sh -c "lintian --fail-on error --allow-root d2s1r/build/package/packages/*.deb"
}

# installed_files BUILD_ROOT: what the packages hold, whatever the architecture.
installed_files() {
  local package
  for package in "$roots/$1/d2s1r/build/package/packages/"*.deb; do
    dpkg-deb --field "$package" Package
    dpkg-deb --contents "$package" | awk '{ print $1, $6, $7, $8 }' | sed -E 's/(x86_64|aarch64)-linux-gnu/MULTIARCH/g' | sort
  done
}

# localize_samples ROOT: the demo of MRPT and the office that is installed, alone, in windows and with the filter; results
# without times in /samples.
localize_samples() {
  local log=/usr/share/mrpt/datasets/localization_demo.rawlog office=/usr/share/d2s1r/data
  quietly in_root "$1" sh -c "mkdir -p /samples && cd /samples &&
    rawlog-localize -q -m /usr/share/mrpt/datasets/localization_demo.simplemap.gz -i $log -o demo --fuse &&
    rawlog-localize -q -m $office/office.yaml -i $office/office.rawlog -o office &&
    rawlog-localize -q -m $office/office.yaml -i $office/office.rawlog -o window --window 10 &&
    for run in demo office window; do cut -d, -f1-12,17- \$run/frames.csv >\$run/frames_without_times.csv; done
    cut -d, -f1-13,15- demo/fused.csv >demo/fused_without_times.csv"
}

# try_arm64_packages RELEASE: in QEMU; they must hold what those of amd64 hold, and give the same poses digit for digit.
try_arm64_packages() {
  local root=$1-arm64-install file
  diff <(installed_files "$1-build") <(installed_files "$1-arm64-build") ||
    { echo "the packages of the two architectures hold other files, see above" >&2; exit 1; }
  new_root "$1" "$root" arm64
  mkdir "$roots/$root/packages"
  cp "$roots/$1-arm64-build/d2s1r/build/package/packages/"*.deb "$roots/$root/packages"
  quietly in_root "$root" sh -c 'apt-get -y install --no-install-recommends /packages/*.deb mrpt-common'
  quietly in_root "$1-install" sh -c 'apt-get -y install --no-install-recommends /packages/*.deb mrpt-common'
  localize_samples "$root"
  localize_samples "$1-install"
  for file in {demo,office,window}/{frames_without_times.csv,hypotheses.csv,trajectory.tum,trajectory.txt} \
    demo/fused_without_times.csv; do
    cmp "$roots/$1-install/samples/$file" "$roots/$root/samples/$file" || { echo "$file differs on arm64" >&2; exit 1; }
  done
  quietly in_root "$root" python3 -c "import d2s1r; print(d2s1r.__version__)"
}

# use_packages ROOT: as a user does, with the program, as a library and in Python.
use_packages() {
  local map=/usr/share/mrpt/datasets/localization_demo.simplemap.gz log=/usr/share/mrpt/datasets/localization_demo.rawlog
  quietly in_root "$1" rawlog-localize -m $map -i $log -o /tmp/demo
  quietly in_root "$1" sh -c "g++ -std=c++17 /tests/print_scans.cpp -o /tmp/print_scans \$(pkg-config --cflags --libs d2s1r)
    /tmp/print_scans $log >/tmp/scans"
  in_root "$1" python3 /tests/localize_demo.py $map /tmp/scans /tmp/demo/frames.csv
  quietly in_root "$1" /tests/use_prefix.sh /usr
}

# all_files ROOT: but those that apt and dpkg keep for themselves.
all_files() {
  (cd "$roots/$1" && find . -xdev \( -path ./tmp -o -path './var/cache/*' -o -path './var/log/*' -o -path './var/lib/apt/*' \
    -o -path './var/lib/dpkg/*' \) -prune -o -print | sort)
}

# try_packages RELEASE: installs them twice, first with what they depend on, then alone; the second removal must leave
# everything as it was, the first one at least nothing that bears our names.
try_packages() {
  local root=$1-install names left
  new_root "$1" "$root"
  mkdir "$roots/$root/packages" "$roots/$root/tests"
  cp "$roots/$1-build/d2s1r/build/package/packages/"*.deb "$roots/$root/packages"
  cp tests/package/{print_scans.cpp,localize_demo.py,use_prefix.sh} "$roots/$root/tests"
  names=$(for package in "$roots/$root/packages/"*.deb; do dpkg-deb --field "$package" Package; done)

  quietly in_root "$root" sh -c 'apt-get -y install --no-install-recommends /packages/*.deb'
  install "$root" mrpt-common mrpt-apps g++ cmake make pkg-config
  use_packages "$root"
  # shellcheck disable=SC2086  # the names are words
  quietly in_root "$root" dpkg --purge $names
  left=$(all_files "$root" | grep -E 'd2s1r|rawlog-localize' | grep -v -E '^\./packages' || true)
  [ -z "$left" ] || { echo "removing left $left" >&2; exit 1; }

  all_files "$root" >"$roots/before"
  quietly in_root "$root" sh -c 'dpkg --install /packages/*.deb'
  use_packages "$root" >/dev/null
  # shellcheck disable=SC2086
  quietly in_root "$root" dpkg --purge $names
  all_files "$root" | diff "$roots/before" - || { echo "installing and removing changed the files above" >&2; exit 1; }
}

# run_all_tests RELEASE: in the root where the packages were made.
run_all_tests() {
  quietly in_root "$1-build" d2s1r/scripts/install_dependencies.sh build demo test
  quietly in_root "$1-build" sh -c \
    "cd d2s1r && cmake --preset release -DBUILD_TESTING=ON && cmake --build --preset release -j $(nproc)"
  if [ -n "${D2S1R_DATA:-}" ]; then
    mkdir "$roots/$1-build/data"
    mount -o bind,ro "$D2S1R_DATA" "$roots/$1-build/data"
    environment+=(D2S1R_DATA=/data)
  fi
  in_root "$1-build" sh -c "cd d2s1r && ctest --preset release -j $(nproc)" >"$roots/$1-tests.log" 2>&1 || true
  sed -n '/tests passed/,$p' "$roots/$1-tests.log"
}

for release in "$@"; do
  say "making the packages"
  make_packages "$release"
  say "installing, using and removing them"
  try_packages "$release"
  say "MRPT $(in_root "$release-build" dpkg-query -W -f '${Version}' libmrpt-maps-dev): packages are good"
  if [ -n "$with_arm64" ]; then
    say "making the packages of arm64"
    make_arm64_packages "$release"
    say "using them in QEMU"
    try_arm64_packages "$release"
    say "packages of arm64 are good"
  fi
  if [ -n "$with_tests" ]; then
    say "running all tests"
    run_all_tests "$release"
    say "the tests' output is in $roots/$release-tests.log"
  fi
done
