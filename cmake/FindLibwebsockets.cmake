# SPDX-License-Identifier: Apache-2.0
# Libwebsockets::Libwebsockets: found by pkg-config.
find_package(PkgConfig QUIET)
if(PkgConfig_FOUND)
  pkg_check_modules(Libwebsockets QUIET IMPORTED_TARGET GLOBAL libwebsockets>=4.1)
endif()
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Libwebsockets REQUIRED_VARS Libwebsockets_LIBRARIES VERSION_VAR Libwebsockets_VERSION)
if(Libwebsockets_FOUND AND NOT TARGET Libwebsockets::Libwebsockets)
  add_library(Libwebsockets::Libwebsockets INTERFACE IMPORTED)
  target_include_directories(Libwebsockets::Libwebsockets INTERFACE ${Libwebsockets_INCLUDE_DIRS})
  # A program that does not use the transport does not load the library.
  target_link_libraries(Libwebsockets::Libwebsockets INTERFACE -Wl,--push-state,--as-needed ${Libwebsockets_LINK_LIBRARIES} -Wl,--pop-state)
endif()
