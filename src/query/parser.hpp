#pragma once

#include <cstddef>
#include <memory>
#include <string_view>

#include <lrt/base/result.hpp>

#include "src/query/algebra.hpp"

namespace lrt::query {

struct ParseOptions {
  std::string_view base;               ///< absolute IRI that relative ones are resolved against; BASE replaces it
  std::size_t max_bytes = 64 * 1024;   ///< of the text; more: limit_exceeded
  std::size_t max_depth = 64;          ///< groups, parentheses, paths and queries in each other; more: limit_exceeded
};

/// Parses a SPARQL 1.1 query and translates it to the algebra.
/// @par Errors      expected_rdf: the text is no query, with line, column and offset; limit_exceeded; unsupported_syntax: SERVICE, and an update, by name
/// @par Threads     any
/// @par Implements  SPARQL 1.1 Query 18.2, 19
Result<std::shared_ptr<const Query>> parse(std::string_view text, const ParseOptions& options);

}  // namespace lrt::query
