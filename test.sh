#!/usr/bin/env bash
# Builds everything and runs all tests, then with Clang the unit tests once more under AddressSanitizer and
# UndefinedBehaviorSanitizer, and with them each fuzz target for 10 s. Takes a bare Debian 12 machine (root, or a user with
# sudo, who is asked first) to a result.
set -euo pipefail
cd "$(dirname "$0")"
scripts/install_dependencies.sh build package demo test
jobs=$(nproc)

cmake --preset release -DBUILD_TESTING=ON -DD2S1R_WERROR=ON
cmake --build --preset release -j "$jobs"
ctest --preset release -j "$((jobs + 1))"  # some tests wait

cmake --preset asan -DD2S1R_WERROR=ON
cmake --build --preset asan -j "$jobs" --target unit_tests
ctest --preset asan -j "$((jobs + 1))"
