// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <raptor2.h>

namespace lrt::rdf::redland {

// clang-format does not come to rest at this macro.
// clang-format off
#define LRT_RAPTOR_FUNCTIONS(X)                                                                              \
  X(alloc_memory) X(free_iostream) X(free_memory) X(free_parser) X(free_serializer) X(free_term) X(free_uri) \
  X(free_world) X(locator_line) X(new_iostream_to_string) X(new_parser) X(new_serializer)                    \
  X(new_term_from_counted_blank) X(new_term_from_counted_literal) X(new_term_from_counted_uri_string)        \
  X(new_uri_from_counted_string) X(new_world_internal) X(parser_get_locator) X(parser_parse_abort)           \
  X(parser_parse_chunk) X(parser_parse_start) X(parser_set_option) X(parser_set_statement_handler)           \
  X(serializer_serialize_end) X(serializer_serialize_statement) X(serializer_set_namespace)                  \
  X(serializer_set_option) X(serializer_start_to_iostream) X(statement_init) X(uri_as_counted_string)        \
  X(world_open) X(world_set_flag) X(world_set_generate_bnodeid_handler) X(world_set_log_handler)
// clang-format on

/// The functions of Raptor that lrt calls, without their prefix. The library is loaded with the first document in RDF/XML, because it needs 40
/// others (libcurl, GnuTLS, Kerberos, ICU ...): 5 MB of resident memory and 20 ms of CPU in programs that have no such document. A static
/// library is linked.
struct Raptor {
#define LRT_MEMBER(name) decltype(&raptor_##name) name;
  LRT_RAPTOR_FUNCTIONS(LRT_MEMBER)
#undef LRT_MEMBER
};

/// Loads the library at the first call.
/// @return  nullptr: it cannot be loaded
const Raptor* load_raptor() noexcept;

}  // namespace lrt::rdf::redland
