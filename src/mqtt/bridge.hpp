// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include <lrt/feed.hpp>
#include <lrt/mqtt.hpp>

#include "src/mqtt/identity_checks.hpp"
#include "src/mqtt/link.hpp"
#include "src/mqtt/topics.hpp"
#include "src/mqtt/window.hpp"

namespace lrt::mqtt {
inline namespace v0 {

/// The logic of a bridge, as a function of its feed, its link and the time. It has no threads and no descriptors.
///
/// @par Threads  One at a time; counters(): any.
class BridgeCore final : private Link::Events {
 public:
  using Instant = std::chrono::steady_clock::time_point;
  using MakeLink = std::function<Result<std::unique_ptr<Link>>(LinkOptions)>;

  /// @par Errors  those of Bridge::create()
  static Result<std::unique_ptr<BridgeCore>> create(Server& server, Options options, const MakeLink& make_link = make_mosquitto_link);

  /// Receives and sends pending messages, for about `budget`.
  /// @return  the time until the next step, unless a descriptor becomes ready earlier; zero: work is left
  std::chrono::milliseconds advance(Instant now, std::chrono::microseconds budget);
  /// Connects again at the next advance(), with the credentials that then are in their files.
  /// @par Threads  Any.
  void reconnect() noexcept;
  void stop() noexcept;

  Feed& feed() noexcept { return feed_; }
  Link& link() noexcept { return *link_; }
  const Topics& topics() const noexcept { return topics_; }
  const Options& options() const noexcept { return options_; }
  Counters counters() const noexcept;
  const std::string& broker_url() const noexcept { return broker_url_; }
  /// Different meanings of the values that are published.
  std::size_t meanings() const noexcept { return meanings_.size(); }

 private:
  /// A resource that is published.
  struct Published {
    std::uint64_t resource;
    std::string topic;
    std::uint64_t sequence = 0;
    const Publication* how;
    bool is_invocation;
    bool is_value;  ///< of a Property or state: each change has a number
    std::chrono::milliseconds minimum_interval;
    const engine::Meaning* meaning;  ///< one of meanings_
    std::uint16_t alias = 0;         ///< of the present connection; 0: none yet
    std::uint64_t unsent = 0;        ///< the number of the newest change that was taken and not sent, because its connection ended; 0: none
    std::uint64_t left_out = 0;      ///< with `unsent`: changes before it that were left out
  };
  /// A message with QoS 1 or 2 that the network has and the broker has not acknowledged.
  struct Unacknowledged {
    OutMessage message;
    std::uint64_t number;  ///< in the order of sending
    bool repeats;          ///< it is sent again on the next connection
    std::size_t bytes() const noexcept { return message.payload ? message.payload->size() : 0; }
  };
  /// The description of a Thing, for programs without RDF or for Home Assistant.
  struct Described {
    std::shared_ptr<const std::string> text{};  ///< on this connection; nullptr: not known yet
    bool is_due = false;                        ///< to be sent
    bool is_there = false;                      ///< in the structure document that is read now
  };
  /// A command that waits for its response.
  struct Waiting {
    std::string response_topic, correlation;
    int qos;
  };
  struct AtomicCounters {
    std::atomic<bool> online{false};
    std::atomic<std::uint64_t> connections{0}, failed_connections{0}, published{0}, published_bytes{0}, acknowledged{0}, refused{0}, not_bridged{0},
        commands{0}, dropped_commands{0}, left_out{0};
    std::atomic<std::uint64_t> taken_over{0};
    std::atomic<std::size_t> resources{0}, unacknowledged{0};
    std::atomic<std::int64_t> lag_ms{0};
  };

  BridgeCore(Feed feed, Topics topics, Options options, Identity identity);

  // Link::Events
  void connected(const Agreement& agreement) override;
  void taken_over() override;
  void disconnected(const std::string& reason) override;
  void acknowledged(int id, bool refused, const std::string& reason) override;
  void confirmed(int id) override;
  void received(InMessage message) override;
  void subscription_refused(const std::string& filter, const std::string& reason) override;

  const Publication* publication_of(const engine::ObservableResource& resource) const;
  void bridge(const engine::ObservableResource& resource);
  void unbridge(std::uint64_t channel);
  void end_channel(std::uint64_t channel);
  void clear_topic(std::string topic);
  std::vector<Statement> statements_of(const engine::ObservableResource& resource, const std::string& topic) const;
  bool send(engine::FeedMessage message);
  void keep_left_out(const engine::FeedMessage& message);
  static std::uint64_t left_out_before(const engine::FeedMessage& message, const Published& published) noexcept;
  const engine::Meaning* kept(engine::Meaning meaning);
  void release(const engine::Meaning& meaning);
  /// How often a message is sent: until it is acknowledged, on the next connection again, or on one connection.
  enum class Sending : std::uint8_t { first, again, once };
  bool publish(const OutMessage& message, Sending how = Sending::first);
  void publish_waiting();
  void publish_own(OutMessage message);
  void describe_again();
  void request_description();
  void request_structure(const std::string& target);
  void describe_things(const http::Response& response);
  void set_described(std::string topic, std::string text);
  void clear_described(bool all);
  bool publish_described();
  void answer(std::uint64_t number, const http::Response& response);
  bool sends_time() const noexcept { return options_.commands.enabled && options_.commands.time_interval.count() > 0; }
  std::string valid_until_of(InMessage& message) const;
  void carry_out(InMessage message);
  void see_status(const InMessage& message);
  void see_kept_status(const StatusText& kept);
  void see_another(const std::string& what);
  std::optional<std::string> refused_command(const InMessage& message) const;
  void respond(const Waiting& to, int status, OutMessage message);
  void drop_command(const std::string& why);
  bool has_quota() const;
  bool may_publish() const;
  Feed::Bounds next_bounds() const;
  void probe();
  void give_up_window();
  void follow_description();
  void count_lag(std::chrono::milliseconds waiting);
  OutMessage status(bool online, bool is_will = false) const;
  void log(LogLevel level, const std::string& message) const noexcept;
  void log_once(const std::string& message);

  Feed feed_;
  const Topics topics_;
  const Options options_;
  const Identity identity_;
  const std::string broker_url_, session_;
  std::unique_ptr<Link> link_;

  // The connection.
  enum class Phase { waiting, connecting, online, stopped };
  Phase phase_ = Phase::waiting;
  Instant now_{}, retry_at_{}, connected_at_{};
  unsigned failures_ = 0;  ///< to connect, in succession
  std::uint64_t chance_;   ///< for jitter
  std::uint16_t max_aliases_ = 0, used_aliases_ = 0;
  std::size_t max_unacknowledged_ = 0;  ///< of the present connection
  Window window_;                       ///< of the present connection
  std::chrono::system_clock::time_point online_since_{};
  bool newest_first_ = false;    ///< set after connecting: each newest value is sent before queued changes and descriptions
  std::size_t newest_left_ = 0;  ///< with newest_first_: topics that had no turn yet, at most
  std::string last_reason_;      ///< of a connection that failed, logged once
  bool is_contested_ = false;    ///< another client was connected as this robot: the next pause is the longest
  std::atomic<bool> reconnects_{false};
  StatusText first_status_;  ///< that the broker had kept when this bridge connected first
  bool is_status_due_ = false;
  Instant status_at_{}, time_at_{};                         ///< not before
  std::unordered_map<int, Unacknowledged> unacknowledged_;  ///< by id, of the present connection
  std::size_t unacknowledged_bytes_ = 0;
  std::uint64_t last_number_ = 0;
  std::deque<OutMessage> repeats_;  ///< unacknowledged when their connection ended, the oldest first

  // Publications.
  std::deque<engine::ObservableResource> new_resources_;
  std::unordered_map<std::uint64_t, Published> published_;                                                     ///< by channel
  std::unordered_map<std::uint64_t, std::uint64_t> channel_of_;                                                ///< by resource
  std::map<engine::Meaning, std::size_t, bool (*)(const engine::Meaning&, const engine::Meaning&)> meanings_;  ///< by how many resources each is used
  std::deque<engine::FeedMessage> messages_;          ///< taken, and not sent yet: the rest of a batch
  Instant taken_at_{};                                ///< messages_
  std::deque<OutMessage> own_;                        ///< responses and the description
  std::set<std::string> cleared_topics_;              ///< whose retained messages the broker has to delete
  std::optional<std::uint64_t> description_request_;  ///< under way
  std::uint64_t structure_ = 0;                       ///< when the description became due
  bool is_description_due_ = false;
  Instant description_at_{};
  std::shared_ptr<const std::string> description_;  ///< published last, on this connection
  /// A description that is on its way: when it was sent, and what the broker has then confirmed.
  struct OnWay {
    Instant since;
    std::uint64_t bytes;
  };
  std::optional<OnWay> description_on_way_;
  std::optional<std::uint64_t> structure_request_;  ///< under way
  bool are_things_due_ = false;
  Instant things_at_{};
  std::map<std::string, Described> described_;  ///< by topic
  std::deque<std::string> due_topics_;          ///< topics of those that are to be sent

  std::unordered_map<std::uint64_t, Waiting> waiting_;  ///< commands by number
  std::string last_warning_;                            ///< see log_once()
  Instant warnings_since_{};
  std::size_t warnings_ = 0;
  AtomicCounters counters_;
};

}  // namespace v0
}  // namespace lrt::mqtt
