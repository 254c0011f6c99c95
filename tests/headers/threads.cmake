# SPDX-License-Identifier: Apache-2.0
# All threads of lrt are started by start_thread(), so that they inherit nothing of a control loop.
#
#   cmake -D ROOT=... -P threads.cmake
file(GLOB_RECURSE files ${ROOT}/src/*.cpp ${ROOT}/src/*.hpp ${ROOT}/include/*.hpp)
list(REMOVE_ITEM files ${ROOT}/src/base/thread.cpp ${ROOT}/src/base/thread.hpp)
foreach(file IN LISTS files)
  file(STRINGS ${file} lines REGEX "std::(jthread|thread|async)([^:a-z_]|$)|pthread_create|thrd_create")
  foreach(line IN LISTS lines)
    message(SEND_ERROR "${file}: threads are started by start_thread() of src/base/thread.hpp only:\n  ${line}")
  endforeach()
endforeach()
