# SPDX-License-Identifier: Apache-2.0
# Libwebsockets::Libwebsockets: found by pkg-config.
include("${CMAKE_CURRENT_LIST_DIR}/LrtPackages.cmake")
lrt_find_by_pkg_config(Libwebsockets Libwebsockets::Libwebsockets libwebsockets>=4.1)
if(Libwebsockets_FOUND)
  # A program that does not use the transport does not load the library.
  set_target_properties(Libwebsockets::Libwebsockets PROPERTIES
                        INTERFACE_INCLUDE_DIRECTORIES "${Libwebsockets_INCLUDE_DIRS}"
                        INTERFACE_LINK_LIBRARIES "-Wl,--push-state,--as-needed;${Libwebsockets_LINK_LIBRARIES};-Wl,--pop-state")
endif()
