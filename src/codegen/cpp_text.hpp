// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <initializer_list>
#include <set>
#include <string>
#include <string_view>

namespace lrt::codegen::cpp {

/// A string literal with quotes, for any bytes: everything but plain ASCII is an octal escape, also '?', because "??/" was a trigraph.
std::string string_literal(std::string_view text);

/// A text for one line of a comment: control characters, invalid UTF-8, and marks that change the direction of text are '?' or spaces; "*/", "/*",
/// "??" and a '\' cannot occur.
/// @param max  bytes; a longer text is cut and ends with "..."
std::string comment_text(std::string_view text, std::size_t max);

/// An identifier of ASCII letters, digits and '_' that begins with an upper-case letter: "joint-limits" is JointLimits.
std::string type_name(std::string_view name, std::size_t max);
/// An identifier that begins with a lower-case letter, is no keyword of C++ and no macro of the standard library: "class" is class_, "NAN" nan.
/// Letters of Latin-1 become ASCII ("gr\u00f6\u00dfe" is groesse), others their code point.
std::string member_name(std::string_view name, std::size_t max);

/// Whether a text is "a" or "a::b" of identifiers that a header may use as its namespace.
bool is_namespace(std::string_view text);

/// The names of one scope.
class Scope {
 public:
  Scope() = default;
  Scope(std::initializer_list<const char*> taken) : taken_(taken.begin(), taken.end()) {}
  /// The name, or if it is taken, the name with a number.
  std::string add(const std::string& name);

 private:
  std::set<std::string> taken_;
};

}  // namespace lrt::codegen::cpp
