#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Checks the sources of the libraries and the command, and the headers that they include, by clang-tidy 14 with the checks of .clang-tidy.
#
#   tests/tidy.sh [PATTERN]    only the translation units whose path has PATTERN
set -eu

root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
cd "$root"
for tool in clang-tidy-14 clang++; do
  if ! command -v $tool >/dev/null; then
    echo "$tool is not installed: vendor/install.sh ci" >&2
    exit 1
  fi
done
if command -v ninja >/dev/null; then export CMAKE_GENERATOR="${CMAKE_GENERATOR:-Ninja}"; fi
mkdir -p build
# Several sources make one translation unit (lrt_compile_together), which saves most of the time.
cmake -S . -B build/tidy -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_COMPILER=clang++ -DCMAKE_EXPORT_COMPILE_COMMANDS=ON -DLRT_SANITIZE= \
  -DLRT_BUILD_TESTS=OFF -DLRT_BUILD_EXAMPLES=OFF -DLRT_BUILD_TOOLS=ON >build/tidy.log || {
  cat build/tidy.log
  exit 1
}
units=$(sed -n 's/^ *"file": "\(.*\)",*$/\1/p' build/tidy/compile_commands.json | grep -e "${1-.}")
echo "$units" | tr '\n' '\0' | xargs -0 -P 2 -n 1 clang-tidy-14 -p build/tidy --config-file=.clang-tidy --quiet 2>build/tidy.err || {
  grep -v 'warnings\? generated' build/tidy.err || true
  exit 1
}
echo "$(echo "$units" | wc -l) translation units"
