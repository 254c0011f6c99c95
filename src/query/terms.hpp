// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include <lrt/rdf/detail/hash_index.hpp>
#include <lrt/rdf/term.hpp>

#include "src/query/budget.hpp"
#include "src/query/dataset.hpp"
#include "src/query/reading.hpp"

namespace lrt::query {

/// The terms of an evaluation: those of the dataset, and after them those that the query writes or makes. Equal terms have one number.
class Terms {
 public:
  Terms(const Dataset& data, Budget& budget) : data_(data), budget_(budget), first_(data.term_limit()) {}

  /// The number of an IRI or literal.
  TermNumber intern(const rdf::TermView& term);
  /// A new blank node.
  TermNumber fresh_blank();
  /// Valid until the end of the evaluation.
  rdf::TermView term(TermNumber number) const noexcept;
  const Reading& value(TermNumber number) const noexcept { return number < first_ ? data_.value(number) : made_[number - first_].value; }

 private:
  struct Entry {
    rdf::TermView term;
    Reading value;
  };
  std::string_view keep(std::string_view text);

  const Dataset& data_;
  Budget& budget_;
  TermNumber first_;
  std::vector<Entry> made_;
  lrt::detail::HashIndex index_;
  std::vector<std::unique_ptr<char[]>> blocks_;  // texts, which stay where they are
  std::size_t left_ = 0;
  char* at_ = nullptr;
};

}  // namespace lrt::query
