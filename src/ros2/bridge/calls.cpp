// SPDX-License-Identifier: Apache-2.0
// A service: a Thing with the Action "call". An action of ROS: a Thing with the Action "send_goal" and the Property "feedback".
#include <algorithm>
#include <cmath>
#include <utility>

#include <lrt/rdf/dynamic_type.hpp>

#include "src/ros2/bridge/core.hpp"

namespace lrt::ros2 {
namespace {

/// How many calls of one service, or goals of one action, run at the same time. The server in ROS decides which of them it takes.
constexpr std::size_t max_parallel = 8;
constexpr std::chrono::seconds call_timeout{30};
/// Versions of one type, one after the other: a DynamicType is kept for the life of the process.
constexpr unsigned max_types = 8;

/// The member with this name of a value; nullptr: there is none.
const rdf::Value* member(const rdf::Type& type, const rdf::Value& value, std::string_view name) {
  const rdf::Value::Sequence* members = value.sequence();
  if (!members) return nullptr;
  for (std::size_t i = 0; i < type.fields.size() && i < members->size(); ++i)
    if (type.fields[i].name == name) return &(*members)[i];
  return nullptr;
}
/// The same for a path, "result.success".
const rdf::Value* member_at(const rdf::Type& type, const rdf::Value& value, std::string_view path) {
  const rdf::Type* t = &type;
  const rdf::Value* v = &value;
  while (v && t) {
    const std::size_t end = path.find('.');
    const std::string_view name = path.substr(0, end);
    const auto field = std::find_if(t->fields.begin(), t->fields.end(), [name](const rdf::FieldType& f) { return f.name == name; });
    v = field == t->fields.end() ? nullptr : member(*t, *v, name);
    if (end == std::string_view::npos || !v) return v;
    t = field->type;
    path.remove_prefix(end + 1);
  }
  return nullptr;
}
std::optional<double> number_of(const rdf::Value* value) {
  if (!value) return std::nullopt;
  if (value->real()) return *value->real();
  if (value->integer()) return static_cast<double>(*value->integer());
  return std::nullopt;
}
/// A sentence in a result or a response: why it is as it is.
std::string words_of(const rdf::Type& type, const rdf::Value& value) {
  for (const char* name : {"message", "error_string", "error_msg", "status_message"})
    if (const rdf::Value* text = member(type, value, name); text && text->text() && !text->text()->empty()) return *text->text();
  return {};
}

/// Runs on any thread; ends an invocation, with or without an output.
using End = std::function<void(Result<rdf::Value>)>;

End end_of(const Responder& done) {
  return [done](Result<rdf::Value> r) { r ? done.succeed() : done.fail(std::move(r).error()); };
}
End end_of(const ResponderOf<rdf::Value>& done) {
  return [done](Result<rdf::Value> r) { r ? done.succeed(*r) : done.fail(std::move(r).error()); };
}

/// Adds an Action for these types, which may be without input or output. `f(input, responder)` begins it.
template <class F>
Action add_action(Thing& thing, std::string_view path, rdf::DynamicType input, rdf::DynamicType output, F f) {
  if (input->fields.empty()) input = {};
  if (output->fields.empty()) output = {};
  if (input && output)
    return thing.action(path, input, output, [f](const rdf::Value& in, ResponderOf<rdf::Value> done) { f(in, done, end_of(done)); });
  if (input) return thing.action(path, input, output, [f](const rdf::Value& in, Responder done) { f(in, done, end_of(done)); });
  const rdf::Value none{rdf::Value::Sequence()};
  if (output) return thing.action(path, input, output, [f, none](ResponderOf<rdf::Value> done) { f(none, done, end_of(done)); });
  return thing.action(path, input, output, [f, none](Responder done) { f(none, done, end_of(done)); });
}

/// Sets whether an Action is available, with one of the reasons that are known here: their addresses are kept.
enum class Why : std::uint8_t { ready, gone, not_ready, other_type };
void set_available(Action& action, Why why) noexcept {
  switch (why) {
    case Why::ready: action.available(true); break;
    case Why::gone: action.available(false, "no node serves it now"); break;
    case Why::not_ready: action.available(false, "its server is not complete yet, or it is in doubt in which form it takes requests"); break;
    case Why::other_type: action.available(false, "its server is of another version of the type now"); break;
  }
}
const char* sentence_of(Why why) noexcept {
  switch (why) {
    case Why::gone: return "no node serves it now";
    case Why::not_ready: return "its server is not complete yet, or it is in doubt in which form it takes requests";
    case Why::other_type: return "its server is of another version of the type now";
    default: return "";
  }
}

/// The common part of services and actions.
class CallPart : public Part {
 public:
  using Part::Part;
  bool is_waiting() const override { return waits_; }

