# SPDX-License-Identifier: Apache-2.0
# Of definitions and CDR.
find_package(fastcdr CONFIG REQUIRED)
target_link_libraries(test_ros2 PRIVATE fastcdr)  # an oracle
