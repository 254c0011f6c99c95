// SPDX-License-Identifier: Apache-2.0
#include "src/mqtt/metrics.hpp"

#include <chrono>

namespace lrt::mqtt {
inline namespace v0 {

std::vector<Metric> metrics_of(const Counters& counters, const std::string& broker, const std::string& prefix) {
  std::vector<Metric> all;
  const auto add = [&](const char* name, const char* help, Metric::Kind kind, auto value) {
    all.push_back({name, help, kind, static_cast<double>(value), {{"broker", broker}, {"prefix", prefix}}});
  };
  using K = Metric::Kind;
  add("lrt_mqtt_online", "Whether the broker is connected.", K::gauge, counters.online ? 1 : 0);
  add("lrt_mqtt_connections_total", "Connections that the broker has accepted.", K::counter, counters.connections);
  add("lrt_mqtt_failed_connections_total", "Attempts to connect that failed.", K::counter, counters.failed_connections);
  add("lrt_mqtt_published_total", "Messages passed to the network, without repetitions.", K::counter, counters.published);
  add("lrt_mqtt_published_bytes_total", "Payloads of these messages.", K::counter, counters.published_bytes);
  add("lrt_mqtt_acknowledged_total", "Messages with QoS 1 and 2 that the broker has acknowledged.", K::counter, counters.acknowledged);
  add("lrt_mqtt_refused_total", "Messages that were refused: too large, or not authorized.", K::counter, counters.refused);
  add("lrt_mqtt_left_out_total", "Changes of values that the broker was not sent, because newer ones replaced them.", K::counter, counters.left_out);
  add("lrt_mqtt_not_bridged_total", "Resources that match a publication and cannot be published.", K::counter, counters.not_bridged);
  add("lrt_mqtt_commands_total", "Commands passed to the server.", K::counter, counters.commands);
  add("lrt_mqtt_dropped_commands_total", "Commands without a response: not well-formed, retained, or too large.", K::counter,
      counters.dropped_commands);
  add("lrt_mqtt_taken_over_total", "Times that another client was found to be connected as this robot.", K::counter, counters.taken_over);
  add("lrt_mqtt_resources", "Resources that are published.", K::gauge, counters.resources);
  add("lrt_mqtt_unacknowledged", "Messages with QoS 1 and 2 that wait for an acknowledgement.", K::gauge, counters.unacknowledged);
  add("lrt_mqtt_lag_seconds", "How long the oldest value that waits has waited; 0: none waits.", K::gauge,
      std::chrono::duration<double>(counters.lag).count());
  return all;
}

}  // namespace v0
}  // namespace lrt::mqtt
