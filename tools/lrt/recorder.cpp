// SPDX-License-Identifier: Apache-2.0
#include "tools/lrt/recorder.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

#include <lrt/rdf/vocab.hpp>

#include "src/http/url.hpp"
#include "src/recording/value_schema.hpp"
#include "tools/lrt/naming.hpp"

namespace lrt::tool {

using client::Change;
using client::GapCause;
using client::RecordedChange;
using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

namespace {

constexpr std::size_t max_properties = 200;
/// The queue that is asked for if a robot has no longer one.
constexpr std::size_t short_queue = 100;
/// For each value that a robot holds, so many wait in this program until they are written: what arrives at once after a stall, and more.
constexpr std::size_t waiting_changes = 5, max_waiting_changes = 100'000;

std::string without_fragment(const std::string& url) { return url.substr(0, url.find('#')); }

/// The root of a URL of a property or a Thing.
std::string root_of(const std::string& url) {
  const Result<http::Url> parsed = http::parse_url(without_fragment(url));
  return parsed ? parsed->origin() + "/" : url;
}

/// Whether a URL is that of a Thing or of a root, not of a property.
bool has_properties(const client::Representation& representation) {
  const std::vector<std::string> types = representation.types();
  const auto has_type = [&](Iri type) { return std::find(types.begin(), types.end(), type.text) != types.end(); };
  return !representation.objects(vocab::hybrit::property).empty() || has_type(vocab::hybrit::RoboticThing) || has_type(vocab::ldp::Container) ||
         has_type(vocab::ldp::BasicContainer) || !representation.objects(vocab::ldp::contains).empty();
}

std::string values_missing(std::uint64_t count) { return std::to_string(count) + (count == 1 ? " value is missing" : " values are missing"); }

}  // namespace

Recorder::~Recorder() {
  for (Channel& channel : channels_) channel.watch.stop();  // their callbacks are functions of this
}

Result<Client*> Recorder::client() {
  if (client_) return &*client_;
  Result<client::Options> options = session_.client_options();
  if (!options) return unexpected(std::move(options).error());
  options->limits.max_waiting_changes = std::min(options_.queue, max_waiting_changes / waiting_changes) * waiting_changes;
  Result<Client> made = Client::create(*std::move(options));
  if (!made) return unexpected(std::move(made).error());
  client_.emplace(*std::move(made));
  return &*client_;
}

Result<void> Recorder::find() {
  const Result<Client*> client = this->client();
  if (!client) return unexpected(client.error());
  const std::vector<std::string>& words = options_.words;
  std::optional<client::Robot> robot;
  const auto open = [&](const std::string& url) -> Result<void> {
    Result<client::Robot> opened = (*client)->open(url);
    if (!opened) {
      Error error = std::move(opened).error();
      if (exit_of(error.code) == Exit::unreachable && error.message.find(url) == std::string::npos)
        error.message = "no response from " + url + ": " + error.message;
      return unexpected(std::move(error));
    }
    if (std::optional<Error> other = elsewhere(**client, *opened)) return unexpected(*std::move(other));
    robot.emplace(*std::move(opened));
    return {};
  };
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    if (!is_url(word)) {
      if (!robot) {
        if (session_.options().robot.empty()) return unexpected(Errc::invalid_option, "no robot is given: use --robot URL, or set LRT_ROBOT");
        if (Result<void> opened = open(session_.options().robot); !opened) return opened;
      }
      if (Result<void> added = add_name(*robot, word); !added) return added;
      continue;
    }
    if (i + 1 < words.size() && !is_url(words[i + 1])) {  // the robot of the names that follow
      if (Result<void> opened = open(word); !opened) return opened;
      continue;
    }
    const Result<client::RepresentationPtr> read = (*client)->get(word);
    if (!read && read.error().code != Errc::unsupported_syntax) return unexpected(read.error());
    if (read)
      if (std::optional<Error> other = elsewhere((*read)->url, (*read)->graph)) return unexpected(*std::move(other));
    if (read && has_properties(**read)) {
      if (Result<void> opened = open(word); !opened) return opened;
      if (Result<void> added = add_thing(*robot, word); !added) return added;
      continue;
    }
    const Result<client::Property> property = (*client)->property(word);
    if (!property) return unexpected(property.error());
    if (Result<void> added = add(*property, session_.label(word), root_of(word)); !added) return added;
  }
  if (channels_.empty()) return unexpected(Errc::invalid_option, "what is recorded has no properties");
  return {};
}

