# SPDX-License-Identifier: Apache-2.0
# What arrows.cmake and third_parties.cmake have in common.

# Every source file below the given directories of ROOT, relative to it.
function(find_sources result)
  set(found)
  foreach(directory IN LISTS ARGN)
    file(GLOB_RECURSE some RELATIVE ${ROOT} ${ROOT}/${directory}/*.hpp ${ROOT}/${directory}/*.cpp ${ROOT}/${directory}/*.in)
    if(NOT some)
      message(FATAL_ERROR "no sources in ${ROOT}/${directory}")
    endif()
    list(APPEND found ${some})
  endforeach()
  set(${result} ${found} PARENT_SCOPE)
endfunction()

# The lines of a file that include something.
function(find_includes file result)
  file(STRINGS ${ROOT}/${file} lines REGEX "^[ \t]*#[ \t]*(include|import)")
  set(${result} ${lines} PARENT_SCOPE)
endfunction()

# "file:line: text" of the first line of a file that is `line`.
function(describe_include file line result)
  file(READ ${ROOT}/${file} text)
  string(FIND "${text}" "${line}" at)
  string(SUBSTRING "${text}" 0 ${at} before)
  string(REGEX REPLACE "[^\n]" "" before "${before}")
  string(LENGTH "${before}" number)
  math(EXPR number "${number} + 1")
  set(${result} "${file}:${number}: ${line}" PARENT_SCOPE)
endfunction()

# The lines of a table beside this file, without comments.
function(read_table name result)
  file(STRINGS ${CMAKE_CURRENT_LIST_DIR}/${name} lines REGEX "^[^#]")
  set(${result} ${lines} PARENT_SCOPE)
endfunction()
