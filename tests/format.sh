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
# Left out: what `lrt generate` wrote stays as it was written.
sources() { git ls-files '*.hpp' '*.cpp' | grep -v -x tests/client/baxter.hpp; }

if [ "${1-}" = --fix ]; then
  sources | xargs -P 2 -n 40 clang-format-14 -i
  exit 0
fi
found=$(sources | xargs -P 2 -n 40 clang-format-14 --dry-run 2>&1 | grep -o '^[^:]*\.[ch]pp' | sort -u) || true
[ -z "$found" ] || {
  echo "not formatted as .clang-format says (tests/format.sh --fix):"
  echo "$found"
  exit 1
}
echo "$(sources | wc -l) files"
