// SPDX-License-Identifier: Apache-2.0
#include <lrt/registration.hpp>

#include <string>
#include <utility>

#include <lrt/base/iri.hpp>
#include <lrt/server.hpp>

#include "src/model/spec.hpp"
#include "src/server/shared_engine.hpp"

namespace lrt {
inline namespace v0 {

struct LRT_LOCAL Registration::State {
  std::shared_ptr<SharedEngine::Scoped> server;
  std::string path;
  std::shared_ptr<const model::HandleContext> handles;  // tells the Thing from a later one of the same path
};

Registration::Registration() noexcept = default;
Registration::Registration(std::unique_ptr<State> state) noexcept : state_(std::move(state)) {}
Registration::Registration(Registration&&) noexcept = default;
Registration& Registration::operator=(Registration&& other) noexcept {
  Registration before(std::move(*this));
  state_ = std::move(other.state_);
  return *this;
}
Registration::~Registration() {
  try {
    (void)remove();
  } catch (...) {}  // out of memory
}

Result<void> Registration::remove() {
  const std::unique_ptr<State> state = std::move(state_);
  if (!state) return unexpected(Errc::closed, "the registration is empty");
  const std::lock_guard lock(state->server->mutex);
  if (!state->server->engine) return unexpected(Errc::closed, "the server is gone");
  return state->server->engine->remove(state->path, state->handles.get());
}

void Registration::keep() noexcept { state_ = nullptr; }

Result<Registration> Server::add_scoped(Thing thing) {
  if (!impl_) return Unexpected{add(std::move(thing)).error()};
  model::ThingSpec& described = thing.described();
  auto state = std::make_unique<Registration::State>(
      Registration::State{shared_engine().scoped(), iri::decode(described.path).value_or(described.path), described.context()});
  if (Result<void> added = add(std::move(thing)); !added) return Unexpected{std::move(added).error()};
  return Registration(std::move(state));
}

}  // namespace v0
}  // namespace lrt
