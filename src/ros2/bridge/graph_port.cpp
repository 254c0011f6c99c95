// SPDX-License-Identifier: Apache-2.0
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <utility>

#include "src/ros2/bridge/port.hpp"

namespace lrt::ros2 {
namespace {

class GraphWriter final : public TopicWriter {
 public:
  explicit GraphWriter(Publisher publisher) noexcept : publisher_(std::move(publisher)) {}
  Result<void> publish(std::string_view payload) const override { return publisher_.publish(payload); }
  std::size_t readers() const noexcept override { return publisher_.readers(); }

 private:
  Publisher publisher_;
};

class GraphGoal final : public SentGoal {
 public:
  explicit GraphGoal(Goal goal) noexcept : goal_(std::move(goal)) {}
  void cancel() const override { goal_.cancel(); }

 private:
  Goal goal_;
};

template <class T>
Result<Handle> handle_of(Result<T> made) {
  if (!made) return Unexpected{std::move(made).error()};
  return Handle(std::make_shared<T>(*std::move(made)));
}

}  // namespace

class GraphPort::Impl {
 public:
  explicit Impl(Graph graph) : graph_(std::move(graph)) {}

  /// Calls `f` with the graph, which lives meanwhile.
  template <class F>
  auto with(F f) -> decltype(f(std::declval<Graph&>())) {
    const std::shared_lock lock(mutex_);
    if (!graph_) return unexpected(Errc::closed, "the bridge is closed");
    return f(*graph_);
  }
  void close() {
    std::optional<Graph> graph;
    {
      const std::unique_lock lock(mutex_);
      graph = std::move(graph_);
      graph_.reset();
    }
  }

  mutable std::shared_mutex mutex_;
  std::optional<Graph> graph_;
};

GraphPort::GraphPort(Graph graph) : impl_(std::make_unique<Impl>(std::move(graph))) {}
GraphPort::~GraphPort() = default;
Graph& GraphPort::graph() noexcept { return *impl_->graph_; }

std::shared_ptr<const GraphSnapshot> GraphPort::snapshot() const {
  const std::shared_lock lock(impl_->mutex_);
  return impl_->graph_ ? impl_->graph_->snapshot() : std::make_shared<const GraphSnapshot>();
}
void GraphPort::on_change(UniqueFunction<void()> f) {
  const std::shared_lock lock(impl_->mutex_);
  if (impl_->graph_) impl_->graph_->on_change(std::move(f));
}
Result<Handle> GraphPort::subscribe(std::string_view topic, std::string_view type, Sink sink, const SubscribeOptions& options) {
  return impl_->with([&](Graph& g) -> Result<Handle> { return handle_of(g.subscribe(topic, type, std::move(sink), options)); });
}
Result<std::shared_ptr<TopicWriter>> GraphPort::advertise(std::string_view topic, std::string_view type, const AdvertiseOptions& options) {
  return impl_->with([&](Graph& g) -> Result<std::shared_ptr<TopicWriter>> {
    Result<Publisher> made = g.advertise(topic, type, options);
    if (!made) return Unexpected{std::move(made).error()};
    return std::shared_ptr<TopicWriter>(std::make_shared<GraphWriter>(*std::move(made)));
  });
}
Result<Handle> GraphPort::call(std::string_view service, std::string_view type, std::string_view request, UniqueFunction<void(Result<Bytes>)> done,
                               std::chrono::milliseconds timeout) {
  return impl_->with([&](Graph& g) -> Result<Handle> { return handle_of(g.call(service, type, request, std::move(done), timeout)); });
}
Result<std::shared_ptr<SentGoal>> GraphPort::send_goal(std::string_view action, std::string_view type, std::string_view request, GoalEvents events) {
  return impl_->with([&](Graph& g) -> Result<std::shared_ptr<SentGoal>> {
    Result<Goal> made = g.send_goal(action, type, request, std::move(events));
    if (!made) return Unexpected{std::move(made).error()};
    return std::shared_ptr<SentGoal>(std::make_shared<GraphGoal>(*std::move(made)));
  });
}
Result<Handle> GraphPort::parameters(std::string_view node, UniqueFunction<void(Result<std::vector<Parameter>>)> done, std::size_t max) {
  return impl_->with([&](Graph& g) -> Result<Handle> { return handle_of(g.parameters(node, std::move(done), max)); });
}
Result<Handle> GraphPort::set_parameter(std::string_view node, const Parameter& parameter, UniqueFunction<void(Result<void>)> done,
                                        std::chrono::milliseconds timeout) {
  return impl_->with([&](Graph& g) -> Result<Handle> { return handle_of(g.set_parameter(node, parameter, std::move(done), timeout)); });
}
Result<Handle> GraphPort::parameter_events(
    UniqueFunction<void(std::string_view node, std::vector<Parameter> parameters, std::vector<std::string> deleted)> changed) {
  return impl_->with([&](Graph& g) -> Result<Handle> { return handle_of(g.parameter_events(std::move(changed))); });
}
Result<Handle> GraphPort::request_definition(std::string_view type, std::string_view hash, Definitions& definitions,
                                             UniqueFunction<void(Result<void>)> done) {
  return impl_->with([&](Graph& g) -> Result<Handle> { return handle_of(g.request_definition(type, hash, definitions, std::move(done))); });
}
GraphCounters GraphPort::counters() const {
  const std::shared_lock lock(impl_->mutex_);
  return impl_->graph_ ? impl_->graph_->counters() : GraphCounters();
}
void GraphPort::close() { impl_->close(); }

}  // namespace lrt::ros2
