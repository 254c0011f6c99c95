// SPDX-License-Identifier: Apache-2.0
// A node: a Thing with its parameters, and with the state and the transitions of a lifecycle node.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include <lrt/rdf/dynamic_type.hpp>

#include "src/ros2/bridge/core.hpp"

namespace lrt::ros2 {
namespace {

using std::chrono::milliseconds;

/// A node has so much time to take a parameter, where lambdas may wait, and where the host's loop waits with them.
constexpr milliseconds set_timeout{5'000}, set_timeout_in_poll{500};
constexpr std::chrono::seconds node_timeout{10};
constexpr unsigned max_renewals = 16;  ///< at once; one more each minute

/// The states of a node, lifecycle_msgs/msg/State, and a name for each.
constexpr std::pair<int, std::string_view> states[] = {
    {0, "unknown"},     {1, "unconfigured"},  {2, "inactive"},    {3, "active"},        {4, "finalized"},        {10, "configuring"},
    {11, "cleaningup"}, {12, "shuttingdown"}, {13, "activating"}, {14, "deactivating"}, {15, "errorprocessing"},
};
/// The transitions that can be requested: in which state, and their number.
struct Transition {
  std::string_view name;
  int from;
  int id;
};
constexpr Transition transitions[] = {
    {"configure", 1, 1}, {"cleanup", 2, 2}, {"activate", 2, 3}, {"deactivate", 3, 4}, {"shutdown", 1, 5}, {"shutdown", 2, 6}, {"shutdown", 3, 7},
};
constexpr std::string_view transition_names[] = {"configure", "activate", "deactivate", "cleanup", "shutdown"};

/// The type of a parameter's values.
rdf::DynamicType type_of(ParameterType type) {
  const auto list = [](rdf::DynamicType element) { return rdf::DynamicType::list(element).value_or(rdf::DynamicType()); };
  switch (type) {
    case ParameterType::boolean: return rdf::DynamicType::of<bool>();
    case ParameterType::integer: return rdf::DynamicType::of<std::int64_t>();
    case ParameterType::real: return rdf::DynamicType::of<double>();
    case ParameterType::text: return rdf::DynamicType::of<std::string>();
    case ParameterType::bytes: return rdf::DynamicType::base64();
    case ParameterType::booleans: return list(rdf::DynamicType::of<bool>());
    case ParameterType::integers: return list(rdf::DynamicType::of<std::int64_t>());
    case ParameterType::reals: return list(rdf::DynamicType::of<double>());
    case ParameterType::texts: return list(rdf::DynamicType::of<std::string>());
    default: return {};
  }
}
std::string_view name_of(ParameterType type) noexcept {
  constexpr std::string_view names[] = {"not set",    "bool",       "integer",       "double",       "string",
                                        "byte_array", "bool_array", "integer_array", "double_array", "string_array"};
  const auto i = static_cast<std::size_t>(type);
  return i < std::size(names) ? names[i] : "unknown";
}

/// Whether a name can be the path of a Property.
bool is_path(std::string_view name) noexcept {
  if (!is_clean_name(name)) return false;
  while (true) {
    const std::size_t end = name.find('/');
    const std::string_view segment = name.substr(0, end);
    if (segment.empty() || segment == "." || segment == "..") return false;
    if (end == std::string_view::npos) return true;
    name.remove_prefix(end + 1);
  }
}

/// Waits for a node's response on the thread of a lambda.
struct Waiting {
  std::mutex mutex;
  std::condition_variable arrived;
  std::optional<Result<void>> result;
};

std::string number_text(double n) {
  char text[32];
  (void)std::snprintf(text, sizeof text, "%.10g", n);
  return text;
}

class NodePart final : public Part {
 public:
  NodePart(Core& core, const std::string& name) : Part(Listed{Listed::What::node, name, {}, {name}, {}, {}, {}}) {
    wanted_path = core.path_of("nodes" + name);
    suffix = "_node";
  }

  bool is_waiting() const override { return is_reading_ || is_asking_; }

  void update(Core& core, const NodeInfo* node) {
    if (!node) {
      if (std::exchange(is_available, false) || !is_gone_) lose("the node " + listed.name + " is gone");
      is_gone_ = true;
      participant_ = {};
      call_.reset(), state_call_.reset(), events_.reset();
      is_reading_ = is_asking_ = false;
      return;
    }
    const bool is_new =
        is_gone_ || node->participant != participant_ || node->has_parameters != has_parameters_ || node->has_lifecycle != has_lifecycle_;
    is_gone_ = false;
    participant_ = node->participant;
    has_parameters_ = node->has_parameters;
    has_lifecycle_ = node->has_lifecycle;
    if (!node->has_parameters && !node->has_lifecycle) {
      is_available = true;
      listed.reason = "it has neither parameters nor a lifecycle";
      if (is_served) lose(listed.reason);
      return;
    }
    if (is_new) attempts_ = 0, is_known_ = false, next_ = {};
    if (node->has_lifecycle && (is_new || !events_)) watch_lifecycle(core);
    if (node->has_parameters && !is_known_ && !is_reading_) read_parameters(core);
    if (!node->has_parameters) is_known_ = true;
    if (!is_known_ || !core.serve(*this)) return;
    is_available = true;
    listed.reason.clear();
  }

  /// Events of it were lost.
  void read_again() {
    if (is_gone_) return;
    is_known_ = false;
    attempts_ = 0, next_ = {};
    events_.reset();  // it is subscribed again, and the state is requested
  }

  void change(Core& core, std::vector<Parameter> changed, const std::vector<std::string>& deleted) {
    bool is_other = false;
    for (Parameter& p : changed) {
      const auto known = std::find_if(parameters_.begin(), parameters_.end(), [&](const Parameter& k) { return k.name == p.name; });
      if (known == parameters_.end() || known->type != p.type) is_other = true;
      else known->value = std::move(p.value), publish(known->name, known->value);
    }
    for (const std::string& name : deleted)
      if (const auto found = outputs_.find(name); found != outputs_.end())
        found->second.publish(RosValue::none("the node has deleted the parameter")), is_other = true;
    if (!is_other || !is_known_) return;
    is_known_ = false;  // descriptors of new ones, and types that have changed
    attempts_ = 0, next_ = {};
    core.mark_changed();
  }

  std::vector<Thing> make(Core& core, const std::string& its_path) override {
    std::vector<Thing> made;
    Thing& thing = made.emplace_back(its_path);
    listed.as = "Thing";
    describe(thing, listed, {}, {}, "Node");
    outputs_.clear();
    bool has_commands = false;
    more.clear();
    for (const Parameter& p : parameters_) {
      Listed& one =
          more.emplace_back(Listed{Listed::What::parameter, listed.name + ':' + p.name, std::string(name_of(p.type)), {listed.name}, {}, {}, {}});
      const bool is_writable = make_parameter(core, thing, p);
      has_commands = has_commands || is_writable;
      if (outputs_.count(p.name) == 0) {
        one.reason = "it has no value, or the mapping hides it";
        continue;
      }
      one.path = '/' + its_path + "/parameters/" + p.name;
      one.as = is_writable ? "writable Property" : "Property";
      if (p.read_only) one.reason = "the node does not let it be set";
    }
    if (has_lifecycle_) has_commands = make_lifecycle(core, thing) || has_commands;
    if (has_commands) thing.control();
    listed.path = '/' + its_path;
    properties = outputs_.size() + (has_lifecycle_ ? 1 : 0);
    actions = transitions_.size();
    return made;
  }

  void was_served(Core&) override {
    for (const Parameter& p : parameters_) publish(p.name, p.value);
    publish_state();
  }

  void parameters_read(Core& core, Result<std::vector<Parameter>> read) {
    is_reading_ = false;
    call_.reset();
    if (is_gone_) return;
    if (!read) {
      listed.reason = "its parameters cannot be read: " + read.error().message;
      next_ = Core::Clock::now() + std::chrono::seconds(std::min(60, 2 << std::min(attempts_, 5U)));
      core.wake_at(next_);
      if (attempts_ >= 2 && has_lifecycle_) is_known_ = true;
      core.mark_changed();
      return;
    }
    is_known_ = true;
    is_available = true;
    listed.reason.clear();
    const bool is_same =
        is_served && std::equal(read->begin(), read->end(), parameters_.begin(), parameters_.end(), [](const Parameter& a, const Parameter& b) {
          const auto range = [](const Parameter& p) { return p.range.value_or(Parameter::Range{NAN, NAN, NAN}); };
          const auto equal = [](double x, double y) { return x == y || (std::isnan(x) && std::isnan(y)); };
          return a.name == b.name && a.type == b.type && a.read_only == b.read_only && a.description == b.description &&
                 a.constraints == b.constraints && equal(range(a).from, range(b).from) && equal(range(a).to, range(b).to) &&
                 equal(range(a).step, range(b).step);
        });
    parameters_ = *std::move(read);
    if (is_same) {
      for (const Parameter& p : parameters_) publish(p.name, p.value);
      publish_state();
    } else if (is_served) {
      const Core::Clock::time_point now = Core::Clock::now();
      const auto passed = std::chrono::duration_cast<std::chrono::minutes>(now - renewals_at_).count();
      renewals_ -= static_cast<unsigned>(std::min<std::int64_t>(renewals_, passed));
      if (passed > 0) renewals_at_ = now;
      if (renewals_ >= max_renewals) {
        listed.reason = "its parameters change too often";
      } else {
        ++renewals_;
        core.renew(*this);
      }
    }
    core.mark_changed();
  }

  void state_came(Core& core, int id) {
    is_asking_ = false;
    if (is_gone_) return;
    lifecycle_ = id;
    publish_state();
    core.mark_changed();
  }

 private:
  void publish(const std::string& name, const rdf::Value& value) {
    if (const auto found = outputs_.find(name); found != outputs_.end())
      found->second.publish(value.is_null() ? RosValue::none("the parameter is not set") : RosValue::of(value));
  }
  void lose(const std::string& why) {
    listed.reason = why;
    for (auto& [name, property] : outputs_) property.publish(RosValue::none(why));
    if (state_) state_->publish(RosValue::none(why));
    for (auto& [name, action] : transitions_) action.available(false, "the node is gone");
  }

  void read_parameters(Core& core) {
    if (Core::Clock::now() < next_) return core.wake_at(next_);
    ++attempts_;
    is_reading_ = true;
    Result<Handle> call = core.port().parameters(
        listed.name,
        [shared = core.shared(), &core, key = "node " + listed.name](Result<std::vector<Parameter>> read) {
          shared->put([&core, key, read = std::move(read)]() mutable {
            if (Part* const part = core.find(key)) static_cast<NodePart*>(part)->parameters_read(core, std::move(read));
          });
        },
        core.options().limits.max_parameters);
    if (call) call_ = *std::move(call);
    else parameters_read(core, Unexpected{std::move(call).error()});
  }

  /// @return  whether clients can set it
  bool make_parameter(Core& core, Thing& thing, const Parameter& p) {
    const rdf::DynamicType type = type_of(p.type);
    if (!type || !is_path(p.name) || outputs_.count(p.name) != 0) return false;
    const std::string full = listed.name + ':' + p.name;
    const Said said = said_of(core.rules(), Rule::Of::parameter, full, {});
    if (said.hidden) return false;
    const bool is_number =
        p.type == ParameterType::integer || p.type == ParameterType::real || p.type == ParameterType::integers || p.type == ParameterType::reals;
    PushedProperty<RosValue> property = thing.pushed<RosValue>("parameters/" + p.name, type);
    std::string words = words_for_people(p.description);
    if (const std::string constraints = words_for_people(p.constraints); !constraints.empty()) words += (words.empty() ? "" : " ") + constraints;
    rdf::Facets facets;
    if (is_number) {
      if (said.value.unit) facets.unit(*said.value.unit);
      if (p.range && std::isfinite(p.range->from)) facets.at_least(p.range->from);
      if (p.range && std::isfinite(p.range->to)) facets.at_most(p.range->to);
      if (said.value.min) facets.at_least(std::max(*said.value.min, facets.min().value_or(*said.value.min)));
      if (said.value.max) facets.at_most(std::min(*said.value.max, facets.max().value_or(*said.value.max)));
      if (p.range && p.range->step > 0) words += (words.empty() ? "" : " ") + ("In steps of " + number_text(p.range->step) + ".");
    }
    property.facets(facets);
    say(property, said.titles, said.descriptions, p.name);
    if (said.descriptions.empty() && !words.empty()) property.description(words);
    if (!said.value.term.empty()) property.predicate(Iri(said.value.term));
    outputs_.emplace(p.name, property);
    if (p.read_only || !core.is_allowed(core.options().allowed.parameters, full)) return property.dispatch(Dispatch::io_thread), false;
    const milliseconds timeout = core.has_executor() ? set_timeout : set_timeout_in_poll;
    property.dispatch(core.has_executor() ? Dispatch::executor : Dispatch::as_server);
    property.on_write([shared = core.shared(), node = listed.name, name = p.name, type = p.type, timeout, step = p.range ? p.range->step : 0,
                       from = p.range ? p.range->from : 0](const RosValue& v) -> Result<void> {
      Parameter to;
      to.name = name;
      to.type = type;
      to.value = v.value ? *v.value : rdf::Value();
      if (step > 0) {
        const double n = to.value.real() ? *to.value.real() : to.value.integer() ? static_cast<double>(*to.value.integer()) : 0;
        const double steps = (n - from) / step;
        if (std::abs(steps - std::round(steps)) > 1e-6)
          return unexpected(Errc::out_of_range, "the parameter " + name + " has steps of " + number_text(step) + " from " + number_text(from));
      }
      const auto waiting = std::make_shared<Waiting>();
      const Result<Handle> call = shared->port->set_parameter(
          node, to,
          [waiting](Result<void> result) {
            {
              const std::lock_guard lock(waiting->mutex);
              waiting->result = std::move(result);
            }
            waiting->arrived.notify_one();
          },
          timeout);
      if (!call) return Unexpected{call.error()};
      std::unique_lock lock(waiting->mutex);
      if (!waiting->arrived.wait_for(lock, timeout + milliseconds(200), [&] { return waiting->result.has_value(); }))
        return unexpected(Errc::unavailable, "the node " + node + " has not responded: the parameter may have been set");
      if (*waiting->result) shared->commands.fetch_add(1, std::memory_order_relaxed);
      return *waiting->result;
    });
    return true;
  }

  // --- lifecycle

  void watch_lifecycle(Core& core) {
    const std::string key = "node " + listed.name;
    const Result<std::shared_ptr<const Service>> get = core.definitions().service("lifecycle_msgs/srv/GetState");
    const Result<MessagePtr> event = core.definitions().message("lifecycle_msgs/msg/TransitionEvent");
    if (!get || !event) return;
    const Result<MessageType> request = MessageType::of((*get)->request), response = MessageType::of((*get)->response),
                              came = MessageType::of(*event);
    if (!request || !response || !came) return;
    if (const Result<MessageType::Place> place = came->place("goal_state.id")) {
      Result<Handle> events = core.port().subscribe(
          listed.name + "/transition_event", "lifecycle_msgs/msg/TransitionEvent",
          [shared = core.shared(), &core, key, type = *came, at = *place](Sample&& sample) {
            const std::optional<std::int64_t> id = sample.payload ? type.integer(*sample.payload, at) : std::nullopt;
            if (id) put_state(shared, core, key, static_cast<int>(*id));
          },
          SubscribeOptions{{}, 10, std::chrono::nanoseconds(0)});
      if (events) events_ = *std::move(events);
    }
    const Result<MessageType::Place> place = response->place("current_state.id");
    if (!place) return;
    is_asking_ = true;
    Result<Handle> call = core.port().call(
        listed.name + "/get_state", "lifecycle_msgs/srv/GetState", request->initial(),
        [shared = core.shared(), &core, key, type = *response, at = *place](const Result<Bytes>& bytes) {
          const std::optional<std::int64_t> id = bytes ? type.integer(**bytes, at) : std::nullopt;
          put_state(shared, core, key, id ? static_cast<int>(*id) : 0);
        },
        node_timeout);
    if (call) state_call_ = *std::move(call);
    else is_asking_ = false;
  }
  static void put_state(const std::shared_ptr<Shared>& shared, Core& core, const std::string& key, int id) {
    shared->put_event(key.size(), [&core, key, id] {
      if (Part* const part = core.find(key)) static_cast<NodePart*>(part)->state_came(core, id);
    });
  }

  void publish_state() {
    if (!state_) return;
    const auto known = std::find_if(std::begin(states), std::end(states), [this](const auto& s) { return s.first == lifecycle_; });
    state_->publish(RosValue::of(rdf::Value(std::string(known == std::end(states) ? "unknown" : known->second))));
    for (auto& [name, action] : transitions_) {
      const bool is_possible = std::any_of(std::begin(transitions), std::end(transitions),
                                           [&, n = std::string_view(name)](const Transition& t) { return t.name == n && t.from == lifecycle_; });
      if (is_possible) action.available(true);
      else action.available(false, "the state of the node has no such transition");
    }
  }

  /// @return  whether clients can request transitions
  bool make_lifecycle(Core& core, Thing& thing) {
    std::vector<std::string> names;
    for (const auto& [id, name] : states) names.emplace_back(name);
    const Result<rdf::DynamicType> type = rdf::DynamicType::enumeration(std::move(names));
    if (!type) return false;
    state_ = thing.pushed<RosValue>("lifecycle", *type);
    state_->title("State of the node", "en").description("Its state in the lifecycle of ROS 2.", "en").dispatch(Dispatch::io_thread);
    transitions_.clear();
    if (!core.is_allowed(core.options().allowed.lifecycle, listed.name)) return false;
    const Result<std::shared_ptr<const Service>> change = core.definitions().service("lifecycle_msgs/srv/ChangeState");
    if (!change) return false;
    const Result<MessageType> request = MessageType::of((*change)->request), response = MessageType::of((*change)->response);
    const Result<MessageType::Place> success = response ? response->place("success") : Unexpected{response.error()};
    if (!request || !success) return false;
    for (const std::string_view name : transition_names) {
      Action action = thing.action(name, [shared = core.shared(), &core, key = "node " + listed.name, node = listed.name, name = std::string(name),
                                          request = *request, response = *response, at = *success](const Responder& done) {
        shared->put([shared, &core, key, node, name, request, response, at, done] {
          Part* const part = core.find(key);
          if (!part) return done.fail(Error{Errc::closed, "the bridge is closed"});
          static_cast<NodePart*>(part)->transition(core, name, request, response, at, done);
        });
      });
      action.ends_soon().dispatch(Dispatch::io_thread);
      transitions_.emplace_back(name, action);
    }
    return true;
  }

  void transition(Core& core, const std::string& name, const MessageType& request, const MessageType& response, const MessageType::Place& at,
                  const Responder& done) {
    const auto known =
        std::find_if(std::begin(transitions), std::end(transitions), [&](const Transition& t) { return t.name == name && t.from == lifecycle_; });
    if (known == std::end(transitions)) return done.fail(Error{Errc::refused, "the state of the node has no such transition"});
    using rdf::Value;
    const Result<std::string> payload = request.encode(Value(Value::Sequence{Value(Value::Sequence{Value(std::int64_t{known->id}), Value(name)})}));
    if (!payload) return done.fail(payload.error());
    Result<Handle> call = core.port().call(
        listed.name + "/change_state", "lifecycle_msgs/srv/ChangeState", *payload,
        [done, response, at](const Result<Bytes>& bytes) {
          if (!bytes) return done.fail(bytes.error());
          const std::optional<Found> found = response.find(**bytes, at);
          if (!found || found->bytes.empty()) return done.fail("the response is malformed");
          if (found->bytes[0] != 1) return done.fail(Error{Errc::refused, "the node says that the transition has failed"});
          done.succeed();
        },
        node_timeout);
    if (!call) return done.fail(call.error());
    core.shared()->commands.fetch_add(1, std::memory_order_relaxed);
    transition_calls_[next_call_++ % 4] = *std::move(call);
  }

  Gid participant_{};
  bool is_gone_ = true, has_parameters_ = false, has_lifecycle_ = false;
  bool is_known_ = false, is_reading_ = false, is_asking_ = false;
  unsigned attempts_ = 0, renewals_ = 0;
  Core::Clock::time_point renewals_at_ = Core::Clock::now();
  Core::Clock::time_point next_{};
  Handle call_, state_call_, events_, transition_calls_[4];
  std::size_t next_call_ = 0;
  std::vector<Parameter> parameters_;
  std::map<std::string, PushedProperty<RosValue>> outputs_;
  int lifecycle_ = 0;
  std::optional<PushedProperty<RosValue>> state_;
  std::vector<std::pair<std::string, Action>> transitions_;
};

}  // namespace

void update_node(Core& core, const std::string& name, const NodeInfo* node) { core.part_of<NodePart>("node " + name, core, name).update(core, node); }

void read_again(Part& node) { static_cast<NodePart&>(node).read_again(); }

void change_parameters(Core& core, const std::string& node, std::vector<Parameter> changed, const std::vector<std::string>& deleted) {
  if (Part* const part = core.find("node " + node)) static_cast<NodePart*>(part)->change(core, std::move(changed), deleted);
}

}  // namespace lrt::ros2
