// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/graph.hpp>

namespace lrt::query {
inline namespace v0 {

/// The solutions of a SELECT, in order: a row for each solution, a column for each selected variable.
///
/// @par Threads  Distinct objects: any. One object: one thread at a time, or any number of reading threads.
class Table {
 public:
  Table() = default;
  /// A table without rows. @param variables  names of the columns
  explicit Table(std::vector<std::string> variables) : variables_(std::move(variables)) {}

  /// Names of the variables without the question mark.
  const std::vector<std::string>& variables() const noexcept { return variables_; }
  std::size_t rows() const noexcept { return rows_; }                 ///< number of rows
  std::size_t columns() const noexcept { return variables_.size(); }  ///< number of columns
  /// The term in a cell; nullopt: the variable is not bound. A blank node has the same label everywhere in the table.
  /// Valid until the table is changed.
  /// @pre row < rows(), column < columns()
  std::optional<rdf::TermView> at(std::size_t row, std::size_t column) const noexcept {
    const std::uint32_t cell = cells_[row * columns() + column];
    return cell == none ? std::nullopt : std::optional(terms_.term(static_cast<rdf::TermId>(cell)));
  }

  /// Adds a row without bindings.
  void add_row() {
    cells_.insert(cells_.end(), columns(), none);
    ++rows_;
  }
  /// Sets a cell of the last row.
  void set(std::size_t column, const rdf::TermView& term) {
    cells_[cells_.size() - columns() + column] = static_cast<std::uint32_t>(terms_.intern(term));
  }

 private:
  static constexpr std::uint32_t none = 0xFFFFFFFF;
  std::vector<std::string> variables_;
  rdf::Graph terms_;  // without triples: each term once
  std::vector<std::uint32_t> cells_;
  std::size_t rows_ = 0;  // also of a table without columns
};

/// The result of a query: a Table for SELECT, a bool for ASK, a Graph for CONSTRUCT and DESCRIBE.
using Answer = std::variant<Table, bool, rdf::Graph>;

/// The formats of results of SELECT and ASK: SPARQL 1.1 Query Results JSON, XML (2nd edition), CSV and TSV. CSV and TSV
/// do not support ASK.
enum class ResultFormat : std::uint8_t { json, xml, csv, tsv };
/// "application/sparql-results+json", "application/sparql-results+xml", "text/csv", "text/tab-separated-values"
/// @par Threads  Any.
LRT_API std::string_view media_type(ResultFormat format) noexcept;

/// Writes solutions.
/// @par Errors   unsupported_syntax: a term has a character that XML cannot express (XML 1.0 2.2)
/// @par Threads  Any.
/// @par Time     Linear in the result. Allocates.
LRT_API Result<std::string> write(const Table& table, ResultFormat format);
/// Writes the result of ASK.
/// @par Errors   unsupported_syntax: CSV and TSV do not support it
/// @par Threads  Any.
LRT_API Result<std::string> write(bool yes, ResultFormat format);

}  // namespace v0
}  // namespace lrt::query
