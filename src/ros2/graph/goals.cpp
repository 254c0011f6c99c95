// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstring>

#include "src/base/random.hpp"
#include "src/ros2/graph/cdr.hpp"
#include "src/ros2/graph/core.hpp"
#include "src/ros2/types/names.hpp"

// An action of ROS 2 is three services and two topics:
//   send_goal {goal_id[16], goal} -> {bool accepted, Time}; get_result {goal_id[16]} -> {int8 status, result}; cancel_goal {GoalInfo} -> {int8, GoalInfo[]}
//   feedback {goal_id[16], feedback}; status {{GoalInfo {goal_id[16], Time}, int8 status}[]}
namespace lrt::ros2 {
inline namespace v0 {

namespace {

constexpr std::size_t max_early = 16;                            ///< feedback before the response to the goal
constexpr std::chrono::milliseconds patience_for_readers{1500};  ///< until a goal is sent without readers of feedback that match
constexpr std::chrono::seconds patience_for_cancel{10};

std::string key_of(const std::array<char, 16>& id) { return std::string(id.data(), id.size()); }

template <class F>
void tell(Goal::State& goal, F&& f) {
  const std::lock_guard<std::recursive_mutex> lock(goal.mutex);
  if (goal.alive) f(goal.events);
}

}  // namespace

Goal::Goal() noexcept = default;
Goal::Goal(std::shared_ptr<State> state) noexcept : state_(std::move(state)) {}
Goal::Goal(Goal&&) noexcept = default;
Goal& Goal::operator=(Goal&& other) noexcept {
  Goal(std::move(other)).state_.swap(state_);
  return *this;
}
Goal::~Goal() {
  if (state_ == nullptr) return;
  GoalEvents events;
  {
    const std::lock_guard<std::recursive_mutex> lock(state_->mutex);
    state_->alive = false;
  }
  if (const auto core = state_->core.lock()) core->goal_handle_ended(state_);
}
void Goal::cancel() const {
  if (state_ == nullptr) return;
  if (const auto core = state_->core.lock()) core->cancel(state_);
}

/// The events are destroyed on the graph's thread: one of them may be running.
void GraphCore::goal_handle_ended(const std::shared_ptr<Goal::State>& goal) {
  post([goal] {
    GoalEvents events;
    const std::lock_guard<std::recursive_mutex> lock(goal->mutex);
    std::swap(events, goal->events);
  });
}

Result<Goal> GraphCore::send_goal(std::string_view action, std::string_view type, std::string_view request, GoalEvents events,
                                  std::chrono::milliseconds timeout) {
  if (request.size() < 20 || request[0] != 0 || (request[1] != 0 && request[1] != 1))
    return unexpected(Errc::expected_value, "the request is no payload with an encapsulation and a goal_id");
  if (!is_full_name(action) || !is_type_name(type))
    return unexpected(Errc::expected_value, "\"" + std::string(action) + "\" or \"" + std::string(type) + "\" is no full name");
  if (goals_.fetch_add(1) >= options.limits.max_goals || calls_ + goals_ > options.limits.max_calls) {
    --goals_;
    return unexpected(Errc::limit_exceeded, "GraphLimits::max_goals goals have not ended");
  }
  auto goal = std::make_shared<Goal::State>();
  goal->core = weak_from_this();
  fill_random(reinterpret_cast<unsigned char*>(goal->id.data()), goal->id.size());
  goal->action = action;
  goal->type = type;
  goal->request = request;
  std::copy(goal->id.begin(), goal->id.end(), goal->request.begin() + 4);
  goal->events = std::move(events);
  goal->deadline = deadline_after(timeout);
  const bool posted = post([this, goal] {
    running_goals_.emplace(key_of(goal->id), goal);
    const std::string key = goal->action + " " + goal->type;
    ActionChannel& channel = channels_[key];
    ++channel.goals;
    if (!channel.feedback) {
      // Both readers exist before the goal is sent.
      auto feedback = subscribe(
          goal->action + "/_action/feedback", goal->type + "_FeedbackMessage",
          [this, key](Sample&& sample) {
            if (sample.payload->size() < 20) return;
            post_sample(sample.payload->size(), [this, key, payload = sample.payload] { goal_feedback(key, payload); });
          },
          SubscribeOptions{{}, 64, std::chrono::nanoseconds(0)}, true);
      auto status = subscribe(
          goal->action + "/_action/status", "action_msgs/msg/GoalStatusArray",
          [this, key](Sample&& sample) {
            post_sample(sample.payload->size(), [this, key, payload = sample.payload] { goal_status(key, *payload); });
          },
          SubscribeOptions{{}, 64, std::chrono::nanoseconds(0)}, true);
      channel.since = std::chrono::steady_clock::now();
      if (feedback) channel.feedback = std::move(*feedback);
      if (status) channel.status = std::move(*status);
    }
    post_at(std::chrono::steady_clock::now() + patience_for_readers, [this] { wake(); });
    subscriptions_changed_ = true;
    react();
  });
  if (!posted) {
    --goals_;
    return unexpected(Errc::closed, "the graph is closed");
  }
  return Goal(std::move(goal));
}

/// Sends it when readers of feedback and status match, as far as there are writers. Called again until then.
void GraphCore::start_goal(const std::shared_ptr<Goal::State>& goal) {
  if (is_closed_ || goal->has_ended) return;
  const TimePoint now = std::chrono::steady_clock::now();
  const ServerFound server = known.server(goal->action + "/_action/send_goal", goal->type + "_SendGoal");
  if (server.pairs.empty() || server.form == IdentityForm::unknown) {
    const char* const why =
        server.pairs.empty() ? "there is no server of the action " : "it is not known how this server identifies requests, so none is sent: ";
    return end_goal(goal, unexpected(Errc::unavailable, why + goal->action), GoalStatus::unknown);
  }
  ActionChannel& channel = channels_[goal->action + " " + goal->type];
  const auto is_matched = [&](const Subscription& subscription) {
    if (!subscription) return true;
    const Subscription::State& state = *subscription.state_;
    const auto writers = known.offered(state.topic, state.type, {}).writers;
    return writers.empty() || (state.reader != nullptr && std::any_of(writers.begin(), writers.end(), [&](const Gid& writer) {
                                 return state.reader->is_matched(writer) && state.reader->is_heard(writer);
                               }));
  };
  if ((!is_matched(channel.feedback) || !is_matched(channel.status)) && now < channel.since + patience_for_readers) return;
  channel.used = now;
  goal->is_sent = true;
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(goal->deadline - now);
  auto sent = call(
      goal->action + "/_action/send_goal", goal->type + "_SendGoal", goal->request,
      [this, goal](const Result<Bytes>& response) { goal_response(goal, response); }, left, true);
  goal->request.clear();
  if (!sent) return end_goal(goal, unexpected(sent.error()), GoalStatus::unknown);
  goal->call = std::move(*sent);
}

void GraphCore::goal_response(const std::shared_ptr<Goal::State>& goal, const Result<Bytes>& response) {
  if (goal->has_ended) return;
  if (!response) return end_goal(goal, unexpected(response.error()), GoalStatus::unknown);
  CdrReader reader(**response);
  const bool accepted = reader.boolean();
  if (!reader.ok())
    return end_goal(goal, unexpected(Errc::expected_value, "the response of " + goal->action + "/_action/send_goal is malformed"),
                    GoalStatus::unknown);
  if (!accepted) return end_goal(goal, unexpected(Errc::refused, "the server of " + goal->action + " rejects the goal"), GoalStatus::unknown);
  goal->is_accepted = true;
  tell(*goal, [](GoalEvents& events) {
    if (events.accepted) events.accepted();
  });
  // The call of the response has ended; this one waits for as long as the server is there.
  std::string request("\0\1\0\0", 4);
  request.append(goal->id.data(), goal->id.size());
  auto sent = call(
      goal->action + "/_action/get_result", goal->type + "_GetResult", request,
      [this, goal](Result<Bytes> result) { goal_result(goal, std::move(result)); }, patience_for_cancel, true, true);
  if (!sent) return end_goal(goal, unexpected(sent.error()), goal->status);
  goal->call = std::move(*sent);
  for (const Bytes& payload : goal->early)
    tell(*goal, [&](GoalEvents& events) {
      if (events.feedback) events.feedback(payload);
    });
  goal->early.clear();
  if (goal->wants_cancel) send_cancel(goal);
}

void GraphCore::goal_result(const std::shared_ptr<Goal::State>& goal, Result<Bytes> response) {
  if (goal->has_ended) return;
  if (!response) {
    Error error = response.error();
    if (error.code == Errc::unconfirmed || error.code == Errc::unavailable)
      error = Error{Errc::unavailable, "the server of " + goal->action + " is gone before the goal has ended"};
    return end_goal(goal, unexpected(std::move(error)), goal->status);
  }
  CdrReader reader(**response);
  const auto status = static_cast<std::int8_t>(reader.u8());
  if (!reader.ok() || status < 0 || status > 6)
    return end_goal(goal, unexpected(Errc::expected_value, "the response of " + goal->action + "/_action/get_result is malformed"), goal->status);
  end_goal(goal, std::move(response), static_cast<GoalStatus>(status));
}

void GraphCore::end_goal(const std::shared_ptr<Goal::State>& goal, Result<Bytes> response, GoalStatus status) {
  if (std::exchange(goal->has_ended, true)) return;
  running_goals_.erase(key_of(goal->id));
  const auto channel = channels_.find(goal->action + " " + goal->type);
  if (channel != channels_.end()) {
    --channel->second.goals;
    channel->second.used = std::chrono::steady_clock::now();
    if (!is_closed_ && !std::exchange(is_collecting_, true)) post_at(channel->second.used + std::chrono::seconds(30), [this] { collect_idle(); });
  }
  --goals_;
  const Call call = std::move(goal->call);  // destroyed behind the event
  const Call cancelling = std::move(goal->cancelling);
  GoalEvents events;
  const std::lock_guard<std::recursive_mutex> lock(goal->mutex);
  std::swap(events, goal->events);
  if (!goal->alive) return;
  if (status != goal->status && status != GoalStatus::unknown && events.status) events.status(status);
  goal->status = status;
  if (events.ended) events.ended(std::move(response), status);
}

void GraphCore::goal_feedback(const std::string& action, const Bytes& payload) {
  const auto found = running_goals_.find(payload->substr(4, 16));
  if (found == running_goals_.end() || found->second->action + " " + found->second->type != action) return;
  const auto goal = found->second;
  if (!goal->is_accepted) {
    if (goal->early.size() < max_early) goal->early.push_back(payload);
    return;
  }
  tell(*goal, [&](GoalEvents& events) {
    if (events.feedback) events.feedback(payload);
  });
}

void GraphCore::goal_status(const std::string& action, const std::string& payload) {
  CdrReader reader(payload);
  const std::size_t count = reader.count(25);
  for (std::size_t i = 0; i < count && reader.ok(); ++i) {
    const std::string id(reader.bytes(16));
    reader.u32();
    reader.u32();
    const auto number = static_cast<std::int8_t>(reader.u8());
    if (!reader.ok() || number < 1 || number > 6) continue;
    const auto found = running_goals_.find(id);
    if (found == running_goals_.end() || found->second->action + " " + found->second->type != action) continue;
    const auto goal = found->second;
    const auto status = static_cast<GoalStatus>(number);
    if (!goal->is_accepted || status == goal->status) continue;  // of the states that end, the result tells with its payload
    if (status >= GoalStatus::succeeded) continue;
    goal->status = status;
    tell(*goal, [&](GoalEvents& events) {
      if (events.status) events.status(status);
    });
  }
}

void GraphCore::cancel(const std::shared_ptr<Goal::State>& goal) {
  post([this, goal] {
    if (goal->has_ended || std::exchange(goal->wants_cancel, true)) return;
    if (goal->is_accepted) send_cancel(goal);
  });
}

void GraphCore::send_cancel(const std::shared_ptr<Goal::State>& goal) {
  CdrWriter request;
  request.bytes(std::string_view(goal->id.data(), goal->id.size())).u32(0).u32(0);
  auto sent = call(
      goal->action + "/_action/cancel_goal", "action_msgs/srv/CancelGoal", request.payload(),
      [this, goal](const Result<Bytes>& response) {
        if (!response) {
          log(LogLevel::warning, "a goal of " + goal->action + " could not be cancelled: " + response.error().message);
          goal->wants_cancel = false;  // another attempt is allowed
        }
      },
      patience_for_cancel, true);
  if (sent) goal->cancelling = std::move(*sent);
}

}  // namespace v0
}  // namespace lrt::ros2
