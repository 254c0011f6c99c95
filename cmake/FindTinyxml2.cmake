# SPDX-License-Identifier: Apache-2.0
# Tinyxml2::Tinyxml2: the shared library of tinyxml2, found by pkg-config.
find_package(PkgConfig QUIET)
if(PkgConfig_FOUND)
  pkg_check_modules(Tinyxml2 QUIET IMPORTED_TARGET GLOBAL tinyxml2>=6)
endif()
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Tinyxml2 REQUIRED_VARS Tinyxml2_LIBRARIES VERSION_VAR Tinyxml2_VERSION)
if(Tinyxml2_FOUND AND NOT TARGET Tinyxml2::Tinyxml2)
  add_library(Tinyxml2::Tinyxml2 INTERFACE IMPORTED)
  target_link_libraries(Tinyxml2::Tinyxml2 INTERFACE PkgConfig::Tinyxml2)
endif()
