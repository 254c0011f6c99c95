# SPDX-License-Identifier: Apache-2.0
# Threads of lrt run until the process has ended, so no object of lrt may have a destructor that runs in exit(): objects with static storage are
# constants, or lrt::Immortal. An object file that registers a handler all the same is named here, with the reason.
#
#   cmake -DNM=nm -DOBJECTS=FILE -P destructors.cmake      FILE: the object files, one in a line
set(allowed
    "base/third_party_call.cpp"               # atexit(): exit() waits for calls of OpenSSL and libxml2
    "transport/asio_loop/asio_loop.cpp"       # Boost: ids of services, a key of thread-local storage, error categories; the threads there are the host's
)

file(STRINGS ${OBJECTS} objects)
if(NOT objects)
  message(FATAL_ERROR "no objects in ${OBJECTS}")
endif()
foreach(object IN LISTS objects)
  execute_process(COMMAND ${NM} -u ${object} OUTPUT_VARIABLE undefined RESULT_VARIABLE failed)
  if(failed)
    message(FATAL_ERROR "${NM} does not read ${object}")
  endif()
  if(NOT undefined MATCHES "(__cxa_atexit|[ _]atexit|__cxa_thread_atexit|at_quick_exit)")
    continue()
  endif()
  set(is_allowed FALSE)
  foreach(file IN LISTS allowed)
    string(REGEX REPLACE "\\." "[.]" pattern "${file}")
    if(object MATCHES "/${pattern}[.]o(bj)?$")
      set(is_allowed TRUE)
    endif()
  endforeach()
  if(NOT is_allowed)
    message(SEND_ERROR "${object}: an object has a destructor that runs in exit(); make it a constant or an lrt::Immortal")
  endif()
endforeach()
