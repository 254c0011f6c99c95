#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Rules for the text of every file in git (without git: every file that is not below build/). What breaks one is printed.
#   - no file has the conflict markers of a merge
#   - each source has its licence in one of its first three lines (a script begins with its interpreter, an HTML page with its doctype)
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd)
cd "$root"
mapfile -t files < <(git ls-files 2>/dev/null || find . -name .git -prune -o -path ./build -prune -o -type f -printf '%P\n' | sort)
if ((${#files[@]} == 0)); then
  echo "$0: there are no files in $root" >&2
  exit 1
fi
status=0

if printf '%s\0' "${files[@]}" | xargs -0 grep -nIE '^(<{7}|>{7}) ' --; then
  echo "conflict markers of a merge"
  status=1
fi

unlicensed=()
for file in "${files[@]}"; do
  case $file in
    tests/fuzz/corpus/*) continue ;;        # inputs, byte by byte
    tests/codegen/baxter.hpp | tests/codegen/mover.hpp) continue ;;    # as `lrt generate` wrote it
    *.cpp | *.hpp | *.cmake | *CMakeLists.txt | *.in | *.py | *.sh | *.js | *.mjs | *.java | *.css | *.html | *.awk | *.1) ;;
    .ci/run | .clang-format | .clang-tidy | *Doxyfile) ;;
    *) continue ;;  # data, records, texts and configurations
  esac
  lines=
  for _ in 1 2 3; do IFS= read -r line && lines+=$line; done <"$file" || true
  [[ $lines == *"SPDX-License-Identifier: Apache-2.0"* ]] || unlicensed+=("$file")
done
if ((${#unlicensed[@]} > 0)); then
  printf '%s\n' "${unlicensed[@]}"
  echo "the first lines do not say SPDX-License-Identifier: Apache-2.0"
  status=1
fi
echo "${#files[@]} files"
exit "$status"
