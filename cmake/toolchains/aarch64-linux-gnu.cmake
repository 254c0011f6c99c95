# SPDX-License-Identifier: Apache-2.0
# 64-bit ARM:  tests/portability/sysroot.sh arm64
#              cmake -S . -B build/arm64 -DCMAKE_TOOLCHAIN_FILE=cmake/toolchains/aarch64-linux-gnu.cmake -DLRT_SYSROOT=$PWD/build/sysroot/arm64
set(LRT_TRIPLET aarch64-linux-gnu)
set(LRT_QEMU qemu-aarch64)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
include(${CMAKE_CURRENT_LIST_DIR}/linux-cross.cmake)
