// SPDX-License-Identifier: Apache-2.0
#include <lrt/ros2.hpp>

#include <utility>

#include "src/base/read_file.hpp"
#include "src/ros2/bridge/core.hpp"
#include "src/ros2/bridge/port.hpp"

namespace lrt::ros2 {
inline namespace v0 {

class LRT_LOCAL Bridge::Impl {
 public:
  Impl(Server& server, Options options, Graph graph, Definitions definitions)
      : definitions_(std::move(definitions)),
        port_(std::make_shared<GraphPort>(std::move(graph))),
        core_(server, std::move(options), port_, definitions_) {}
  ~Impl() {
    core_.stop();
    port_->close();
  }

  Definitions definitions_;
  const std::shared_ptr<GraphPort> port_;
  Core core_;
};

Bridge::Bridge(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
Bridge::Bridge(Bridge&&) noexcept = default;
Bridge& Bridge::operator=(Bridge&&) noexcept = default;
Bridge::~Bridge() = default;

Result<Bridge> Bridge::create(Server& server, Options options) {
  if (!options.robot_description_file.empty()) {
    Result<std::string> text = read_file(options.robot_description_file, 16 * 1024 * 1024);
    if (!text) return Unexpected{std::move(text).error()};
    options.robot_description = *std::move(text);
  }
  for (const std::string& ns : options.namespaces)
    if (ns.empty() || ns.front() != '/') return unexpected(Errc::invalid_option, "the namespace \"" + ns + "\" does not begin with '/'");
  if (options.limits.command_life.count() < 1 || options.limits.command_life > std::chrono::hours(1))
    return unexpected(Errc::invalid_option, "limits.command_life: expected 1 ms to 1 h");
  Definitions definitions(options.definition_limits);
  for (const std::string& folder : options.definitions)
    if (Result<std::size_t> added = definitions.add_folder(folder); !added) return Unexpected{std::move(added).error()};
  if (!options.graph.log) options.graph.log = options.log;
  Result<Graph> graph = Graph::join(options.graph);
  if (!graph) return Unexpected{std::move(graph).error()};
  auto impl = std::make_unique<Impl>(server, std::move(options), *std::move(graph), std::move(definitions));
  if (Result<void> started = impl->core_.start(); !started) return Unexpected{std::move(started).error()};
  return Bridge(std::move(impl));
}

std::vector<Listed> Bridge::list() const { return impl_->core_.list(); }
bool Bridge::wait_until_settled(std::chrono::milliseconds limit) const { return impl_->core_.wait_until_settled(limit); }
Graph& Bridge::graph() noexcept { return impl_->port_->graph(); }
Definitions& Bridge::definitions() noexcept { return impl_->definitions_; }
Counters Bridge::counters() const { return impl_->core_.counters(); }

}  // namespace v0
}  // namespace lrt::ros2
