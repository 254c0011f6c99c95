// SPDX-License-Identifier: Apache-2.0
// Compiled twice: with NDEBUG (misuse of a handle is logged) and without (it is also a failed assertion).
#include <lrt/thing.hpp>

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <string>
#include <type_traits>
#include <vector>

#include <lrt/engine/engine.hpp>

#include "src/model/spec.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;

namespace {

struct Ended {
  std::string log;
  bool aborted = false;
};

struct Handles {
  PushedProperty<double> pushed;
  PulledProperty<int> pulled;
  Action action;
  Collection<int> collection;
};

/// Adds a thing to an engine in a child process, and lets `use` use its handles.
template <class F>
Ended in_child(F use) {
  int ends[2];
  REQUIRE(::pipe(ends) == 0);
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    std::signal(SIGABRT, SIG_DFL);  // not the handler of the test program
    ::close(2);                     // the message of the assertion
    engine::EngineOptions options;
    options.log = [&](LogLevel level, std::string_view message) {
      const std::string line = (level == LogLevel::error ? "error: " : "") + std::string(message) + "\n";
      if (::write(ends[1], line.data(), line.size()) < 0) ::_exit(2);
    };
    Handles handles;
    {
      engine::Engine engine(options);
      Thing thing{"arm"};
      handles.pushed = thing.property<double>("angle");
      handles.pulled = thing.property("count", [] { return 1; });
      handles.action = thing.action("turn", [](double) {});
      handles.collection = thing.collection<int>("points");
      if (!engine.add(std::move(thing))) ::_exit(3);
      use(handles, engine);
    }
    ::_exit(0);
  }
  ::close(ends[1]);
  Ended ended;
  char bytes[512];
  for (ssize_t n = 0; (n = ::read(ends[0], bytes, sizeof bytes)) > 0;) ended.log.append(bytes, static_cast<std::size_t>(n));
  ::close(ends[0]);
  int status = 0;
  REQUIRE(::waitpid(child, &status, 0) == child);
  ended.aborted = WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT;
  CHECK((ended.aborted || (WIFEXITED(status) && WEXITSTATUS(status) == 0)));
  return ended;
}

#ifdef NDEBUG
constexpr bool asserts = false;
#else
constexpr bool asserts = true;
#endif

template <class H, class = void>
struct CanPublish : std::false_type {};
template <class H>
struct CanPublish<
    H, std::void_t<decltype(std::declval<H&>().publish(0)), decltype(std::declval<H&>().keep(1)), decltype(std::declval<H&>().every_sample())>>
    : std::true_type {};
template <class H, class = void>
struct CanChange : std::false_type {};
template <class H>
struct CanChange<H, std::void_t<decltype(std::declval<H&>().changed()), decltype(std::declval<H&>().sample(std::chrono::milliseconds(1)))>>
    : std::true_type {};

}  // namespace

TEST_CASE("publish exists on pushed properties only, changed and sample on pulled ones only", "[engine][handles]") {
  STATIC_REQUIRE(CanPublish<PushedProperty<int>>::value);
  STATIC_REQUIRE_FALSE(CanChange<PushedProperty<int>>::value);
  STATIC_REQUIRE(CanChange<PulledProperty<int>>::value);
  STATIC_REQUIRE_FALSE(CanPublish<PulledProperty<int>>::value);
  const auto read = [] { return 1; };
  const auto write = [](int) {};
  Thing thing{"arm"};  // a chain keeps the type of the handle
  STATIC_REQUIRE(std::is_same_v<decltype(thing.property<int>("p").unit(unit::metre).at_least(0).title("x").octets()), PushedProperty<int>&>);
  STATIC_REQUIRE(std::is_same_v<decltype(thing.property("q", read).above(0).on_write(write)), PulledProperty<int>&>);
  STATIC_REQUIRE(std::is_same_v<decltype(thing.action("a", write).between(0, 1).title("x")), Action&>);
  STATIC_REQUIRE(std::is_same_v<decltype(thing.collection<int>("c").below(1).type(Iri{"urn:t"})), Collection<int>&>);
}

TEST_CASE("a handle can be a member that is assigned later", "[engine][handles]") {
  Handles handles;
  CHECK_FALSE(handles.pushed);
  CHECK_FALSE(handles.pulled);
  CHECK_FALSE(handles.action);
  CHECK_FALSE(handles.collection);
  Thing thing{"arm"};
  handles.pushed = thing.property<double>("angle");
  CHECK(handles.pushed);
}

