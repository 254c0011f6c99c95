// SPDX-License-Identifier: Apache-2.0
#include <lrt/server_thing.hpp>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <functional>
#include <set>
#include <utility>

#include <lrt/base/metric.hpp>
#include <lrt/engine/handler.hpp>
#include <lrt/identity.hpp>
#include <lrt/rdf/unit.hpp>
#include <lrt/rdf/vocab.hpp>
#include <lrt/version.hpp>

#include "src/base/utf8.hpp"

namespace lrt {
inline namespace v0 {
namespace {

constexpr std::string_view metrics_type = "text/plain;version=0.0.4;charset=utf-8";
constexpr std::array<std::string_view, 5> classes = {"1xx", "2xx", "3xx", "4xx", "5xx"};

#ifdef __clang__
constexpr std::string_view built_by = "clang " __clang_version__;
#else
constexpr std::string_view built_by = "g++ " __VERSION__;
#endif

/// Writes the shortest digits that are read back as the same number.
std::string text_of(double number) {
  if (std::isnan(number)) return "NaN";
  if (std::isinf(number)) return number > 0 ? "+Inf" : "-Inf";
  char digits[32];
  return std::string(digits, std::to_chars(digits, digits + sizeof digits, number).ptr);
}

bool is_metric_name(std::string_view name) noexcept {
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  return !name.empty() && is_letter(name.front()) &&
         std::all_of(name.begin(), name.end(), [&](char c) { return is_letter(c) || (c >= '0' && c <= '9'); });
}

/// A text as the format escapes it: of a label with its quotes, of a help without.
std::string escaped_text(std::string_view text, bool is_label) {
  std::string out;
  for (const char c : text) {
    if (c == '\n') out += "\\n";
    else if (c == '\\' || (c == '"' && is_label)) (out += '\\') += c;
    else out += c;
  }
  return out;
}

bool has_end(std::string_view name, std::string_view end) noexcept {
  return name.size() > end.size() && name.substr(name.size() - end.size()) == end;
}

/// Whether a metric is as Metric states.
bool can_be_shown(const Metric& metric) {
  if (!is_metric_name(metric.name) || has_end(metric.name, "_total") != (metric.kind == Metric::Kind::counter)) return false;
  for (const char* of_histograms : {"_bucket", "_count", "_sum"})
    if (has_end(metric.name, of_histograms)) return false;
  if (metric.help.empty() || utf8::find_invalid(metric.help)) return false;
  std::set<std::string_view> names;
  return std::all_of(metric.labels.begin(), metric.labels.end(), [&](const auto& label) {
    return is_metric_name(label.first) && label.first.compare(0, 2, "__") != 0 && names.insert(label.first).second &&
           !utf8::find_invalid(label.second);
  });
}

/// "{name="value",...}", in the order of the names, so that equal sets of labels are equal texts; empty: there are none.
std::string label_text(const Metric& metric) {
  auto labels = metric.labels;
  std::sort(labels.begin(), labels.end());
  std::string out;
  for (const auto& [name, value] : labels) out += (out.empty() ? "{" : ",") + name + "=\"" + escaped_text(value, true) + "\"";
  return out.empty() ? out : out + "}";
}

/// Writes the exposition format. Names and labels are lrt's own and need no escapes, but for those of others().
class Exposition {
 public:
  void family(std::string_view name, std::string_view type, std::string_view help) {
    name_ = name;
    families_.insert(name_);
    out_.append("# HELP ").append(name).append(" ").append(help).append("\n# TYPE ").append(name).append(" ").append(type).append("\n");
  }
  void sample(std::string_view suffix, std::string_view label, std::string_view label_value, const std::string& value) {
    out_.append(name_).append(suffix);
    if (!label.empty()) out_.append("{").append(label).append("=\"").append(label_value).append("\"}");
    out_.append(" ").append(value).append("\n");
  }
  /// A sample with labels as label_text() writes them.
  void labelled(const std::string& labels, const std::string& value) { sample(labels, {}, {}, value); }
  void single(std::string_view name, std::string_view type, std::string_view help, const std::string& value) {
    family(name, type, help);
    sample("", "", "", value);
  }
  void single(std::string_view name, std::string_view type, std::string_view help, std::uint64_t value) {
    single(name, type, help, std::to_string(value));
  }
  void histogram(std::string_view name, std::string_view help, const TimeCounts& times) {
    family(name, "histogram", help);
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < times.counts.size(); ++i) {
      sum += times.counts[i];
      sample("_bucket", "le", i < TimeCounts::bounds.size() ? text_of(TimeCounts::bounds[i]) : "+Inf", std::to_string(sum));
    }
    sample("_sum", "", "", text_of(times.sum));
    sample("_count", "", "", std::to_string(sum));
  }
  /// Writes metrics of others, and how many are left out.
  void others(std::vector<Metric> metrics) {
    constexpr std::string_view left_out = "lrt_metrics_left_out";
    const std::size_t all = metrics.size();
    families_.emplace(left_out);
    metrics.erase(std::remove_if(metrics.begin(), metrics.end(), [&](const Metric& m) { return !can_be_shown(m) || families_.count(m.name) != 0; }),
                  metrics.end());
    std::stable_sort(metrics.begin(), metrics.end(), [](const Metric& a, const Metric& b) { return a.name < b.name; });
    std::size_t shown = 0;
    std::set<std::string> series;
    for (const Metric& metric : metrics) {
      if (metric.name != name_) {
        family(metric.name, metric.kind == Metric::Kind::counter ? "counter" : "gauge", escaped_text(metric.help, false));
        series.clear();
      }
      std::string labels = label_text(metric);
      if (!series.insert(labels).second) continue;
      labelled(labels, text_of(metric.value));
      ++shown;
    }
    single(left_out, "gauge", "Metrics of other parts of the program that this text cannot contain.", all - shown);
  }
  std::string take() { return std::move(out_); }

 private:
  std::string out_;
  std::string name_;
  std::set<std::string> families_;
};

}  // namespace

std::string prometheus_text(const ServerCounters& counters) { return prometheus_text(counters, {}); }

std::string prometheus_text(const ServerCounters& counters, std::vector<Metric> others) {
  Exposition e;
  e.family("lrt_build_info", "gauge", "1; the labels are the version of lrt and the compiler that built it.");
  e.labelled("{version=\"" LRT_VERSION "\",compiler=\"" + escaped_text(built_by, true) + "\"}", "1");
  e.single("lrt_start_time_seconds", "gauge", "When the server was created, in seconds since 1970.",
           text_of(std::chrono::duration<double>(counters.started.time_since_epoch()).count()));
  e.single("lrt_requests_total", "counter", "Requests.", counters.requests);
  e.family("lrt_responses_total", "counter", "Responses by class of their status.");
  for (std::size_t i = 0; i < classes.size(); ++i) e.sample("", "class", classes[i], std::to_string(counters.responses[i]));
  e.family("lrt_refusals_total", "counter", "Refused requests by reason.");
  for (std::size_t i = 1; i < http::denial_count; ++i)
    e.sample("", "reason", http::to_string(static_cast<http::Denial>(i)), std::to_string(counters.refusals[i]));
  if (counters.connections) e.single("lrt_connections", "gauge", "Open connections.", *counters.connections);
  e.family("lrt_subscribers", "gauge", "Subscriptions by protocol.");
  e.sample("", "protocol", "websocket", std::to_string(counters.websockets));
  e.sample("", "protocol", "event_stream", std::to_string(counters.event_streams));
  e.sample("", "protocol", "callback", std::to_string(counters.callbacks));
  e.sample("", "protocol", "feed", std::to_string(counters.feeds));
  e.single("lrt_messages_sent_total", "counter", "Messages that subscribers got.", counters.messages_sent);
  e.single("lrt_messages_dropped_total", "counter", "Changes that subscribers did not get one by one.", counters.messages_dropped);
  e.single("lrt_queued_bytes", "gauge", "Bytes of messages that wait for subscribers.", counters.queued_bytes);
  e.single("lrt_waiting_requests", "gauge", "Deferred requests.", counters.waiting_requests);
  e.single("lrt_waiting_calls", "gauge", "Calls of lambdas that the host has not run.", counters.waiting_calls);
  e.histogram("lrt_poll_seconds", "How long calls of poll took.", counters.poll);
  e.single("lrt_poll_maximum_seconds", "gauge", "The longest call of poll.", text_of(counters.poll.maximum));
  e.histogram("lrt_poll_interval_seconds", "From the beginning of one call of poll to that of the next.", counters.poll_interval);
  e.single("lrt_poll_interval_maximum_seconds", "gauge", "The longest of these times.", text_of(counters.poll_interval.maximum));
  e.single("lrt_audit_dropped_lines_total", "counter", "Lines of the audit that were dropped.", counters.audit_dropped);
  e.single("lrt_audit_waiting_lines", "gauge", "Lines that wait for the sink or the file of the audit.", counters.audit_waiting);
  e.single("lrt_audit_file_errors_total", "counter", "Steps that failed in writing the file of the audit.", counters.audit_errors);
  e.single("lrt_graph_changes_unsaved", "gauge", "Changes of graphs with a file that are not on the disk.", counters.unsaved_graph_changes);
  e.single("lrt_graph_file_errors_total", "counter", "Attempts to write changes of graphs to their files that failed.", counters.graph_file_errors);
  e.single("lrt_queries_total", "counter", "Queries that were begun, without the evaluations of standing queries.", counters.queries);
  e.single("lrt_queries_failed_total", "counter", "Queries that ended without a result: too long, too large, or cancelled.", counters.failed_queries);
  e.single("lrt_queries_refused_total", "counter", "Queries that were refused because too many are under way or stand.", counters.refused_queries);
  e.single("lrt_query_seconds_total", "counter", "How long queries took from their beginning to their end, in all.", text_of(counters.query_seconds));
  e.single("lrt_running_queries", "gauge", "Queries that have begun and not ended.", counters.running_queries);
  e.single("lrt_standing_queries", "gauge", "Standing queries.", counters.standing_queries);
  e.others(std::move(others));
  return e.take();
}

std::string prometheus_text(const Identity& identity) {
  if (identity.iri.empty()) return {};
  std::string labels;
  const auto add = [&](const char* name, const std::string& text) {
    if (text.empty()) return;
    labels.append(labels.empty() ? "" : ",").append(name).append("=\"");
    for (const char c : text) labels += c == '\\' ? "\\\\" : c == '"' ? "\\\"" : c == '\n' ? "\\n" : std::string(1, c);
    labels += '"';
  };
  add("iri", identity.iri);
  add("serial_number", identity.serial_number);
  add("model", identity.model);
  add("manufacturer", identity.manufacturer);
  add("software_version", identity.software_version);
  add("build", identity.build);
  return "# HELP lrt_robot_info Which robot this is; the value is 1.\n# TYPE lrt_robot_info gauge\nlrt_robot_info{" + labels + "} 1\n";
}

Thing server_thing(const Server& server, std::string_view path) {
  const std::function<ServerCounters()> read = server.counter_source();
  const std::string who = prometheus_text(server.identity());
  Thing thing(path);
  thing.title("Server", "en").dispatch(Dispatch::io_thread);
  const auto add = [&](const std::string& name, const char* title, const char* description, const Unit& unit, auto value) {
    thing
        .property(
            name, [read, value] { return value(read()); }, unit)
        .title(title, "en")
        .description(description, "en")
        .as_counter();
  };
  const auto count = [&](const std::string& name, const char* title, const char* description, auto value) {
    add(name, title, description, unit::one, [value](const ServerCounters& c) { return static_cast<std::uint64_t>(value(c)); });
  };
  const auto time = [&](const std::string& name, const char* title, const char* description, auto value) {
    add(name, title, description, unit::second, value);
  };
  using C = const ServerCounters&;
  count("requests", "Requests", "Requests since the server was created.", [](C c) { return c.requests; });
  for (std::size_t i = 0; i < classes.size(); ++i)
    count("responses/" + std::string(classes[i]), "Responses", "Responses of this class since the server was created.",
          [i](C c) { return c.responses[i]; });
  for (std::size_t i = 1; i < http::denial_count; ++i)
    count("refusals/" + std::string(http::to_string(static_cast<http::Denial>(i))), "Refusals",
          "Requests refused for this reason since the server was created.", [i](C c) { return c.refusals[i]; });
  count("connections", "Connections", "Open connections, WebSockets included; 0 where the transport does not count them.",
        [](C c) { return c.connections.value_or(0); });
  count("subscribers/websocket", "WebSockets", "Open WebSockets.", [](C c) { return c.websockets; });
  count("subscribers/event_stream", "Event streams", "Open event streams.", [](C c) { return c.event_streams; });
  count("subscribers/callback", "Web callbacks", "Subscriptions of web callbacks.", [](C c) { return c.callbacks; });
  count("subscribers/feed", "Feeds", "Subscriptions of the robot's own program, as of a bridge to an MQTT broker.", [](C c) { return c.feeds; });
  count("messages/sent", "Messages sent", "Messages that subscribers got since the server was created.", [](C c) { return c.messages_sent; });
  count("messages/dropped", "Changes dropped", "Changes that subscribers did not get one by one.", [](C c) { return c.messages_dropped; });
  count("queues/bytes", "Bytes in queues", "Bytes of messages that wait for subscribers.", [](C c) { return c.queued_bytes; });
  count("queues/requests", "Deferred requests", "Requests that wait for their response.", [](C c) { return c.waiting_requests; });
  count("queues/calls", "Waiting calls", "Calls of lambdas that the host has not run.", [](C c) { return c.waiting_calls; });
  time("poll/newest", "Newest call of poll", "How long the newest call of poll took.", [](C c) { return c.poll.newest; });
  time("poll/maximum", "Longest call of poll", "How long the longest call of poll took.", [](C c) { return c.poll.maximum; });
  time("poll/interval/newest", "Time between polls", "From the beginning of the last but one call of poll to that of the last.",
       [](C c) { return c.poll_interval.newest; });
  time("poll/interval/maximum", "Longest time between polls", "The longest time from one call of poll to the next.",
       [](C c) { return c.poll_interval.maximum; });
  count("audit/dropped", "Audit lines dropped", "Lines of the audit that were dropped.", [](C c) { return c.audit_dropped; });
  count("audit/waiting", "Audit lines waiting", "Lines that wait for the sink or the file of the audit.", [](C c) { return c.audit_waiting; });
  count("audit/errors", "Audit file errors", "Steps that failed in writing the file of the audit.", [](C c) { return c.audit_errors; });
  count("queries/begun", "Queries", "Queries that were begun, without the evaluations of standing queries.", [](C c) { return c.queries; });
  count("queries/failed", "Failed queries", "Queries that ended without a result.", [](C c) { return c.failed_queries; });
  count("queries/refused", "Refused queries", "Queries that were refused because too many are under way or stand.",
        [](C c) { return c.refused_queries; });
  count("queries/running", "Running queries", "Queries that have begun and not ended.", [](C c) { return c.running_queries; });
  count("queries/standing", "Standing queries", "Standing queries.", [](C c) { return c.standing_queries; });
  count("graphs/unsaved", "Unsaved changes", "Changes of graphs with a file that are not on the disk.", [](C c) { return c.unsaved_graph_changes; });
  count("graphs/errors", "Graph file errors", "Attempts to write changes of graphs to their files that failed.",
        [](C c) { return c.graph_file_errors; });
  thing.property("metrics", [read, who, others = server.metric_source()] { return who + prometheus_text(read(), others()); })
      .title("Metrics", "en")
      .description("The counters and those of other parts of the program in the text format of Prometheus.", "en")
      .representation(metrics_type, [](const std::string& text) { return text; })
      .as_file();
  return thing;
}

}  // namespace v0
}  // namespace lrt
