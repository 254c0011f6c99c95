// SPDX-License-Identifier: Apache-2.0
#include "src/engine/change_log.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "tests/support/catch.hpp"

using namespace lrt;
using engine::ChangeLog;
using engine::ResourceId;

namespace {

constexpr ResourceId a{1}, b{2};
using Ids = std::optional<std::vector<ResourceId>>;

Ids ids(std::vector<ResourceId> all) { return all; }

}  // namespace

TEST_CASE("each reader gets the changes since it has read, each resource once", "[engine][query]") {
  ChangeLog log;
  ChangeLog::Place first = 0, second = 0;
  log.add(a);  // nobody reads
  CHECK(log.read(first) == std::nullopt);
  CHECK(log.read(first) == ids({}));
  log.add(a);
  log.add(b);
  log.add(a);
  CHECK(log.read(second) == std::nullopt);
  CHECK(log.read(first) == ids({a, b}));
  log.add(a);
  CHECK(log.read(second) == ids({a}));
  CHECK(log.read(first) == ids({a}));
  CHECK(log.read(first) == ids({}));
}

TEST_CASE("a reader learns that changes were forgotten", "[engine][query]") {
  ChangeLog log;
  ChangeLog::Place quick = 0, slow = 0;
  (void)log.read(quick);
  (void)log.read(slow);
  for (std::size_t i = 0; i < ChangeLog::max_changes; ++i) log.add(ResourceId{i});
  CHECK(log.read(quick)->size() == ChangeLog::max_changes);
  log.add(a);
  CHECK(log.read(slow) == std::nullopt);
  CHECK(log.read(quick) == std::nullopt);  // it does not know of the last one either
  log.add(b);
  CHECK(log.read(slow) == ids({b}));
  log.stop();
  log.add(a);
  CHECK(log.read(slow) == std::nullopt);
  CHECK(log.read(slow) == ids({}));
}