TEST_CASE("a set-up call after add is reported with its resource, and an assertion fails in debug builds", "[engine][handles]") {
  const auto check = [](const char* label, const char* call, void (*use)(Handles&, engine::Engine&)) {
    CAPTURE(label, call);
    const Ended ended = in_child(use);
    CHECK(ended.log == "error: " + std::string(label) + ": " + call + "() was called after the thing was added to a server; it has no effect\n");
    CHECK(ended.aborted == asserts);
  };
  check("property \"arm/angle\"", "at_least", [](Handles& h, engine::Engine&) { h.pushed.at_least(0); });
  check("property \"arm/angle\"", "keep", [](Handles& h, engine::Engine&) { h.pushed.keep(5); });
  check("property \"arm/count\"", "on_write", [](Handles& h, engine::Engine&) { h.pulled.on_write([](int) {}); });
  check("property \"arm/count\"", "sample", [](Handles& h, engine::Engine&) { h.pulled.sample(std::chrono::milliseconds(5)); });
  check("action \"arm/actions/turn\"", "policy", [](Handles& h, engine::Engine&) { h.action.policy(ActionPolicy::reject()); });
  check("collection \"arm/points\"", "on_create", [](Handles& h, engine::Engine&) { h.collection.on_create([](int) {}); });
  check("collection \"arm/points\"", "title", [](Handles& h, engine::Engine& engine) {
    if (!engine.remove("arm")) ::_exit(4);
    h.collection.title("too late");
  });
}

TEST_CASE("a handle never calls the log of a server that is gone, and publish after remove is no misuse", "[engine][handles]") {
  const Ended removed = in_child([](Handles& h, engine::Engine& engine) {
    if (!engine.remove("arm")) ::_exit(4);
    h.pushed.publish(1);
    h.pulled.changed();
  });
  CHECK(removed.log.empty());
  CHECK_FALSE(removed.aborted);
  const Ended gone = in_child([](Handles& h, engine::Engine&) {
    {
      engine::EngineOptions options;
      options.log = [](LogLevel, std::string_view) { ::_exit(5); };
      engine::Engine other(options);
      Thing thing{"arm"};
      h.pushed = thing.property<double>("angle");
      if (!other.add(std::move(thing))) ::_exit(3);
    }
    h.pushed.title("too late");
  });
  CHECK(gone.log.empty());
  CHECK(gone.aborted == asserts);
}

TEST_CASE("a call on an empty handle has no effect, and an assertion fails in debug builds", "[engine][handles]") {
  for (void (*use)(Handles&, engine::Engine&) :
       {+[](Handles&, engine::Engine&) { PushedProperty<double>().publish(1); },
        +[](Handles&, engine::Engine&) { PulledProperty<double>().changed(); }, +[](Handles&, engine::Engine&) { Action().title("x"); }}) {
    const Ended ended = in_child(use);
    CHECK(ended.log.empty());
    CHECK(ended.aborted == asserts);
  }
}

TEST_CASE("facets keep what was given before", "[engine][handles]") {
  Thing thing{"arm"};
  thing.property<double>("angle", unit::radian).at_most(3).facets(Facets().above(-3));
  thing.action("turn", [](double) { return 1.0; })
      .unit(unit::radian)
      .consumes(Facets().between(-1, 1))
      .produces(Facets{unit::second})
      .produces(Facets().at_least(0));
  thing.collection<double>("points").unit(unit::metre).below(5).facets(Facets().allow_non_finite());
  thing.property<std::string>("name").length(1, 8).facets(Facets());
  const auto spec = std::move(thing).release();
  const Facets& angle = spec->properties[0]->facets;
  CHECK(angle.unit() == unit::radian);
  CHECK(angle.max() == 3.0);
  CHECK_FALSE(angle.max_exclusive());
  CHECK(angle.min() == -3.0);
  CHECK(angle.min_exclusive());
  CHECK(spec->actions[0]->facets.unit() == unit::radian);
  CHECK(spec->actions[0]->facets.min() == -1.0);
  CHECK(spec->actions[0]->output_facets.unit() == unit::second);
  CHECK(spec->actions[0]->output_facets.min() == 0.0);
  CHECK(spec->collections[0]->facets.unit() == unit::metre);
  CHECK(spec->collections[0]->facets.max_exclusive());
  CHECK(spec->collections[0]->facets.allows_non_finite());
  CHECK(spec->properties[1]->facets.min_length() == 1);
  CHECK(spec->properties[1]->facets.max_length() == 8);
}

TEST_CASE("bounds of an input or output that an action does not have are an error of add", "[engine][handles]") {
  engine::Engine engine;
  Thing without_input{"a"};
  without_input.action("stop", [] {}).at_least(0);
  const Result<void> r = engine.add(std::move(without_input));
  REQUIRE_FALSE(r);
  CHECK(r.error().code == Errc::invalid_option);
  CHECK(r.error().message == "action \"a/actions/stop\": there is no input to which the unit, bounds or length could apply");
  Thing without_output{"a"};
  without_output.action("stop", [](double) {}).produces(Facets{unit::metre});
  CHECK(engine.add(std::move(without_output)).error().message ==
        "action \"a/actions/stop\": there is no output to which the unit, bounds or length could apply");
}
