# SPDX-License-Identifier: Apache-2.0
# PCRE2::8BIT: the 8-bit library of PCRE2, found by pkg-config. (PCRE2's own CMake config is not in every distribution's package.)
include("${CMAKE_CURRENT_LIST_DIR}/LrtPackages.cmake")
lrt_find_by_pkg_config(PCRE2 PCRE2::8BIT libpcre2-8>=10.30)
