// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace lrt::test {

/// The value of a field of a message as received, whose name is written so; empty: there is none in its header section.
inline std::string field_of(const std::string& message, std::string_view name) {
  const std::size_t at = message.find("\r\n" + std::string(name) + ": ");
  if (at == std::string::npos || at > message.find("\r\n\r\n")) return {};
  const std::size_t from = at + name.size() + 4;
  return message.substr(from, message.find("\r\n", from) - from);
}

}  // namespace lrt::test
