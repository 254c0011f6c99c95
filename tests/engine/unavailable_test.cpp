// SPDX-License-Identifier: Apache-2.0
// A published value that is none: its traits throw an error, as those of a value from another program do while that program is gone.
#include <lrt/property.hpp>

#include <string>

#include <lrt/thing.hpp>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"

namespace {

struct Remote {
  double number = 0;
  std::string missing{};  ///< why there is no value
  lrt::Errc code = lrt::Errc::unavailable;
};

}  // namespace

template <>
struct lrt::rdf::traits<Remote> {
  static const Type& type() { return traits<double>::type(); }
  static Value encode(const Remote& v) {
    if (!v.missing.empty()) throw BadResult(Error{v.code, v.missing});
    return Value(v.number);
  }
  static Result<Remote> decode(const Value& v) { return Remote{*v.real(), {}, {}}; }
  static bool runs_user_code() noexcept { return true; }
  static bool same(const Remote& a, const Remote& b) noexcept { return a.number == b.number && a.missing == b.missing; }
};

namespace {

using namespace lrt;
using namespace lrt::test;

TEST_CASE("a published value that is unavailable is 503 with the newest reason, until one comes", "[engine]") {
  Bench bench;
  Thing thing{"arm"};
  auto angle = thing.property<Remote>("angle");
  bench.engine.add(std::move(thing)).value();
  angle.publish({0, "the driver is not there", Errc::unavailable});
  const auto get = [&] { return bench.ask("GET /arm/angle\nAccept: application/json"); };
  for (int i = 0; i < 2; ++i) {  // also the second time, when nothing new was published
    CHECK(get().status == 503);
    CHECK(get().says("the driver is not there"));
  }
  CHECK(bench.ask("GET /arm/state\nAccept: application/json").says("the driver is not there"));
  angle.publish({0, "the driver is gone", Errc::unavailable});
  CHECK(get().says("the driver is gone"));
  angle.publish({2, {}, {}});
  CHECK(get().body == "2");
  angle.publish({0, "the sample is malformed", Errc::expected_value});
  CHECK(get().status == 500);
  CHECK(get().status == 500);
  angle.publish({3, {}, {}});
  CHECK(get().body == "3");
}

TEST_CASE("a write needs no value before it, unless it has a condition", "[engine]") {
  Bench bench;
  Thing thing{"arm"};
  double written = 0;
  auto angle = thing.property<Remote>("angle");
  angle.on_write([&](const Remote& v) { written = v.number; });
  bench.engine.add(std::move(thing)).value();
  angle.publish({0, "the driver is gone", Errc::unavailable});
  CHECK(bench.ask("PUT /arm/angle\nContent-Type: application/json\nIf-Match: \"x\"\n\n4").status == 503);
  CHECK(written == 0);
  CHECK(bench.ask("PUT /arm/angle\nContent-Type: application/json\n\n4").status == 204);
  CHECK(written == 4);
  CHECK(bench.ask("GET /arm/angle\nAccept: application/json").body == "4");
}

}  // namespace
