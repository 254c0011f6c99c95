# SPDX-License-Identifier: Apache-2.0
# Every lesson is run and compared with the output that its main.cpp states. (tests/docs compares README's program with the first one.)
# Included from examples/CMakeLists.txt when tests are built.
enable_testing()
foreach(lesson IN LISTS lessons)
  add_test(NAME lesson_${lesson} COMMAND sh ${CMAKE_CURRENT_LIST_DIR}/lesson.sh $<TARGET_FILE:${lesson}> ${CMAKE_CURRENT_SOURCE_DIR}/${lesson}/main.cpp)
  set_tests_properties(lesson_${lesson} PROPERTIES TIMEOUT 60 LABELS quick)
  set_property(GLOBAL APPEND PROPERTY LRT_QUICK_PROGRAMS ${lesson})
endforeach()
# A program loads only the libraries that it needs.
add_test(NAME lesson_libraries COMMAND sh ${CMAKE_CURRENT_LIST_DIR}/libraries.sh $<TARGET_FILE:t01_first_thing>)