 protected:
  void show(Why why) {
    is_available = why == Why::ready;
    listed.reason = is_allowed_ ? sentence_of(why) : is_available ? "not allowed: read-only" : sentence_of(why);
    if (action_) set_available(*action_, why);
  }

  bool waits_ = false, is_allowed_ = false;
  unsigned types_made_ = 0;
  std::string hash_;
  Said said_;
  std::optional<Action> action_;
};

// --- services

/// Keeps a call until its response.
class PendingCall {
 public:
  void keep(Handle call) {
    const std::lock_guard lock(mutex_);
    if (!has_ended_) call_ = std::move(call);
  }
  Handle end() {
    const std::lock_guard lock(mutex_);
    has_ended_ = true;
    return std::exchange(call_, nullptr);
  }

 private:
  std::mutex mutex_;
  Handle call_;
  bool has_ended_ = false;
};

class ServicePart final : public CallPart {
 public:
  ServicePart(Core& core, const std::string& name) : CallPart(Listed{Listed::What::service, name, {}, {}, {}, {}, {}}) {
    wanted_path = core.path_of(name);
    suffix = "_service";
  }

  void update(Core& core, const ServiceInfo* service) {
    waits_ = false;
    if (!service) return show(Why::gone);
    listed.nodes = service->nodes;
    listed.type = service->type;
    is_allowed_ = core.is_allowed(core.options().allowed.services, listed.name);
    said_ = said_of(core.rules(), Rule::Of::service, listed.name, service->type);
    if (!is_allowed_ || said_.hidden) {
      is_available = true;
      listed.reason = said_.hidden ? "the mapping hides it" : "not allowed";
      return;
    }
    if (!request_ || service->type != type_ || (!service->hash.empty() && service->hash != hash_)) {
      if (!make_types(core, *service)) {
        if (action_) set_available(*action_, Why::other_type);
        return;
      }
      if (is_served) core.renew(*this);
    }
    if (!is_served && !core.serve(*this)) return;
    show(service->is_ready ? Why::ready : Why::not_ready);
  }

  std::vector<Thing> make(Core& core, const std::string& its_path) override {
    std::vector<Thing> made;
    Thing& thing = made.emplace_back(its_path);
    describe(thing, listed, {}, {}, "Service");
    std::string success = said_.success;
    if (success.empty() && (type_ == "std_srvs/srv/Trigger" || type_ == "std_srvs/srv/SetBool")) success = "success";
    const auto call = [shared = core.shared(), name = listed.name, type = type_, request = *request_, response = *response_, success](
                          const rdf::Value& in, const model::ResponderBase&, const End& end) {
      Result<std::string> payload = request.encode(in);
      if (!payload) return end(Unexpected{std::move(payload).error()});
      auto pending = std::make_shared<PendingCall>();
      Result<Handle> sent = shared->port->call(
          name, type, *payload,
          [end, response, success, pending](Result<Bytes> bytes) {
            const Handle ended = pending->end();
            if (!bytes) return end(Unexpected{std::move(bytes).error()});
            Result<rdf::Value> value = response.decode(**bytes);
            if (!value) return end(Unexpected{std::move(value).error()});
            if (const rdf::Value* good = success.empty() ? nullptr : member_at(*response.type(), *value, success))
              if (good->boolean() && !*good->boolean()) {
                const std::string words = words_of(*response.type(), *value);
                return end(refused(words.empty() ? "the service says that it did not succeed" : words));
              }
            end(*std::move(value));
          },
          call_timeout);
      if (!sent) return end(Unexpected{std::move(sent).error()});
      pending->keep(*std::move(sent));
      shared->commands.fetch_add(1, std::memory_order_relaxed);
    };
    Action action = add_action(thing, "call", request_->type(), response_->type(), call);
    say(action, said_.titles, said_.descriptions, "Call");
    action.ends_soon().dispatch(Dispatch::io_thread).policy(ActionPolicy::parallel(max_parallel));
    if (said_.requires_expiry) action.requires_expiry();
    thing.control();
    action_ = action;
    actions = 1;
    listed.path = '/' + its_path + "/actions/call";
    listed.as = "Action";
    return made;
  }

