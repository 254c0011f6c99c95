// SPDX-License-Identifier: Apache-2.0
#include "tools/lrt/observing.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <map>
#include <set>

namespace lrt::tool {

using client::Change;
using std::chrono::milliseconds;
using std::chrono::steady_clock;
using std::chrono::system_clock;

constexpr std::chrono::seconds silence{3};  ///< then people are told that the robot says nothing

const char* name_of(Observed::Kind kind) noexcept {
  switch (kind) {
    case Observed::Kind::gap: return "gap";
    case Observed::Kind::silent: return "silent";
    case Observed::Kind::heard: return "heard";
    default: return "ended";
  }
}

void add_observe_options(CLI::App& command, ObserveOptions& options) {
  command.add_option("NAME", options.words, "Names of properties or Things, patterns with * and ?, or URLs")
      ->required()
      ->type_name("[ROBOT] NAME...")
      ->expected(1, 1000);
  command.add_option("--count", options.count, "End after this number of values")->type_name("N")->check(number_from(1, 1e12));
  command.add_option("--for", options.seconds, "End after this time")->type_name("SECONDS")->check(number_from(0, 1e9));
  command.add_option("--via", options.via, "websocket, event-stream or polling; default: the first of them that the server has")
      ->type_name("PROTOCOL")
      ->transform(one_of<client::Via>(
          {{"websocket", client::Via::websocket}, {"event-stream", client::Via::event_stream}, {"polling", client::Via::polling}}));
}

Result<void> Observer::find() {
  std::vector<std::string>& words = options_.words;
  if (words.size() > 1 && is_url(words[0]) && !is_url(words[1])) session_.take_robot(words, 1);
  constexpr std::size_t max_watches = 200;
  if (words.size() > max_watches) return unexpected(Errc::invalid_option, "at most 200 properties can be watched at a time");
  std::set<std::string> known;
  for (const std::string& word : words) {
    Result<std::vector<NamedProperty>> named = session_.properties(word, true);
    if (!named) return unexpected(std::move(named).error());
    for (NamedProperty& one : *named) {
      if (!known.insert(one.property.url()).second) continue;
      if (known.size() > max_watches)
        return unexpected(Errc::invalid_option, "\"" + word + "\" names more than 200 properties; at most 200 can be watched at a time");
      const Result<std::optional<client::Shape>> shape = one.property.value_shape();
      if (!shape) return unexpected(shape.error());
      schemas_.push_back(schema_of(shape));
      names_.push_back(printable(one.name));
      properties_.push_back(std::move(one.property));
    }
  }
  return {};
}

void Observer::take(std::size_t index, const Change& change) {
  Observed seen;
  seen.property = index;
  seen.received = change.received;
  seen.time = system_clock::now() - std::chrono::duration_cast<system_clock::duration>(steady_clock::now() - change.received);
  if (change.kind == Change::Kind::gap || change.kind == Change::Kind::ended) {
    seen.kind = change.kind == Change::Kind::gap ? Observed::Kind::gap : Observed::Kind::ended;
    if (seen.kind == Observed::Kind::ended) {
      has_ended_[index] = true;
      if (change.reason && !refusal_) refusal_ = change.reason;
    }
    seen.reason = change.reason ? printable(change.reason->message) : change.left_out ? "" : "the connection was lost";
    if (seen.kind == Observed::Kind::gap && change.left_out) {
      if (!seen.reason.empty()) seen.reason += "; ";
      seen.reason += std::to_string(*change.left_out) + (*change.left_out == 1 ? " value is missing" : " values are missing");
    }
    changes_.push_back(std::move(seen));
    return;
  }
  if (change.kind == Change::Kind::silent || change.kind == Change::Kind::heard) {
    const bool is_silent = change.kind == Change::Kind::silent;
    seen.kind = is_silent ? Observed::Kind::silent : Observed::Kind::heard;
    seen.reason =
        is_silent ? "no word for " + std::to_string(silence.count()) + " s; the value may be another one by now" : "the robot responds again";
    changes_.push_back(std::move(seen));
    return;
  }
  if (change.dropped > 0) {
    Observed gap = seen;
    gap.kind = Observed::Kind::gap;
    gap.reason = std::to_string(change.dropped) + " values were dropped, because they arrived too fast";
    changes_.push_back(std::move(gap));
  }
  const Result<rdf::Graph> graph = change.graph();
  const client::Property& property = properties_[index];
  const Result<rdf::TermId> node =
      graph ? property.value_node(*graph, client::find_focus(*graph, property.url())) : Result<rdf::TermId>(unexpected(graph.error()));
  if (!node) {
    seen.kind = Observed::Kind::gap;
    seen.reason = printable(node.error().message);
  } else {
    seen.source_time = change.at;
    seen.value = value_at(*graph, *node, schemas_[index] ? &*schemas_[index] : nullptr);
  }
  changes_.push_back(std::move(seen));
}

void Observer::report_connections(const ObserveHooks& hooks) {
  for (std::size_t i = 0; i < watches_.size(); ++i) {
    const bool connected = watches_[i].is_connected();
    if (was_connected_[i] && !connected && !has_ended_[i]) {
      if (hooks.on_lost) hooks.on_lost(i);
      else session_.warn("\"" + names_[i] + "\": the connection is lost; connecting again");
    }
    was_connected_[i] = connected;
  }
}

std::optional<milliseconds> Observer::age() const {
  std::optional<milliseconds> oldest;
  for (const client::Watch& watch : watches_)
    if (const auto age = watch.age()) oldest = std::max(oldest.value_or(*age), *age);
  return oldest;
}

Result<int> Observer::run(const ObserveHooks& hooks) {
  const Result<Client*> client = session_.client();
  if (!client) return unexpected(client.error());
  Signals signals;
  client::WatchOptions options;
  options.via = options_.via;
  options.queue_length = 100;
  options.first_pause = milliseconds(100);
  options.max_pause = milliseconds(2'000);  // standard output is a terminal
  if (session_.terminal().is_for_people()) {
    options.heartbeat = milliseconds(1'000);
    options.silence = silence;
  }
  has_ended_.assign(properties_.size(), false);
  was_connected_.assign(properties_.size(), false);
  for (std::size_t i = 0; i < properties_.size(); ++i) {
    Result<client::Watch> watch = (*client)->watch(properties_[i].url(), options, [this, i](const Change& change) { take(i, change); });
    if (!watch) return unexpected(std::move(watch).error());
    watches_.push_back(*std::move(watch));
  }
  const auto start = steady_clock::now();
  std::optional<steady_clock::time_point> end;
  if (options_.seconds) end = start + milliseconds(static_cast<std::int64_t>(*options_.seconds * 1000));
  std::size_t values = 0;
  bool reads_keys = hooks.on_key != nullptr;
  while (true) {
    (*client)->poll(std::chrono::milliseconds(20));
    while (!changes_.empty()) {
      const Observed seen = std::move(changes_.front());
      changes_.pop_front();
      if (!hooks.on_change(seen)) return Exit::success;
      if (seen.kind == Observed::Kind::value && options_.count && ++values >= *options_.count) {
        if (hooks.on_pause) hooks.on_pause();
        return Exit::success;
      }
    }
    report_connections(hooks);
    if (hooks.on_pause) hooks.on_pause();
    if (session_.terminal().failed() != 0) return Exit::failure;  // reported by main()
    if (std::all_of(has_ended_.begin(), has_ended_.end(), [](bool ended) { return ended; })) {
      if (refusal_) return unexpected(*refusal_);
      return Exit::success;
    }
    const auto now = steady_clock::now();
    if (end && now >= *end) return Exit::success;
    milliseconds pause = hooks.pause;
    if (end) pause = std::min(pause, std::chrono::ceil<milliseconds>(*end - now));
    // Standard output is checked, too: if its reader has closed it, a watch without changes ends.
    pollfd events[4] = {
        {(*client)->descriptor(), POLLIN, 0}, {signals.descriptor(), POLLIN, 0}, {STDOUT_FILENO, 0, 0}, {reads_keys ? STDIN_FILENO : -1, POLLIN, 0}};
    ::poll(events, 4, static_cast<int>(pause.count()));
    while (const int signal = signals.take()) {
      if (ends_command(signal)) return 128 + signal;
      if (hooks.on_signal) hooks.on_signal(signal);
    }
    if ((events[2].revents & POLLERR) != 0 && !session_.terminal().is_for_people()) return Exit::pipe_closed;
    if (reads_keys && events[3].revents != 0) {
      char key = 0;
      if (::read(STDIN_FILENO, &key, 1) != 1) reads_keys = false;
      else if (!hooks.on_key(key)) return Exit::success;
    }
  }
}

namespace {

std::string formatted(system_clock::time_point time, bool here) {
  const auto since = std::chrono::duration_cast<std::chrono::microseconds>(time.time_since_epoch()).count();
  const std::time_t seconds = static_cast<std::time_t>(since / 1'000'000);
  const long micros = static_cast<long>(since % 1'000'000);
  std::tm parts{};
  if (here) ::localtime_r(&seconds, &parts);
  else ::gmtime_r(&seconds, &parts);
  char text[96];
  if (here) std::snprintf(text, sizeof text, "%02d:%02d:%02d.%03ld", parts.tm_hour, parts.tm_min, parts.tm_sec, micros / 1000);
  else
    std::snprintf(text, sizeof text, "%04d-%02d-%02dT%02d:%02d:%02d.%06ldZ", parts.tm_year + 1900, parts.tm_mon + 1, parts.tm_mday, parts.tm_hour,
                  parts.tm_min, parts.tm_sec, micros);
  return text;
}

}  // namespace

std::string utc(system_clock::time_point time) { return formatted(time, false); }
std::string time_of_day(system_clock::time_point time) { return formatted(time, true); }

}  // namespace lrt::tool
