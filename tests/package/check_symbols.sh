#!/usr/bin/env bash
# Nothing in a bundle needs a newer symbol than those of Ubuntu 22.04, or a library that neither the bundle nor every
# system has; all libraries are found from where they lie.
# Usage: check_symbols.sh FOLDER
set -euo pipefail
declare -A most=([GLIBC]=2.35 [GLIBCXX]=3.4.30 [CXXABI]=1.3.13 [GCC]=12.0.0)
checked=0 wrong=0
complain() { echo "$1" >&2; wrong=$((wrong + 1)); }
while IFS= read -r -d '' file; do
  readelf --file-header "$file" >/dev/null 2>&1 || continue
  checked=$((checked + 1))
  while IFS=_ read -r kind version; do
    newest=$(printf '%s\n%s\n' "$version" "${most[$kind]}" | sort -V | tail -n 1)
    [ "$newest" = "${most[$kind]}" ] || complain "$file needs ${kind}_$version"
  done < <(readelf --version-info --wide "$file" | sed -n '/Version needs/,$p' |
    grep -oE '\b(GLIBC|GLIBCXX|CXXABI|GCC)_[0-9.]+' | sort -u)
  dynamic=$(readelf --dynamic --wide "$file")
  for library in $(sed -n 's/.*(NEEDED).*\[\(.*\)\]/\1/p' <<<"$dynamic"); do
    case "$library" in ld-linux* | lib[cm].so.6 | libdl.so.2 | libpthread.so.0 | librt.so.1 | libstdc++.so.6 | libgcc_s.so.1) ;;
      *) [ -e "$1/lib/$library" ] || complain "$file needs $library" ;;
    esac
  done
  if grep -E 'R(UN)?PATH' <<<"$dynamic" | grep -vE '\[(\$ORIGIN[^:]*:?)+\]'; then complain "$file looks there for libraries"; fi
done < <(find "$1" -type f -print0)
echo "$checked files checked"
[ "$checked" -gt 30 ] && [ "$wrong" -eq 0 ]
size=$(du -sm --apparent-size "$1" | cut -f1)
[ "$size" -le 80 ] || { echo "$1 takes $size MB" >&2; exit 1; }