 private:
  bool make_types(Core& core, const ServiceInfo& service) {
    Result<std::shared_ptr<const Service>> found = core.service(service.type, service.hash, waits_);
    if (!found) return listed.reason = found.error().message, false;
    if (types_made_ >= max_types) return listed.reason = "its type has changed too often", false;
    const std::size_t before = core.types().count();
    const TypeUse use{Rule::Of::service, listed.name, {}, {}};
    Result<MessageType> request = core.types().make((*found)->request, use);
    Result<MessageType> response = request ? core.types().make((*found)->response, use) : request;
    types_made_ += core.types().count() != before ? 1 : 0;  // two versions that come and go are two
    if (!response) return listed.reason = response.error().message, false;
    request_ = *std::move(request);
    response_ = *std::move(response);
    type_ = service.type;
    hash_ = (*found)->hash;
    return true;
  }

  std::string type_;
  std::optional<MessageType> request_, response_;
};

// --- actions

struct GoalTypes {
  MessageType request, response, feedback;
  std::string progress;
  bool is_trajectory = false;
};

/// How far a goal is, from its feedback.
class ProgressMeter {
 public:
  ProgressMeter(std::shared_ptr<const GoalTypes> types, const rdf::Value& goal) : types_(std::move(types)) {
    if (!types_->is_trajectory) return;
    // The time of the last point of a trajectory is its duration.
    const rdf::Type& record = *types_->request.type();
    const rdf::Type* goal_type = record.fields.empty() ? nullptr : record.fields.back().type;
    if (!goal_type) return;
    const auto trajectory = std::find_if(goal_type->fields.begin(), goal_type->fields.end(), [](const auto& f) { return f.name == "trajectory"; });
    const rdf::Value* points = member_at(*goal_type, goal, "trajectory.points");
    if (trajectory == goal_type->fields.end() || !points || !points->sequence() || points->sequence()->empty()) return;
    for (const rdf::FieldType& f : trajectory->type->fields)
      if (f.name == "points" && f.type->element)
        whole_ = number_of(member(*f.type->element, points->sequence()->back(), "time_from_start")).value_or(0);
  }

  /// @param feedback  the record of the feedback
  std::optional<double> fraction(const rdf::Type& type, const rdf::Value& feedback) {
    if (!types_->progress.empty()) return number_of(member_at(type, feedback, types_->progress));
    if (types_->is_trajectory && whole_ > 0)
      for (const char* path : {"desired.time_from_start", "actual.time_from_start"})
        if (const auto at = number_of(member_at(type, feedback, path))) return *at / whole_;
    for (const char* name : {"progress", "fraction", "completion", "percent_complete", "percent_completed", "percentage"})
      if (const auto n = number_of(member(type, feedback, name))) return name[0] == 'p' && name[1] == 'e' ? *n / 100 : *n;
    for (const char* name : {"distance_remaining", "estimated_time_remaining", "time_remaining"})
      if (const auto left = number_of(member(type, feedback, name)); left && std::isfinite(*left) && *left >= 0) {
        most_ = std::max(most_, *left);
        return most_ > 0 ? 1 - *left / most_ : 0;
      }
    return std::nullopt;
  }

 private:
  std::shared_ptr<const GoalTypes> types_;
  double whole_ = 0, most_ = 0;
};

/// A goal that runs. Used by the thread of the graph and by hooks of the server.
struct RunningGoal {
  std::mutex mutex;
  std::shared_ptr<SentGoal> goal;  ///< null: it is not sent yet, or has ended
  bool is_cancelled = false, has_ended = false;

