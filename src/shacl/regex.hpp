// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>

namespace lrt::shacl {

/// A regular expression with the meaning of SPARQL's REGEX (XPath and XQuery Functions 3.1, 5.6): a match anywhere in the subject, flags i,
/// m, s, x, q. Evaluated by PCRE2, with a bound on the work of a whole search. Immutable, any thread.
class LRT_INTERNAL_API Regex {
 private:
  struct Work;

 public:
  /// undecided: the work reached its bound
  enum class Outcome : unsigned char { match, no_match, undecided };

  /// Memory for matching, reused, and the work that its searches may still do: some steps for each byte of their subjects, and a reserve
  /// that they share. So the work of many searches is linear in the bytes that are searched. One for each thread and validation.
  class Scratch {
   public:
    Scratch() noexcept;
    ~Scratch();
    Scratch(const Scratch&) = delete;
    Scratch& operator=(const Scratch&) = delete;

   private:
    friend class Regex;
    Work& work();
    std::unique_ptr<Work> work_;
  };

  /// @par Errors  expected_value: an invalid expression or unknown flags; limit_exceeded: longer than `max_length` bytes
  static Result<Regex> compile(std::string_view pattern, std::string_view flags, std::size_t max_length);

  /// @param steps  the cost of the search is added, in units of some tens of nanoseconds
  Outcome search(std::string_view subject, Scratch& scratch, std::size_t& steps) const;

  enum class Replaced : unsigned char { done, invalid, too_long, undecided };
  /// Replaces each match (XPath and XQuery Functions 3.1, 5.6.4). In the replacement $N stands for a group, $0 for the match, \$ and \\ for
  /// themselves; with the flag q it is taken as it is.
  /// @param result  the text; at most `max_bytes`
  /// @return  invalid: the expression matches the empty text, or the replacement has another \ or $
  Replaced replace(std::string_view subject, std::string_view replacement, std::size_t max_bytes, Scratch& scratch, std::size_t& steps,
                   std::string& result) const;

 private:
  Regex() = default;
  int match(std::string_view subject, std::size_t at, Work& work) const;

  std::shared_ptr<const void> code_;
  bool literal_ = false;  // the flag q
  std::uint32_t groups_ = 0;
  std::size_t unmoved_ = 0;       // characters that an item may read without moving the match over them
  bool back_references_ = false;  // an item may read the text of a group without moving
};

}  // namespace lrt::shacl
