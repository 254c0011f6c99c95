# SPDX-License-Identifier: Apache-2.0
# Of definitions and CDR.
find_package(fastcdr CONFIG REQUIRED)
target_link_libraries(test_ros2 PRIVATE fastcdr)  # an oracle

add_executable(ros2_codec_peer ros2/codec_peer.cpp)
lrt_target_defaults(ros2_codec_peer)
lrt_compile_quickly(ros2_codec_peer)
target_include_directories(ros2_codec_peer PRIVATE ${PROJECT_SOURCE_DIR})
target_link_libraries(ros2_codec_peer PRIVATE lrt::ros2)
if(LRT_PYTHON)
  add_test(NAME ros2_oracle COMMAND ${LRT_PYTHON} -B ${CMAKE_CURRENT_SOURCE_DIR}/ros2/oracle_test.py $<TARGET_FILE:ros2_codec_peer>
                                    ${CMAKE_CURRENT_BINARY_DIR}/ros2_oracle)
  set_tests_properties(ros2_oracle PROPERTIES SKIP_RETURN_CODE 77)
endif()
