// SPDX-License-Identifier: Apache-2.0
// The options --mqtt... of the examples: the broker, and who the robot is for it.
#pragma once

#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <lrt/mqtt.hpp>

namespace broker {

/// Of a program with several robots: "{}" becomes the number of one.
inline std::string numbered(std::string text, unsigned number) {
  for (std::size_t at; (at = text.find("{}")) != std::string::npos;) text.replace(at, 2, std::to_string(number));
  return text;
}

/// What the options say.
///
/// --mqtt HOST:PORT           the broker
/// --mqtt-prefix LEVELS       the first levels of the topics; default: robots/ and the last part of the robot's identity
/// --mqtt-user NAME           a user of the broker, with --mqtt-password-file FILE, whose first line is the password
/// --mqtt-ca FILE             TLS; the authorities of the broker's certificate, or "system"
/// --mqtt-certificate FILE    the robot's own certificate, with --mqtt-key FILE
class Arguments {
 public:
  static constexpr const char* usage =
      "[--mqtt HOST:PORT [--mqtt-prefix LEVELS] [--mqtt-user NAME --mqtt-password-file FILE] [--mqtt-ca FILE|system] [--mqtt-certificate FILE "
      "--mqtt-key "
      "FILE]]";

  /// False: the option is none of these, or its value is wrong.
  bool take(std::string_view name, const std::string& value) {
    lrt::mqtt::Broker& to = options_.broker;
    if (name == "--mqtt") return is_given_ = read_address(value);
    if (name == "--mqtt-prefix") return options_.prefix = value, true;
    if (name == "--mqtt-user") return to.user = value, true;
    if (name == "--mqtt-password-file") return to.password_file = value, true;
    if (name == "--mqtt-ca") return tls().ca_file = value == "system" ? std::string() : value, true;
    if (name == "--mqtt-certificate") return tls().certificate_file = value, true;
    if (name == "--mqtt-key") return tls().key_file = value, true;
    return false;
  }
  /// Whether there are files that Bridge::reload() reads again.
  bool has_files() const { return options_.broker.tls || !options_.broker.password_file.empty(); }
  /// nullopt: there is no broker.
  /// @param number  of the robot, instead of "{}" in the values
  std::optional<lrt::mqtt::Options> options(unsigned number = 0) const {
    if (!is_given_) return std::nullopt;
    lrt::mqtt::Options one = options_;
    for (std::string* text : {&one.prefix, &one.broker.user, &one.broker.password_file}) *text = numbered(*text, number);
    if (one.broker.tls)
      for (std::string* text : {&one.broker.tls->certificate_file, &one.broker.tls->key_file}) *text = numbered(*text, number);
    return one;
  }

 private:
  bool read_address(const std::string& text) {
    const std::size_t colon = text.rfind(':');
    if (colon == std::string::npos || colon == 0) return false;
    options_.broker.host = text.substr(0, colon);
    const char* const end = text.data() + text.size();
    const auto [read_to, error] = std::from_chars(text.data() + colon + 1, end, options_.broker.port);
    return error == std::errc() && read_to == end;
  }
  lrt::mqtt::Tls& tls() { return options_.broker.tls ? *options_.broker.tls : options_.broker.tls.emplace(); }

  lrt::mqtt::Options options_;
  bool is_given_ = false;
};

}  // namespace broker
