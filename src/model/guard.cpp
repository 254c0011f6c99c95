// SPDX-License-Identifier: Apache-2.0
// Thing::guard(), apart from thing.cpp: a linker leaves it out of programs without it.
#include <lrt/thing.hpp>

#include <memory>
#include <utility>
#include <vector>

#include <lrt/responder.hpp>

#include "src/model/spec.hpp"

namespace lrt::model {
inline namespace v0 {
namespace {

using Shared = std::shared_ptr<const Guards>;

/// Keeps the objects for the time of a call.
/// @throws BadResult  unavailable: one of them is gone
std::vector<std::shared_ptr<void>> held(const Guards& guards) {
  std::vector<std::shared_ptr<void>> all;
  all.reserve(guards.objects.size());
  for (const std::weak_ptr<void>& object : guards.objects) {
    all.push_back(object.lock());
    if (!all.back()) throw BadResult({Errc::unavailable, "the part of the robot's program that serves it is gone"});
  }
  return all;
}

template <class R, class... Args>
void guard(UniqueFunction<R(Args...)>& function, const Shared& guards) {
  if (!function) return;
  function = [guards, inner = std::move(function)](Args... args) mutable -> R {
    const auto objects = held(*guards);
    return inner(std::forward<Args>(args)...);
  };
}

/// What a lambda registers with on_cancel() runs after it.
class GuardedLink final : public InvocationLink {
 public:
  GuardedLink(std::shared_ptr<InvocationLink> link, Shared guards) : link_(std::move(link)), guards_(std::move(guards)) {}
  void finish(Result<rdf::Value> result) noexcept override { link_->finish(std::move(result)); }
  void progress(double fraction) noexcept override { link_->progress(fraction); }
  bool cancelled() const noexcept override { return link_->cancelled(); }
  void on_cancel(UniqueFunction<void()> hook) override {
    guard(hook, guards_);
    link_->on_cancel(std::move(hook));
  }

 private:
  const std::shared_ptr<InvocationLink> link_;
  const Shared guards_;
};

void guard_lambdas(ThingSpec& thing) {
  const Shared guards = std::move(thing.guards);
  for (const auto& p : thing.properties) {
    guard(p->read, guards);
    guard(p->write, guards);
    if (p->life) guard(p->life->function(), guards);
    for (RepresentationSpec& r : p->representations) guard(r.encode, guards);
  }
  for (const auto& a : thing.actions) {
    guard(a->start, guards);
    a->start = [guards, start = std::move(a->start)](const rdf::Value& input, const std::shared_ptr<InvocationLink>& link) mutable {
      start(input, std::make_shared<GuardedLink>(link, guards));
    };
    if (a->stop_state) guard(a->stop_state->read, guards);
  }
  for (const auto& c : thing.collections) {
    guard(c->create, guards);
    guard(c->remove, guards);
  }
}

}  // namespace
}  // namespace v0
}  // namespace lrt::model

namespace lrt {
inline namespace v0 {

Thing& Thing::guard(std::weak_ptr<void> object) {
  model::ThingSpec& thing = described();
  if (object.expired())
    remember({Errc::invalid_option, "thing \"" + thing.path +
                                        "\": guard() expected an object that exists, found one that is gone; keep a "
                                        "std::shared_ptr to it as long as the Thing is served"});
  if (!thing.guards) thing.guards = std::make_unique<model::Guards>(model::Guards{{}, model::guard_lambdas});
  thing.guards->objects.push_back(std::move(object));
  return *this;
}

}  // namespace v0
}  // namespace lrt
