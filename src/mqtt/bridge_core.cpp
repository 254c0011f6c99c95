// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/clock.hpp>
#include <lrt/base/ids.hpp>
#include <lrt/http/message.hpp>
#include <lrt/http/problem.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/back_off.hpp"
#include "src/base/charset.hpp"
#include "src/engine/identity.hpp"
#include "src/http/robot_time.hpp"
#include "src/http/target.hpp"
#include "src/mqtt/bridge.hpp"

namespace lrt::mqtt {
inline namespace v0 {

namespace {

using std::chrono::milliseconds;

constexpr std::size_t max_own = 1'000;           ///< limit of the bridge's own waiting messages; above it the oldest are dropped
constexpr std::size_t max_cleared = 10'000;      ///< limit of the topics to be cleared; further ones keep their retained messages
constexpr milliseconds warning_time{10'000};     ///< see log_once()
constexpr milliseconds status_interval{1'000};   ///< between two messages of the status on one connection
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
    if (p.expiry.count() < 0 || p.expiry.count() > UINT32_MAX) return invalid("publications: expected an expiry of 0 to 2^32-1 s");
  }
  for (const std::string& topic : options.commands.response_topics)
    if (topic.empty() || !is_text(topic)) return invalid("commands.response_topics: expected patterns of topics");
  if (options.commands.qos < 0 || options.commands.qos > 2) return invalid("commands.qos: expected 0 to 2");
  if (!options.commands.token.empty() && !is_token68(options.commands.token)) return invalid("commands.token: expected a token of RFC 6750");
  if (options.limits.max_unacknowledged == 0 || options.limits.max_unacknowledged > 60'000)
    return invalid("limits.max_unacknowledged: expected 1 to 60000");
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
  values.kinds = {Kind::property, Kind::state, Kind::control};
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
      chance_(std::hash<std::string>()(session_) | 1) {}

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
  link.will = core->status(false);
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

OutMessage BridgeCore::status(bool online) const {
  OutMessage message;
  message.topic = topics_.status();
  message.qos = 1;
  message.retain = true;
  message.content_type = "application/json";
  std::string text = online ? "{\"online\":true" : "{\"online\":false";
  if (online) {
    text += ",\"base\":" + http::json_string(feed_.base()) + ",\"since\":" + http::json_string(to_xsd_date_time(std::chrono::system_clock::now()));
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
    phase_ = Phase::connecting;
    link_->connect();
  }
  if (phase_ != Phase::waiting) link_->step(*this);

  const auto end = std::chrono::steady_clock::now() + budget;
  const auto is_over = [&] { return std::chrono::steady_clock::now() >= end; };
  bool more = false;
  do {
    Feed::Bounds bounds;
    bounds.max_messages = may_publish() && messages_.empty() && repeats_.empty() ? options_.limits.batch_messages : 0;
    bounds.max_bytes = options_.limits.batch_bytes;
    bounds.queued = !newest_first_;
    Feed::Batch batch = feed_.take(bounds);
    if (std::exchange(structure_, batch.structure) != batch.structure) is_description_due_ = options_.description.publish;
    for (engine::ObservableResource& resource : batch.resources) new_resources_.push_back(std::move(resource));
    for (const Feed::Response& response : batch.responses) answer(response.number, response.response);
    if (bounds.max_messages != 0 && newest_first_ && batch.messages.empty()) {
      newest_first_ = false;
      batch.more = true;
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
    if (batch.closed) {
      log(LogLevel::info, "the server has stopped");
      stop();
      return long_time;
    }
    more = !new_resources_.empty() || batch.more;
  } while (more && !is_over());

  milliseconds rest = long_time;
  if (is_description_due_ && !description_request_) {
    if (now >= description_at_) request_description();
    else rest = std::min(rest, std::chrono::ceil<milliseconds>(description_at_ - now));
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
    if (!publish(own_.front())) return;
    own_.pop_front();
  }
  while (!messages_.empty() && may_publish()) {
    engine::FeedMessage message = std::move(messages_.front());
    messages_.pop_front();
    if (!send(std::move(message))) return;
  }
}

bool BridgeCore::may_publish() const {
  return phase_ == Phase::online && unacknowledged_.size() < options_.limits.max_unacknowledged &&
         unacknowledged_bytes_ < options_.limits.max_unacknowledged_bytes && !link_->is_congested();
}

void BridgeCore::reconnect() noexcept {
  reconnects_ = true;
  feed_.waker()->wake();
}

void BridgeCore::stop() noexcept {
  if (std::exchange(phase_, Phase::stopped) == Phase::stopped) return;
  counters_.online = false;
  link_->disconnect();
}

// --------------------------------------------------------------------------------------------------------------- the link

void BridgeCore::connected(const Agreement& agreement) {
  phase_ = Phase::online;
  connected_at_ = now_;
  last_reason_.clear();
  max_aliases_ = std::min(agreement.max_aliases, options_.limits.max_topic_aliases);
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
  is_description_due_ = options_.description.publish;
  description_ = nullptr;
  description_at_ = now_;
  newest_first_ = true;
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
  const Kind kind = kind_of(resource.kind);
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
  wanted.minimum_interval = how->minimum_interval;
  wanted.protocol = "mqtt";
  wanted.statements = statements_of(resource, topic);
  wanted.repeats = how->retain;
  const Result<Feed::Channel> channel = feed_.add(std::move(wanted));
  if (!channel) {
    if (channel.error().code != Errc::unknown_path) refuse(channel.error().message);  // it was removed in the meantime
    return;
  }
  const auto number = static_cast<std::uint64_t>(*channel);
  published_.emplace(number, Published{resource.id, std::move(topic), 0, how, kind_of(resource.kind) == Kind::invocation, 0});
  channel_of_[resource.id] = number;
  counters_.resources = published_.size();
}

/// The resource, or the right to read it, no longer exists.
void BridgeCore::end_channel(std::uint64_t channel) {
  const auto found = published_.find(channel);
  if (found == published_.end()) return;
  if (found->second.how->retain) clear_topic(found->second.topic);
  if (!found->second.is_invocation) is_description_due_ = options_.description.publish;  // it may show what the owner may no longer read
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
  out.payload = std::move(message.body);
  out.qos = published.how->qos;
  out.retain = published.how->retain;
  const std::string_view type = published.how->media_type.empty() ? std::string_view("text/turtle") : published.how->media_type;
  out.content_type = out.payload ? charset::content_type(type, *out.payload) : std::string(type);
  out.expiry = published.how->expiry;
  published.sequence += 1 + (message.queued ? message.missed : 0);
  out.user.emplace_back("seq", std::to_string(published.sequence));
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
    return true;
  }
  published.sequence -= 1 + (message.queued ? message.missed : 0);
  if (!message.queued) return false;  // the newest value is sent again later
  message.body = std::move(out.payload);
  messages_.push_front(std::move(message));
  return false;
}

/// False: there is no connection, and the message is to be sent later.
bool BridgeCore::publish(const OutMessage& message, Sending how) {
  const std::size_t bytes = message.payload ? message.payload->size() : 0;
  const Result<int> id = link_->publish(message);
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

void BridgeCore::request_description() {
  if (phase_ != Phase::online) return;
  is_description_due_ = false;
  description_at_ = now_ + options_.description.minimum_interval;
  const std::string base = feed_.base();
  const auto target = http::split_target(base);
  http::Request request;
  request.method = "GET";
  request.target = "/all";
  request.secure = target && target->secure;
  if (target) request.fields.push_back({"Host", target->authority});
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
/// robot. (A broker that was restored from an older copy has what was kept then, which is what this bridge has found first.)
void BridgeCore::see_kept_status(const StatusText& kept) {
  if (kept.session.empty() || kept.session == session_) return;
  if (counters_.connections > 1) {
    if (kept.session != first_session_) see_another(another_robot(identity_, options_.prefix, kept));
    return;
  }
  first_session_ = kept.session;
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
  const auto target = http::split_target(base);
  http::Request request;
  request.method = demand->command == Topics::Command::put ? "PUT" : demand->command == Topics::Command::post ? "POST" : "DELETE";
  request.target = demand->path;
  request.secure = target && target->secure;
  request.body = message.payload;
  request.peer = "mqtt";  // the limits for clients without a principal, and the audit
  if (target) request.fields.push_back({"Host", target->authority});
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
  message.user.emplace_back("status", std::to_string(status));
  message.user.emplace_back("response-of", options_.prefix);
  message.user.emplace_back(robot_time, feed_.robot_time());
  publish_own(std::move(message));
}

void BridgeCore::answer(std::uint64_t number, const http::Response& response) {
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
