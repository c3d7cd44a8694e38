#!/usr/bin/env bash
# Writes d2s1r-VERSION-linux-ARCHITECTURE.tar.xz: d2s1r-live, d2s1r-live-drive and rawlog-localize without MRPT's own
# formats, with every library that they need but those of glibc, libstdc++ and libgcc. It is unpacked anywhere, and needs
# no root and no package. Debian 12's compiler and libraries make it: those of newer systems need newer symbols.
# Usage: scripts/make_bundle.sh [--arm64] [--build BUILD_FOLDER] [FOLDER]
#   --arm64   cross-built; `scripts/test_packages.sh --bundle --arm64` does this in a root that has what it needs
#   --build   where target bundle has been built; else it is built in build/bundle or build/bundle-arm64
#   FOLDER    that the file is written to; the current one if none is given
set -euo pipefail
fail() { echo "$1" >&2; exit 1; }
architecture=amd64 triplet=x86_64-linux-gnu build='' options=()
while [ $# -gt 0 ]; do
  case "$1" in
    --arm64) architecture=arm64 triplet=aarch64-linux-gnu options=(--toolchain packaging/arm64.cmake) ;;
    --build) build=$(realpath "$2"); shift ;;
    -*) fail "usage: scripts/make_bundle.sh [--arm64] [--build BUILD_FOLDER] [FOLDER]" ;;
    *) break ;;
  esac
  shift
done
target=$(realpath "${1:-.}")
cd "$(dirname "$0")/.."
if [ -z "$build" ]; then
  build=build/bundle
  [ $architecture = amd64 ] || build=build/bundle-arm64
  cmake --preset bundle -B "$build" "${options[@]}"
  cmake --build "$build" --target bundle -j "$(nproc)"
fi

version=$(sed -n 's/^CMAKE_PROJECT_VERSION:STATIC=//p' "$build/CMakeCache.txt")
name=d2s1r-$version-linux-$architecture
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
root=$work/$name
mkdir -p "$root"
for component in runtime live bundle; do cmake --install "$build" --prefix "$root" --component $component --strip >"$work/log"; done
cp -r share/d2s1r/config share/d2s1r/data "$root/share/d2s1r"
cp share/man/man1/rawlog-localize.1 "$root/share/man/man1"
cp share/bash-completion/completions/rawlog-localize "$root/share/bash-completion/completions"
rm -rf "$root/lib/systemd"  # whose unit names /usr
# The library of Cyclone DDS looks for its own here, and not where the program says.
ln -s . "$root/lib/$triplet"

# needed_by FILE: the names of the libraries that it needs, but for those that every system has.
needed_by() {
  readelf -d "$1" | sed -n 's/.*(NEEDED).*\[\(.*\)\]/\1/p' |
    grep -vE '^(ld-linux.*|lib(c|m|dl|pthread|rt|resolv|util|anl|stdc\+\+|gcc_s)\.so\.[0-9]+)$' || true
}
pending=("$root"/bin/* "$root"/lib/libd2s1r.so.*.*.*)
declare -A seen=()
files=()
while [ ${#pending[@]} -gt 0 ]; do
  file=${pending[0]}
  pending=("${pending[@]:1}")
  for library in $(needed_by "$file"); do
    [ -z "${seen[$library]:-}" ] || continue
    seen[$library]=yes
    [ ! -e "$root/lib/$library" ] || continue
    if [[ $library = libicudata.so.* ]]; then  # of 31 MB; see below
      number=${library##*.}
      continue
    fi
    from=$(find -L "/usr/lib/$triplet" "/lib/$triplet" -maxdepth 1 -name "$library" -print -quit)
    [ -n "$from" ] || fail "$library, which ${file##*/} needs, is not in /usr/lib/$triplet"
    cp -L "$from" "$root/lib/$library"
    pending+=("$root/lib/$library")
    files+=("*/$triplet/$(basename "$(realpath "$from")")")
  done
done
mkdir -p "$root/share/doc/licences"
for package in $(dpkg-query --search "${files[@]}" | sed 's/:.*//' | sort -u); do  # which fails if a file is of none
  cp -L "/usr/share/doc/$package/copyright" "$root/share/doc/licences/$package"
done
# No program asks ICU for anything: it comes with the reader of ini files that MRPT's libraries bring. Its tables are empty.
"${CC:-$([ $architecture = amd64 ] && echo cc || echo aarch64-linux-gnu-gcc)}" -shared -nostdlib -x c -o "$root/lib/libicudata.so.$number" \
  -Wl,-soname,"libicudata.so.$number" - <<<"const char icudt${number}_dat[64] = {0};"

tests/package/check_symbols.sh "$root"
tar -C "$work" --sort=name --owner=root --group=root -cJf "$target/$name.tar.xz" "$name"
echo "$target/$name.tar.xz: $(du -m "$target/$name.tar.xz" | cut -f1) MB, unpacked $(du -sm --apparent-size "$root" | cut -f1) MB"
