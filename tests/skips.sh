#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Counts what the last run of ctest skipped, by reason: whole tests, and cases of tests that passed.
#
#   tests/skips.sh [BUILD]             the folder of the build, default build/dev
#   tests/skips.sh --missing [BUILD]   only what needs a program that is not installed; fails if there is such a reason. Node and npm are left out:
#                                      vendor/install.sh installs neither, and npm needs its registry
set -eu

missing=
if [ "${1-}" = --missing ]; then
  missing=yes
  shift
fi
log=${1:-build/dev}/Testing/Temporary/LastTest.log
if ! [ -f "$log" ]; then
  echo "skips.sh: there is no $log; run ctest first" >&2
  exit 2
fi
reasons=$(sed -n 's/^.*skipped: *//p' "$log" | sort | uniq -c | sort -rn)
if [ -n "$missing" ]; then
  reasons=$(printf '%s\n' "$reasons" | grep -E '(is|are) not installed|not found|vendor/install\.sh|apt-get install|there is no [a-z_-]+( |$)' |
    grep -Ev '\b(node|npm|Comunica)\b|/shared|suite') || true
fi
if [ -z "$reasons" ]; then
  echo "0 skips"
else
  printf '%s\n' "$reasons" | awk '{ total += $1; print } END { printf "%d skips, %d reasons\n", total, NR }'
  [ -z "$missing" ]
fi