Result<void> Recorder::add(const client::Property& property, const std::string& name, const std::string& robot) {
  const bool is_known = std::any_of(channels_.begin(), channels_.end(), [&](const Channel& c) { return c.property.url() == property.url(); });
  if (is_known) return {};
  if (channels_.size() >= max_properties)
    return unexpected(Errc::invalid_option, "more than " + std::to_string(max_properties) + " properties; name those that are to be recorded");
  if (std::find(robots_.begin(), robots_.end(), robot) == robots_.end()) robots_.push_back(robot);
  const Result<std::optional<client::Shape>> shape = property.value_shape();
  if (!shape) return unexpected(shape.error());
  channels_.push_back({property, name, robot, schema_of(shape)});
  return {};
}

/// All properties of a Thing and of the Things below it, or of all Things.
Result<void> Recorder::add_thing(const client::Robot& robot, const std::string& url) {
  std::string whole = without_fragment(url);
  while (!whole.empty() && whole.back() == '/') whole.pop_back();
  const auto is_below = [&](const client::Thing& thing) {
    const std::string of = without_fragment(thing.url());
    return of.size() >= whole.size() && of.compare(0, whole.size(), whole) == 0 && (of.size() == whole.size() || of[whole.size()] == '/');
  };
  const bool is_known = std::any_of(robot.things().begin(), robot.things().end(), is_below);
  const bool is_thing =
      std::any_of(robot.things().begin(), robot.things().end(), [&](const client::Thing& thing) { return thing.url() == robot.url(); });
  const std::string of = is_thing ? root_of(robot.url()) : robot.url();
  for (const client::Thing& thing : robot.things()) {
    if (is_known && !is_below(thing)) continue;
    for (const client::Property& property : thing.properties())
      if (Result<void> added = add(property, printable(thing.name() + "/" + property.name()), of); !added) return added;
  }
  return {};
}

/// A property, a Thing, or a pattern with * that properties fit.
Result<void> Recorder::add_name(const client::Robot& robot, const std::string& name) {
  const auto label = [&](const std::string& url) {
    for (const client::Thing& thing : robot.things())
      for (const client::Property& property : thing.properties())
        if (property.url() == url) return printable(thing.name() + "/" + property.name());
    return session_.label(url);
  };
  if (name.find('*') != std::string::npos) {
    const std::size_t had = channels_.size();
    for (const client::Thing& thing : robot.things())
      for (const client::Property& property : thing.properties())
        if (recording::fits(thing.name() + "/" + property.name(), name) || recording::fits(property.url(), name))
          if (Result<void> added = add(property, printable(thing.name() + "/" + property.name()), robot.url()); !added) return added;
    if (channels_.size() == had) return unexpected(Errc::unknown_path, "no property fits \"" + name + "\"");
    return {};
  }
  const Result<client::Property> property = robot.property(name);
  if (property) return add(*property, label(property->url()), robot.url());
  const Result<client::Thing> thing = robot.thing(name);
  if (!thing) return unexpected(property.error());
  return add_thing(robot, thing->url());
}

bool Recorder::has_several_origins() const {
  const auto origin = [](const std::string& url) { return url.substr(0, url.find('/', std::min(url.find("://") + 3, url.size()))); };
  return std::any_of(channels_.begin(), channels_.end(),
                     [&](const Channel& channel) { return origin(channel.property.url()) != origin(channels_.front().property.url()); });
}

microseconds Recorder::since_start(steady_clock::time_point time) const {
  return std::max(std::chrono::duration_cast<microseconds>(time - start_), microseconds(0));
}

void Recorder::write(const RecordedChange& change) {
  if (error_) return;
  if (Result<void> written = file_->add(change); !written) error_ = std::move(written).error();
}

void Recorder::write_gap(Channel& channel, RecordedChange gap) {
  gap.name = channel.name;
  gap.url = channel.property.url();
  gap.robot = channel.robot;
  ++gaps_;
  left_out_ += gap.left_out.value_or(0);
  write(gap);
}

