#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing, builds everything in build/dev, and runs all tests. The last lines list the parts that were skipped, with their
# reasons (tests/README.md).
#
#   tests/run.sh [arguments of ctest: -R NAME, --rerun-failed, ...]
set -eu

root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
"$root/vendor/install.sh" tests

if command -v ninja >/dev/null; then export CMAKE_GENERATOR="${CMAKE_GENERATOR:-Ninja}"; fi
if command -v ccache >/dev/null; then export CMAKE_CXX_COMPILER_LAUNCHER="${CMAKE_CXX_COMPILER_LAUNCHER:-ccache}"; fi

cd "$root"
cmake --preset dev
cmake --build --preset dev
status=0
ctest --preset dev "$@" || status=$?
"$root/tests/skips.sh" build/dev
exit "$status"
