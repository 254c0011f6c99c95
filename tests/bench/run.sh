#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# What lrt costs, beside the least that any program could do on this machine: builds the programs, and prints a table of lrt, that limit, and
# their ratio. Twelve minutes at most once it is built; on loopback, bounded in count and time. Nothing is asserted.
#
#   tests/bench/run.sh [--json FILE] [--parts get,push,...] [--rounds 3] [--seconds 3]      (run.py has them all)
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/../.." && pwd)
"$root/vendor/install.sh" tests
if command -v ninja >/dev/null; then export CMAKE_GENERATOR="${CMAKE_GENERATOR:-Ninja}"; fi
if command -v ccache >/dev/null; then export CMAKE_CXX_COMPILER_LAUNCHER="${CMAKE_CXX_COMPILER_LAUNCHER:-ccache}"; fi
(cd "$root" && cmake --preset release >/dev/null && cmake --build --preset release --target lrt_bench)
exec python3 -B "$root/tests/bench/run.py" "$root/build/release" "$@"
