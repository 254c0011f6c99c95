# SPDX-License-Identifier: Apache-2.0
# The program lrt-ros2, run as people run it.
find_program(LRT_PYTHON python3 PATHS /usr/bin NO_DEFAULT_PATH)
if("thread" IN_LIST LRT_SANITIZE)
  return()  # as the tests with Fast DDS
endif()
if(NOT TARGET lrt_ros2_command OR NOT LRT_PYTHON)
  message(STATUS "lrt: the tests of lrt-ros2 need the program and python3, and are left out")
  return()
endif()
add_test(NAME ros2_program COMMAND ${LRT_PYTHON} -B ${CMAKE_CURRENT_LIST_DIR}/program_test.py $<TARGET_FILE:lrt_ros2_command> ${PROJECT_SOURCE_DIR})
if(TARGET ros2_robot AND TARGET lrt_command)
  find_program(LRT_MOSQUITTO mosquitto PATHS /usr/sbin /usr/local/sbin)
  add_test(NAME ros2_robot COMMAND ${LRT_PYTHON} -B ${CMAKE_CURRENT_LIST_DIR}/robot_test.py $<TARGET_FILE:lrt_ros2_command> $<TARGET_FILE:lrt_command>
                                   $<TARGET_FILE:ros2_robot> ${PROJECT_SOURCE_DIR} "$<$<BOOL:${LRT_MOSQUITTO}>:${LRT_MOSQUITTO}>")
  if(TARGET lrt-shacl AND NOT LRT_SANITIZE)  # other engines judge
    add_test(NAME ros2_strangers COMMAND ${LRT_PYTHON} -B ${CMAKE_CURRENT_LIST_DIR}/strangers_test.py ${CMAKE_CURRENT_BINARY_DIR}/conformance/shacl_engines
                                         $<TARGET_FILE:lrt-shacl> $<TARGET_FILE:lrt_ros2_command> $<TARGET_FILE:ros2_robot> ${PROJECT_SOURCE_DIR})
    set_tests_properties(ros2_strangers PROPERTIES SKIP_RETURN_CODE 77 RESOURCE_LOCK shacl_engines)  # which merging_test.py fetches, too
  endif()
else()
  message(STATUS "lrt: the test of lrt-ros2 on a robot needs the command lrt and the example ros2_robot, and is left out")
endif()
