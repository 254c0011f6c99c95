#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds lrt for another machine with Debian's cross compiler, and runs its tests under qemu.
#
#   tests/portability/cross.sh arm64|armhf          the least library with the tests of base, rdf and http, and lesson 1 in full: for CI
#   tests/portability/cross.sh arm64|armhf MODULE...  the library with all that the packages allow, and the tests of these modules: engine shacl ...
#
# Exits with 77 where the compiler or qemu is missing: vendor/install.sh cross.
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/../.." && pwd)
cd "$root"
arch=${1:-}
case $arch in
  arm64) triplet=aarch64-linux-gnu qemu=qemu-aarch64-static ;;
  armhf) triplet=arm-linux-gnueabihf qemu=qemu-arm-static ;;
  *)
    echo "usage: $0 arm64|armhf [MODULE...]" >&2
    exit 2
    ;;
esac
shift
for program in "$triplet-g++" "$qemu"; do
  if ! command -v "$program" >/dev/null; then
    echo "skipped: $program is not installed (vendor/install.sh cross)"
    exit 77
  fi
done

options=()
if (($# > 0)); then
  modules=("$@")
  name=$arch-full
  tests/portability/sysroot.sh "$arch" "build/sysroot/$name"
else
  modules=(base rdf http)
  name=$arch
  for option in REDLAND ASIO_LOOP LIBWEBSOCKETS CALLBACKS CLIENT QUERY MQTT PROTOBUF LIBRDF ROS2 URDF PAGE; do options+=("-DLRT_$option=OFF"); done
  LRT_PACKAGES="libc6-dev libstdc++6 libpcre2-dev libssl-dev nlohmann-json3-dev catch2" tests/portability/sysroot.sh "$arch"
fi
sysroot=$root/build/sysroot/$name
folder=build/cross/$name
cmake -S . -B "$folder" -DCMAKE_TOOLCHAIN_FILE="$root/cmake/toolchains/$triplet.cmake" -DLRT_SYSROOT="$sysroot" -DLRT_UNITY_BUILD=ON \
  -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS=-O1 "${options[@]}" >/dev/null
cmake --build "$folder" -j 2 --target "${modules[@]/#/test_}" t01_first_thing
# The lesson serves, asks itself and prints what its last comment states: sockets, threads and codecs of the whole library.
lesson=examples/t01_first_thing
printf '#!/bin/sh\nexec %s -L %s %s\n' "$qemu" "$sysroot" "$root/$folder/$lesson" >"$folder/$lesson-emulated"
chmod +x "$folder/$lesson-emulated"
sh tests/examples/lesson.sh "$folder/$lesson-emulated" "$lesson/main.cpp"
ctest --test-dir "$folder" --output-on-failure -R "^($(IFS='|' && echo "${modules[*]}"))\$"
