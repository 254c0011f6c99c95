// SPDX-License-Identifier: Apache-2.0
// A graph of ROS 2 without DDS, for tests of the bridge.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/ros2/definitions.hpp>
#include <lrt/ros2/graph.hpp>
#include <lrt/ros2/message_type.hpp>

#include "src/ros2/bridge/port.hpp"

namespace lrt::test {

/// Who is there is said by the test; sinks and callbacks run on its thread.
class FakeGraph final : public ros2::Port {
 public:
  struct Subscribed {
    std::string topic, type;
    ros2::SubscribeOptions options;
    ros2::Sink sink;
  };
  struct Written {
    std::string topic, payload;
  };
  struct Called {
    std::string service, type, request;
    UniqueFunction<void(Result<Bytes>)> done;
  };
  struct Goal {
    std::string action, type, request;
    ros2::GoalEvents events;
    std::atomic<bool> is_cancelled{false};
  };

  // --- what the test says

  ros2::Topic& topic(const std::string& name) { return of(now_.topics, name); }
  void write(const std::string& name, const std::string& type, const std::string& node, const std::string& hash = {}) {
    const std::lock_guard lock(mutex);
    ros2::Endpoint e;
    e.node = node;
    e.type = type;
    e.hash = hash;
    topic(name).writers.push_back(e);
  }
  void read(const std::string& name, const std::string& type, const std::string& node) {
    const std::lock_guard lock(mutex);
    ros2::Endpoint e;
    e.node = node;
    e.type = type;
    topic(name).readers.push_back(e);
  }
  void serve(const std::string& name, const std::string& type, const std::string& node, bool is_ready = true) {
    const std::lock_guard lock(mutex);
    ros2::ServiceInfo& s = of(now_.services, name);
    s.type = type;
    s.nodes = {node};
    s.is_ready = is_ready;
    s.form = is_ready ? ros2::IdentityForm::header : ros2::IdentityForm::unknown;
  }
  void act(const std::string& name, const std::string& type, const std::string& node) {
    const std::lock_guard lock(mutex);
    ros2::ActionInfo& a = of(now_.actions, name);
    a.type = type;
    a.nodes = {node};
    a.is_ready = true;
  }
  void join(const std::string& name, bool has_parameters, bool has_lifecycle = false) {
    const std::lock_guard lock(mutex);
    ros2::NodeInfo& n = of(now_.nodes, name);
    n.has_parameters = has_parameters;
    n.has_lifecycle = has_lifecycle;
  }
  /// Everything of a node is gone.
  void leave(const std::string& node) {
    const std::lock_guard lock(mutex);
    const auto of_node = [&](const ros2::Endpoint& e) { return e.node == node; };
    for (ros2::Topic& t : now_.topics)
      for (auto* all : {&t.writers, &t.readers}) all->erase(std::remove_if(all->begin(), all->end(), of_node), all->end());
    const auto serves = [&](const auto& s) { return s.nodes == std::vector<std::string>{node}; };
    now_.topics.erase(std::remove_if(now_.topics.begin(), now_.topics.end(), [](const auto& t) { return t.writers.empty() && t.readers.empty(); }),
                      now_.topics.end());
    now_.services.erase(std::remove_if(now_.services.begin(), now_.services.end(), serves), now_.services.end());
    now_.actions.erase(std::remove_if(now_.actions.begin(), now_.actions.end(), serves), now_.actions.end());
    now_.nodes.erase(std::remove_if(now_.nodes.begin(), now_.nodes.end(), [&](const auto& n) { return n.name == node; }), now_.nodes.end());
  }
  /// Tells the bridge what was said.
  void announce() {
    UniqueFunction<void()>* f = nullptr;
    {
      const std::lock_guard lock(mutex);
      ++now_.version;
      seen_ = std::make_shared<const ros2::GraphSnapshot>(now_);
      f = changed_ ? &changed_ : nullptr;
    }
    if (f) (*f)();
  }
  /// Passes a sample to all that read the topic.
  /// @return  how many there are
  std::size_t publish(const std::string& name, std::string payload, std::chrono::system_clock::time_point source = {}) {
    std::vector<std::shared_ptr<Subscribed>> all;
    {
      const std::lock_guard lock(mutex);
      for (const auto& weak : subscribed_)
        if (const auto s = weak.lock(); s && s->topic == name) all.push_back(s);
    }
    const auto bytes = std::make_shared<const std::string>(std::move(payload));
    for (const auto& s : all) s->sink(ros2::Sample{bytes, source, {}, {}});
    return all.size();
  }
  std::size_t subscriptions(const std::string& name) const {
    const std::lock_guard lock(mutex);
    std::size_t count = 0;
    for (const auto& weak : subscribed_)
      if (const auto s = weak.lock(); s && s->topic == name) ++count;
    return count;
  }
  std::vector<Written> written() const {
    const std::lock_guard lock(mutex);
    return written_;
  }
  std::optional<Called> take_call() {
    const std::lock_guard lock(mutex);
    if (calls_.empty()) return std::nullopt;
    Called first = std::move(calls_.front());
    calls_.erase(calls_.begin());
    return first;
  }
  std::shared_ptr<Goal> goal() const {
    const std::lock_guard lock(mutex);
    return goals_.empty() ? nullptr : goals_.back();
  }

