# SPDX-License-Identifier: Apache-2.0
# CppHttplib::CppHttplib: the compiled cpp-httplib of the distribution, found by pkg-config, with the definitions it was built with: they
# decide what its classes look like.
find_package(PkgConfig QUIET)
if(PkgConfig_FOUND)
  pkg_check_modules(CppHttplib QUIET IMPORTED_TARGET GLOBAL cpp-httplib>=0.11)
endif()
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(CppHttplib REQUIRED_VARS CppHttplib_LIBRARIES VERSION_VAR CppHttplib_VERSION)
if(CppHttplib_FOUND AND NOT TARGET CppHttplib::CppHttplib)
  add_library(CppHttplib::CppHttplib INTERFACE IMPORTED)
  target_link_libraries(CppHttplib::CppHttplib INTERFACE PkgConfig::CppHttplib)
endif()
