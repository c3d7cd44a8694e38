#!/usr/bin/env bash
# What a robot carries loads at most 50 libraries, and none of those that draw, or read images and logs for MRPT.
# Usage: check_closure.sh FILE...
set -euo pipefail
for file in "$@"; do
  libraries=$(ldd "$file")
  if grep -E 'libmrpt.(obs|maps|img|opengl|viz|io|slam|vision|gui)|libopencv|libgdal|not found' <<<"$libraries"; then
    echo "$file loads the libraries above" >&2
    exit 1
  fi
  count=$(wc -l <<<"$libraries")
  echo "$file loads $count libraries"
  [ "$count" -le 50 ] || exit 1
done
