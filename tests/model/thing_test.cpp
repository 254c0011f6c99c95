// SPDX-License-Identifier: Apache-2.0
#include <lrt/thing.hpp>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "src/model/spec.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using model::ActionShape;

namespace {
struct Callable {
  int operator()(std::string) const noexcept { return 0; }
};
int free_function(double) { return 0; }
}  // namespace

TEST_CASE("the signature of an action is derived from its callable", "[model]") {
  const auto plain = [] {};
  const auto in = [](double) {};
  const auto by_reference = [](const std::string&) { return 1; };
  const auto result = []() -> Result<double> { return 1.0; };
  const auto async = [](Responder) {};
  const auto async_in_out = [](int, ResponderOf<std::string>) {};
  const auto changes = [n = 0]() mutable { return ++n; };
  STATIC_REQUIRE(std::is_void_v<ActionShape<decltype(plain)>::Input>);
  STATIC_REQUIRE_FALSE(ActionShape<decltype(plain)>::asynchronous);
  STATIC_REQUIRE(std::is_same_v<ActionShape<decltype(in)>::Input, double>);
  STATIC_REQUIRE(std::is_same_v<ActionShape<decltype(by_reference)>::Input, std::string>);
  STATIC_REQUIRE(std::is_same_v<ActionShape<decltype(by_reference)>::Return, int>);
  STATIC_REQUIRE(std::is_same_v<model::Unwrapped<ActionShape<decltype(result)>::Return>::type, double>);
  STATIC_REQUIRE(ActionShape<decltype(async)>::asynchronous);
  STATIC_REQUIRE(std::is_void_v<ActionShape<decltype(async)>::Input>);
  STATIC_REQUIRE(ActionShape<decltype(async_in_out)>::asynchronous);
  STATIC_REQUIRE(std::is_same_v<ActionShape<decltype(async_in_out)>::Input, int>);
  STATIC_REQUIRE(std::is_same_v<model::ResponderTraits<ActionShape<decltype(async_in_out)>::Last>::Output, std::string>);
  STATIC_REQUIRE(std::is_same_v<ActionShape<decltype(changes)>::Return, int>);
  STATIC_REQUIRE(std::is_same_v<ActionShape<Callable>::Input, std::string>);
  STATIC_REQUIRE(std::is_same_v<ActionShape<decltype(&free_function)>::Input, double>);
}

namespace {

/// An invocation that counts what it gets.
struct FakeInvocation final : model::InvocationLink {
  void finish(Result<rdf::Value> result) noexcept override { results.push_back(std::move(result)); }
  void progress(double fraction) noexcept override { last_progress = fraction; }
  bool cancelled() const noexcept override { return is_cancelled; }
  void on_cancel(UniqueFunction<void()> given) override { hook = std::move(given); }
  std::vector<Result<rdf::Value>> results;
  double last_progress = -1;
  bool is_cancelled = false;
  UniqueFunction<void()> hook;
};

}  // namespace

TEST_CASE("copies of a Responder are one invocation: the first result counts", "[model][R0.8]") {
  STATIC_REQUIRE(std::is_copy_constructible_v<Responder>);
  STATIC_REQUIRE(std::is_nothrow_move_constructible_v<Responder>);
  STATIC_REQUIRE(std::is_nothrow_move_assignable_v<Responder>);
  const auto invocation = std::make_shared<FakeInvocation>();
  const Responder first(invocation);
  const Responder second = first;
  CHECK(first);
  second.progress(0.5);
  CHECK(invocation->last_progress == 0.5);
  second.succeed();
  first.fail("too late");
  second.succeed();
  CHECK_FALSE(first);
  CHECK_FALSE(second);
  REQUIRE(invocation->results.size() == 1);
  CHECK(invocation->results[0]);
  invocation->is_cancelled = true;
  CHECK(first.cancelled());
}

