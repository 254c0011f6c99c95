# SPDX-License-Identifier: Apache-2.0
# 32-bit ARM with floating point:  tests/portability/sysroot.sh armhf
#   cmake -S . -B build/armhf -DCMAKE_TOOLCHAIN_FILE=cmake/toolchains/arm-linux-gnueabihf.cmake -DLRT_SYSROOT=$PWD/build/sysroot/armhf
set(LRT_TRIPLET arm-linux-gnueabihf)
set(LRT_QEMU qemu-arm)
set(CMAKE_SYSTEM_PROCESSOR armv7l)
include(${CMAKE_CURRENT_LIST_DIR}/linux-cross.cmake)
