#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The smallest robot: the library without what can be left out (Boost, Redland, libwebsockets, cpp-httplib, the page), optimised for size and
# linked statically into lesson 1. Prints its stripped size and its shared libraries, and fails if they are more than docs/platforms.md says.
#
#   tests/portability/minimal.sh [BUILD_FOLDER] [CMAKE_ARGUMENT...]   default build/minimal
#   LRT_MAX_BYTES=1468006 LRT_MAX_LIBRARIES=8                         1.4 MiB
#   LRT_MODULES=1                                                     prints the bytes of each module of the library too
#   LRT_LDD="PROGRAM ARGUMENT..."                                     instead of ldd, for another machine
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/../.." && pwd)
folder=${1:-$root/build/minimal}
if (($# > 0)); then shift; fi
max_bytes=${LRT_MAX_BYTES:-1468006}
max_libraries=${LRT_MAX_LIBRARIES:-8}

off=()
for option in REDLAND ASIO_LOOP LIBWEBSOCKETS CALLBACKS CLIENT QUERY MQTT URDF PAGE BUILD_TESTS BUILD_TOOLS; do off+=("-DLRT_$option=OFF"); done
cmake -S "$root" -B "$folder" -DCMAKE_BUILD_TYPE=MinSizeRel -DBUILD_SHARED_LIBS=OFF -DLRT_COMPILE_TOGETHER=ON "${off[@]}" \
  -DCMAKE_INTERPROCEDURAL_OPTIMIZATION=ON -DCMAKE_CXX_FLAGS="-ffunction-sections -fdata-sections" \
  -DCMAKE_EXE_LINKER_FLAGS="-Wl,--gc-sections -Wl,--as-needed -Wl,-z,pack-relative-relocs" "$@" >/dev/null
cmake --build "$folder" -j 2 --target t01_first_thing | tail -n 1

program=$folder/examples/t01_first_thing
"$(sed -n 's/^CMAKE_STRIP:FILEPATH=//p' "$folder/CMakeCache.txt")" -o "$program.stripped" "$program"
bytes=$(stat -c %s "$program.stripped")
# A line of ldd that has a path is a library; the kernel's own (linux-vdso) has none.
read -ra ldd <<<"${LRT_LDD:-ldd}"
mapfile -t libraries < <("${ldd[@]}" "$program.stripped" | grep -o '/[^ ]*' | xargs -n 1 basename | sort)
printf '%s\n' "${libraries[@]}"
if [[ -n ${LRT_MODULES:-} ]]; then
  # Symbols of the program by namespace: what the linker kept. Debian's ELF tools are enough.
  nm --size-sort --print-size --radix=d --demangle "$program" |
    awk '{ module = match($0, /lrt::([a-z_]+)::/) ? substr($0, RSTART + 5, RLENGTH - 7) : ($0 ~ /lrt::/ ? "lrt" : ($0 ~ /nlohmann/ ? "nlohmann" : "others"))
           sum[module] += $2 } END { for (m in sum) printf "%8d %s\n", sum[m], m }' | sort -rn
  size -A -d "$program.stripped" | sort -k 2 -rn | head -n 12
fi
echo "$bytes bytes stripped (at most $max_bytes), ${#libraries[@]} shared libraries (at most $max_libraries)"
((bytes <= max_bytes && ${#libraries[@]} <= max_libraries))
