# SPDX-License-Identifier: Apache-2.0
# Mosquitto::Mosquitto: libmosquitto, found by pkg-config.
find_package(PkgConfig QUIET)
if(PkgConfig_FOUND)
  pkg_check_modules(Mosquitto QUIET IMPORTED_TARGET GLOBAL libmosquitto>=2.0)
endif()
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Mosquitto REQUIRED_VARS Mosquitto_LIBRARIES VERSION_VAR Mosquitto_VERSION)
if(Mosquitto_FOUND AND NOT TARGET Mosquitto::Mosquitto)
  add_library(Mosquitto::Mosquitto INTERFACE IMPORTED)
  target_link_libraries(Mosquitto::Mosquitto INTERFACE PkgConfig::Mosquitto)
endif()
