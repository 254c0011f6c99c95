// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/exactly_one.hpp"

namespace lrt::rdf {

void ExactlyOne::add(std::string_view name, bool is_present) {
  if (!names_.empty()) names_ += ", ";
  names_ += name;
  if (!is_present) return;
  if (++count_ > 1) found_ += " and ";
  found_ += name;
}

std::string ExactlyOne::message() const { return "expected exactly one of " + names_ + "; found " + (count_ == 0 ? "none" : found_); }

}  // namespace lrt::rdf
