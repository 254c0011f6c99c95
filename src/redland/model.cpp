// SPDX-License-Identifier: Apache-2.0
#include <lrt/redland.hpp>

#include <utility>

#include "src/redland/attachment.hpp"

namespace lrt::redland {
inline namespace v0 {

Model::Model(std::shared_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
Model::Model(Model&&) noexcept = default;
Model& Model::operator=(Model&& other) noexcept {
  if (this == &other) return *this;
  detach();
  impl_ = std::move(other.impl_);
  return *this;
}
Model::~Model() { detach(); }

Result<Model> Model::attach(World& world, std::string_view path, librdf_model* model, Options options, GraphOptions graph) {
  const auto named = [&](Error error) {
    error.message = "graph \"" + std::string(path) + "\": " + error.message;
    return Unexpected{std::move(error)};
  };
  const auto invalid = [&](const char* what) { return named({Errc::invalid_option, what}); };
  if (!model) return invalid("expected a librdf_model, found nullptr");
  if (!graph.file.empty() || !graph.turtle.empty())
    return invalid("GraphOptions::file, turtle: the content is that of the librdf_model; leave them empty");
  if (options.max_step.count() <= 0 || options.max_write == 0 || options.write_timeout.count() <= 0)
    return invalid("Options::max_step, max_write, write_timeout: expected more than 0");
  if (!options.base.empty() && options.base.back() == '/') options.base.pop_back();
  if (!options.context.empty() && librdf_model_supports_contexts(model) == 0)
    return invalid("Options::context: this storage has no contexts; open it with contexts='yes'");
  Result<std::shared_ptr<WorldUse>> use = WorldUse::enter(model, options);
  if (!use) return named(std::move(use).error());
  auto impl = std::make_shared<Impl>(*std::move(use), model, std::move(options), graph);
  const WorldGraph handle = world.graph(path, std::move(graph));
  if (!handle) {
    impl->give_up();
    return named({Errc::invalid_option, "the World does not take it; Server::add() of the World returns why"});
  }
  impl->serve(handle);
  if (Result<void> read = impl->read_first(); !read) {
    impl->detach();
    return named(std::move(read).error());
  }
  return Model(std::move(impl));
}

void Model::changed() noexcept {
  if (impl_) impl_->changed();
}

Result<void> Model::call(const std::function<void(librdf_model*)>& work) {
  if (!impl_) return unexpected(Errc::closed, "the handle of the model is empty");
  return impl_->call(work);
}

WorldGraph Model::graph() const { return impl_ ? impl_->graph() : WorldGraph(); }
Result<void> Model::state() const {
  if (!impl_) return unexpected(Errc::closed, "the handle of the model is empty");
  return impl_->state();
}
Counters Model::counters() const { return impl_ ? impl_->counters() : Counters(); }

void Model::detach() noexcept {
  if (impl_) impl_->detach();  // which others may be using: changed(), state()
}

}  // namespace v0
}  // namespace lrt::redland
