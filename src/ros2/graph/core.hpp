// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <shared_mutex>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/unique_function.hpp>
#include <lrt/ros2/graph.hpp>

#include "src/base/thread.hpp"
#include "src/ros2/graph/dds.hpp"
#include "src/ros2/graph/known.hpp"

namespace lrt::ros2 {
inline namespace v0 {

using TimePoint = std::chrono::steady_clock::time_point;
/// @param timeout  below 0: now; more than a year: a year
inline TimePoint deadline_after(std::chrono::milliseconds timeout) {
  const std::chrono::milliseconds year = std::chrono::hours(24 * 365);
  return std::chrono::steady_clock::now() + std::min(std::max(timeout, std::chrono::milliseconds(0)), year);
}

/// A subscription. Its reader is made and removed without `mutex`, because DDS holds a lock of the reader while it calls received().
struct LRT_LOCAL Subscription::State final : dds::EndpointEvents {
  std::weak_ptr<GraphCore> core{};
  std::string topic{}, type{};
  SubscribeOptions options{};
  bool is_internal = false;
  std::recursive_mutex mutex{};  ///< held while the sink runs; protects what follows
  bool alive = true, in_sink = false;
  Sink sink{};
  std::unordered_map<Gid, std::chrono::steady_clock::time_point, GidHash> last{};  ///< of each writer, with a minimum interval
  std::unordered_map<Gid, bool, GidHash> fitting{};                                ///< writers whose hash is known
  /// @{
  /// Of the graph's thread, once the subscription is made.
  std::unique_ptr<dds::Reader> reader{};
  dds::EndpointOptions made{};
  TimePoint made_at{};
  /// @}
  std::function<void()> ended{};  ///< called without a lock when the handle goes; may be empty

  void received(const dds::Received& sample) override;
  void lost(std::uint64_t count) override;
  void matched() override;
  void end();
};

struct LRT_LOCAL Publisher::State {
  std::weak_ptr<GraphCore> core{};
  std::size_t max_bytes = 0;
  mutable std::shared_mutex mutex{};      ///< protects `writer`; publishing shares it
  std::unique_ptr<dds::Writer> writer{};  ///< nullptr: the graph is closed
};

/// A call, or a chain of calls with one handle.
struct LRT_LOCAL Call::State {
  std::weak_ptr<GraphCore> core{};
  std::recursive_mutex mutex{};  ///< held while the callback runs
  bool alive = true;
  bool is_counted = false;
  UniqueFunction<void(Result<Bytes>)> done{};
  Call inner{};  ///< the present call of a chain

  bool is_alive() {
    const std::lock_guard<std::recursive_mutex> lock(mutex);
    return alive;
  }
  void finish(Result<Bytes> response);
  void end();  ///< the handle goes
};

struct LRT_LOCAL Goal::State {
  std::weak_ptr<GraphCore> core{};
  std::array<char, 16> id{};
  std::string action{}, type{}, request{};
  TimePoint deadline{};
  std::recursive_mutex mutex{};  ///< held while an event runs
  bool alive = true;
  GoalEvents events{};
  /// @{
  /// Of the graph's thread.
  bool is_sent = false, is_accepted = false, has_ended = false, wants_cancel = false;
  GoalStatus status = GoalStatus::unknown;
  std::deque<Bytes> early{};  ///< feedback that came before the response to the goal
  Call call{}, cancelling{};
  /// @}
};

/// A client of one service in one form. Of the graph's thread, but for received() and matched().
class ServiceClient final : public dds::EndpointEvents {
 public:
  struct Pending {
    std::shared_ptr<Call::State> call;
    std::string request;  ///< until it is sent
    std::vector<std::pair<Gid, Gid>> servers;
    TimePoint deadline;
    bool waits_for_ever = false;
  };

  ServiceClient(GraphCore& core, std::string service, std::string type, IdentityForm form);
  Result<void> create();
  void add(Pending pending);
  void react(TimePoint now);  ///< sends what can be sent, and ends what cannot be responded to
  void close(const Error& error);
  bool is_idle() const noexcept { return waiting_.empty() && sent_.empty(); }
  TimePoint next() const noexcept;  ///< when react() has to be called again

  void received(const dds::Received& sample) override;
  void matched() override;

  const std::string service, type;
  const IdentityForm form;
  TimePoint used{};

 private:
  void respond(std::int64_t sequence, Bytes payload);
  bool is_ready(const ServerFound& server, TimePoint now);
  void release();

  GraphCore& core_;
  Gid id_{};                  ///< inline_qos: of the reader
  std::uint64_t number_ = 0;  ///< header: random
  std::int64_t last_ = 0;
  std::atomic<std::int64_t> newest_{0};  ///< sequence numbers above have not been sent
  std::unique_ptr<dds::Reader> responses_;
  std::unique_ptr<dds::Writer> requests_;
  Gid requests_gid_{};
  std::map<Gid, TimePoint> matched_;  ///< writers of responses, since when
  std::list<Pending> waiting_;
  std::map<std::int64_t, Pending> sent_;
};

/// What a Graph is. Handles refer to it weakly.
class GraphCore final : public std::enable_shared_from_this<GraphCore>, private dds::EndpointEvents {
 public:
  explicit GraphCore(GraphOptions options);
  ~GraphCore();
  Result<void> join();
  void close();  ///< not on the graph's thread

  std::shared_ptr<const GraphSnapshot> snapshot() const;
  void on_change(UniqueFunction<void()> f);
  Result<Subscription> subscribe(std::string_view topic, std::string_view type, Sink sink, const SubscribeOptions& options, bool internal);
  Result<Publisher> advertise(std::string_view topic, std::string_view type, const AdvertiseOptions& options);
  Result<Call> call(std::string_view service, std::string_view type, std::string_view request, UniqueFunction<void(Result<Bytes>)> done,
                    std::chrono::milliseconds timeout, bool internal, bool waits_for_ever = false);
  Result<Goal> send_goal(std::string_view action, std::string_view type, std::string_view request, GoalEvents events,
                         std::chrono::milliseconds timeout);
  void cancel(const std::shared_ptr<Goal::State>& goal);
  /// A handle for a chain of calls; counts as one call.
  Result<std::shared_ptr<Call::State>> begin_chain(UniqueFunction<void(Result<Bytes>)> done);
  /// `ended` is called when the handle goes, without a lock.
  static void when_ended(const Subscription& subscription, std::function<void()> ended) { subscription.state_->ended = std::move(ended); }
  static Call handle_of(std::shared_ptr<Call::State> state) { return Call(std::move(state)); }
  GraphCounters counters() const noexcept;

  /// @{
  /// Runs a function on the graph's thread, soon or at a time. False: the graph is closed.
  bool post(UniqueFunction<void()> job);
  void post_at(TimePoint at, UniqueFunction<void()> job);
  /// As post(), for what strangers send: at most GraphLimits::max_waiting_bytes wait, the rest is dropped and counted.
  void post_sample(std::size_t bytes, UniqueFunction<void()> job);
  /// @}
  void wake_clients() { clients_changed_ = true, wake(); }
  void log(LogLevel level, std::string_view text) const noexcept;
  bool own(const Gid& gid, bool is_writer, bool there);
  void ended(const Call::State& call) noexcept;
  void goal_handle_ended(const std::shared_ptr<Goal::State>& goal);

  const GraphOptions options;
  Known known;
  std::unique_ptr<dds::Participant> participant;
  struct {
    std::atomic<std::uint64_t> samples{0}, sample_bytes{0}, lost{0}, large{0}, other_version{0};
  } counts;

 private:
  friend struct Subscription::State;
  friend class Publisher;

  void received(const dds::Received& sample) override;  ///< ros_discovery_info
  void run();
  void wake();
  void react();
  void make_reader(Subscription::State& state, const Offered& offered);
  void check_subscriptions(TimePoint now);
  void announce_node();
  void remove(const std::shared_ptr<Publisher::State>& publisher);
  void remove(std::list<std::unique_ptr<ServiceClient>>::iterator client);
  void remove_oldest_idle();
  void collect_idle();
  void start_call(const std::string& service, const std::string& type, ServiceClient::Pending pending);
  void start_goal(const std::shared_ptr<Goal::State>& goal);
  void goal_response(const std::shared_ptr<Goal::State>& goal, const Result<Bytes>& response);
  void goal_result(const std::shared_ptr<Goal::State>& goal, Result<Bytes> response);
  void send_cancel(const std::shared_ptr<Goal::State>& goal);
  void end_goal(const std::shared_ptr<Goal::State>& goal, Result<Bytes> response, GoalStatus status);
  void goal_status(const std::string& action, const std::string& payload);
  void goal_feedback(const std::string& action, const Bytes& payload);
  struct ActionChannel {
    std::size_t goals = 0;
    TimePoint since{};  ///< when its readers were made
    TimePoint used{};
    Subscription feedback{}, status{};
  };

  Thread thread_;
  mutable std::mutex mutex_;  ///< of what follows, up to the next comment
  std::condition_variable condition_;
  std::deque<UniqueFunction<void()>> jobs_;
  std::multimap<TimePoint, UniqueFunction<void()>> timers_;
  bool closing_ = false, woken_ = false, joined_ = false;
  Result<void> join_result_{};
  std::shared_ptr<const GraphSnapshot> snapshot_ = std::make_shared<const GraphSnapshot>();
  std::vector<std::shared_ptr<Subscription::State>> subscriptions_;
  std::vector<std::shared_ptr<Publisher::State>> publishers_;
  std::unordered_set<Gid, GidHash> own_readers_, own_writers_;

  std::recursive_mutex change_mutex_;  ///< held while the callback runs
  UniqueFunction<void()> on_change_;

  std::atomic<bool> clients_changed_{false}, own_changed_{false}, subscriptions_changed_{false};
  std::atomic<std::size_t> calls_{0}, goals_{0}, subscribed_{0}, waiting_bytes_{0};

  /// @{
  /// Of the graph's thread.
  std::unique_ptr<dds::Reader> nodes_reader_;
  std::unique_ptr<dds::Writer> nodes_writer_;
  std::string announced_;
  bool is_closed_ = false, is_collecting_ = false;
  std::uint64_t seen_changes_ = 0, snapshot_changes_ = 0, version_ = 0;
  TimePoint snapshot_due_ = TimePoint::max(), subscriptions_due_ = TimePoint::max();
  std::list<std::unique_ptr<ServiceClient>> clients_;
  std::map<std::string, std::shared_ptr<Goal::State>> running_goals_;  ///< by id
  std::map<std::string, ActionChannel> channels_;                      ///< by action and type
  /// @}
};

class LRT_LOCAL Graph::Impl {
 public:
  explicit Impl(GraphOptions options) : core(std::make_shared<GraphCore>(std::move(options))) {}
  ~Impl() {
    if (joined) core->close();
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  std::shared_ptr<GraphCore> core;
  bool joined = false;
};

}  // namespace v0
}  // namespace lrt::ros2
