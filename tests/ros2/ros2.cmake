# SPDX-License-Identifier: Apache-2.0
# The tests of lrt::ros2 and their peers.
target_link_libraries(test_ros2 PRIVATE lrt::ros2)
if("address" IN_LIST LRT_SANITIZE)
  target_sources(test_ros2 PRIVATE ros2/address_sanitizer.cpp)
endif()
enable_language(C)  # of what idlc makes
foreach(room types graph bridge program)
  include(${CMAKE_CURRENT_LIST_DIR}/${room}.cmake OPTIONAL)
endforeach()
