#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The first C++ program of README.md is the first lesson: each of its lines is in main.cpp, in this order, and what main.cpp has besides
# is its title, its output and lines that say "lesson".
#
#   readme.sh README MAIN_CPP
set -eu

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
awk '/^```/ && on { exit } on { print } /^```cpp$/ { on = 1 }' "$1" >"$work/readme"
awk '/^\/\/ Output:$/ { exit } NR > 1 && !/lesson/ { print }' "$2" | cat -s >"$work/lesson"
sed -e :a -e '/^\n*$/{$d;N;ba' -e '}' "$work/lesson" >"$work/main"
if ! [ -s "$work/readme" ]; then
  echo "$1 has no C++ program" >&2
  exit 1
fi
diff -u "$work/main" "$work/readme"
