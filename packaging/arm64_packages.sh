# Part of scripts/test_packages.sh, which says what it needs: packages of arm64, compared with those of amd64.
# shellcheck shell=bash disable=SC2154  # $roots is that of the script

# cross_dependencies ROOT: prints what is needed to build, as packages of arm64 unless they run while building.
cross_dependencies() {
  local package purpose
  # amd64's libmrpt-common-dev would satisfy the others, but its config.h is that of another processor.
  echo crossbuild-essential-arm64 dpkg-dev file lintian libmrpt-common-dev:arm64 libpython3-dev:arm64
  while read -r package purpose _; do
    [ "$purpose" = build ] || continue
    case "$package" in
      g++) ;;  # crossbuild-essential-arm64
      libtf2-dev) echo libtf2-dev libtf2-2d:arm64 libroscpp-core-dev:arm64 libconsole-bridge-dev:arm64 ;;
      cmake | ninja-build | pkg-config | python3-* | cyclonedds-tools) echo "$package" ;;
      *)
        case "$(in_root "$1" apt-cache show "$package")" in
          *"Architecture: all"*) echo "$package" ;;
          *) echo "$package:arm64" ;;
        esac ;;
    esac
  done <dependencies.txt
}

# new_arm64_root RELEASE ROOT: a bare system of amd64 that runs programs of arm64, too, in QEMU. One of arm64 alone would
# take QEMU a quarter of an hour to install.
new_arm64_root() {
  new_root "$1" "$2"
  quietly in_root "$2" sh -c "dpkg --add-architecture arm64 && apt-get update"
}

# arm64_build_root RELEASE ROOT: one with the sources and all that builds them, and a shell of arm64.
arm64_build_root() {
  new_arm64_root "$1" "$2"
  copy_sources "$2"
  # shellcheck disable=SC2046  # the names are words
  install "$2" $(cross_dependencies "$2")
  # libtf2-dev:arm64 depends on a generator of messages that cannot be installed beside that of amd64.
  quietly in_root "$2" sh -c "cd /tmp && apt-get download libtf2-dev:arm64 dash:arm64 && dpkg -x libtf2-dev_*_arm64.deb / &&
    dpkg -x dash_*_arm64.deb /arm64-dash"
}

# make_arm64_packages RELEASE: leaves them in $roots/RELEASE-arm64-build/d2s1r/build/package/packages.
make_arm64_packages() {
  local root=$1-arm64-build
  arm64_build_root "$1" "$root"
  quietly in_root "$root" sh -c "cd d2s1r && cmake --preset package --toolchain packaging/arm64.cmake &&
    env DEB_HOST_ARCH=arm64 DEB_HOST_GNU_TYPE=aarch64-linux-gnu cmake --build --preset package -j $(nproc)"
  in_root "$root" sh -c "lintian --fail-on error --allow-root d2s1r/build/package/packages/*.deb"
}

as_multiarch='s/(x86_64|aarch64)-linux-gnu/MULTIARCH/g'

# unpack BUILD_ROOT FOLDER: unpacks the packages, one folder each, so that folders of two architectures compare as equal:
# machine code is emptied, and the names of the architecture are replaced.
unpack() {
  local package name file
  rm -rf "$2"
  mkdir "$2"
  for package in "$roots/$1/d2s1r/build/package/packages/"*.deb; do
    name=$(dpkg-deb --field "$package" Package)
    dpkg-deb --extract "$package" "$2/$name"
    dpkg-deb --contents "$package" | awk '{ print $1, $2, $6, $7, $8 }' | sed -E "$as_multiarch" | sort >"$2/$name.list"
  done
  find "$2" -type f | while read -r file; do
    if [ "$(head -c 4 "$file" | tr -d '\0')" = $'\177ELF' ]; then
      : >"$file"
    else
      sed -i -E "$as_multiarch" "$file"
    fi
  done
  find "$2" -depth -name '*-linux-gnu*' | while read -r file; do
    mv "$file" "$(dirname "$file")/$(basename "$file" | sed -E "$as_multiarch")"
  done
}

# compare_files RELEASE
compare_files() {
  unpack "$1-build" "$roots/files-amd64"
  unpack "$1-arm64-build" "$roots/files-arm64"
  diff --recursive --no-dereference "$roots/files-amd64" "$roots/files-arm64" ||
    { echo "the packages of the two architectures hold other files, see above" >&2; exit 1; }
  echo "$(find "$roots/files-arm64" ! -type d ! -name '*.list' | wc -l) files are the same, but for machine code"
}

# localize_samples ROOT: MRPT's demo and the installed office, 104 scans, alone, in windows and with the filter; what is
# promised to be the same everywhere is in /samples, one folder a run. If $D2S1R_DATA is set, 100 scans of each of four
# buildings, too.
localize_samples() {
  local demo=/usr/share/mrpt/datasets/localization_demo office=/usr/share/d2s1r/data/office site
  local run="rawlog-localize -q -o"  # and a folder
  quietly in_root "$1" sh -c "mkdir /samples && cd /samples &&
    $run demo -m $demo.simplemap.gz -i $demo.rawlog && $run demo_fuse -m $demo.simplemap.gz -i $demo.rawlog --fuse &&
    $run office -m $office.yaml -i $office.rawlog &&
    $run office_together -m $office.yaml -i $office.rawlog --fuse --window 10"
  if [ -n "${D2S1R_DATA:-}" ]; then
    mkdir "$roots/$1/data"
    mount -o bind,ro "$D2S1R_DATA" "$roots/$1/data"
    for site in intel fr079 mit_csail mit_killian; do
      quietly in_root "$1" rawlog-localize -q -o "/samples/$site" -m "/data/$site/map_test.yaml" \
        -i "/data/$site/test.rawlog" --frames 0:500:5
    done
  fi
  quietly in_root "$1" python3 - <<'end'
import csv, pathlib
for table in pathlib.Path("/samples").glob("*/*.csv"):
    rows = [{k: v for k, v in row.items() if not k.endswith("_ms")} for row in csv.DictReader(open(table))]
    with open(table, "w") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
end
}

# compare_poses RELEASE: installs the packages of arm64 in a root that has nothing else of arm64, those of amd64 where they
# were made, and uses both; the poses must be the same, digit for digit.
compare_poses() {
  local root made file count=0
  new_arm64_root "$1" "$1-arm64-use"
  for made in "$1-build" "$1-arm64-build"; do
    root=$made
    [ "$made" = "$1-build" ] || root=$1-arm64-use
    mkdir "$roots/$root/packages"
    cp "$roots/$made/d2s1r/build/package/packages/"*.deb "$roots/$root/packages"
    quietly in_root "$root" sh -c 'apt-get -y install --no-install-recommends /packages/*.deb mrpt-common'
    localize_samples "$root"
  done
  for file in "$roots/$1-build/samples/"*/{frames.csv,hypotheses.csv,fused.csv,fused.tum,trajectory.tum,trajectory.txt}; do
    [ -e "$file" ] || continue
    cmp "$file" "${file/"$1-build"/"$1-arm64-use"}" || { echo "results of the two architectures differ" >&2; exit 1; }
    count=$((count + 1))
  done
  echo "$count files of results are the same, byte for byte"
  quietly in_root "$1-arm64-use" python3 -c "import d2s1r; d2s1r.Localizer"
}
