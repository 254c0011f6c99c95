#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing, builds in build/dev, and runs tests. The last lines list the parts that were skipped, with their reasons
# (tests/README.md).
#
#   tests/run.sh              the tests of the modules, the lessons, the checks of sources and pages: 10 minutes on two cores
#   tests/run.sh --all        builds everything and runs all tests of CI
#   tests/run.sh --evidence   builds everything and runs the long proofs, which CI has in a short form
#   tests/run.sh ... -R NAME  only tests of these whose name matches; other arguments of ctest too
set -eu

root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
step() { echo "tests/run.sh: $*"; }

targets="quick_tests"
which="-L ^quick$"
case ${1-} in
  --all)
    shift
    targets=all
    which="-LE ^evidence$"
    ;;
  --evidence)
    shift
    targets=all
    which="-L ^evidence$"
    ;;
esac

step "1 of 4: installs the packages that are missing"
"$root/vendor/install.sh" tests

if command -v ninja >/dev/null; then export CMAKE_GENERATOR="${CMAKE_GENERATOR:-Ninja}"; fi
if command -v ccache >/dev/null; then
  export CMAKE_CXX_COMPILER_LAUNCHER="${CMAKE_CXX_COMPILER_LAUNCHER:-ccache}"
  export CCACHE_SLOPPINESS="${CCACHE_SLOPPINESS:-pch_defines,time_macros}"  # else it keeps no object that has precompiled headers
fi

cd "$root"
step "2 of 4: configures build/dev"
cmake --preset dev
step "3 of 4: compiles and links in build/dev"
NINJA_STATUS='[%f of %t, %e s] ' cmake --build --preset dev --target $targets
step "4 of 4: runs the tests"
status=0
# shellcheck disable=SC2086  # an option and its argument
ctest --preset dev $which "$@" || status=$?
# "1/9 Testing: NAME", and further down "Test time =  23.45 sec". tests/README.md says why these are long.
awk '/^[0-9]+\/[0-9]+ Testing: / { name = $3 } /^Test time = / && $4 > 20 { printf "longer than 20 s: %s, %.0f s\n", name, $4 }' build/dev/Testing/Temporary/LastTest.log
"$root/tests/skips.sh" build/dev
exit "$status"
