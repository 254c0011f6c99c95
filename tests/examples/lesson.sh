#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Runs a lesson and compares what it prints with the comment that ends its main.cpp.
#
#   lesson.sh PROGRAM MAIN_CPP
#   lesson.sh --update PROGRAM MAIN_CPP    writes that comment anew
set -eu

update=
if [ "$1" = --update ]; then
  update=yes
  shift
fi
program=$1
source=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

"$program" >"$work/printed"
sed 's|^|// |; s| *$||' "$work/printed" | awk '/^\/\/$/ { empty = empty $0 "\n"; next } { printf "%s", empty; empty = ""; print }' >"$work/found"

if [ -n "$update" ]; then
  awk '/^\/\/ Output:$/ { exit } { print }' "$source" >"$work/main.cpp"
  { sed -e :a -e '/^\n*$/{$d;N;ba' -e '}' "$work/main.cpp"; printf '\n// Output:\n'; cat "$work/found"; } >"$source"
  exit
fi

awk 'on { print } /^\/\/ Output:$/ { on = 1 }' "$source" >"$work/expected"
if ! [ -s "$work/expected" ]; then
  echo "$source does not end with a comment \"// Output:\" and the output" >&2
  exit 1
fi
diff -u "$work/expected" "$work/found"