  void cancel() {
    std::shared_ptr<SentGoal> sent;
    {
      const std::lock_guard lock(mutex);
      is_cancelled = true;
      sent = goal;
    }
    if (sent) sent->cancel();
  }
};

/// The newest feedback of an action.
struct FeedbackOutput {
  std::mutex mutex;
  PushedProperty<RosValue> property;
  std::shared_ptr<const PayloadReader> reader;
  bool is_made = false;
  void publish(const Bytes& payload) {
    const std::lock_guard lock(mutex);
    if (!is_made) return;
    RosValue value;
    value.payload = payload;
    value.reader = reader;
    property.publish(value);
  }
};

class ActionPart final : public CallPart {
 public:
  ActionPart(Core& core, const std::string& name) : CallPart(Listed{Listed::What::action, name, {}, {}, {}, {}, {}}) {
    wanted_path = core.path_of(name);
    suffix = "_action";
  }

  void update(Core& core, const ActionInfo* action) {
    waits_ = false;
    if (!action) return show(Why::gone);
    listed.nodes = action->nodes;
    listed.type = action->type;
    is_allowed_ = core.is_allowed(core.options().allowed.actions, listed.name);
    said_ = said_of(core.rules(), Rule::Of::action, listed.name, action->type);
    if (!is_allowed_ || said_.hidden) {
      is_available = true;
      listed.reason = said_.hidden ? "the mapping hides it" : "not allowed";
      return;
    }
    if (!types_ || action->type != type_) {
      if (!make_types(core, *action)) {
        if (action_) set_available(*action_, Why::other_type);
        return;
      }
      if (is_served) core.renew(*this);
    }
    if (!is_served && !core.serve(*this)) return;
    show(action->is_ready ? Why::ready : Why::not_ready);
  }

  std::vector<Thing> make(Core& core, const std::string& its_path) override {
    std::vector<Thing> made;
    Thing& thing = made.emplace_back(its_path);
    describe(thing, listed, {}, {}, "Action");
    const rdf::DynamicType feedback_type = feedback_->type();
    auto output = std::make_shared<FeedbackOutput>();
    if (!feedback_type->fields.empty()) {
      output->property = thing.pushed<RosValue>("feedback", feedback_type);
      output->property.title("Feedback", "en")
          .description("What the running goal has reported last.", "en")
          .every_sample()
          .dispatch(Dispatch::io_thread);
      output->reader = std::make_shared<MessageReader>(types_->feedback, core.shared(), core.options().limits.max_value_bytes, true);
      output->is_made = true;
      output->property.publish(RosValue::none("no goal has reported anything yet"));
      properties = 1;
    }
    const auto send = [shared = core.shared(), name = listed.name, type = type_, types = types_, output](const rdf::Value& in, const auto& responder,
                                                                                                         const End& end) {
      send_goal(*shared, name, type, types, output, in, responder, end);
    };
    Action action = add_action(thing, "send_goal", goal_->type(), result_->type(), send);
    say(action, said_.titles, said_.descriptions, "Send a goal");
    action.dispatch(Dispatch::io_thread).policy(ActionPolicy::parallel(max_parallel));
    if (said_.requires_expiry) action.requires_expiry();
    thing.control();
    action_ = action;
    actions = 1;
    listed.path = '/' + its_path + "/actions/send_goal";
    listed.as = "Action";
    return made;
  }

 private:
  static void send_goal(Shared& shared, const std::string& name, const std::string& type, const std::shared_ptr<const GoalTypes>& types,
                        const std::shared_ptr<FeedbackOutput>& output, const rdf::Value& in, const model::ResponderBase& responder, const End& end) {
    Result<std::string> payload = types->request.encode(rdf::Value(rdf::Value::Sequence{in}));
    if (!payload) return end(Unexpected{std::move(payload).error()});
    auto running = std::make_shared<RunningGoal>();
    auto meter = std::make_shared<ProgressMeter>(types, in);
    GoalEvents events;
    events.feedback = [types, output, meter, responder](const Bytes& feedback) {
      output->publish(feedback);
      if (feedback->size() > 256 * 1024) return;  // no measure is worth that
      const Result<rdf::Value> value = types->feedback.decode(*feedback);
      if (!value || !value->sequence() || value->sequence()->size() != 1) return;
      const rdf::Type& record = *types->feedback.type()->fields.front().type;
      if (const std::optional<double> done = meter->fraction(record, value->sequence()->front())) responder.progress(*done);
    };
    events.ended = [types, running, end](Result<Bytes> response, GoalStatus status) {
      {
        const std::lock_guard lock(running->mutex);
        running->has_ended = true;
      }
      end(outcome_of(*types, std::move(response), status));
      std::shared_ptr<SentGoal> ended;
      const std::lock_guard lock(running->mutex);
      ended.swap(running->goal);
    };
    Result<std::shared_ptr<SentGoal>> sent = shared.port->send_goal(name, type, *payload, std::move(events));
    if (!sent) return end(Unexpected{std::move(sent).error()});
    shared.commands.fetch_add(1, std::memory_order_relaxed);
    bool is_cancelled = false;
    {
      const std::lock_guard lock(running->mutex);
      if (!running->has_ended) running->goal = *sent;
      is_cancelled = running->is_cancelled;
    }
    if (is_cancelled) (*sent)->cancel();
    responder.on_cancel([running] { running->cancel(); });
  }

