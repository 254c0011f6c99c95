# SPDX-License-Identifier: Apache-2.0
# CppHttplib::CppHttplib: the compiled cpp-httplib of the distribution, found by pkg-config, with the definitions it was built with: they
# decide what its classes look like.
include("${CMAKE_CURRENT_LIST_DIR}/LrtPackages.cmake")
lrt_find_by_pkg_config(CppHttplib CppHttplib::CppHttplib cpp-httplib>=0.11)
