// SPDX-License-Identifier: Apache-2.0
#include "src/engine/rights_changes.hpp"

#include <cstddef>
#include <cstdint>
#include <string>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"

using namespace lrt::engine;

TEST_CASE("who was signed out after a request was judged is known by name", "[engine][security]") {
  RightsChanges rights;
  const std::uint64_t first = rights.number();
  CHECK_FALSE(rights.was_signed_out("anna", first));
  rights.add();
  CHECK(rights.number() != first);
  CHECK_FALSE(rights.was_signed_out("anna", first));
  rights.sign_out("anna");
  const std::uint64_t second = rights.number();
  CHECK(rights.was_signed_out("anna", first));
  CHECK_FALSE(rights.was_signed_out("bert", first));
  CHECK_FALSE(rights.was_signed_out("anna", second));
  rights.sign_out("anna");
  CHECK(rights.was_signed_out("anna", second));
}

TEST_CASE("when too many were signed out, nobody who was is forgotten", "[engine][security]") {
  RightsChanges rights;
  rights.sign_out("anna");
  for (std::size_t i = 0; i < RightsChanges::max_names; ++i) rights.sign_out("user " + std::to_string(i));
  const std::uint64_t now = rights.number();
  CHECK(rights.was_signed_out("anna", 0));
  CHECK(rights.was_signed_out("user 0", 1));
  CHECK_FALSE(rights.was_signed_out("anna", now));
  CHECK_FALSE(rights.was_signed_out("bert", now));
}

TEST_CASE("an engine counts the changes of rights", "[engine][security]") {
  lrt::test::Bench bench;
  const std::uint64_t first = bench.engine.rights_revision();
  bench.engine.sign_out("anna");
  const std::uint64_t second = bench.engine.rights_revision();
  CHECK(second != first);
  bench.engine.renew_rights();
  CHECK(bench.engine.rights_revision() != second);
}
