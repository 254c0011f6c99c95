#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Do the public headers, and programs that use their templates, compile with each compiler in each language mode, without a warning?
# All headers in one file, which is only parsed: 4 s for each combination. (tests/headers compiles each header alone, with one compiler.)
# lrt needs exceptions, and says so in one line: include/lrt/base/language.hpp.
#
#   tests/portability/headers.sh [COMPILER...]   default: each of g++ and clang++, with any version number, that is installed
#   LRT_SYSROOT=FOLDER                           with the libraries of tests/portability/sysroot.sh
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/../.." && pwd)
cd "$root"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

compilers=("$@")
if ((${#compilers[@]} == 0)); then
  for name in g++ clang++ $(seq -f 'g++-%g' 12 20) $(seq -f 'clang++-%g' 14 30); do
    path=$(command -v "$name") || continue
    path=$(realpath "$path")
    if [[ " ${compilers[*]} " != *" $path "* ]]; then compilers+=("$path"); fi
  done
fi

# Of third parties, whose warnings are not ours: -isystem.
sysroot=${LRT_SYSROOT:-}
options=(-fsyntax-only -Iinclude -I. -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -Werror)
if [[ -n $sysroot ]]; then options+=("--sysroot=$sysroot"); fi
options+=(-isystem "$sysroot/usr/include/eigen3")
options+=(-isystem "$sysroot/usr/include/raptor2" -isystem "$sysroot/usr/include/rasqal")  # the header of librdf includes them
left_out=()
[[ -d $sysroot/usr/include/eigen3 ]] || left_out+=(lrt/eigen.hpp)
[[ -f $sysroot/usr/include/httplib.h ]] || left_out+=(lrt/httplib.hpp)
[[ -f $sysroot/usr/include/redland.h ]] || left_out+=(lrt/redland.hpp)
if ((${#left_out[@]} > 0)); then echo "left out, because their libraries are not installed: ${left_out[*]}"; fi

while IFS= read -r header; do
  header=${header#include/}
  if [[ " ${left_out[*]} " != *" $header "* ]]; then echo "#include <$header>"; fi
done < <(find include/lrt -name '*.hpp' | sort) >"$work/headers.hpp"
cat "$work/headers.hpp" tests/headers/templates.cpp examples/t23_client/main.cpp >"$work/all.cpp"

status=0
count=0
check() {
  local title=$1
  shift
  local start=$SECONDS
  if "$@" "${options[@]}" 2>"$work/log"; then
    printf '%-60s accepted, %d s\n' "$title" $((SECONDS - start))
  else
    printf '%-60s REFUSED\n' "$title"
    head -n 40 "$work/log"
    status=1
  fi
  count=$((count + 1))
}
for compiler in "${compilers[@]}"; do
  name="$(basename "$compiler") $("$compiler" -dumpfullversion -dumpversion)"
  for standard in 17 20 23; do
    flag=-std=c++$standard
    if [[ $standard == 23 ]]; then flag=-std=c++2b; fi  # the name that older compilers know too
    check "$name, C++$standard" "$compiler" "$flag" "$work/all.cpp"
  done
  check "$name, C++17 without RTTI" "$compiler" -std=c++17 -fno-rtti "$work/all.cpp"
  if "$compiler" -std=c++17 -fno-exceptions -fsyntax-only -Iinclude include/lrt/base/language.hpp 2>"$work/log"; then
    echo "$name: -fno-exceptions is not refused"
    status=1
  elif ! grep -q "lrt needs exceptions" "$work/log"; then
    cat "$work/log"
    status=1
  fi
done
echo "$count compilations, $SECONDS s"
exit $status