TEST_CASE("a std::function holds a Responder", "[model][R0.8]") {
  const auto invocation = std::make_shared<FakeInvocation>();
  std::function<void(bool)> on_done;
  {
    const ResponderOf<int> done(invocation);
    on_done = [done](bool ok) { ok ? done.succeed(7) : done.fail(Error{Errc::refused, "no"}); };
  }
  std::function<void(bool)> copy = on_done;
  on_done = nullptr;
  CHECK(invocation->results.empty());
  copy(true);
  copy(false);
  REQUIRE(invocation->results.size() == 1);
  CHECK(*invocation->results[0]->integer() == 7);
}

TEST_CASE("the invocation fails when the last copy of its Responder is destroyed", "[model][R0.6]") {
  const auto invocation = std::make_shared<FakeInvocation>();
  std::optional<Responder> first(invocation), second(first);
  Responder assigned;
  assigned = *second;
  first.reset();
  second.reset();
  CHECK(invocation->results.empty());
  assigned = Responder();
  REQUIRE(invocation->results.size() == 1);
  CHECK(invocation->results[0].error().code == Errc::dropped);
}

TEST_CASE("a thing stores its description", "[model]") {
  Thing thing{"caf\u00e9/arm 1"};
  CHECK(thing.path() == "caf%C3%A9/arm%201");
  thing
      .property(
          "deep/p", [] { return 1; }, unit::metre)
      .between(-1, 1);
  thing.property("text", [] { return "literal"; });
  thing.property<float>("pushed");
  thing.action("go", [](double) { return std::string(); });
  thing.action("later", [](ResponderOf<int>) {});
  thing.collection<double>("c").max_members(5);
  const auto spec = std::move(thing).release();
  REQUIRE(spec);
  CHECK_FALSE((spec->handles && spec->handles->first_error));
  CHECK(spec->title == "arm 1");
  REQUIRE(spec->properties.size() == 3);
  CHECK(spec->properties[0]->path == "deep/p");
  CHECK(spec->properties[0]->facets.unit() == unit::metre);
  CHECK(spec->properties[0]->facets.min() == -1.0);
  CHECK(spec->properties[0]->read);
  CHECK_FALSE(spec->properties[0]->slot);
  CHECK(*spec->properties[1]->read(false).value.text() == "literal");
  CHECK(spec->properties[2]->slot);
  CHECK_FALSE(spec->properties[2]->write);
  REQUIRE(spec->actions.size() == 2);
  CHECK(spec->actions[0]->input == &rdf::traits<double>::type());
  CHECK(spec->actions[0]->output == &rdf::traits<std::string>::type());
  CHECK_FALSE(spec->actions[0]->asynchronous);
  CHECK(spec->actions[1]->input == nullptr);
  CHECK(spec->actions[1]->output == &rdf::traits<int>::type());
  CHECK(spec->actions[1]->asynchronous);
  CHECK(spec->collections[0]->max_members == 5);
}

TEST_CASE("the first error of a thing is kept with its path", "[model]") {
  Thing thing{"a//b"};
  thing.property<int>("x//y");
  const auto spec = std::move(thing).release();
  REQUIRE(spec->handles->first_error);
  CHECK(spec->handles->first_error->code == Errc::expected_iri);
  CHECK(spec->handles->first_error->message.find("a//b") != std::string::npos);
}

TEST_CASE("paths are encoded segment by segment", "[model]") {
  CHECK(model::encode_path("a/b").value() == "a/b");
  CHECK(model::encode_path("a b/\u00e9/100%/?#").value() == "a%20b/%C3%A9/100%25/%3F%23");
  for (const char* bad : {"", "/", "/a", "a/", "a//b", ".", "..", "a/../b", "a\xff"}) {
    CAPTURE(bad);
    CHECK_FALSE(model::encode_path(bad));
  }
}

TEST_CASE("a responder without an invocation does nothing", "[model]") {
  Responder empty;
  empty.progress(0.5);
  CHECK_FALSE(empty.cancelled());
  empty.on_cancel([] { FAIL("called"); });
  Responder moved = std::move(empty);
  moved.succeed();
  moved.fail("twice");
}
