#!/usr/bin/env bash
# The Debian packages hold all components of the installation, each file once, depend on what they need, and name one version.
# Usage: check_packages.sh BUILD_FOLDER VERSION
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
fail() { echo "$1" >&2; exit 1; }
if grep -qE '^mrpt.maps_DIR:PATH=' "$1/CMakeCache.txt" && ! grep -qE '^mrpt.maps_DIR:PATH=/usr/lib/' "$1/CMakeCache.txt"; then
	echo "skipped: this MRPT is of no package that ours could depend on"
	exit 77
fi
# Compressing well takes long, and what is to be packed is built already, which CPack does not look up for Ninja.
(cd "$1" && cpack -B "$folder" -D CPACK_DEBIAN_COMPRESSION_TYPE=gzip -D CPACK_CMAKE_GENERATOR=Ninja >"$folder/log" 2>&1) || fail "$(cat "$folder/log")"

field() { dpkg-deb --field "$folder/$1"_*.deb "$2"; }
check() {  # check PACKAGE DEPENDS FILE...
	local package=$1 depends=$2 files
	shift 2
	[ "$(field "$package" Version)" = "$version-1" ] || fail "$package is of version $(field "$package" Version)"
	field "$package" Depends | grep -q -- "$depends" || fail "$package depends on $(field "$package" Depends)"
	files=$(dpkg-deb --contents "$folder/$package"_*.deb | sed 's/^\([^ ]* *\)\{5\}\.//; s/ -> .*//' | grep -v '/$')
	for file in "$@" "/usr/share/doc/$package/copyright" "/usr/share/doc/$package/changelog.Debian.gz"; do
		grep -q -- "$file\$" <<<"$files" || fail "$package has no $file, but $files"
	done
	echo "$files" >>"$folder/files"
}
version=$2
abi=${version%.*}
check "libd2s1r$abi" 'libmrpt-poses' "libd2s1r.so.$abi" "libd2s1r.so.$version"
field "libd2s1r$abi" Depends | grep -qE 'libmrpt-(maps|obs|img)' && fail "libd2s1r$abi depends on $(field "libd2s1r$abi" Depends)"
check "libd2s1r-mrpt$abi" 'libmrpt-maps' "libd2s1r-mrpt.so.$abi" "libd2s1r-mrpt.so.$version" "/d2s1r-read-mrpt-map-$abi"
check libd2s1r-mrpt-dev "libd2s1r-mrpt$abi (= $version-1)" /libd2s1r-mrpt.so /d2s1r/mrpt.h /d2s1r-mrpt.pc /d2s1r-mrpt-targets.cmake
check libd2s1r-dev "libd2s1r$abi (= $version-1)" /libd2s1r.so /d2s1r/localizer.h /d2s1r.pc /d2s1r-config.cmake
check d2s1r-tools "libd2s1r-mrpt$abi (= $version-1)" /bin/rawlog-localize /libd2s1r-pf-init.so /rawlog-localize.1.gz \
	/completions/rawlog-localize /config/default.ini /examples/localize_then_track.sh /doc/d2s1r/README.md /doc/d2s1r/doc/usage.md
if compgen -G "$folder/d2s1r-live_*" >/dev/null; then
	check d2s1r-live "libd2s1r$abi (= $version-1)" /bin/d2s1r-live /d2s1r-live.1.gz /completions/d2s1r-live \
		/systemd/system/d2s1r-live.service /bin/d2s1r-live-drive /d2s1r-live-drive.1.gz /lib/d2s1r/d2s1r-live /ament_index/resource_index/packages/d2s1r /d2s1r/package.xml
	field d2s1r-live Depends | grep -q ddsc || fail "d2s1r-live depends on $(field d2s1r-live Depends)"
fi
if compgen -G "$folder/d2s1r-live-ros1_*" >/dev/null; then
	check d2s1r-live-ros1 "libd2s1r$abi (= $version-1)" /bin/d2s1r-live-ros1 /d2s1r-live-ros1.1.gz
fi
if compgen -G "$folder/python3-d2s1r_*" >/dev/null; then
	check python3-d2s1r "python3-numpy" /d2s1r/__init__.py /d2s1r/__init__.pyi /d2s1r/_d2s1r.*so
fi
[ -z "$(sort "$folder/files" | uniq -d)" ] || fail "in two packages: $(sort "$folder/files" | uniq -d)"

components=$(find "$1" -name cmake_install.cmake -exec sed -n 's/.*_COMPONENT STREQUAL "\(.*\)" .*/\1/p' {} + | sort -u)
packed=$(sed -n 's/^set(CPACK_COMPONENTS_ALL "\(.*\)")/\1/p' "$1/CPackConfig.cmake" | tr ';' '\n' | sort)
[ "$components" = "$packed" ] || fail "installed are $components, packed $packed"

changelog=$(dirname "$0")/../../packaging/debian/changelog
[ "$(sed -n '1s/.*(\(.*\)).*/\1/p' "$changelog")" = "$version-1" ] || fail "$changelog starts with another version"
grep -q "^## \[$version\]" "$(dirname "$0")/../../CHANGELOG.md" || fail "CHANGELOG.md has no section $version"
