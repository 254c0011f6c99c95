// SPDX-License-Identifier: Apache-2.0
// Code of docs/mqtt.md. It is compiled, not run: tests/mqtt runs the same functions.
#include <chrono>

#include <lrt/lrt.hpp>
#include <lrt/mqtt.hpp>

namespace docs {

void publish(lrt::Server& server) {
  lrt::mqtt::Options options;
  options.broker.host = "broker.example";
  options.prefix = "robots/r7";  // the first levels of all topics of this robot
  auto bridge = lrt::mqtt::Bridge::create(server, options).value();
  bridge.start().value();  // a thread of its own; or call poll() in a loop of yours
}

void choose(lrt::mqtt::Options& options) {
  lrt::mqtt::Publication poses, rest;
  poses.paths = "/**/pose";
  poses.media_type = "application/cbor";
  poses.minimum_interval = std::chrono::milliseconds(100);  // at most 10 in a second
  rest.media_type = "application/ld+json";
  rest.qos = 1;
  options.publications = {poses, rest};
}

void encrypt(lrt::mqtt::Options& options) {
  options.broker.tls.emplace().ca_file = "ca.pem";  // empty: the authorities of the system
  options.broker.tls->certificate_file = "r7.pem";  // for brokers that require the robot's own
  options.broker.tls->key_file = "r7-key.pem";
}

}  // namespace docs
