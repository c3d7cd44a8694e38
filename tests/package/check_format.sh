#!/usr/bin/env bash
# All sources are laid out as .clang-format says; clang-format -i FILE corrects one.
# Usage: check_format.sh CLANG_FORMAT SOURCE_FOLDER
set -euo pipefail
cd "$2"
find . -path "./build*" -prune -o \( -name "*.cpp" -o -name "*.h" \) -print0 |
  xargs -0 --no-run-if-empty "$1" --dry-run --Werror
