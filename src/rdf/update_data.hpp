// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/graph.hpp>

namespace lrt::rdf {

/// One operation of a request in SPARQL 1.1 Update: the triples that it adds or removes.
struct DataUpdate {
  enum class Kind : unsigned char { insert, remove };
  Kind kind;
  Graph graph;
};

/// More operations in one request are refused: each one is read with the whole prologue before it.
inline constexpr std::size_t max_data_updates = 100;

/// Reads INSERT DATA and DELETE DATA, several of them separated by ';', each with its prologue of PREFIX and BASE. The triples in the braces
/// are read as Turtle. Blank nodes of two operations are different nodes.
///
/// @param options  max_triples and max_bytes count for all operations together
/// @par Errors  unsupported_syntax: an operation or part that is not supported, by its name, such as LOAD, WHERE and GRAPH; expected_rdf;
///              limit_exceeded. All with line, column and offset.
/// @par Implements  SPARQL 1.1 Update 3.1.1, 3.1.2 and its grammar, of one graph
Result<std::vector<DataUpdate>> read_data_updates(std::string_view text, const ReadOptions& options);

}  // namespace lrt::rdf
