// SPDX-License-Identifier: Apache-2.0
#include "src/engine/resource.hpp"

#include <optional>
#include <string>
#include <vector>

#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/engine/description.hpp"
#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::engine;
using namespace lrt::test;

namespace {

template <class Base>
struct Kind : Base {
  explicit Kind(const std::string& at) : Base(at, nullptr) {}
  void describe(const Description&) const override {}
  void describe_types(About& about, const Description&) const override { about.a(vocab::ldp::RDFSource); }
  const ResourceKind& kind() const noexcept override {
    static constexpr ResourceKind kind{"node"};
    return kind;
  }
};
using Plain = Kind<Resource>;
using Valued = Kind<ValueResource>;

struct Folder final : Plain, Container {
  using Container::members;
  using Plain::Plain;
  const engine::Container* container() const noexcept override { return this; }
  std::vector<Resource*> members() const override { return {&first, &second}; }
  mutable Plain first{"/folder/1"}, second{"/folder/2"};
};

}  // namespace

TEST_CASE("a resource has only the facets of its kind", "[engine][resource]") {
  const Plain plain("/a");
  CHECK_FALSE(plain.observable());
  CHECK_FALSE(plain.values());
  CHECK_FALSE(plain.container());
  CHECK_FALSE(plain.own_protocol());
  CHECK_FALSE(plain.own_representation());
  CHECK(plain.saved_type().empty());
  CHECK_FALSE(Plain("/a").graph_store());
  CHECK(plain.kind().right_to_change == security::Right::write);

  const Valued valued("/b");
  CHECK(valued.values() == &valued);
  CHECK(valued.is_up_to_date());
  CHECK(valued.fits_rdf(0));
  CHECK_FALSE(valued.plain_value({}));

  const Folder folder("/folder");
  CHECK(folder.container() == static_cast<const Container*>(&folder));
  CHECK_FALSE(folder.values());
}

TEST_CASE("values need no memory in a resource, and another facet that of one pointer", "[engine][resource]") {
  CHECK(sizeof(ValueResource) == sizeof(Resource));
  struct Both : Plain, Container {
    using Plain::Plain;
    std::vector<Resource*> members() const override { return {}; }
  };
  CHECK(sizeof(Both) == sizeof(Resource) + sizeof(void*));
}

TEST_CASE("the traits of a kind are independent, and its changes are urgent only with a queue", "[engine][resource]") {
  constexpr ResourceKind kind{"node", Trait::fixed_links | Trait::stop};
  CHECK(kind.is(Trait::fixed_links));
  CHECK(kind.is(Trait::stop));
  for (const Trait other : {Trait::placeholder, Trait::about_caller, Trait::no_rdf_source, Trait::plain_bodies, Trait::by_principal})
    CHECK_FALSE(kind.is(other));
  CHECK_FALSE(Observable{}.wants_queues());
  CHECK_FALSE(Observable{}.is_urgent());
  CHECK(Observable{{}, Observable::Order::each}.wants_queues());
  CHECK_FALSE(Observable{{}, Observable::Order::each}.is_urgent());
  CHECK(Observable{{}, Observable::Order::urgent}.wants_queues());
  CHECK(Observable{{}, Observable::Order::urgent}.is_urgent());
}

TEST_CASE("rights are looked up at the path without its query", "[engine][resource]") {
  CHECK(Plain("/world").path_of_rights() == "/world");
  CHECK(Plain("/world?default").path_of_rights() == "/world");
}

TEST_CASE("a container shows all members to an audience with all rights", "[engine][resource]") {
  const Folder folder("/folder");
  const Container& container = *folder.container();
  CHECK(container.members(Audience{}) == std::vector<Resource*>{&folder.first, &folder.second});
}

TEST_CASE("each resource of a Thing says how it is observed", "[engine][resource]") {
  Bench bench;
  Thing arm("arm");
  arm.property("angle", [] { return 1.0; });
  arm.action("turn", [](Responder done) { std::move(done).succeed(); });
  REQUIRE(bench.engine.add(std::move(arm)));
  const auto queued = [&](const std::string& path) -> std::optional<bool> {
    for (const ObservableResource& one : bench.engine.observable_resources())
      if (one.path == path) return one.wants_queue;
    return std::nullopt;
  };
  CHECK(queued("/arm") == false);
  CHECK(queued("/arm/state") == false);
  CHECK(queued("/arm/angle") == false);
  CHECK(queued("/arm/actions/turn") == true);
  CHECK(queued("/arm/subscriptions") == std::nullopt);
  CHECK(queued("/arm/blueprint") == std::nullopt);
  CHECK(queued("/arm/all") == std::nullopt);
  CHECK(queued("/") == std::nullopt);
}