  mutable std::mutex mutex;
  std::map<std::string, std::vector<ros2::Parameter>> parameters_of;                      ///< by node
  std::function<Result<void>(const std::string& node, const ros2::Parameter& p)> setter;  ///< empty: all are taken
  std::function<Result<void>(const std::string& type, ros2::Definitions& to)> describer;  ///< empty: nobody describes types
  std::map<std::string, std::size_t> readers;                                             ///< of topics that are written
  std::size_t descriptions = 0;
  UniqueFunction<void(std::string_view, std::vector<ros2::Parameter>, std::vector<std::string>)> parameter_event;

  // --- Port

  std::shared_ptr<const ros2::GraphSnapshot> snapshot() const override {
    const std::lock_guard lock(mutex);
    return seen_;
  }
  void on_change(UniqueFunction<void()> f) override {
    const std::lock_guard lock(mutex);
    changed_ = std::move(f);
  }
  Result<ros2::Handle> subscribe(std::string_view topic, std::string_view type, ros2::Sink sink, const ros2::SubscribeOptions& options) override {
    auto made = std::make_shared<Subscribed>(Subscribed{std::string(topic), std::string(type), options, std::move(sink)});
    const std::lock_guard lock(mutex);
    subscribed_.push_back(made);
    return ros2::Handle(made);
  }
  Result<std::shared_ptr<ros2::TopicWriter>> advertise(std::string_view topic, std::string_view, const ros2::AdvertiseOptions&) override {
    struct Writer final : ros2::TopicWriter {
      Writer(FakeGraph& g, std::string t) : graph(g), name(std::move(t)) {}
      Result<void> publish(std::string_view payload) const override {
        const std::lock_guard lock(graph.mutex);
        graph.written_.push_back({name, std::string(payload)});
        return {};
      }
      std::size_t readers() const noexcept override {
        const std::lock_guard lock(graph.mutex);
        return graph.readers[name];
      }
      FakeGraph& graph;
      std::string name;
    };
    return std::shared_ptr<ros2::TopicWriter>(std::make_shared<Writer>(*this, std::string(topic)));
  }
  Result<ros2::Handle> call(std::string_view service, std::string_view type, std::string_view request, UniqueFunction<void(Result<Bytes>)> done,
                            std::chrono::milliseconds) override {
    const std::lock_guard lock(mutex);
    calls_.push_back({std::string(service), std::string(type), std::string(request), std::move(done)});
    return ros2::Handle(std::make_shared<int>());
  }
  Result<std::shared_ptr<ros2::SentGoal>> send_goal(std::string_view action, std::string_view type, std::string_view request,
                                                    ros2::GoalEvents events) override {
    struct Sent final : ros2::SentGoal {
      explicit Sent(std::weak_ptr<Goal> g) : goal(std::move(g)) {}
      void cancel() const override {
        if (const auto g = goal.lock()) g->is_cancelled = true;
      }
      std::weak_ptr<Goal> goal;
    };
    auto made = std::make_shared<Goal>();
    made->action = action;
    made->type = type;
    made->request = request;
    made->events = std::move(events);
    const std::lock_guard lock(mutex);
    goals_.push_back(made);
    return std::shared_ptr<ros2::SentGoal>(std::make_shared<Sent>(made));
  }
  Result<ros2::Handle> parameters(std::string_view node, UniqueFunction<void(Result<std::vector<ros2::Parameter>>)> done, std::size_t max) override {
    std::vector<ros2::Parameter> all;
    {
      const std::lock_guard lock(mutex);
      all = parameters_of[std::string(node)];
    }
    if (all.size() > max) all.resize(max);
    done(std::move(all));
    return ros2::Handle(std::make_shared<int>());
  }
  Result<ros2::Handle> set_parameter(std::string_view node, const ros2::Parameter& p, UniqueFunction<void(Result<void>)> done,
                                     std::chrono::milliseconds) override {
    done(setter ? setter(std::string(node), p) : Result<void>());
    return ros2::Handle(std::make_shared<int>());
  }
  Result<ros2::Handle> parameter_events(UniqueFunction<void(std::string_view, std::vector<ros2::Parameter>, std::vector<std::string>)> f) override {
    const std::lock_guard lock(mutex);
    parameter_event = std::move(f);
    return ros2::Handle(std::make_shared<int>());
  }
  Result<ros2::Handle> request_definition(std::string_view type, std::string_view, ros2::Definitions& definitions,
                                          UniqueFunction<void(Result<void>)> done) override {
    ++descriptions;
    done(describer ? describer(std::string(type), definitions) : unexpected(Errc::unavailable, "no node describes it"));
    return ros2::Handle(std::make_shared<int>());
  }
  ros2::GraphCounters counters() const override { return {}; }
  /// Callbacks refer to the bridge, and the bridge to this.
  void close() override {
    const std::lock_guard lock(mutex);
    calls_.clear();
    goals_.clear();
    parameter_event = {};
  }

 private:
  template <class T>
  static T& of(std::vector<T>& all, const std::string& name) {
    for (auto at = all.begin();; ++at) {
      if (at != all.end() && at->name == name) return *at;
      if (at != all.end() && at->name < name) continue;
      T made;
      made.name = name;
      return *all.insert(at, std::move(made));
    }
  }

  ros2::GraphSnapshot now_;
  std::shared_ptr<const ros2::GraphSnapshot> seen_ = std::make_shared<const ros2::GraphSnapshot>();
  UniqueFunction<void()> changed_;
  std::vector<std::weak_ptr<Subscribed>> subscribed_;
  std::vector<Written> written_;
  std::vector<Called> calls_;
  std::vector<std::shared_ptr<Goal>> goals_;
};

}  // namespace lrt::test
