#!/usr/bin/env bash
# Makes the Debian packages in a bare root of each given release of Debian, installs them in another bare one, uses them
# there (demo, Python module, tests of what is installed), removes them, and looks for what is left.
# Usage, as root, with mmdebstrap: scripts/test_packages.sh [--tests] [--arm64] [--bundle] [RELEASE...]
#   --tests  run all tests as well, in the root that the packages were made in
#   --arm64  instead, make those of arm64, too, by Debian's cross compiler, compare what both hold, use those of arm64 in
#            QEMU, and compare the poses; needs qemu-user-static and binfmt-support
#   --bundle instead, make the bundle on Debian 12 and use it; with --arm64 that of arm64, in QEMU
#   RELEASE  bookworm or trixie; both if none is given
# The roots are in a temporary folder, or in $D2S1R_ROOTS, which is kept. Recorded data is used if $D2S1R_DATA is set.
set -euo pipefail
cd "$(dirname "$0")/.."
if [ "${D2S1R_MOUNTS:-}" != own ]; then  # what is mounted below is unmounted when the inner process ends
  if [ -z "${D2S1R_ROOTS:-}" ]; then
    D2S1R_ROOTS=$(mktemp -d /var/tmp/d2s1r-roots.XXXXXX)
    trap 'rm -rf --one-file-system "$D2S1R_ROOTS"' EXIT
  fi
  export D2S1R_ROOTS
  D2S1R_MOUNTS=own unshare --mount --propagation private "$0" "$@"
  exit
fi

with_tests='' with_arm64='' with_bundle=''
while [ $# -gt 0 ]; do
  case "$1" in --tests) with_tests=yes ;; --arm64) with_arm64=yes ;; --bundle) with_bundle=yes ;; -*)
    echo "usage: scripts/test_packages.sh [--tests] [--arm64] [--bundle] [RELEASE...]" >&2
    exit 1 ;;
  *) break ;; esac
  shift
done
if [ -n "$with_arm64" ] && ! grep -qs enabled /proc/sys/fs/binfmt_misc/qemu-aarch64; then
  echo "--arm64: this machine does not run programs of arm64; install qemu-user-static and binfmt-support" >&2
  exit 1
