# SPDX-License-Identifier: Apache-2.0
# Libprotobuf::Libprotobuf: the C++ library of Protocol Buffers, found by pkg-config. CMake's own FindProtobuf finds no pkg-config file.
include("${CMAKE_CURRENT_LIST_DIR}/LrtPackages.cmake")
lrt_find_by_pkg_config(Libprotobuf Libprotobuf::Libprotobuf protobuf>=3.21)
