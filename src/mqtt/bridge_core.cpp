// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include <lrt/base/clock.hpp>
#include <lrt/base/ids.hpp>
#include <lrt/http/message.hpp>
#include <lrt/http/problem.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/back_off.hpp"
#include "src/engine/identity.hpp"
#include "src/http/robot_time.hpp"
#include "src/http/target.hpp"
#include "src/mqtt/bridge.hpp"
#include "src/mqtt/description.hpp"
#include "src/mqtt/message.hpp"

namespace lrt::mqtt {
inline namespace v0 {

namespace {

using std::chrono::milliseconds;

constexpr std::size_t max_own = 1'000;          ///< limit of the bridge's own waiting messages; above it the oldest are dropped
constexpr std::size_t max_cleared = 10'000;     ///< limit of the topics to be cleared; further ones keep their retained messages
constexpr milliseconds warning_time{10'000};    ///< see log_once()
constexpr milliseconds status_interval{1'000};  ///< between two messages of the status on one connection
constexpr milliseconds value_interval{100}, counter_interval{10'000};  ///< see Publication::minimum_interval
constexpr std::size_t usual_bytes = 256;                               ///< of a message with a small value, its topic and what it says of it
constexpr milliseconds good_connection{10'000};  ///< that has lasted so long is followed by the short pause, or max_pause if that is less

Kind kind_of(std::string_view kind) noexcept {
  if (kind == "property") return Kind::property;
  if (kind == "state") return Kind::state;
  if (kind == "invocation") return Kind::invocation;
  if (kind == "action") return Kind::action;
  if (kind == "thing") return Kind::thing;
  if (kind == "control") return Kind::control;
  return Kind::other;
}
Kind kind_of(const engine::ObservableResource& resource) noexcept { return resource.document ? Kind::document : kind_of(resource.kind); }

/// Whether a message of a resource may replace an older one that waits.
bool has_queue(const engine::ObservableResource& resource, const Publication& how) noexcept {
  return how.queue_length ? *how.queue_length > 0 : resource.wants_queue;
}

milliseconds interval_of(const engine::ObservableResource& resource, const Publication& how) noexcept {
  if (how.minimum_interval) return *how.minimum_interval;
  if (has_queue(resource, how)) return milliseconds(0);
  return resource.counter ? counter_interval : value_interval;
}

/// A request to the robot at `base`. It refers to the three texts.
http::Request request_to(std::string_view base, std::string_view method, std::string_view target) {
  http::Request request;
  request.method = method;
  request.target = target;
  if (const auto robot = http::split_target(base)) {
    request.secure = robot->secure;
    request.fields.push_back({"Host", robot->authority});
  }
  return request;
}

bool is_before(const engine::Meaning& a, const engine::Meaning& b) noexcept {
  return std::tie(a.unit, a.datatype, a.frame) < std::tie(b.unit, b.datatype, b.frame);
}

/// Whether a resource is of a kind that the bridge must not publish: it changes with each subscription of the bridge.
bool is_own(std::string_view kind) noexcept { return kind == "subscriptions" || kind == "subscription" || kind == "query"; }

bool is_header_value(std::string_view text) noexcept {
  return std::all_of(text.begin(), text.end(), [](char c) { return c >= 0x20 && c < 0x7F; });
}
bool is_token68(std::string_view text) noexcept {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string_view("-._~+/=").find(c) != std::string_view::npos;
  });
}

/// User properties that become header fields.
constexpr std::array<std::pair<std::string_view, std::string_view>, 7> fields = {{{"accept", "Accept"},
                                                                                  {"control-id", "Control-Id"},
                                                                                  {"take-over", "Take-Over"},
                                                                                  {"if-match", "If-Match"},
                                                                                  {"if-none-match", "If-None-Match"},
                                                                                  {"prefer", "Prefer"},
                                                                                  {"start-before", http::start_before_field}}};
constexpr std::string_view valid_until = "valid-until", robot_time = "robot-time";

std::string_view without_space(std::string_view text) noexcept {
  constexpr std::string_view space = " \t\r\n";
  text.remove_prefix(std::min(text.find_first_not_of(space), text.size()));
  return text.substr(0, text.find_last_not_of(space) + 1);
}

/// Takes a token and the white space around it off a JSON text.
bool take(std::string_view& text, std::string_view token) noexcept {
  std::string_view rest = without_space(text);
  if (rest.substr(0, token.size()) != token) return false;
  text = without_space(rest.substr(token.size()));
  return true;
}

/// Takes the member `validUntil` off a payload of a client that has no user properties: `{"validUntil":STAMP,"value":VALUE}` becomes VALUE, a record
/// loses it, and nothing is left of `{"validUntil":STAMP}`.
/// @return  nullopt: the payload does not begin with it, and stays as it is
std::optional<std::string> take_valid_until(std::string& payload) {
  std::string_view text = payload;
  if (!take(text, "{") || !take(text, "\"validUntil\"") || !take(text, ":") || !take(text, "\"")) return std::nullopt;
  const std::size_t end = text.find('"');
  if (end == std::string_view::npos || text.back() != '}') return std::nullopt;
  std::string stamp(text.substr(0, end));
  text.remove_prefix(end + 1);
  std::string rest;
  if (take(text, ",")) {
    std::string_view value = text;
    if (take(value, "\"value\"") && take(value, ":")) rest = value.substr(0, value.size() - 1);
    else rest = "{" + std::string(text);
  } else if (!take(text, "}") || !text.empty()) {
    return std::nullopt;
  }
  payload = std::move(rest);
  return stamp;
}

Result<void> check(const Options& options) {
  const auto invalid = [](const std::string& what) { return unexpected(Errc::invalid_option, what); };
  const Broker& broker = options.broker;
  if (broker.host.empty() || !is_header_value(broker.host)) return invalid("broker.host: expected a name or an address");
  if (broker.keep_alive < std::chrono::seconds(5) || broker.keep_alive > std::chrono::seconds(65'535))
    return invalid("broker.keep_alive: expected 5 s to 65535 s");
  if (broker.first_pause.count() <= 0 || broker.max_pause < broker.first_pause)
    return invalid("broker.first_pause: expected more than 0 and at most max_pause");
  if (broker.connect_time.count() <= 0) return invalid("broker.connect_time: expected more than 0");
  if (!is_text(broker.client_id) || !is_text(broker.user) || !is_text(broker.password))
    return invalid("broker: expected texts without control characters");
  for (const Publication& p : options.publications) {
    if (p.qos < 0 || p.qos > 2) return invalid("publications: expected qos 0 to 2, found " + std::to_string(p.qos));
    if (!is_header_value(p.media_type)) return invalid("publications: media_type: expected a media type");
    if (p.form == Form::with_meaning && !is_json(p.media_type))
      return invalid("publications: expected a media type of JSON for Form::with_meaning, found " + p.media_type);
    if (p.minimum_interval && p.minimum_interval->count() < 0) return invalid("publications: minimum_interval: expected 0 ms or more");
    if (p.expiry.count() < 0 || p.expiry.count() > UINT32_MAX) return invalid("publications: expected an expiry of 0 to 2^32-1 s");
  }
  for (const std::string& topic : options.commands.response_topics)
    if (topic.empty() || !is_text(topic)) return invalid("commands.response_topics: expected patterns of topics");
  if (options.commands.qos < 0 || options.commands.qos > 2) return invalid("commands.qos: expected 0 to 2");
  if (!options.commands.token.empty() && !is_token68(options.commands.token)) return invalid("commands.token: expected a token of RFC 6750");
  if (options.limits.max_unacknowledged == 0 || options.limits.max_unacknowledged > 60'000)
    return invalid("limits.max_unacknowledged: expected 1 to 60000");
  if (options.home_assistant && !is_topic(options.home_assistant->prefix))
    return invalid("home_assistant.prefix: expected levels of a topic such as \"homeassistant\"");
  if (options.limits.batch_messages == 0) return invalid("limits.batch_messages: expected at least 1");
  return {};
}

std::string url_of(const Broker& broker) {
  if (!broker.public_url.empty()) return broker.public_url;
  const std::string host = broker.host.find(':') == std::string::npos ? broker.host : "[" + broker.host + "]";
  return (broker.tls ? "mqtts://" : "mqtt://") + host + ":" + std::to_string(broker.port != 0 ? broker.port : broker.tls ? 8883 : 1883);
}

}  // namespace

std::vector<Publication> default_publications() {
  Publication values;
  values.kinds = {Kind::property, Kind::control};
  values.retain = true;
  Publication invocations;
  invocations.kinds = {Kind::invocation};
  invocations.qos = 1;
  return {values, invocations};
}

BridgeCore::BridgeCore(Feed feed, Topics topics, Options options, Identity identity)
    : feed_(std::move(feed)),
      topics_(std::move(topics)),
      options_(std::move(options)),
      identity_(std::move(identity)),
      broker_url_(url_of(options_.broker)),
      session_(RandomIds().next()),
      chance_(std::hash<std::string>()(session_) | 1),
      meanings_(is_before) {}

Result<std::unique_ptr<BridgeCore>> BridgeCore::create(Server& server, Options options, const MakeLink& make_link) {
  if (Result<void> checked = check(options); !checked) return Unexpected{std::move(checked).error()};
  Result<Feed> feed = Feed::create(server, options.owner);
  if (!feed) return Unexpected{std::move(feed).error()};
  Identity identity = feed->identity();
  if (identity.iri.empty()) return unexpected(Errc::invalid_option, without_identity());
  if (options.prefix.empty()) options.prefix = default_prefix(identity);
  Result<Topics> topics = Topics::create(options.prefix);
  if (!topics) return Unexpected{std::move(topics).error()};
  if (options.commands.enabled && !options.commands.allow_unprotected && !feed->is_protected())
    return unexpected(Errc::insecure_address,
                      "commands from a broker allow every client that may publish there to move the robot: set the server's Security, "
                      "or commands.allow_unprotected");
  std::unique_ptr<BridgeCore> core(new BridgeCore(*std::move(feed), *std::move(topics), std::move(options), std::move(identity)));
  LinkOptions link;
  link.broker = core->options_.broker;
  if (link.broker.client_id.empty()) link.broker.client_id = client_id_of(core->identity_);
  link.commands = core->options_.commands;
  link.will = core->status(false, true);
  link.probed_filter = core->topics_.probe();
  link.waker = core->feed_.waker();
  link.log = core->options_.log;
  link.thread = core->options_.thread;
  Result<std::unique_ptr<Link>> made = make_link(std::move(link));
  if (!made) return Unexpected{std::move(made).error()};
  core->link_ = *std::move(made);
  return core;
}

Counters BridgeCore::counters() const noexcept {
  Counters all;
  const AtomicCounters& c = counters_;
  all.online = c.online;
  all.connections = c.connections;
  all.failed_connections = c.failed_connections;
  all.published = c.published;
  all.published_bytes = c.published_bytes;
  all.acknowledged = c.acknowledged;
  all.refused = c.refused;
  all.not_bridged = c.not_bridged;
  all.commands = c.commands;
  all.dropped_commands = c.dropped_commands;
  all.taken_over = c.taken_over;
  all.resources = c.resources;
  all.unacknowledged = c.unacknowledged;
  all.left_out = c.left_out;
  all.lag = milliseconds(c.lag_ms);
  return all;
}

void BridgeCore::log(LogLevel level, const std::string& message) const noexcept {
  try {
    if (options_.log) options_.log(level, "mqtt: " + message);
  } catch (...) {}
}

/// Limits the log lines that remote clients can cause: not the same one twice in succession, and ten in ten seconds.
void BridgeCore::log_once(const std::string& message) {
  constexpr std::size_t max_warnings = 10;
  if (now_ - warnings_since_ >= warning_time) {
    if (warnings_ > max_warnings) log(LogLevel::warning, std::to_string(warnings_ - max_warnings) + " further messages were not logged");
    warnings_ = 0;
    warnings_since_ = now_;
    last_warning_.clear();
  }
  if (std::exchange(last_warning_, message) != message && ++warnings_ <= max_warnings) log(LogLevel::warning, message);
}

/// @param is_will  the broker publishes it when the connection is lost, which is known to nobody now
OutMessage BridgeCore::status(bool online, bool is_will) const {
  OutMessage message;
  message.topic = topics_.status();
  message.qos = 1;
  message.retain = true;
  message.is_utf8 = true;
  message.content_type = "application/json";
  const auto time = [](std::chrono::system_clock::time_point at) { return http::json_string(to_xsd_date_time(at)); };
  std::string text = online ? "{\"online\":true" : "{\"online\":false";
  if (online) text += ",\"since\":" + time(online_since_);
  else if (!is_will) text += ",\"since\":" + time(std::chrono::system_clock::now());
  if (!online) text += ",\"onlineSince\":" + time(online_since_);
  if (is_will) text += ",\"keepAlive\":" + std::to_string(options_.broker.keep_alive.count());
  if (online) {
    text += ",\"base\":" + http::json_string(feed_.base());
    if (options_.description.publish) text += ",\"description\":" + http::json_string(topics_.description());
    text += options_.commands.enabled ? ",\"commands\":true" : ",\"commands\":false";
  }
  if (!online) text += ",\"base\":" + http::json_string(feed_.base());  // who is back compares it with its own
  text += ",\"identity\":" + engine::json_of(identity_);
  text += ",\"session\":" + http::json_string(session_) + "}";
  message.payload = std::make_shared<const std::string>(std::move(text));
  return message;
}

// ----------------------------------------------------------------------------------------------------------------- a turn

milliseconds BridgeCore::advance(Instant now, std::chrono::microseconds budget) {
  constexpr milliseconds long_time{3'600'000};
  now_ = now;
  if (phase_ == Phase::stopped) return long_time;
  if (reconnects_.exchange(false)) {
    if (phase_ == Phase::online) {
      log(LogLevel::info, "connects again, with the credentials that it has now");
      link_->disconnect();
      last_reason_ = "reload";
      disconnected(last_reason_);
      failures_ = 0;
    }
    retry_at_ = now;
  }
  if (phase_ == Phase::waiting && now >= retry_at_) {
    online_since_ = std::chrono::system_clock::now();
    link_->set_will(status(false, true));
    phase_ = Phase::connecting;
    link_->connect();
  }
  if (phase_ != Phase::waiting) link_->step(*this);

  const auto end = std::chrono::steady_clock::now() + budget;
  const auto is_over = [&] { return std::chrono::steady_clock::now() >= end; };
  bool more = false;
  probe();  // the first one of a connection before all messages
  do {
    const Feed::Bounds bounds = next_bounds();
    Feed::Batch batch = feed_.take(bounds);
    if (messages_.empty()) taken_at_ = now_;
    count_lag(batch.waiting);
    if (std::exchange(structure_, batch.structure) != batch.structure) describe_again();
    for (engine::ObservableResource& resource : batch.resources) new_resources_.push_back(std::move(resource));
    for (const Feed::Response& response : batch.responses) answer(response.number, response.response);
    if (bounds.max_messages != 0 && newest_first_ && batch.messages.empty()) {
      newest_first_ = false;
      batch.more = true;
    }
    if (newest_first_) {  // once each: behind a slow link there is always a newer one
      newest_left_ -= std::min(newest_left_, batch.messages.size());
      newest_first_ = newest_left_ > 0;
      batch.more = batch.more || !newest_first_;  // the queues
    }
    for (engine::FeedMessage& message : batch.messages) {
      const auto is_of_channel = [&](const engine::FeedMessage& other) { return other.channel == message.channel; };
      // An end is not kept while there is no broker, unless messages precede it.
      if (message.end && std::none_of(messages_.begin(), messages_.end(), is_of_channel)) end_channel(static_cast<std::uint64_t>(message.channel));
      else messages_.push_back(std::move(message));
    }
    for (std::size_t i = 0; i < 32 && !new_resources_.empty(); ++i) {
      bridge(new_resources_.front());
      new_resources_.pop_front();
    }
    publish_waiting();
    probe();
    if (batch.closed) {
      log(LogLevel::info, "the server has stopped");
      stop();
      return long_time;
    }
    more = !new_resources_.empty() || batch.more || (!due_topics_.empty() && may_publish());
  } while (more && !is_over());

  milliseconds rest = long_time;
  if (is_description_due_ && !description_request_ && !newest_first_ && !description_on_way_) {
    if (now >= description_at_) request_description();
    else rest = std::min(rest, std::chrono::ceil<milliseconds>(description_at_ - now));
  }
  if (are_things_due_ && !structure_request_ && !newest_first_ && new_resources_.empty()) {
    if (now >= things_at_) request_structure("/ns/structure");
    else rest = std::min(rest, std::chrono::ceil<milliseconds>(things_at_ - now));
  }
  if (is_status_due_ && phase_ == Phase::online && now < status_at_) rest = std::min(rest, std::chrono::ceil<milliseconds>(status_at_ - now));
  if (more) return milliseconds(0);
  if (sends_time() && phase_ == Phase::online && may_publish())
    rest = std::min(rest, std::chrono::ceil<milliseconds>(std::max(time_at_ - now, Instant::duration(0))));
  if (phase_ == Phase::waiting) rest = std::min(rest, std::chrono::ceil<milliseconds>(std::max(retry_at_ - now, Instant::duration(0))));
  else rest = std::min(rest, link_->step_interval());
  return rest;
}

/// Sends what the network takes: the status, what has to be repeated, the bridge's own messages, and values.
void BridgeCore::publish_waiting() {
  if (is_status_due_ && now_ >= status_at_ && may_publish() && publish(status(true), Sending::once)) {
    is_status_due_ = false;
    status_at_ = now_ + status_interval;
  }
  if (sends_time() && now_ >= time_at_ && may_publish()) {
    OutMessage time;
    time.topic = topics_.time();
    time.content_type = "text/plain";
    time.is_utf8 = true;
    time.payload = std::make_shared<const std::string>(feed_.robot_time());
    if (publish(time, Sending::once)) time_at_ = now_ + options_.commands.time_interval;
  }
  while (!repeats_.empty() && may_publish()) {
    const OutMessage message = std::move(repeats_.front());
    repeats_.pop_front();
    if (!publish(message, Sending::again)) return repeats_.push_front(message);
  }
  if (!repeats_.empty()) return;  // they are older than all others
  while (!cleared_topics_.empty() && may_publish()) {
    OutMessage empty;
    empty.topic = *cleared_topics_.begin();
    empty.qos = 1;
    empty.retain = true;
    if (!publish(empty)) return;
    cleared_topics_.erase(cleared_topics_.begin());
  }
  while (!own_.empty() && may_publish()) {
    const bool is_description = own_.front().topic == topics_.description();  // on the next connection it is made anew, after the values
    if (!publish(own_.front(), is_description ? Sending::once : Sending::first)) return;
    if (is_description) follow_description();
    own_.pop_front();
  }
  if (!publish_described()) return;
  while (!messages_.empty() && has_quota()) {  // the window had room for them
    engine::FeedMessage message = std::move(messages_.front());
    messages_.pop_front();
    if (!send(std::move(message))) return;
  }
}

/// Whether the socket and the broker take a further message. The latter has a limit of its own, beyond which libmosquitto would keep messages.
bool BridgeCore::has_quota() const {
  return phase_ == Phase::online && unacknowledged_.size() < max_unacknowledged_ &&
         unacknowledged_bytes_ < options_.limits.max_unacknowledged_bytes && !link_->is_congested();
}

bool BridgeCore::may_publish() const { return has_quota() && window_.is_open(); }

/// What is taken from the server is sent at once: as much as the window has room for.
Feed::Bounds BridgeCore::next_bounds() const {
  Feed::Bounds bounds;
  bounds.max_bytes = std::min(options_.limits.batch_bytes, window_.room());
  const bool may_take = may_publish() && messages_.empty() && repeats_.empty();
  bounds.max_messages =
      !may_take ? 0 : std::min({options_.limits.batch_messages, 1 + window_.room() / usual_bytes, max_unacknowledged_ - unacknowledged_.size()});
  bounds.queued = !newest_first_;
  return bounds;
}

/// Asks the broker what has arrived, if that is to be known.
void BridgeCore::probe() {
  if (phase_ != Phase::online) return;
  // If it did not answer pings either, libmosquitto would have ended the connection.
  if (const auto oldest = window_.oldest(); oldest && now_ - *oldest > 3 * options_.broker.keep_alive) {
    log_once("the broker does not answer an UNSUBSCRIBE, so the bridge cannot know what has arrived: behind a slow link values can be old");
    give_up_window();
  }
  if (!window_.wants_probe()) return;
  const Result<int> id = link_->probe();
  if (id) return window_.probed(*id, now_);
  if (id.error().code == Errc::closed) return;
  log_once("the broker cannot be asked what has arrived: " + id.error().message);
  give_up_window();
}

/// The description was just sent.
void BridgeCore::follow_description() {
  if (window_.is_off()) return;
  description_on_way_ = OnWay{now_, window_.sent_bytes()};
  window_.want_probe();
}

void BridgeCore::give_up_window() {
  window_.give_up();
  description_on_way_.reset();
}

/// @param waiting  how long the longest waiting subscription has waited in the server
void BridgeCore::count_lag(milliseconds waiting) {
  Instant::duration lag = waiting;
  if (!messages_.empty()) lag = std::max(lag, now_ - taken_at_);
  if (const auto oldest = window_.oldest(); oldest && phase_ == Phase::online) lag = std::max(lag, now_ - *oldest);
  counters_.lag_ms = std::chrono::ceil<milliseconds>(lag).count();
}

void BridgeCore::reconnect() noexcept {
  reconnects_ = true;
  feed_.waker()->wake();
}

void BridgeCore::stop() noexcept {
  const bool was_online = phase_ == Phase::online;
  if (std::exchange(phase_, Phase::stopped) == Phase::stopped) return;
  counters_.online = false;
  // A robot that takes its leave says since when. With QoS 0, because the message is not kept by libmosquitto then.
  bool has_said = false;
  try {
    OutMessage last = status(false);
    last.qos = 0;
    has_said = was_online && !link_->is_congested() && link_->publish(last).has_value();
  } catch (...) {}  // no memory: the Last Will
  link_->disconnect(!has_said);
}

// --------------------------------------------------------------------------------------------------------------- the link

void BridgeCore::connected(const Agreement& agreement) {
  phase_ = Phase::online;
  connected_at_ = now_;
  last_reason_.clear();
  max_aliases_ = std::min(agreement.max_aliases, options_.limits.max_topic_aliases);
  max_unacknowledged_ = std::min<std::size_t>(options_.limits.max_unacknowledged, std::max<std::uint16_t>(agreement.receive_maximum, 1));
  window_.begin();
  used_aliases_ = 0;
  for (auto& [channel, published] : published_) published.alias = 0;
  ++counters_.connections;
  counters_.online = true;
  log(LogLevel::info, "connected to " + broker_url_);
  if (const std::string warning = certificate_warning(options_.broker, identity_, options_.prefix, std::chrono::system_clock::now());
      !warning.empty())
    log_once(warning);
  if (options_.commands.enabled)
    for (const Topics::Command command : {Topics::Command::put, Topics::Command::post, Topics::Command::remove})
      if (const Result<void> subscribed = link_->subscribe(topics_.filter(command), options_.commands.qos); !subscribed)
        subscription_refused(topics_.filter(command), subscribed.error().message);
  if (const Result<void> subscribed = link_->subscribe(topics_.status(), 1, true); !subscribed)
    subscription_refused(topics_.status(), subscribed.error().message);
  is_status_due_ = true;
  status_at_ = time_at_ = now_;
  describe_again();
  description_ = nullptr;
  own_.erase(std::remove_if(own_.begin(), own_.end(), [this](const OutMessage& m) { return m.topic == topics_.description(); }), own_.end());
  description_at_ = things_at_ = now_;
  for (auto& [topic, described] : described_) {
    described.text = nullptr;
    described.is_due = false;
  }
  due_topics_.clear();
  newest_first_ = true;
  newest_left_ = published_.size();
  description_on_way_.reset();
  feed_.repeat_all();
}

void BridgeCore::disconnected(const std::string& reason) {
  const bool was_online = phase_ == Phase::online;
  phase_ = Phase::waiting;
  counters_.online = false;
  if (!was_online) ++counters_.failed_connections;
  if (last_reason_ != reason) {
    last_reason_ = reason;
    const std::string more = was_online ? std::string() : why_not_connected(options_.broker, reason, std::chrono::system_clock::now());
    log(LogLevel::warning, broker_url_ + ": " + reason + more);
  }
  // The unsent messages are newest values, which repeat_all() sends again, and queued ones, which are kept.
  for (const engine::FeedMessage& message : messages_)
    if (!message.queued && !message.end) keep_left_out(message);
  messages_.erase(std::remove_if(messages_.begin(), messages_.end(), [](const engine::FeedMessage& m) { return !m.queued && !m.end; }),
                  messages_.end());
  std::vector<Unacknowledged> lost;
  for (auto& [id, sent] : unacknowledged_)
    if (sent.repeats) lost.push_back(std::move(sent));
  std::sort(lost.begin(), lost.end(), [](const Unacknowledged& a, const Unacknowledged& b) { return a.number > b.number; });
  for (Unacknowledged& sent : lost) repeats_.push_front(std::move(sent.message));
  unacknowledged_.clear();
  unacknowledged_bytes_ = 0;
  counters_.unacknowledged = repeats_.size();
  if (was_online && now_ - connected_at_ >= std::min(options_.broker.max_pause, good_connection)) failures_ = 0;
  if (std::exchange(is_contested_, false)) failures_ = 30;  // robots that end each other's connections do so seldom
  chance_ = chance_ * 6364136223846793005U + 1442695040888963407U;
  const double chance = static_cast<double>(chance_ >> 11) / 9007199254740992.0;
  retry_at_ = now_ + back_off(++failures_, options_.broker.first_pause, options_.broker.max_pause, chance);
}

void BridgeCore::confirmed(int id) {
  window_.confirmed(id, now_);
  // The whole description is the largest message. Values wait for it, so it gets a tenth of the time of a slow link at most.
  if (!description_on_way_ || window_.confirmed_bytes() < description_on_way_->bytes) return;
  description_at_ = std::max(description_at_, now_ + 9 * (now_ - description_on_way_->since));
  description_on_way_.reset();
}

void BridgeCore::acknowledged(int id, bool refused, const std::string& reason) {
  const auto found = unacknowledged_.find(id);
  if (found == unacknowledged_.end()) return;
  unacknowledged_bytes_ -= found->second.bytes();
  unacknowledged_.erase(found);
  counters_.unacknowledged = unacknowledged_.size() + repeats_.size();
  if (!refused) {
    ++counters_.acknowledged;
    return;
  }
  ++counters_.refused;
  log_once("the broker refused a message: " + reason);
}

void BridgeCore::subscription_refused(const std::string& filter, const std::string& reason) {
  if (filter == topics_.status())
    return log_once("the broker does not let the robot subscribe to its own status, which an older connection may overwrite: " + reason);
  log(LogLevel::error, "no commands: the broker refused the subscription to " + filter + ": " + reason);
}

// ------------------------------------------------------------------------------------------------------------ publications

const Publication* BridgeCore::publication_of(const engine::ObservableResource& resource) const {
  const Kind kind = kind_of(resource);
  for (const Publication& p : options_.publications) {
    if (!p.kinds.empty() && std::find(p.kinds.begin(), p.kinds.end(), kind) == p.kinds.end()) continue;
    if (p.kinds.empty() && is_own(resource.kind)) continue;
    if (fits(p.paths, resource.path)) return p.publish ? &p : nullptr;
  }
  return nullptr;
}

std::vector<Statement> BridgeCore::statements_of(const engine::ObservableResource& resource, const std::string& topic) const {
  std::vector<Statement> all;
  all.push_back({std::string(vocab::lrt_::mqttBroker.text), Object::typed(broker_url_, vocab::xsd::anyURI)});
  all.push_back({std::string(vocab::lrt_::mqttTopic.text), Object(topic)});
  if (options_.commands.enabled && kind_of(resource.kind) == Kind::property)
    all.push_back({std::string(vocab::lrt_::mqttCommandTopic.text), Object(topics_.of(Topics::Command::put, resource.path))});
  if (options_.commands.enabled && (kind_of(resource.kind) == Kind::action || kind_of(resource.kind) == Kind::control))
    all.push_back({std::string(vocab::lrt_::mqttCommandTopic.text), Object(topics_.of(Topics::Command::post, resource.path))});
  return all;
}

void BridgeCore::bridge(const engine::ObservableResource& resource) {
  if (const auto known = channel_of_.find(resource.id); known != channel_of_.end()) {
    const auto at = published_.find(known->second);
    if (at->second.topic == topics_.of(resource.path)) return;
    const std::uint64_t channel = known->second;
    if (at->second.how->retain) clear_topic(at->second.topic);
    unbridge(channel);  // it has another path now
    feed_.remove(Feed::Channel{channel});
  }
  const Publication* const how = publication_of(resource);
  if (!how) return;
  std::string topic = topics_.of(resource.path);
  const auto refuse = [&](const std::string& why) {
    ++counters_.not_bridged;
    log_once(resource.path + " is not published: " + why);
  };
  if (!is_topic(topic)) return refuse("its path is not valid as a topic");
  engine::FeedSubscription wanted;
  wanted.path = resource.path;
  wanted.media_type = how->media_type;
  wanted.queue_length = how->queue_length;
  wanted.minimum_interval = interval_of(resource, *how);
  wanted.protocol = "mqtt";
  wanted.statements = statements_of(resource, topic);
  wanted.repeats = how->retain;
  Result<engine::Subscribed> made = feed_.subscribe(std::move(wanted));
  if (!made) {
    if (made.error().code != Errc::unknown_path) refuse(made.error().message);  // it was removed in the meantime
    return;
  }
  const auto number = static_cast<std::uint64_t>(made->channel);
  const bool is_invocation = kind_of(resource.kind) == Kind::invocation;
  const bool is_value = resource.kind == "property" || resource.kind == "state";
  published_.emplace(number, Published{resource.id, std::move(topic), 0, how, is_invocation, is_value, interval_of(resource, *how),
                                       kept(std::move(made->meaning)), 0, 0, 0});
  if (!is_invocation) describe_again();  // with its topic
  channel_of_[resource.id] = number;
  counters_.resources = published_.size();
}

/// A robot has few of them and many Properties. Frames can be those of Things that come and go.
const engine::Meaning* BridgeCore::kept(engine::Meaning meaning) {
  const auto found = meanings_.try_emplace(std::move(meaning), 0).first;
  ++found->second;
  return &found->first;
}

/// @param meaning  of kept(); it may no longer exist afterwards
void BridgeCore::release(const engine::Meaning& meaning) {
  const auto found = meanings_.find(meaning);
  if (found != meanings_.end() && --found->second == 0) meanings_.erase(found);
}

/// A value was taken from the server and is not sent. What the message after it left out has to count it.
void BridgeCore::keep_left_out(const engine::FeedMessage& message) {
  const auto found = published_.find(static_cast<std::uint64_t>(message.channel));
  if (found == published_.end()) return;
  Published& published = found->second;
  if (!published.is_value) return;
  published.left_out += message.left_out + (published.unsent != 0 && published.unsent != message.number ? 1 : 0);
  published.unsent = message.number;
}

/// The numbers of other resources also count what is no message, such as that a resource says where it is published.
std::uint64_t BridgeCore::left_out_before(const engine::FeedMessage& message, const Published& published) noexcept {
  return published.is_value ? message.left_out : message.queued ? message.missed : 0;
}

/// The resource, or the right to read it, no longer exists.
void BridgeCore::end_channel(std::uint64_t channel) {
  const auto found = published_.find(channel);
  if (found == published_.end()) return;
  if (found->second.how->retain) clear_topic(found->second.topic);
  if (!found->second.is_invocation) describe_again();  // they may show what the owner may no longer read
  unbridge(channel);
}

/// The broker has to delete the retained message of a topic.
void BridgeCore::clear_topic(std::string topic) {
  if (cleared_topics_.size() < max_cleared) cleared_topics_.insert(std::move(topic));
  else log_once("the retained messages of some topics are left at the broker: more than " + std::to_string(max_cleared) + " are to be deleted");
}

void BridgeCore::unbridge(std::uint64_t channel) {
  const auto found = published_.find(channel);
  if (found == published_.end()) return;
  channel_of_.erase(found->second.resource);
  release(*found->second.meaning);
  published_.erase(found);
  counters_.resources = published_.size();
}

/// False: the connection has just ended.
bool BridgeCore::send(engine::FeedMessage message) {
  const auto channel = static_cast<std::uint64_t>(message.channel);
  const auto found = published_.find(channel);
  if (found == published_.end()) return true;  // it was removed meanwhile
  if (message.end) {
    end_channel(channel);
    return true;
  }
  Published& published = found->second;
  OutMessage out;
  out.qos = published.how->qos;
  out.retain = published.how->retain;
  out.expiry = published.how->expiry;
  published.sequence += 1 + (message.queued ? message.missed : 0);
  say(out, message.body, *published.how, {published.sequence, message.at, *published.meaning});
  // Aliases belong to a connection, and libmosquitto repeats messages with QoS 1 on the next.
  if (out.qos == 0 && published.alias != 0) {
    out.alias = published.alias;
  } else {
    out.topic = published.topic;
    if (out.qos == 0 && used_aliases_ < max_aliases_) out.alias = published.alias = ++used_aliases_;
  }
  const std::uint64_t refused = counters_.refused;
  if (publish(out)) {
    if (counters_.refused != refused && !out.topic.empty()) published.alias = 0;  // an alias that the broker does not know
    counters_.left_out += left_out_before(message, published) + std::exchange(published.left_out, 0);
    if (const std::uint64_t unsent = std::exchange(published.unsent, 0); unsent != 0 && unsent != message.number) ++counters_.left_out;
    return true;
  }
  published.sequence -= 1 + (message.queued ? message.missed : 0);
  if (!message.queued) {  // the newest value is sent again later
    keep_left_out(message);
    return false;
  }
  messages_.push_front(std::move(message));
  return false;
}

/// False: there is no connection, and the message is to be sent later.
bool BridgeCore::publish(const OutMessage& message, Sending how) {
  const std::size_t bytes = message.payload ? message.payload->size() : 0;
  const Result<int> id = link_->publish(message);
  if (id) window_.sent(wire_bytes(message));
  if (!id) {
    if (id.error().code == Errc::closed) return false;
    ++counters_.refused;
    log_once("a message of " + std::to_string(bytes) + " bytes cannot be published: " + id.error().message);
    return true;
  }
  if (how != Sending::again) {
    ++counters_.published;
    counters_.published_bytes += bytes;
  }
  if (*id != 0) {
    unacknowledged_.insert_or_assign(*id, Unacknowledged{message, ++last_number_, how != Sending::once});
    unacknowledged_bytes_ += bytes;
    counters_.unacknowledged = unacknowledged_.size() + repeats_.size();
  }
  return true;
}

void BridgeCore::publish_own(OutMessage message) {
  if (own_.size() >= max_own) own_.pop_front();
  own_.push_back(std::move(message));
}

/// The descriptions of the robot are no longer what they were.
void BridgeCore::describe_again() {
  is_description_due_ = options_.description.publish;
  are_things_due_ = options_.description.things || options_.home_assistant;
}

void BridgeCore::request_structure(const std::string& target) {
  if (phase_ != Phase::online) return;
  are_things_due_ = false;
  things_at_ = now_ + options_.description.minimum_interval;
  const std::string base = feed_.base();
  http::Request request = request_to(base, "GET", target);
  request.fields.push_back({"Accept", "application/json"});
  structure_request_ = feed_.send(request, Feed::As::owner);
}

/// A page of the structure document.
void BridgeCore::describe_things(const http::Response& response) {
  if (response.status == 401 || response.status == 403 || response.status == 404) clear_described(true);
  if (response.status != 200 || !response.body)
    return log_once("Things have no descriptions: the server responds with " + std::to_string(response.status));
  std::unordered_map<std::string, const Published*> by_topic;
  for (const auto& [channel, published] : published_) by_topic.emplace(published.topic, &published);
  RobotFacts robot{feed_.base(), topics_,  options_.commands.enabled, options_.description.publish, options_.home_assistant.has_value(),
                   {},           identity_};
  robot.published = [&](const std::string& topic) -> std::optional<PublishedAs> {
    const auto found = by_topic.find(topic);
    if (found == by_topic.end()) return std::nullopt;
    return PublishedAs{found->second->how, found->second->minimum_interval, found->second->meaning->frame};
  };
  Result<DescribedPage> page = mqtt::describe_things(*response.body, robot);
  if (!page) return log_once("Things have no descriptions: " + page.error().message);
  for (DescribedThing& thing : page->things) {
    if (options_.description.things) set_described(topics_.thing(thing.path), std::move(thing.json));
    if (!thing.discovery.empty())
      set_described(options_.home_assistant->prefix + "/device/" + id_of(topics_.of(thing.path)) + "/config", std::move(thing.discovery));
  }
  if (!page->next.empty()) request_structure(page->next);
  else clear_described(false);
}

void BridgeCore::set_described(std::string topic, std::string text) {
  if (!is_topic(topic)) return;
  Described& described = described_[topic];
  described.is_there = true;
  if (described.text && *described.text == text) return;
  described.text = std::make_shared<const std::string>(std::move(text));
  if (!std::exchange(described.is_due, true)) due_topics_.push_back(std::move(topic));
}

/// Deletes the descriptions of Things that are gone, and begins to look for them anew.
/// @param all  of all Things
void BridgeCore::clear_described(bool all) {
  for (auto at = described_.begin(); at != described_.end();) {
    if (!all && std::exchange(at->second.is_there, false)) {
      ++at;
      continue;
    }
    clear_topic(at->first);
    at = described_.erase(at);
  }
}

/// One at a time, so that values come between many of them.
/// @return  false: the connection has just ended
bool BridgeCore::publish_described() {
  if (due_topics_.empty() || !may_publish()) return true;
  const std::string topic = std::move(due_topics_.front());
  due_topics_.pop_front();
  const auto found = described_.find(topic);
  if (found == described_.end() || !std::exchange(found->second.is_due, false)) return true;
  OutMessage out;
  out.topic = topic;
  out.qos = 1;
  out.retain = out.is_utf8 = true;
  out.content_type = "application/json";
  out.payload = found->second.text;
  return publish(out, Sending::once);  // on the next connection they are made anew
}

void BridgeCore::request_description() {
  if (phase_ != Phase::online) return;
  is_description_due_ = false;
  description_at_ = now_ + options_.description.minimum_interval;
  const std::string base = feed_.base();
  http::Request request = request_to(base, "GET", "/all");
  request.fields.push_back({"Accept", options_.description.media_type});
  description_request_ = feed_.send(request, Feed::As::owner);
}

// --------------------------------------------------------------------------------------------------------------- commands

void BridgeCore::received(InMessage message) {
  if (message.topic == topics_.status()) see_status(message);
  else carry_out(std::move(message));
}

/// Another client has published to the status. If it is the Last Will of an older connection of this robot, the status is published again. That of a
/// robot which is connected is not contradicted, because two robots would do so without end.
void BridgeCore::see_status(const InMessage& message) {
  const StatusText seen = read_status(message.payload);
  if (message.retained) return see_kept_status(seen);
  if (!seen.online) is_status_due_ = true;
  else if (seen.session != session_) see_another(another_robot(identity_, options_.prefix, seen));
}

/// The broker sends what it has kept when the robot subscribes. Has another client published since this bridge has done so, it has been connected as this
/// robot. (A broker that was restored from an older copy has what was kept then: the connection that this bridge has found first. The robot of that
/// connection may be the other one, which is back on another connection.)
void BridgeCore::see_kept_status(const StatusText& kept) {
  if (kept.session.empty() || kept.session == session_) return;
  if (counters_.connections > 1) {
    if (kept.session != first_status_.session || kept.since != first_status_.since) see_another(another_robot(identity_, options_.prefix, kept));
    return;
  }
  first_status_ = kept;
  if (const std::string changed = earlier_status(identity_, options_.prefix, feed_.base(), kept); !changed.empty()) log_once(changed);
}

void BridgeCore::see_another(const std::string& what) {
  is_contested_ = true;
  ++counters_.taken_over;
  log_once(what);
}

void BridgeCore::taken_over() {
  see_another(mqtt::taken_over(identity_, options_.broker.client_id.empty() ? client_id_of(identity_) : options_.broker.client_id));
}

void BridgeCore::drop_command(const std::string& why) {
  ++counters_.dropped_commands;
  log_once("a command was dropped: " + why);
}

/// Until when a command is valid: what it says, and what is left of its message expiry, whichever is earlier; empty: for ever.
std::string BridgeCore::valid_until_of(InMessage& message) const {
  std::string said;
  for (const auto& [name, value] : message.user)
    if (name == valid_until) said += (said.empty() ? "" : ", ") + value;  // two of them: the server says what is wrong with that
  const std::string& type = message.content_type.empty() ? options_.commands.default_content_type : message.content_type;
  if (said.empty() && type.find("json") != std::string::npos) said = take_valid_until(message.payload).value_or("");
  if (!message.expiry) return said;
  std::optional<http::RobotTime> end = http::RobotTime::parse(feed_.robot_time());
  if (!end) return said;
  end->milliseconds += static_cast<std::uint64_t>(std::chrono::milliseconds(*message.expiry).count());
  if (said.empty()) return end->text();
  const auto stated = http::RobotTime::parse(said);
  return stated && stated->instance == end->instance && end->milliseconds < stated->milliseconds ? end->text() : said;
}

void BridgeCore::carry_out(InMessage message) {
  const Commands& bounds = options_.commands;
  if (!bounds.enabled) return drop_command("commands are not enabled");
  if (message.retained) return drop_command("it was retained, so its age is unknown");
  if (message.topic.size() > bounds.max_topic_bytes) return drop_command("its topic is too long");
  const auto demand = topics_.demand(message.topic);
  if (!demand) return drop_command("its topic is not a command topic");
  for (const auto& [name, value] : message.user)
    if (name == "response-of") return drop_command("it is the response of a robot");
  if (message.correlation.size() > bounds.max_correlation_bytes) return drop_command("its correlation data is too long");
  Waiting waiting{std::move(message.response_topic), std::move(message.correlation), bounds.qos};
  if (const std::string& topic = waiting.response_topic; !topic.empty()) {
    const auto fits_topic = [&](const std::string& pattern) { return fits(pattern, topic); };
    if (topic.size() > bounds.max_topic_bytes || !topics_.may_respond_to(topic) ||
        std::none_of(bounds.response_topics.begin(), bounds.response_topics.end(), fits_topic))
      return drop_command("no response may be sent to its response topic (commands.response_topics)");
  }

  const auto refuse = [&](int status, std::string detail) {
    OutMessage out;
    out.content_type = "application/problem+json";
    out.payload = std::make_shared<const std::string>(http::to_json({status, std::move(detail)}));
    respond(waiting, status, std::move(out));
  };
  if (const auto why = refused_command(message)) return refuse(400, *why);
  if (message.has_payload_limit) return refuse(413, "the payload has more than " + std::to_string(bounds.max_payload_bytes) + " bytes");
  if (waiting_.size() >= bounds.max_waiting) return refuse(503, "too many commands wait for their response");
  const std::string until = valid_until_of(message);

  const std::string base = feed_.base();
  const auto method = demand->command == Topics::Command::put ? "PUT" : demand->command == Topics::Command::post ? "POST" : "DELETE";
  http::Request request = request_to(base, method, demand->path);
  request.body = message.payload;
  request.peer = "mqtt";  // the limits for clients without a principal, and the audit
  std::string token = bounds.token.empty() ? std::string() : "Bearer " + bounds.token;
  bool accepts = false;
  for (const auto& [name, value] : message.user) {
    if (name == "token") token = "Bearer " + value;
    for (const auto& [property, field] : fields)
      if (name == property) request.fields.push_back({field, value});
    accepts = accepts || name == "accept";
  }
  if (!accepts) request.fields.push_back({"Accept", "application/problem+json, application/json;q=0.9, text/turtle;q=0.5, */*;q=0.1"});
  if (!until.empty()) request.fields.push_back({http::valid_until_field, until});
  if (!token.empty()) request.fields.push_back({"Authorization", token});
  const std::string& type = message.content_type.empty() ? bounds.default_content_type : message.content_type;
  if (!message.payload.empty()) request.fields.push_back({"Content-Type", type});
  ++counters_.commands;
  const std::uint64_t number = feed_.send(request);
  waiting_.emplace(number, std::move(waiting));
}

/// Why a message is not well-formed.
std::optional<std::string> BridgeCore::refused_command(const InMessage& message) const {
  if (message.has_property_limit) return "there are more properties than allowed, or longer ones";
  if (!is_header_value(message.content_type)) return "the content type is not a media type";
  std::size_t tokens = 0;
  for (const auto& [name, value] : message.user) {
    if (name == "token") {
      if (++tokens > 1) return "there is more than one token";
      if (!is_token68(value)) return "the token is not one of RFC 6750";
    }
    const std::string_view key = name;
    const bool is_field = key == valid_until || std::any_of(fields.begin(), fields.end(), [&](const auto& field) { return field.first == key; });
    if (is_field && !is_header_value(value)) return "the user property " + name + " has characters that a header field must not contain";
  }
  return std::nullopt;
}

void BridgeCore::respond(const Waiting& to, int status, OutMessage message) {
  if (to.response_topic.empty()) return;
  message.topic = to.response_topic;
  message.correlation = to.correlation;
  message.qos = to.qos;
  message.expiry = options_.commands.response_expiry;
  message.is_utf8 = is_utf8(message.content_type);
  message.user.emplace_back("status", std::to_string(status));
  message.user.emplace_back("response-of", options_.prefix);
  message.user.emplace_back(robot_time, feed_.robot_time());
  publish_own(std::move(message));
}

void BridgeCore::answer(std::uint64_t number, const http::Response& response) {
  if (structure_request_ == number) {
    structure_request_.reset();
    return describe_things(response);
  }
  if (description_request_ == number) {
    description_request_.reset();
    if (response.status == 401 || response.status == 403 || response.status == 404) {
      // What the broker has kept must no longer be read.
      description_ = nullptr;
      own_.erase(std::remove_if(own_.begin(), own_.end(), [&](const OutMessage& m) { return m.topic == topics_.description(); }), own_.end());
      clear_topic(topics_.description());
    }
    if (response.status != 200 || !response.body)
      return log_once("there is no description: the server responds with " + std::to_string(response.status));
    if (description_ && *description_ == *response.body) return;
    description_ = response.body;
    OutMessage out;
    out.topic = topics_.description();
    out.qos = 1;
    out.retain = true;
    out.content_type = std::string(response.fields.find("Content-Type").value_or(options_.description.media_type));
    out.is_utf8 = is_utf8(out.content_type);
    out.payload = response.body;
    return publish_own(std::move(out));
  }
  const auto found = waiting_.find(number);
  if (found == waiting_.end()) return;
  OutMessage out;
  out.payload = response.body;
  out.content_type = std::string(response.fields.find("Content-Type").value_or(std::string_view()));
  for (const auto& [field, property] : {std::pair("Location", "location"), std::pair("ETag", "etag"), std::pair("Retry-After", "retry-after"),
                                        std::pair("WWW-Authenticate", "www-authenticate"), std::pair("Control-Id", "control-id")})
    if (const auto value = response.fields.find(field); value && is_text(*value)) out.user.emplace_back(property, std::string(*value));
  respond(found->second, response.status, std::move(out));
  waiting_.erase(found);
}

}  // namespace v0
}  // namespace lrt::mqtt
