// SPDX-License-Identifier: Apache-2.0
#include "tools/lrt-ros2/broker.hpp"

#ifdef LRT_ROS2_HAS_MQTT

#include <algorithm>
#include <charconv>
#include <string>
#include <string_view>
#include <utility>

#include <lrt/mqtt.hpp>

#include "tools/lrt/terminal.hpp"

namespace lrt::ros2_tool {
namespace {

class Link final : public BrokerLink {
 public:
  explicit Link(mqtt::Bridge bridge) : bridge_(std::move(bridge)) {}

 private:
  mqtt::Bridge bridge_;
};

/// "host", "host:port", "[address]", "[address]:port".
bool read_address(std::string_view text, mqtt::Broker& broker) {
  const bool has_brackets = !text.empty() && text.front() == '[';
  const std::size_t end = has_brackets ? text.find(']') : text.find(':');
  if (has_brackets && end == std::string_view::npos) return false;
  broker.host = std::string(has_brackets ? text.substr(1, end - 1) : text.substr(0, end));
  text.remove_prefix(std::min(has_brackets ? end + 1 : end, text.size()));
  if (broker.host.empty()) return false;
  if (text.empty()) return true;
  const char* const last = text.data() + text.size();
  const auto [read_to, error] = std::from_chars(text.data() + 1, last, broker.port);
  return text.front() == ':' && error == std::errc() && read_to == last && broker.port != 0;
}

}  // namespace

Result<std::unique_ptr<BrokerLink>> BrokerLink::create(Server& server, const Broker& broker, const LogCallback& log) {
  if (broker.address.empty()) return std::unique_ptr<BrokerLink>();
  mqtt::Options options;
  if (!read_address(broker.address, options.broker))
    return unexpected(Errc::invalid_option, "--mqtt: expected HOST or HOST:PORT, found \"" + tool::printable(broker.address) + '"');
  options.prefix = broker.prefix;
  options.log = log;
  options.broker.user = broker.user;
  options.broker.client_id = broker.client_id;
  options.broker.public_url = broker.public_url;
  if (!broker.password_file.empty()) {
    Result<std::string> password = first_line(broker.password_file);
    if (!password) return unexpected(std::move(password).error());
    options.broker.password = *std::move(password);
  }
  if (broker.tls || !broker.ca.empty() || !broker.certificate.empty()) options.broker.tls = mqtt::Tls{broker.ca, broker.certificate, broker.key};
  options.commands.enabled = broker.commands;
  if (!broker.command_token_file.empty()) {
    Result<std::string> token = first_line(broker.command_token_file);
    if (!token) return unexpected(std::move(token).error());
    options.commands.token = *std::move(token);
  }
  auto bridge = mqtt::Bridge::create(server, std::move(options));
  if (!bridge) return unexpected(std::move(bridge).error());
  if (Result<void> started = bridge->start(); !started) return unexpected(std::move(started).error());
  return std::make_unique<Link>(*std::move(bridge));
}

}  // namespace lrt::ros2_tool

#else

namespace lrt::ros2_tool {

Result<std::unique_ptr<BrokerLink>> BrokerLink::create(Server&, const Broker& broker, const LogCallback&) {
  if (broker.address.empty()) return std::unique_ptr<BrokerLink>();
  return unexpected(Errc::invalid_option, "--mqtt: this lrt-ros2 was built without lrt::mqtt");
}

}  // namespace lrt::ros2_tool

#endif
