# SPDX-License-Identifier: Apache-2.0
# Zstd::Zstd: libzstd, found by pkg-config.
include("${CMAKE_CURRENT_LIST_DIR}/LrtPackages.cmake")
lrt_find_by_pkg_config(Zstd Zstd::Zstd libzstd>=1.4)