void Recorder::take(std::size_t index, const Change& change) {
  Channel& channel = channels_[index];
  if (change.kind == Change::Kind::gap) {
    if (channel.gap) {  // two without a value between them
      channel.gap->left_out = channel.gap->left_out && change.left_out ? std::optional(*channel.gap->left_out + *change.left_out) : std::nullopt;
      if (!channel.gap->reason) channel.gap->reason = change.reason;
    } else {
      channel.gap = change;
    }
    return;
  }
  if (change.kind == Change::Kind::ended) {
    channel.has_ended = true;
    if (change.reason && !refusal_) refusal_ = change.reason;
    RecordedChange gap;
    gap.at = since_start(change.received);
    gap.gap = change.reason ? printable(change.reason->message) : "the robot has ended the subscription";
    gap.cause = GapCause::ended;
    gap.from = channel.last;
    write_gap(channel, std::move(gap));
    channel.gap.reset();
    return;
  }

  // A value, and the gap before it.
  if (options_.count && values_ >= *options_.count) return;
  RecordedChange value;
  value.at = since_start(change.received);
  value.name = channel.name;
  value.url = channel.property.url();
  value.robot = channel.robot;
  value.sequence = change.sequence;
  value.series = change.series;
  value.source_time = change.at;
  const bool has_restarted = channel.has_value && !channel.series.empty() && !change.series.empty() && channel.series != change.series;
  const std::uint64_t at_robot = change.left_out.value_or(0);
  if (channel.gap || has_restarted || change.dropped > 0 || (channel.has_value && at_robot > 0)) {
    RecordedChange gap;
    gap.at = value.at;
    gap.from = channel.last;
    gap.to = {change.sequence, change.at};
    std::optional<std::uint64_t> count = channel.gap ? channel.gap->left_out : std::optional<std::uint64_t>(0);
    if (has_restarted) count = std::nullopt;
    if (count) *count += at_robot + change.dropped;
    const bool is_numbered = !has_restarted && channel.series == change.series && !change.series.empty() && channel.last.sequence && change.sequence;
    if (!count && is_numbered && *change.sequence > *channel.last.sequence) count = *change.sequence - *channel.last.sequence - 1;
    gap.left_out = count;
    if (has_restarted) {
      gap.cause = GapCause::restart;
      gap.gap = "the robot was started again";
    } else if (channel.gap && (channel.gap->reason || !channel.gap->left_out)) {
      gap.cause = GapCause::connection;
      gap.gap = "the connection was lost";
      if (channel.gap->reason) gap.gap += ": " + printable(channel.gap->reason->message);
    } else if (change.dropped > 0) {
      gap.cause = GapCause::not_taken;
      gap.gap = "this program was too slow";
    } else {
      gap.cause = GapCause::left_out;
      gap.gap = "the robot did not send all values";
    }
    if (count) gap.gap += "; " + values_missing(*count);
    if (channel.gap || has_restarted || count.value_or(1) > 0) write_gap(channel, std::move(gap));
    channel.gap.reset();
  }
  channel.has_value = true;
  channel.last = {change.sequence, change.at};
  channel.series = change.series;

  const Result<rdf::Graph> graph = change.graph();
  const client::Property& property = channel.property;
  const Result<rdf::TermId> node =
      graph ? property.value_node(*graph, client::find_focus(*graph, property.url())) : Result<rdf::TermId>(unexpected(graph.error()));
  if (!node) {  // it is counted, as one that is missing
    RecordedChange gap;
    gap.at = value.at;
    gap.gap = "a value that cannot be read: " + printable(node.error().message);
    gap.left_out = 1;
    gap.from = gap.to = channel.last;
    write_gap(channel, std::move(gap));
    return;
  }
  PlainValue plain = value_at(*graph, *node, channel.schema ? &*channel.schema : nullptr);
  value.value = std::move(plain.json);
  value.unit = std::move(plain.unit);
  ++values_;
  write(value);
}

