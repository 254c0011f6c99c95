# SPDX-License-Identifier: Apache-2.0
# The peers of the tests of the graph: Eclipse Cyclone DDS with types of idlc, and Fast DDS.
find_package(Fastdds REQUIRED)
add_custom_command(
  OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/ros2_peers/graph_peer.c ${CMAKE_CURRENT_BINARY_DIR}/ros2_peers/graph_peer.h
  COMMAND ${CMAKE_COMMAND} -E make_directory ${CMAKE_CURRENT_BINARY_DIR}/ros2_peers
  COMMAND ${CMAKE_COMMAND} -E chdir ${CMAKE_CURRENT_BINARY_DIR}/ros2_peers ${LRT_IDLC} -x final ${CMAKE_CURRENT_LIST_DIR}/peers/graph_peer.idl
  DEPENDS ${CMAKE_CURRENT_LIST_DIR}/peers/graph_peer.idl
  VERBATIM)
add_executable(ros2_cyclone_peer ${CMAKE_CURRENT_LIST_DIR}/peers/cyclone_peer.cpp ${CMAKE_CURRENT_BINARY_DIR}/ros2_peers/graph_peer.c)
target_include_directories(ros2_cyclone_peer PRIVATE ${CMAKE_CURRENT_BINARY_DIR}/ros2_peers)
target_compile_features(ros2_cyclone_peer PRIVATE cxx_std_17)
target_link_libraries(ros2_cyclone_peer PRIVATE CycloneDDS::ddsc)
add_executable(ros2_fastdds_peer ${CMAKE_CURRENT_LIST_DIR}/peers/fastdds_peer.cpp)
target_compile_features(ros2_fastdds_peer PRIVATE cxx_std_17)
target_link_libraries(ros2_fastdds_peer PRIVATE Fastdds::Fastdds)
add_dependencies(test_ros2 ros2_cyclone_peer ros2_fastdds_peer)
target_compile_definitions(test_ros2 PRIVATE LRT_CYCLONE_PEER="$<TARGET_FILE:ros2_cyclone_peer>" LRT_FASTDDS_PEER="$<TARGET_FILE:ros2_fastdds_peer>")
