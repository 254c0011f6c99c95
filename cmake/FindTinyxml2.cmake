# SPDX-License-Identifier: Apache-2.0
# Tinyxml2::Tinyxml2: the shared library of tinyxml2, found by pkg-config.
include("${CMAKE_CURRENT_LIST_DIR}/LrtPackages.cmake")
lrt_find_by_pkg_config(Tinyxml2 Tinyxml2::Tinyxml2 tinyxml2>=6)
