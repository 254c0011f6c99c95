# SPDX-License-Identifier: Apache-2.0
# Urdfdom::Urdfdom: liburdfdom with the console_bridge that it logs by, found by pkg-config. (Its own CMake config asks for all of its
# libraries and says where those of the distribution were built.)
find_package(PkgConfig QUIET)
if(PkgConfig_FOUND)
  pkg_check_modules(Urdfdom QUIET IMPORTED_TARGET GLOBAL urdfdom>=3.0 console_bridge)
endif()
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Urdfdom REQUIRED_VARS Urdfdom_LIBRARIES VERSION_VAR Urdfdom_urdfdom_VERSION)
if(Urdfdom_FOUND AND NOT TARGET Urdfdom::Urdfdom)
  add_library(Urdfdom::Urdfdom INTERFACE IMPORTED)
  target_link_libraries(Urdfdom::Urdfdom INTERFACE PkgConfig::Urdfdom)
endif()
