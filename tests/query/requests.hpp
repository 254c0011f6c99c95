// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <set>
#include <string>
#include <string_view>

#include "tests/support/catch.hpp"
#include "tests/support/message.hpp"

namespace lrt::test {

/// A query in the query of a URL, or in a form.
inline std::string encoded(std::string_view text) {
  static constexpr char digits[] = "0123456789ABCDEF";
  std::string all;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if ((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9')) all += c;
    else (all += '%').append({digits[byte >> 4], digits[byte & 15]});
  }
  return all;
}

using Rows = std::multiset<std::string>;

/// The lines of CSV without the first, which has the names.
inline Rows rows(const Answer& answer) {
  INFO(answer.body);
  CHECK(answer.status == 200);
  Rows all;
  for (std::size_t at = answer.body.find("\r\n"); at != std::string::npos && at + 2 < answer.body.size();) {
    const std::size_t end = answer.body.find("\r\n", at + 2);
    all.insert(answer.body.substr(at + 2, end - at - 2));
    at = end;
  }
  return all;
}

}  // namespace lrt::test
