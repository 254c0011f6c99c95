#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The smallest robot: README's program, with the library linked into it, without what can be left out (Boost, Redland, JSON-LD, libwebsockets, callbacks,
# the page) and optimised for size. Prints its stripped size and its shared libraries, and fails if they are more than docs/platforms.md says, or if it has
# code of Worlds or queries, which it does not use.
#
#   tests/portability/minimal.sh [BUILD_FOLDER] [CMAKE_ARGUMENT...]   default build/smallest
#   LRT_MAX_BYTES=1432000 LRT_MAX_LIBRARIES=8                         what is reached, and half a percent
#   LRT_MODULES=1                                                     prints the bytes of each module of the library too
#   LRT_LDD="PROGRAM ARGUMENT..."                                     instead of ldd, for another machine
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/../.." && pwd)
folder=${1:-$root/build/smallest}
if (($# > 0)); then shift; fi
max_bytes=${LRT_MAX_BYTES:-1432000}
max_libraries=${LRT_MAX_LIBRARIES:-8}

# README's program in a project of its own, below which lrt stands.
mkdir -p "$folder/robot"
# shellcheck disable=SC2016  # the fence of a block
sed -n '/^```cpp$/,/^```$/{/^```/!p;/^```$/q}' "$root/README.md" >"$folder/robot/main.cpp"
cat >"$folder/robot/CMakeLists.txt" <<END
cmake_minimum_required(VERSION 3.21)
project(robot LANGUAGES CXX)
add_subdirectory("$root" lrt)
add_executable(smallest_robot main.cpp)
target_link_libraries(smallest_robot PRIVATE lrt::lrt)
END
off=()
for option in REDLAND JSON_LD ASIO_LOOP LIBWEBSOCKETS CALLBACKS PAGE; do off+=("-DLRT_$option=OFF"); done  # a subdirectory has no tools and no leaves
cmake -S "$folder/robot" -B "$folder" -DCMAKE_BUILD_TYPE=MinSizeRel -DCMAKE_CXX_FLAGS_MINSIZEREL="-Oz -DNDEBUG" -DBUILD_SHARED_LIBS=OFF -DLRT_UNITY_BUILD=ON "${off[@]}" \
  -DCMAKE_INTERPROCEDURAL_OPTIMIZATION=ON -DCMAKE_CXX_FLAGS="-ffunction-sections -fdata-sections -fno-rtti" \
  -DCMAKE_EXE_LINKER_FLAGS="-Wl,--gc-sections -Wl,--as-needed -Wl,-z,pack-relative-relocs -Wl,-z,noseparate-code -Wl,-z,now -flto-partition=one" "$@" >/dev/null
cmake --build "$folder" -j 2 --target smallest_robot | tail -n 1

program=$folder/smallest_robot
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
for unused in WorldGraphResource Queries Snapshots; do
  if (($(nm --demangle "$program" | grep -c "[TtWw] lrt::.*::$unused::") > 0)); then
    echo "it has code of $unused, which it does not use"
    exit 1
  fi
done
((bytes <= max_bytes && ${#libraries[@]} <= max_libraries))
