// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <string_view>

#include <lrt/base/result.hpp>

#include "src/query/algebra.hpp"

namespace lrt::query {

struct ParseOptions {
  std::string_view base;              ///< absolute IRI that relative ones are resolved against; BASE replaces it
  std::size_t max_bytes = 64 * 1024;  ///< of the text; more: limit_exceeded
  /// Groups, brackets, paths and queries in each other; more: limit_exceeded. No pattern or expression of the algebra is more than four times as
  /// high: each OPTIONAL, MINUS and BIND of a group has what stands before it as a part.
  std::size_t max_depth = 64;
  /// Patterns of all groups and the template; a sequence path is several. Also, apart from them, of the variables that each `SELECT *` stands for.
  /// More: limit_exceeded.
  std::size_t max_triples = 10'000;
  std::size_t max_term_bytes = 4 * 1024 * 1024;  ///< of IRIs and literals, written out, each time they occur; more: limit_exceeded
};

/// Parses a SPARQL 1.1 query and translates it to the algebra.
/// @par Errors      expected_rdf: the text is no query, with line, column and offset; limit_exceeded; unsupported_syntax: SERVICE, and an update, by
///                  name; expected_iri: the base is not absolute
/// @par Threads     any
/// @par Implements  SPARQL 1.1 Query 18.2, 19
Result<std::shared_ptr<const Query>> parse(std::string_view text, const ParseOptions& options);

}  // namespace lrt::query
