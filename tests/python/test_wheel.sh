#!/usr/bin/env bash
# `pip wheel .` makes a file that holds all that the module needs but numpy: README's lines run with it in an environment that
# has numpy and nothing else. It builds the library anew, without optimization, which would take twice as long.
# Usage: test_wheel.sh SOURCE_FOLDER
set -euo pipefail
/usr/bin/python3 -c 'import setuptools, ensurepip, numpy, pip, venv, wheel' 2>/dev/null ||
  { echo "skipped: python3-pip, python3-setuptools, python3-wheel, python3-venv or python3-numpy is missing"; exit 77; }
sources=$(realpath "$1")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
git clone --quiet --depth 1 "file://$sources" clone 2>/dev/null || { mkdir clone && cp -r "$sources"/* clone/ && rm -rf clone/build; }
CMAKE_ARGS=-DCMAKE_CXX_FLAGS_RELEASE=-O0 /usr/bin/python3 -m pip wheel --quiet --no-index --no-deps --no-build-isolation --wheel-dir . ./clone
/usr/bin/python3 -m venv bare
bare/bin/pip install --quiet --no-index --no-deps d2s1r-*.whl
packages=$(echo bare/lib/python3*/site-packages)
ln -s "$(/usr/bin/python3 -c 'import numpy; print(numpy.__path__[0])')" "$packages/numpy"
unset PYTHONPATH LD_LIBRARY_PATH
libraries=$(ldd "$packages"/d2s1r/_d2s1r*.so | grep '=> /' | grep -v "$folder" || true)
if grep -v -E 'lib(c|m|dl|rt|pthread|resolv|util|gcc_s|stdc\+\+)\.so' <<<"$libraries"; then
  echo "the module needs these libraries of the system" >&2
  exit 1
fi
sed -n '/^```python$/,/^```$/p' clone/README.md | grep -v '```' >readme.py
cd clone
"$folder/bare/bin/python" "$folder/readme.py"
