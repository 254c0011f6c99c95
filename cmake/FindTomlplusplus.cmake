# SPDX-License-Identifier: Apache-2.0
# Tomlplusplus::Tomlplusplus: toml++, headers only. Debian's package has neither a CMake package nor a pkg-config file.
include("${CMAKE_CURRENT_LIST_DIR}/LrtPackages.cmake")
lrt_how_to_install(lrt_how Tomlplusplus)
find_path(Tomlplusplus_INCLUDE_DIR toml++/toml.h)
mark_as_advanced(Tomlplusplus_INCLUDE_DIR)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Tomlplusplus REQUIRED_VARS Tomlplusplus_INCLUDE_DIR REASON_FAILURE_MESSAGE "${lrt_how}")
if(Tomlplusplus_FOUND AND NOT TARGET Tomlplusplus::Tomlplusplus)
  add_library(Tomlplusplus::Tomlplusplus INTERFACE IMPORTED)
  target_include_directories(Tomlplusplus::Tomlplusplus SYSTEM INTERFACE ${Tomlplusplus_INCLUDE_DIR})
endif()
