// SPDX-License-Identifier: Apache-2.0
// A host of lrt::mqtt: a bridge to a broker that is not there.
#include <lrt/lrt.hpp>
#include <lrt/mqtt.hpp>

int main() {
  lrt::Options options;
  options.listen.port = 0;
  options.identity.iri = "https://robots.example/r1";
  lrt::Server server = lrt::Server::create(options).value();
  lrt::mqtt::Options mqtt;
  mqtt.broker.port = 1;
  mqtt.prefix = "robots/r1";
  lrt::mqtt::Bridge bridge = lrt::mqtt::Bridge::create(server, mqtt).value();
  bridge.poll();
  return bridge.counters().online ? 1 : 0;
}
