// SPDX-License-Identifier: Apache-2.0
#include "src/mirror/metrics.hpp"

#include <chrono>

namespace lrt::mirror {
inline namespace v0 {

std::vector<Metric> metrics_of(const MirrorCounts& counts, const std::string& store, std::size_t robots) {
  std::vector<Metric> all;
  const auto add = [&](const char* name, const char* help, Metric::Kind kind, auto value) {
    all.push_back({name, help, kind, static_cast<double>(value), {{"store", store}}});
  };
  using K = Metric::Kind;
  add("lrt_mirror_sent_total", "Graphs written to the store.", K::counter, counts.sent);
  add("lrt_mirror_sent_bytes_total", "These graphs as Turtle.", K::counter, counts.sent_bytes);
  add("lrt_mirror_deleted_total", "Graphs deleted in the store.", K::counter, counts.deleted);
  add("lrt_mirror_refused_total", "Graphs that the store refused.", K::counter, counts.refused);
  add("lrt_mirror_overwritten_total", "Graphs that another client had changed in the store.", K::counter, counts.overwritten);
  add("lrt_mirror_lost_total", "Graphs that the store had lost and got again.", K::counter, counts.lost);
  add("lrt_mirror_unread_total", "Readings of single resources of robots that failed.", K::counter, counts.unread);
  add("lrt_mirror_unchanged_total", "Graphs that were not sent, because the store has them.", K::counter, counts.unchanged);
  add("lrt_mirror_failures_total", "Requests to the store that failed and are repeated.", K::counter, counts.failures);
  add("lrt_mirror_graphs", "Graphs in the store, as far as is known.", K::gauge, counts.graphs);
  add("lrt_mirror_waiting_graphs", "Graphs to be sent or deleted.", K::gauge, counts.waiting);
  add("lrt_mirror_lag_seconds", "The age of the oldest change that the store has not accepted; 0: it has all.", K::gauge,
      std::chrono::duration<double>(counts.lag).count());
  add("lrt_mirror_robots", "Robots of this mirror.", K::gauge, robots);
  add("lrt_mirror_robots_away", "Robots that cannot be read.", K::gauge, counts.robots_away);
  add("lrt_mirror_robots_elsewhere", "Robots that name themselves by another URL than the given one.", K::gauge, counts.robots_elsewhere);
  return all;
}

}  // namespace v0
}  // namespace lrt::mirror
