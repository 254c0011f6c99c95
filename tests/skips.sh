#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Counts what the last run of ctest skipped, by reason: whole tests, and cases of tests that passed.
#
#   tests/skips.sh [BUILD]     the folder of the build, default build/dev
set -eu

log=${1:-build/dev}/Testing/Temporary/LastTest.log
if ! [ -f "$log" ]; then
  echo "skips.sh: there is no $log; run ctest first" >&2
  exit 2
fi
reasons=$(sed -n 's/^.*skipped: *//p' "$log" | sort | uniq -c | sort -rn)
if [ -z "$reasons" ]; then
  echo "0 skips"
else
  printf '%s\n' "$reasons" | awk '{ total += $1; print } END { printf "%d skips, %d reasons\n", total, NR }'
fi
