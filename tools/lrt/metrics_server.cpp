// SPDX-License-Identifier: Apache-2.0
#include "tools/lrt/metrics_server.hpp"

#include <charconv>
#include <cstdint>
#include <string_view>
#include <utility>

#include <lrt/server_thing.hpp>

namespace lrt::tool {

MetricsServer::MetricsServer(Server server, MetricSource source) : server_(std::move(server)), shown_(server_.add_metrics(std::move(source))) {}

Result<MetricsServer> MetricsServer::create(const std::string& where, MetricSource source) {
  Options options;
  std::string_view port = where;
  if (const std::size_t colon = port.rfind(':'); colon != std::string_view::npos) {
    std::string_view address = port.substr(0, colon);
    if (address.size() > 2 && address.front() == '[' && address.back() == ']') address = address.substr(1, address.size() - 2);
    options.listen.address = address;
    port.remove_prefix(colon + 1);
  }
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), options.listen.port);
  if (error != std::errc() || end != port.data() + port.size() || options.listen.address.empty())
    return unexpected(Errc::invalid_option, "--metrics: expected a port or ADDRESS:PORT, found \"" + where + "\"");
  Result<Server> server = Server::create(std::move(options));
  if (!server) return unexpected(std::move(server).error());
  if (Result<void> added = server->add(server_thing(*server)); !added) return unexpected(std::move(added).error());
  return MetricsServer(*std::move(server), std::move(source));
}

}  // namespace lrt::tool
