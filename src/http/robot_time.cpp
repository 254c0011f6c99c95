// SPDX-License-Identifier: Apache-2.0
#include "src/http/robot_time.hpp"

#include <charconv>

namespace lrt::http {

namespace {

constexpr std::size_t instance_digits = 16, max_digits = 15;

template <class T>
bool read(std::string_view text, int base, T& number) noexcept {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, base);
  return error == std::errc() && end == text.data() + text.size();
}

}  // namespace

std::optional<RobotTime> RobotTime::parse(std::string_view text) noexcept {
  if (text.size() < instance_digits + 2 || text.size() > instance_digits + 1 + max_digits || text[instance_digits] != '/') return std::nullopt;
  RobotTime time;
  if (!read(text.substr(0, instance_digits), 16, time.instance) || !read(text.substr(instance_digits + 1), 10, time.milliseconds))
    return std::nullopt;
  return time;
}

std::string RobotTime::text() const {
  char digits[instance_digits + 1 + 20];
  std::uint64_t rest = instance;
  for (std::size_t i = instance_digits; i-- > 0; rest >>= 4) digits[i] = "0123456789abcdef"[rest & 15];
  digits[instance_digits] = '/';
  const char* const end = std::to_chars(digits + instance_digits + 1, digits + sizeof digits, milliseconds).ptr;
  return std::string(digits, static_cast<std::size_t>(end - digits));
}

}  // namespace lrt::http
