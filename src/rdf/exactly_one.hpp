// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace lrt::rdf {

/// Counts what is present of that of which exactly one should be, and names it for people.
class ExactlyOne {
 public:
  void add(std::string_view name, bool is_present);
  bool is_empty() const noexcept { return names_.empty(); }
  bool holds() const noexcept { return count_ == 1; }
  /// "expected exactly one of moveJ, moveL; found moveJ and moveL".
  std::string message() const;

 private:
  std::string names_, found_;
  std::size_t count_ = 0;
};

}  // namespace lrt::rdf
