#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

#include <lrt/base/result.hpp>

namespace lrt::shacl {

/// A regular expression with the meaning of SPARQL's REGEX (XPath and XQuery Functions 3.1, 5.6): a match anywhere in the subject, flags i,
/// m, s, x, q. Evaluated by PCRE2 with a limit of work. Immutable, any thread.
class Regex {
 public:
  enum class Outcome : unsigned char { match, no_match, undecided };

  /// Memory for matching, reused. One per thread.
  class Scratch {
   public:
    Scratch() = default;

   private:
    friend class Regex;
    struct Free {
      void operator()(void* data) const noexcept;
    };
    std::unique_ptr<void, Free> data_;
  };

  /// @par Errors  expected_value: an invalid expression or unknown flags; limit_exceeded: longer than `max_length` bytes
  static Result<Regex> compile(std::string_view pattern, std::string_view flags, std::size_t max_length);

  /// @param steps  the cost of the search is added, in units of some tens of nanoseconds
  Outcome search(std::string_view subject, Scratch& scratch, std::size_t& steps) const noexcept;

 private:
  Regex() = default;
  std::shared_ptr<const void> code_;
};

}  // namespace lrt::shacl
