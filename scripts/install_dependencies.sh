#!/usr/bin/env bash
# Installs the packages of dependencies.txt that the given purposes need and that are missing. If the user is not root, the
# script uses sudo, and asks first if there is a terminal to ask at.
# Usage: scripts/install_dependencies.sh build [package] [demo] [test] [develop] [ros1]
set -euo pipefail
for purpose in "${@:-}"; do
  case "$purpose" in build | package | demo | test | develop | ros1) ;; *)
    echo "usage: scripts/install_dependencies.sh build [package] [demo] [test] [develop] [ros1]" >&2
    exit 1 ;;
  esac
done
list="$(dirname "$0")/../dependencies.txt"

missing=()
while read -r package purpose _; do
  case "$package" in '' | '#'*) continue ;; esac
  case " $* " in *" $purpose "*) ;; *) continue ;; esac
  status=$(dpkg-query --show --showformat='${Status}' "$package" 2>/dev/null || true)
  [ "$status" = 'install ok installed' ] || missing+=("$package")
done <"$list"
[ ${#missing[@]} -gt 0 ] || { echo "Nothing is missing."; exit 0; }

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "install these as root, then run again: ${missing[*]}" >&2; exit 1; }
  as_root=(sudo)
  if [ -t 0 ] && [ -t 2 ]; then
    echo "To be installed with sudo apt-get: ${missing[*]}" >&2
    read -r -p 'Go on? [y/N] ' answer
    case "$answer" in [yY]*) ;; *)
      echo "nothing was installed; by hand: sudo apt-get install --no-install-recommends ${missing[*]}" >&2
      exit 1 ;;
    esac
  fi
fi
echo "Installing ${missing[*]} ..."
log=$(mktemp)
trap 'rm -f "$log"' EXIT
apt() { "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq -y "$@" >>"$log" 2>&1; }
if ! { apt update && apt install --no-install-recommends "${missing[@]}"; }; then
  cat "$log" >&2
  echo "apt-get failed, see above; the packages are those of Debian 12" >&2
  exit 1
fi
