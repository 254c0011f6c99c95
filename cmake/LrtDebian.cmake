# SPDX-License-Identifier: Apache-2.0
# Debian packages of a shared build, by `cpack -G DEB` (tests/package/debs.sh):
#   liblrt0                    lrt, lrt::query, lrt::client and what is beside it: they need no library that lrt does not need
#   liblrt-urdf0, liblrt-mqtt0, liblrt-protobuf0, liblrt-librdf0 apart: a robot without a description, a broker, messages or models does not install
#                              XML parsers, libmosquitto, libprotobuf or librdf
#   liblrt-ros2-0              apart: a robot without ROS 2 does not install Fast DDS
#   lrt-ros2               the program of that name, apart for the same reason
#   liblrt-dev, lrt-tools, and a -dbgsym package for each with programs or libraries
if(NOT BUILD_SHARED_LIBS OR NOT CMAKE_SYSTEM_NAME STREQUAL "Linux")
  return()
endif()

set(LRT_DEBIAN_MAINTAINER "lrt maintainers <maintainers@lrt.example.org>" CACHE STRING "Maintainer: of Debian packages, with an address")
set(LRT_DEBIAN_REVISION 1 CACHE STRING "Of the Debian packages of this version")

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME lrt)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "${LRT_DEBIAN_MAINTAINER}")
set(CPACK_PACKAGE_VENDOR lrt)
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # each package has its own first line
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES OFF)  # objcopy of CPACK_DEBIAN_DEBUGINFO_PACKAGE does
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_PRE_BUILD_SCRIPTS ${PROJECT_SOURCE_DIR}/cmake/LrtDebianFiles.cmake)
set(CPACK_POST_BUILD_SCRIPTS ${PROJECT_SOURCE_DIR}/cmake/LrtDebianControl.cmake)
set(CPACK_LRT_SOURCE_DIR ${PROJECT_SOURCE_DIR})
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE ${LRT_DEBIAN_REVISION})
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS_POLICY ">=")  # for packages of others: libraries of one LRT_ABI can replace each other
set(CPACK_DEBIAN_DEBUGINFO_PACKAGE ON)
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)

