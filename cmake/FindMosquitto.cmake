# SPDX-License-Identifier: Apache-2.0
# Mosquitto::Mosquitto: libmosquitto, found by pkg-config.
include("${CMAKE_CURRENT_LIST_DIR}/LrtPackages.cmake")
lrt_find_by_pkg_config(Mosquitto Mosquitto::Mosquitto libmosquitto>=2.0)
