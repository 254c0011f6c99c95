# SPDX-License-Identifier: Apache-2.0
# Configures lrt without packages that are installed: cmake -D LRT_SOURCE_DIR=... -D WORK_DIR=... -D GENERATOR=... -D COMPILER=... -P missing.cmake
cmake_minimum_required(VERSION 3.21)

# configure(ARGUMENT...): sets code and text
function(configure)
  file(REMOVE_RECURSE ${WORK_DIR})
  execute_process(COMMAND ${CMAKE_COMMAND} -S ${LRT_SOURCE_DIR} -B ${WORK_DIR} -G ${GENERATOR} -D CMAKE_CXX_COMPILER=${COMPILER}
                          -D LRT_BUILD_TESTS=OFF -D LRT_BUILD_EXAMPLES=OFF -D LRT_BUILD_TOOLS=OFF -D LRT_CALLBACKS=OFF ${ARGN}
                  RESULT_VARIABLE code OUTPUT_VARIABLE text ERROR_VARIABLE text)
  string(REGEX REPLACE "[ \n]+" " " text "${text}")  # CMake breaks the lines of an error
  set(code ${code} PARENT_SCOPE)
  set(text "${text}" PARENT_SCOPE)
endfunction()

foreach(pair "MQTT;Mosquitto" "LIBWEBSOCKETS;Libwebsockets" "CLIENT;ZLIB" "URDF;Tinyxml2" "PROTOBUF;Libprotobuf" "LIBRDF;Librdf" "ROS2;Fastdds")
  list(GET pair 0 option)
  list(GET pair 1 package)
  configure(-D CMAKE_DISABLE_FIND_PACKAGE_${package}=ON -D LRT_${option}=ON)
  if(code EQUAL 0 OR NOT text MATCHES "LRT_${option} is ON, and .* needs .*${package}.*: install .*, or run vendor/install.sh")
    message(FATAL_ERROR "LRT_${option}=ON without ${package}: expected an error that names the package, found code ${code} and\n${text}")
  endif()
endforeach()
configure(-D CMAKE_DISABLE_FIND_PACKAGE_Mosquitto=ON)
if(NOT code EQUAL 0 OR NOT text MATCHES "lrt::mqtt needs Mosquitto and is left out")
  message(FATAL_ERROR "without Mosquitto: expected a message, found code ${code} and\n${text}")
endif()
file(REMOVE_RECURSE ${WORK_DIR})
