// SPDX-License-Identifier: Apache-2.0
#include <lrt/ros2/graph.hpp>

#include "src/ros2/graph/core.hpp"
#include "src/ros2/types/names.hpp"

namespace lrt::ros2 {
inline namespace v0 {

Result<Graph> Graph::join(GraphOptions options) {
  if (options.domain > 232) return unexpected(Errc::invalid_option, "domain " + std::to_string(options.domain) + ": expected 0 to 232");
  if (!is_full_name(options.node)) return unexpected(Errc::invalid_option, "\"" + options.node + "\" is no full name of a node");
  auto impl = std::make_unique<Impl>(std::move(options));
  if (const auto joined = impl->core->join(); !joined) return unexpected(joined.error());
  impl->joined = true;
  return Graph(std::move(impl));
}
Graph::Graph(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
Graph::Graph(Graph&&) noexcept = default;
Graph& Graph::operator=(Graph&&) noexcept = default;
Graph::~Graph() = default;

std::shared_ptr<const GraphSnapshot> Graph::snapshot() const { return impl_->core->snapshot(); }
void Graph::on_change(UniqueFunction<void()> f) { impl_->core->on_change(std::move(f)); }
Result<Subscription> Graph::subscribe(std::string_view topic, std::string_view type, Sink sink, const SubscribeOptions& options) {
  return impl_->core->subscribe(topic, type, std::move(sink), options, false);
}
Result<Publisher> Graph::advertise(std::string_view topic, std::string_view type, const AdvertiseOptions& options) {
  return impl_->core->advertise(topic, type, options);
}
Result<Call> Graph::call(std::string_view service, std::string_view type, std::string_view request,
                         UniqueFunction<void(Result<Bytes> response)> response, std::chrono::milliseconds timeout) {
  return impl_->core->call(service, type, request, std::move(response), timeout, false);
}
Result<Goal> Graph::send_goal(std::string_view action, std::string_view type, std::string_view request, GoalEvents events,
                              std::chrono::milliseconds timeout) {
  return impl_->core->send_goal(action, type, request, std::move(events), timeout);
}
GraphCounters Graph::counters() const noexcept { return impl_->core->counters(); }
const GraphOptions& Graph::options() const noexcept { return impl_->core->options; }

}  // namespace v0
}  // namespace lrt::ros2
