# SPDX-License-Identifier: Apache-2.0
# Urdfdom::Urdfdom: liburdfdom with the console_bridge that it logs by, found by pkg-config. (Its own CMake config asks for all of its
# libraries and says where those of the distribution were built.)
include("${CMAKE_CURRENT_LIST_DIR}/LrtPackages.cmake")
lrt_find_by_pkg_config(Urdfdom Urdfdom::Urdfdom urdfdom>=3.0 console_bridge)
