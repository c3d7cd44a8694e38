#!/usr/bin/env bash
# Who is not root is asked before packages are installed with sudo, if there is a terminal, also by demo.sh; id,
# dpkg-query, sudo and so apt-get are stand-ins here.
# Usage: check_sudo.sh SOURCE_FOLDER
set -euo pipefail
install="$1/scripts/install_dependencies.sh build"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
stand_in() { printf '#!/bin/sh\n%s\n' "$2" >"$folder/$1" && chmod +x "$folder/$1"; }
stand_in id 'echo "${FAKE_UID:-1000}"'
stand_in dpkg-query 'echo not-installed'
stand_in sudo "echo \"\$*\" >>$folder/sudo_was_used"
stand_in env "[ \"\$1\" = DEBIAN_FRONTEND=noninteractive ] && echo \"\$*\" >>$folder/root_was_used"
export PATH="$folder:$PATH"

fail() { echo "$1" >&2; cat "$folder/output" >&2; exit 1; }
at_a_terminal() { script -qec "/usr/bin/env bash ${2:-$install}" /dev/null <<<"$1" >"$folder/output" 2>&1; }

for command in "$install" "$1/demo.sh"; do
  if at_a_terminal n "$command"; then fail "$command went on after the answer no"; fi
  [ ! -e "$folder/sudo_was_used" ] || fail "$command used sudo after the answer no"
  grep -q 'with sudo apt-get: g++ cmake' "$folder/output" || fail "$command did not say what it wants to install"
  grep -q 'sudo apt-get install' "$folder/output" || fail "$command did not say what to do by hand"
done

at_a_terminal y || fail "failed after the answer yes"
grep -q 'apt-get.* install .*g++ cmake' "$folder/sudo_was_used" || fail "installed nothing after the answer yes"

rm "$folder/sudo_was_used"
bash $install </dev/null >"$folder/output" 2>&1 || fail "failed without a terminal"
[ -e "$folder/sudo_was_used" ] || fail "installed nothing without a terminal"

rm "$folder/sudo_was_used"
FAKE_UID=0 at_a_terminal '' || fail "failed as root"
[ ! -e "$folder/sudo_was_used" ] || fail "used sudo as root"
grep -q 'apt-get.* install .*g++ cmake' "$folder/root_was_used" || fail "installed nothing as root"