  static Result<rdf::Value> outcome_of(const GoalTypes& types, Result<Bytes> response, GoalStatus status) {
    if (!response) return Unexpected{std::move(response).error()};
    Result<rdf::Value> value = types.response.decode(**response);
    if (!value) return value;
    const rdf::Type& record = *types.response.type();
    const rdf::Value* result = member(record, *value, "result");
    if (!result) return unexpected(Errc::expected_value, "the response has no result");
    if (status == GoalStatus::succeeded) return rdf::Value(*result);
    const rdf::Type* result_type = nullptr;
    for (const rdf::FieldType& f : record.fields)
      if (f.name == "result") result_type = f.type;
    const std::string words = result_type ? words_of(*result_type, *result) : std::string();
    if (status == GoalStatus::canceled) return unexpected(Errc::cancelled, "the goal was cancelled" + (words.empty() ? "" : ": " + words));
    return unexpected(Errc::failed, "the robot aborted the goal" + (words.empty() ? "" : ": " + words));
  }

  bool make_types(Core& core, const ActionInfo& action) {
    Result<std::shared_ptr<const ActionDefinition>> found = core.action(action.type, waits_);
    if (!found) return listed.reason = found.error().message, false;
    if (types_made_ >= max_types) return listed.reason = "its type has changed too often", false;
    const std::size_t before = core.types().count();
    const ActionDefinition& d = **found;
    const TypeUse use{Rule::Of::action, listed.name, {}, {}};
    // Rules speak of what the author of the action wrote.
    const TypeUse in_request{Rule::Of::action, listed.name, {"goal_id"}, "goal"};
    const TypeUse in_response{Rule::Of::action, listed.name, {}, "result"};
    const TypeUse in_feedback{Rule::Of::action, listed.name, {"goal_id"}, "feedback"};
    Result<MessageType> goal = core.types().make(d.goal, use);
    Result<MessageType> result = goal ? core.types().make(d.result, use) : goal;
    Result<MessageType> feedback = result ? core.types().make(d.feedback, use) : result;
    Result<MessageType> request = feedback ? core.types().make(d.send_goal_request, in_request) : feedback;
    Result<MessageType> response = request ? core.types().make(d.get_result_response, in_response) : request;
    Result<MessageType> feedback_message = response ? core.types().make(d.feedback_message, in_feedback) : response;
    types_made_ += core.types().count() != before ? 1 : 0;
    if (!feedback_message) return listed.reason = feedback_message.error().message, false;
    goal_ = *std::move(goal);
    result_ = *std::move(result);
    feedback_ = *std::move(feedback);
    types_ = std::make_shared<const GoalTypes>(GoalTypes{*std::move(request), *std::move(response), *std::move(feedback_message), said_.progress,
                                                         action.type == "control_msgs/action/FollowJointTrajectory"});
    type_ = action.type;
    return true;
  }

  std::string type_;
  std::optional<MessageType> goal_, result_, feedback_;
  std::shared_ptr<const GoalTypes> types_;
};

}  // namespace

void update_service(Core& core, const std::string& name, const ServiceInfo* service) {
  core.part_of<ServicePart>("service " + name, core, name).update(core, service);
}
void update_action(Core& core, const std::string& name, const ActionInfo* action) {
  core.part_of<ActionPart>("action " + name, core, name).update(core, action);
}

}  // namespace lrt::ros2
