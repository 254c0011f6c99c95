# SPDX-License-Identifier: Apache-2.0
# Messages of the tests and examples, by protoc. Debian has it in protobuf-compiler, apart from the library.
find_package(Libprotobuf QUIET)
find_program(LRT_PROTOC protoc)

# lrt_add_messages(TARGET FILE.proto...): adds what protoc makes of files below this folder to a target. That code is not ours, and neither are its
# warnings: its headers are those of a system.
function(lrt_add_messages target)
  set(folder ${CMAKE_CURRENT_BINARY_DIR}/${target}.messages)
  file(MAKE_DIRECTORY ${folder})
  foreach(file IN LISTS ARGN)
    get_filename_component(name ${file} NAME_WE)
    get_filename_component(from ${file} ABSOLUTE)
    get_filename_component(from_folder ${from} DIRECTORY)
    set(made ${folder}/${name}.pb)
    add_custom_command(OUTPUT ${made}.cc ${made}.h COMMAND ${LRT_PROTOC} -I ${from_folder} --cpp_out=${folder} ${from} DEPENDS ${from} VERBATIM)
    set_source_files_properties(${made}.cc PROPERTIES COMPILE_OPTIONS -w SKIP_PRECOMPILE_HEADERS ON)
    target_sources(${target} PRIVATE ${made}.cc ${made}.h)
  endforeach()
  target_include_directories(${target} SYSTEM PRIVATE ${folder})
  target_link_libraries(${target} PRIVATE Libprotobuf::Libprotobuf)
endfunction()
