#!/usr/bin/env bash
# Nothing we build may load wxWidgets (mrpt::apps drags it in): it has no place on a robot without a screen.
# Usage: check_libraries.sh BUILD_FOLDER
set -euo pipefail
checked=0
while IFS= read -r -d '' file; do
  [ "$(head -c 4 "$file" | tail -c 3)" = ELF ] || continue
  libraries=$(ldd "$file")
  if grep -i -E 'libwx|not found' <<<"$libraries"; then
    echo "$file loads the libraries above" >&2
    exit 1
  fi
  checked=$((checked + 1))
done < <(find "$1" -type f -perm -u+x ! -path '*/CMakeFiles/*' -print0)
echo "$checked files checked"
[ "$checked" -gt 1 ]
