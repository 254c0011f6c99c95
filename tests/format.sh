#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Are all sources formatted as .clang-format says? The files that are not are printed; `tests/format.sh --fix` formats them.
#
# Needs clang-format 14, whose result differs from that of other releases.
set -eu

root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
cd "$root"
if ! command -v clang-format-14 >/dev/null; then
  echo "clang-format-14 is not installed: vendor/install.sh ci" >&2
  exit 1
fi
# What git has; without git, what is not below build/. Left out: what `lrt generate` wrote stays as it was written.
sources() {
  { git ls-files '*.hpp' '*.cpp' 2>/dev/null || find . -path ./build -prune -o \( -name '*.hpp' -o -name '*.cpp' \) -printf '%P\n'; } |
    grep -v -x -e tests/codegen/baxter.hpp -e tests/codegen/mover.hpp
}
count=$(sources | wc -l)
if [ "$count" -eq 0 ]; then
  echo "format.sh: there are no sources in $root" >&2
  exit 1
fi

if [ "${1-}" = --fix ]; then
  sources | xargs -P 2 -n 40 clang-format-14 -i
  exit 0
fi
# It fails for a file that differs, and for a configuration that it cannot read.
said=$(sources | xargs -P 2 -n 40 clang-format-14 --dry-run -Werror 2>&1) || {
  found=$(echo "$said" | grep -o '^[^: ]*\.[ch]pp' | sort -u) || true
  if [ -z "$found" ]; then
    echo "$said" | sort -u | head -n 20
  else
    echo "not formatted as .clang-format says (tests/format.sh --fix):"
    echo "$found"
  fi
  exit 1
}
echo "$count files"