Result<void> Recorder::watch(std::size_t index) {
  Channel& channel = channels_[index];
  client::WatchOptions options;
  options.via = options_.via;
  options.queue_length = channel.queue;
  options.first_pause = milliseconds(100);
  options.max_pause = milliseconds(2'000);
  Result<client::Watch> watch = (*client_).watch(channel.property.url(), options, [this, index](const Change& change) {
    // A longer queue than the robot's is refused, and the robot is polled in the end: see check_protocols(). Nothing was recorded yet.
    Channel& watched = channels_[index];
    if (change.kind == Change::Kind::ended ? may_refuse_queue(watched) : has_refused_queue(watched)) watched.is_refused = true;
    if (!watched.is_refused) take(index, change);
  });
  if (!watch) return unexpected(std::move(watch).error());
  channel.watch = *std::move(watch);
  return {};
}

bool Recorder::may_refuse_queue(const Channel& channel) { return !channel.has_value && channel.queue > short_queue; }

bool Recorder::has_refused_queue(const Channel& channel) const {
  return options_.via == client::Via::any && channel.watch.via() == client::Via::polling && may_refuse_queue(channel);
}

/// A robot that refuses the queue is polled in the end, which misses values without a word: then a shorter queue is tried, and what remains is said.
void Recorder::check_protocols() {
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    Channel& channel = channels_[i];
    if (channel.has_ended) continue;
    const bool is_polled = channel.watch.via() == client::Via::polling;
    if (channel.is_refused || has_refused_queue(channel)) {
      channel.watch.stop();
      channel.is_refused = false;
      channel.queue = short_queue;
      if (Result<void> again = watch(i); !again) error_ = std::move(again).error();
      continue;
    }
    if (is_polled && !std::exchange(channel.is_polled, true)) {
      RecordedChange gap;
      gap.at = since_start(steady_clock::now());
      gap.gap = "the robot is polled: values between two requests are missing";
      gap.cause = GapCause::polled;
      gap.from = gap.to = channel.last;
      write_gap(channel, std::move(gap));
      session_.warn("\"" + channel.name + "\" is polled, because the robot offers no subscription: values between two requests are missing");
    }
    const bool connected = channel.watch.is_connected();
    if (channel.was_connected && !connected) session_.warn("\"" + channel.name + "\": the connection is lost; connecting again");
    channel.was_connected = connected;
  }
}

/// What is missing at the end.
void Recorder::end_gaps() {
  for (Channel& channel : channels_) {
    if (channel.has_ended || (!channel.gap && channel.watch.is_connected())) continue;
    RecordedChange gap;
    gap.at = since_start(steady_clock::now());
    const std::optional<Error> why = channel.gap ? channel.gap->reason : channel.watch.last_error();
    gap.gap = channel.has_value ? "the connection was lost, and not found again before the end" : "no value was received";
    if (why) gap.gap += ": " + printable(why->message);
    gap.cause = GapCause::connection;
    gap.from = channel.last;
    write_gap(channel, std::move(gap));
  }
}

Result<int> Recorder::run(recording::BagWriter& file, steady_clock::time_point start) {
  file_ = &file;
  start_ = start;
  for (const Channel& channel : channels_) {
    if (!channel.schema) continue;
    std::string alternatives = recording::schema_of_alternatives(channel.schema->type(), channel.schema->facets());
    if (!alternatives.empty()) file.describe(channel.property.url(), std::move(alternatives));
  }
  const Result<Client*> client = this->client();
  if (!client) return unexpected(client.error());
  Signals signals;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    channels_[i].queue = options_.queue;
    if (Result<void> watched = watch(i); !watched) return unexpected(std::move(watched).error());
  }
  std::optional<steady_clock::time_point> end;
  if (options_.seconds) end = start + milliseconds(static_cast<std::int64_t>(*options_.seconds * 1000));
  while (true) {
    (*client)->poll(milliseconds(20));
    if (!error_)
      if (Result<void> flushed = file_->flush_older(since_start(steady_clock::now())); !flushed) error_ = std::move(flushed).error();
    check_protocols();
    if (error_) return unexpected(*error_);
    if (options_.count && values_ >= *options_.count) return Exit::success;
    if (std::all_of(channels_.begin(), channels_.end(), [](const Channel& channel) { return channel.has_ended; })) {
      if (refusal_) return unexpected(*refusal_);
      return Exit::success;
    }
    const auto now = steady_clock::now();
    milliseconds pause{500};
    if (end) pause = std::min(pause, std::chrono::ceil<milliseconds>(*end - now));
    int status = -1;
    if (end && now >= *end) status = Exit::success;
    pollfd events[3] = {{(*client)->descriptor(), POLLIN, 0}, {signals.descriptor(), POLLIN, 0}, {options_.file == "-" ? STDOUT_FILENO : -1, 0, 0}};
    if (status < 0) ::poll(events, 3, static_cast<int>(pause.count()));
    while (const int signal = signals.take())
      if (ends_command(signal)) status = 128 + signal;
    if ((events[2].revents & POLLERR) != 0) return Exit::pipe_closed;
    if (status < 0) continue;
    (*client)->poll(milliseconds(500));  // what has arrived
    end_gaps();
    if (error_) return unexpected(*error_);
    return status;
  }
}

}  // namespace lrt::tool
