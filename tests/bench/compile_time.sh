#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# What including lrt costs: CPU time to compile a file that includes a header of lrt and nothing else, beside one that includes
# the standard headers that the header brings along. Medians of 5.
#
#   tests/bench/compile_time.sh [header, default lrt/lrt.hpp] [flags of the compiler, default -std=c++17]
#   tests/bench/compile_time.sh FILE.cpp [flags of the compiler, default -std=c++17 -O2]   a lesson, for example
#   tests/bench/compile_time.sh records [flags of the compiler, default -std=c++17 -O2]    40 writable records of 6 fields, 20 numbers
#   tests/bench/compile_time.sh library [arguments of cmake, default the preset release]    CPU time of the library from nothing
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/../.." && pwd)
if [[ ${1:-} == library ]]; then
  shift
  if (($# == 0)); then set -- --preset release; fi
  build=$(mktemp -d)
  trap 'rm -rf "$build"' EXIT
  cd "$root"
  cmake "$@" -B "$build" -DCMAKE_CXX_COMPILER_LAUNCHER= >"$build/configure.log"
  TIMEFORMAT='%U %S'
  { time cmake --build "$build" --target lrt -j"$(nproc)" >"$build/build.log"; } 2>&1 |
    awk '{ printf "the library from nothing: %.0f s of CPU\n", $1 + $2 }'
  exit
fi
compiler=${CXX:-g++}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

median() {
  local times=()
  for _ in 1 2 3 4 5; do
    TIMEFORMAT='%U %S'
    times+=("$({ time "$compiler" "${flags[@]}" -I"$root/include" -c "$1" -o "$work/object.o"; } 2>&1 | awk '{ print $1 + $2 }')")
  done
  printf '%s\n' "${times[@]}" | sort -n | sed -n 3p
}

if [[ ${1:-} == records ]]; then
  shift
  flags=("$@")
  if ((${#flags[@]} == 0)); then flags=(-std=c++17 -O2); fi
  echo "#include <lrt/lrt.hpp>" >"$work/headers.cpp"
  python3 -B "$root/tests/bench/records.py" source 40 6 pulled >"$work/pulled.cpp"
  python3 -B "$root/tests/bench/records.py" source 40 6 pushed >"$work/pushed.cpp"
  {
    echo "#include <lrt/lrt.hpp>"
    echo "lrt::Thing describe(double* v);"
    echo "lrt::Thing describe(double* v) {"
    echo "  lrt::Thing thing{\"robot\"};"
    for i in {0..19}; do echo "  thing.property(\"p$i\", [v] { return v[$i]; }, lrt::unit::radian).on_write([v](double x) { v[$i] = x; });"; done
    echo "  return thing;"
    echo "}"
  } >"$work/numbers.cpp"
  for program in headers numbers pulled pushed; do
    seconds=$(median "$work/$program.cpp")
    echo "$program (${flags[*]}): $seconds s, $(size "$work/object.o" | awk 'NR == 2 { print $1 }') bytes of text"
  done
  exit
fi
if [[ ${1:-} == *.cpp ]]; then
  source=$1
  shift
  flags=("$@")
  if ((${#flags[@]} == 0)); then flags=(-std=c++17 -O2); fi
  flags+=(-I"$root")
  echo "$source (${flags[*]::${#flags[@]}-1}): $(median "$source") s"
  exit
fi
header=${1:-lrt/lrt.hpp}
if (($# > 0)); then shift; fi
flags=("$@")
if ((${#flags[@]} == 0)); then flags=(-std=c++17); fi

[[ -f $root/include/$header ]] || { echo "$0: no include/$header" >&2; exit 1; }
echo "#include <$header>" >"$work/lrt.cpp"
# The headers of lrt that it brings, by -H; what these include and is not of lrt.
"$compiler" "${flags[@]}" -I"$root/include" -H -fsyntax-only "$work/lrt.cpp" 2>&1 |
  sed -n "s|^\.\.* \($root/include/lrt/.*\)|\1|p" | sort -u >"$work/headers"
tr '\n' '\0' <"$work/headers" | xargs -0 sed -n 's|^#include \(<[a-z0-9_.]*>\).*|#include \1|p' | sort -u >"$work/std.cpp"

with_lrt=$(median "$work/lrt.cpp")
with_std=$(median "$work/std.cpp")
echo "$header (${flags[*]}): $with_lrt s, $(wc -l <"$work/headers") headers of lrt"
echo "the $(wc -l <"$work/std.cpp") standard headers in it: $with_std s"
awk "BEGIN { printf \"ratio %.2f\\n\", $with_lrt / $with_std }"