# Between the packages of lrt: LRT_INTERNAL_API is of one version.
set(lrt_this_version "(= ${PROJECT_VERSION}-${LRT_DEBIAN_REVISION})")
set(lrt_about "lrt exposes the joints, sensors and actions of a robot as resources on the Web:
RDF over HTTP, with SHACL shapes for what clients may send, and subscriptions.")

# lrt_debian_binary(COMPONENT NAME SECTION SYNOPSIS TEXT [DEPENDS])
macro(lrt_debian_binary component name section synopsis text)
  string(TOUPPER ${component} lrt_upper)
  list(APPEND CPACK_COMPONENTS_ALL ${component})
  set(CPACK_DEBIAN_${lrt_upper}_PACKAGE_NAME ${name})
  set(CPACK_DEBIAN_${lrt_upper}_PACKAGE_SECTION ${section})
  set(CPACK_DEBIAN_${lrt_upper}_DESCRIPTION "${synopsis}\n${lrt_about}\n\n${text}")
  set(CPACK_DEBIAN_${lrt_upper}_PACKAGE_DEPENDS "${ARGN}")
endmacro()

set(CPACK_COMPONENTS_ALL)
set(lrt_runtimes "liblrt${LRT_ABI} ${lrt_this_version}")
lrt_debian_binary(lrt_runtime liblrt${LRT_ABI} libs "robots as Linked Robotic Things (shared libraries)"
                  "This package has the libraries for servers, clients and SPARQL queries.")
set(CPACK_DEBIAN_LRT_RUNTIME_PACKAGE_RECOMMENDS libraptor2-0)  # loaded with the first document in RDF/XML
if(NOT LRT_REDLAND OR LRT_LINKS_RAPTOR)
  set(CPACK_DEBIAN_LRT_RUNTIME_PACKAGE_RECOMMENDS "")
endif()
if(TARGET lrt_urdf)
  lrt_debian_binary(lrt_urdf_runtime liblrt-urdf${LRT_ABI} libs "robots as Linked Robotic Things (URDF)"
                    "This package has the library for robot descriptions." "liblrt${LRT_ABI} ${lrt_this_version}")
  string(APPEND lrt_runtimes ", liblrt-urdf${LRT_ABI} ${lrt_this_version}")
endif()
if(TARGET lrt_mqtt)
  lrt_debian_binary(lrt_mqtt_runtime liblrt-mqtt${LRT_ABI} libs "robots as Linked Robotic Things (MQTT)"
                    "This package has the library for MQTT brokers." "liblrt${LRT_ABI} ${lrt_this_version}")
  string(APPEND lrt_runtimes ", liblrt-mqtt${LRT_ABI} ${lrt_this_version}")
endif()
if(TARGET lrt_protobuf)
  lrt_debian_binary(lrt_protobuf_runtime liblrt-protobuf${LRT_ABI} libs "robots as Linked Robotic Things (Protocol Buffers)"
                    "This package has the library for messages of Protocol Buffers." "liblrt${LRT_ABI} ${lrt_this_version}")
  string(APPEND lrt_runtimes ", liblrt-protobuf${LRT_ABI} ${lrt_this_version}")
endif()
if(TARGET lrt_librdf)
  lrt_debian_binary(lrt_librdf_runtime liblrt-librdf${LRT_ABI} libs "robots as Linked Robotic Things (Redland)"
                    "This package has the library for models of Redland." "liblrt${LRT_ABI} ${lrt_this_version}")
  string(APPEND lrt_runtimes ", liblrt-librdf${LRT_ABI} ${lrt_this_version}")
endif()
if(TARGET lrt_ros2)
  lrt_debian_binary(lrt_ros2_runtime liblrt-ros2-${LRT_ABI} libs "robots as Linked Robotic Things (ROS 2)"
                    "This package has the library for ROS 2 graphs." "liblrt${LRT_ABI} ${lrt_this_version}, liblrt-urdf${LRT_ABI} ${lrt_this_version}")
  string(APPEND lrt_runtimes ", liblrt-ros2-${LRT_ABI} ${lrt_this_version}")
endif()
lrt_debian_binary(lrt_dev liblrt-dev libdevel "robots as Linked Robotic Things (development files)"
                  "This package has the headers and the files for CMake and pkg-config." "${lrt_runtimes}")
set(CPACK_DEBIAN_LRT_DEV_DEBUGINFO_PACKAGE OFF)
set(CPACK_DEBIAN_LRT_DEV_PACKAGE_SUGGESTS "libeigen3-dev, libcpp-httplib-dev, libboost-dev, libprotobuf-dev, librdf0-dev")  # of hosts of lrt/eigen.hpp, httplib.hpp, asio_loop.hpp, protobuf.hpp, redland.hpp
if(TARGET lrt_command)
  lrt_debian_binary(lrt_tools lrt-tools utils "robots as Linked Robotic Things (command lrt)"
                    "This package has the command lrt, which lists, reads, commands, watches and\nchecks Linked Robotic Things, and the module lrt of Python."
                    "liblrt${LRT_ABI} ${lrt_this_version}")
  set(CPACK_DEBIAN_LRT_TOOLS_PACKAGE_SUGGESTS python3)
endif()
if(TARGET lrt_ros2_command)
  set(lrt_of_program "liblrt${LRT_ABI} ${lrt_this_version}, liblrt-ros2-${LRT_ABI} ${lrt_this_version}")
  if(TARGET lrt_mqtt)
    string(APPEND lrt_of_program ", liblrt-mqtt${LRT_ABI} ${lrt_this_version}")
  endif()
  lrt_debian_binary(lrt_ros2_tool lrt-ros2 utils "robots as Linked Robotic Things (program lrt-ros2)"
                    "This package has the program lrt-ros2, which joins a graph of ROS 2 and\nserves it. It needs no ROS." "${lrt_of_program}")
endif()
# dpkg-shlibdeps finds the libraries of one package, which is not installed, for another one.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/src ${PROJECT_BINARY_DIR}/src/client ${PROJECT_BINARY_DIR}/src/query
                                                     ${PROJECT_BINARY_DIR}/src/urdf ${PROJECT_BINARY_DIR}/src/mqtt ${PROJECT_BINARY_DIR}/src/ros2)

include(CPack)
