// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/engine/counts.hpp>
#include <lrt/http/message.hpp>
#include <lrt/server.hpp>
#include <lrt/thing.hpp>

namespace lrt {
inline namespace v0 {

struct Metric;

/// A distribution of durations since the server was created, in seconds.
struct TimeCounts {
  /// Upper bounds of the first counts.
  static constexpr std::array<double, 11> bounds = {0.00001, 0.00005, 0.0001, 0.0002, 0.0005, 0.001, 0.002, 0.005, 0.01, 0.1, 1};
  std::array<std::uint64_t, bounds.size() + 1> counts{};  ///< durations up to each bound and above the one before; the last: above all bounds
  double sum = 0;                                         ///< [s] of all durations
  double newest = 0;                                      ///< [s]
  double maximum = 0;                                     ///< [s]
};

/// Counters of a server since it was created, and present numbers. Requests that the transport itself refuses are not
/// counted.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
struct ServerCounters : engine::EngineCounts {
  std::uint64_t requests = 0;                                ///< all requests that the engine got
  std::array<std::uint64_t, 5> responses{};                  ///< by class of status: 1xx, 2xx, 3xx, 4xx, 5xx
  std::array<std::uint64_t, http::denial_count> refusals{};  ///< by http::Denial
  std::optional<std::size_t> connections;                    ///< open ones, WebSockets included; nullopt: the transport does not count them
  TimeCounts poll;                                           ///< durations of Server::poll()
  TimeCounts poll_interval;                                  ///< from the beginning of one Server::poll() to that of the next
  std::uint64_t audit_dropped = 0;                           ///< lines of the audit that were lost
  std::size_t audit_waiting = 0;                             ///< lines that wait for the sink or the file of the audit
  std::uint64_t audit_errors = 0;                            ///< steps that failed in writing the file of the audit
  std::size_t unsaved_graph_changes = 0;                     ///< changes of graphs with a file that are not on the disk
  std::uint64_t graph_file_errors = 0;                       ///< attempts to write changes of graphs to their files that failed
  std::chrono::system_clock::time_point started{};           ///< when the server was created
};

/// The counters in the text format 0.0.4 of Prometheus, `text/plain;version=0.0.4;charset=utf-8`. The names begin with
/// `lrt_`; `lrt_start_time_seconds` is when the server was created, the labels of `lrt_build_info` are the version of lrt
/// and its compiler.
/// @par Threads  Any.
LRT_API std::string prometheus_text(const ServerCounters& counters);
/// The same with further metrics, sorted by their names. One is left out if it is not as Metric states, if the server has
/// that name, or if it is there twice, because Prometheus would refuse the whole text. `lrt_metrics_left_out` is how
/// many there are.
/// @par Threads  Any.
LRT_API std::string prometheus_text(const ServerCounters& counters, std::vector<Metric> others);

/// A Thing with the counters of a server, to be added to that server. Each client that may read it sees them. Its
/// property `metrics` is the text of prometheus_text(), with what Server::add_metrics() was given:
///
///     server.add(lrt::server_thing(server));   // scrape_configs: metrics_path: /server/metrics
///
/// Its lambdas run on the I/O thread and do not wait for the host. With Io::in_poll they do not wait for other threads either: while one of these
/// has the engine, subscribers, messages and queues are as at the reading before.
///
/// @param server  must exist as long as the Thing is served
/// @param path    path of the Thing
/// @par Threads  Any.
LRT_API Thing server_thing(const Server& server, std::string_view path = "server");

/// The identity of a robot in the text format of Prometheus, which the property `metrics` of server_thing() has first: `lrt_robot_info` with the value 1, and a label for each member that is not
/// empty: iri, serial_number, model, manufacturer, software_version, build. Empty without an IRI.
/// Two robots with one identity: `count by (iri) (lrt_robot_info) > 1`.
/// @par Threads  Any.
LRT_API std::string prometheus_text(const Identity& identity);

}  // namespace v0
}  // namespace lrt