fi
[ -z "$with_bundle" ] || set -- bookworm
[ $# -gt 0 ] || set -- bookworm trixie
roots=$D2S1R_ROOTS
mkdir -p "$roots/debs"

say() { echo "$(date +%H:%M:%S) $release: $*"; }
# in_root ROOT COMMAND...: runs a command in $roots/ROOT, where `environment` is all that it knows of this one.
environment=(PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 HOME=/root
  DEBIAN_FRONTEND=noninteractive)
in_root() { chroot "$roots/$1" env -i "${environment[@]}" "${@:2}"; }
# quietly COMMAND...: shows what the command prints only if it fails.
quietly() { "$@" >"$roots/log" 2>&1 || { tail -n 100 "$roots/log" >&2; echo "failed: $*" >&2; exit 1; }; }
install() { quietly in_root "$1" apt-get -y install --no-install-recommends "${@:2}"; }

# new_root RELEASE ROOT: a bare system, from an archive that is made once. All roots share what apt fetches.
new_root() {
  if [ ! -e "$roots/$1.tar" ]; then
    quietly mmdebstrap --variant=minbase --include=ca-certificates "$1" "$roots/new.tar" http://deb.debian.org/debian
    mv "$roots/new.tar" "$roots/$1.tar"
  fi
  rm -rf --one-file-system "${roots:?}/$2"
  mkdir "$roots/$2"
  tar -xf "$roots/$1.tar" -C "$roots/$2" --exclude='./dev/*'
  mount -t proc proc "$roots/$2/proc"
  mount --rbind /dev "$roots/$2/dev"
  mount --bind "$roots/debs" "$roots/$2/var/cache/apt/archives"
  cp /etc/resolv.conf "$roots/$2/etc/"
  echo force-unsafe-io >"$roots/$2/etc/dpkg/dpkg.cfg.d/unsafe"  # the root is not to outlive a loss of power
  quietly in_root "$2" apt-get update
}

# copy_sources ROOT: to its folder d2s1r.
copy_sources() {
  mkdir "$roots/$1/d2s1r"
  git ls-files -z | tar -c --null -T - | tar -x -C "$roots/$1/d2s1r"
}

# make_packages RELEASE: leaves them in $roots/RELEASE-build/d2s1r/build/package/packages.
make_packages() {
  new_root "$1" "$1-build"
  copy_sources "$1-build"
  quietly in_root "$1-build" d2s1r/scripts/install_dependencies.sh build package
  install "$1-build" lintian
  quietly in_root "$1-build" sh -c \
    "cd d2s1r && cmake --preset package && cmake --build --preset package -j $(nproc)"
  in_root "$1-build" sh -c "lintian --fail-on error --allow-root d2s1r/build/package/packages/*.deb"
}

# use_packages ROOT: as a user does, with the program, as a library and in Python.
use_packages() {
  local map=/usr/share/mrpt/datasets/localization_demo.simplemap.gz log=/usr/share/mrpt/datasets/localization_demo.rawlog
  quietly in_root "$1" rawlog-localize -m $map -i $log -o /tmp/demo
  quietly in_root "$1" sh -c "g++ -std=c++17 /tests/print_scans.cpp -o /tmp/print_scans \$(pkg-config --cflags --libs d2s1r-mrpt)
    /tmp/print_scans $log >/tmp/scans"
  in_root "$1" python3 /tests/localize_demo.py $map /tmp/scans /tmp/demo/frames.csv
  quietly in_root "$1" /tests/use_prefix.sh /usr
}

# bundle_root ROOT: a root where the bundle can be made, of the architecture that is asked for.
bundle_root() {
  if [ -n "$with_arm64" ]; then
    arm64_build_root "$release" "$1"
  else
    new_root "$release" "$1"
    copy_sources "$1"
    quietly in_root "$1" d2s1r/scripts/install_dependencies.sh build package
  fi
}

# try_bundle: makes it, and uses it in a root within that root.
try_bundle() {
  local root=$release-bundle option='' names=(x86_64-linux-gnu /lib64/ld-linux-x86-64.so.2 /bin/dash)
  if [ -n "$with_arm64" ]; then
    option=--arm64
    names=(aarch64-linux-gnu /lib/ld-linux-aarch64.so.1 /arm64-dash/bin/dash)
  fi
  bundle_root "$root"
  # shellcheck disable=SC2086  # none or one word
  quietly in_root "$root" d2s1r/scripts/make_bundle.sh $option /
  tests/package/use_bundle.sh "$roots/$root"/d2s1r-*.tar.xz 60 "$roots/$root" "${names[@]}"
  ls -l "$roots/$root"/d2s1r-*.tar.xz
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
  quietly in_root "$1-build" d2s1r/scripts/install_dependencies.sh build package demo test
  quietly in_root "$1-build" sh -c \
    "cd d2s1r && cmake --preset release -DBUILD_TESTING=ON && cmake --build --preset release -j $(nproc)"
  if [ -n "${D2S1R_DATA:-}" ]; then
    mkdir "$roots/$1-build/data"
    mount -o bind,ro "$D2S1R_DATA" "$roots/$1-build/data"
    environment+=(D2S1R_DATA=/data)
  fi
  in_root "$1-build" sh -c "cd d2s1r && ctest --preset release -j $(nproc)" >"$roots/tests.log" 2>&1 || true
  sed -n '/tests passed/,$p' "$roots/tests.log"
}

# shellcheck source=packaging/arm64_packages.sh
[ -z "$with_arm64" ] || . packaging/arm64_packages.sh
for release in "$@"; do
  if [ -n "$with_bundle" ]; then
    say "making and using the bundle"
    try_bundle
    continue
  fi
  say "making the packages"
  make_packages "$release"
  if [ -n "$with_arm64" ]; then
    say "making the packages of arm64"
    make_arm64_packages "$release"
    say "comparing what the packages of both architectures hold"
    compare_files "$release"
    say "using those of arm64 in QEMU"
    compare_poses "$release"
    say "packages of arm64 are good"
    continue
  fi
  say "installing, using and removing them"
  try_packages "$release"
  say "MRPT $(in_root "$release-build" dpkg-query -W -f '${Version}' libmrpt-maps-dev): packages are good"
  if [ -n "$with_tests" ]; then
    say "running all tests"
    run_all_tests "$release"
  fi
done
