// SPDX-License-Identifier: Apache-2.0
#include <lrt/base/result.hpp>

#include <memory>
#include <string>

#include "tests/support/catch.hpp"

using namespace lrt;

namespace {
Result<int> half(int n) {
  if (n % 2 != 0) return unexpected(Errc::out_of_range, "expected an even number, found " + std::to_string(n));
  return n / 2;
}
}  // namespace

TEST_CASE("a Result holds a value or an Error", "[base]") {
  CHECK(*half(4) == 2);
  CHECK(half(3).error().code == Errc::out_of_range);
  CHECK(half(3).error().message == "expected an even number, found 3");
  CHECK(half(3).value_or(7) == 7);
  CHECK(half(4).value() == 2);
  CHECK_THROWS_AS(half(3).value(), BadResult);
  Result<std::unique_ptr<int>> owner = std::make_unique<int>(1);
  CHECK(**std::move(owner) == 1);
  Result<void> good;
  CHECK(good);
  CHECK_NOTHROW(good.value());
  Result<void> bad = unexpected(Errc::closed, "gone");
  CHECK_FALSE(bad);
  CHECK_THROWS_AS(bad.value(), BadResult);
}

TEST_CASE("every error code has its own name", "[base]") {
  CHECK(to_string(Errc::expected_iri) == "expected_iri");
  CHECK(to_string(Errc::closed) == "closed");
  for (int i = 0; i <= static_cast<int>(Errc::unconfirmed); ++i) {
    CHECK(to_string(static_cast<Errc>(i)) != "unknown");
    for (int j = 0; j < i; ++j) CHECK(to_string(static_cast<Errc>(i)) != to_string(static_cast<Errc>(j)));
  }
}

TEST_CASE("a Result is copied if its value can be", "[base]") {
  static_assert(std::is_copy_constructible_v<lrt::Result<std::string>> && std::is_copy_assignable_v<lrt::Result<std::string>>);
  static_assert(!std::is_copy_constructible_v<lrt::Result<std::unique_ptr<int>>>);
  static_assert(!std::is_copy_assignable_v<lrt::Result<std::unique_ptr<int>>>);
  static_assert(std::is_nothrow_move_constructible_v<lrt::Result<std::unique_ptr<int>>>);
  static_assert(std::is_nothrow_move_assignable_v<lrt::Result<std::unique_ptr<int>>>);

  const std::string text(100, 'x'), why(100, 'y');
  const lrt::Result<std::string> good = text, bad = lrt::unexpected(lrt::Errc::failed, why);
  for (const auto* from : {&good, &bad}) {
    for (const auto* to : {&good, &bad}) {
      lrt::Result<std::string> result = *to;
      result = *from;
      REQUIRE(result.has_value() == from->has_value());
      CHECK((result ? *result : result.error().message) == (from == &good ? text : why));
      lrt::Result<std::string> moved = *to;
      moved = std::move(result);
      REQUIRE(moved.has_value() == from->has_value());
      CHECK((moved ? *moved : moved.error().message) == (from == &good ? text : why));
      const auto& same = moved;
      moved = same;
      CHECK((moved ? *moved : moved.error().message) == (from == &good ? text : why));
    }
  }
}
