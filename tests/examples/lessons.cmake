# SPDX-License-Identifier: Apache-2.0
# Every lesson is run and compared with the output that its main.cpp states, and README's first program with the first lesson.
# Included from examples/CMakeLists.txt when tests are built.
enable_testing()
foreach(lesson IN LISTS lessons)
  add_test(NAME lesson_${lesson} COMMAND sh ${CMAKE_CURRENT_LIST_DIR}/lesson.sh $<TARGET_FILE:${lesson}> ${CMAKE_CURRENT_SOURCE_DIR}/${lesson}/main.cpp)
  set_tests_properties(lesson_${lesson} PROPERTIES TIMEOUT 60)
endforeach()
add_test(NAME lesson_readme COMMAND sh ${CMAKE_CURRENT_LIST_DIR}/readme.sh ${PROJECT_SOURCE_DIR}/README.md ${CMAKE_CURRENT_SOURCE_DIR}/t01_first_thing/main.cpp)
# A program loads only the libraries that it needs.
add_test(NAME lesson_libraries COMMAND sh -c "! ldd $<TARGET_FILE:t01_first_thing> | grep -E 'libraptor|libwebsockets'")
