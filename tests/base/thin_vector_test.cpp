// SPDX-License-Identifier: Apache-2.0
#include "src/base/thin_vector.hpp"

#include <memory>
#include <string>
#include <vector>

#include "tests/support/catch.hpp"

using namespace lrt;

TEST_CASE("a thin vector is one pointer, and a vector otherwise", "[base]") {
  ThinVector<std::string> all;
  CHECK(sizeof all == sizeof(void*));
  CHECK(all.empty());
  CHECK(all.begin() == all.end());
  CHECK(static_cast<const std::vector<std::string>&>(all).empty());
  for (const char* text : {"a", "b", "a", "c"}) all.push_back(text);
  CHECK(all.size() == 4);
  CHECK(all[1] == "b");
  CHECK(all.back() == "c");
  CHECK(static_cast<const std::vector<std::string>&>(all) == std::vector<std::string>{"a", "b", "a", "c"});
  all.remove("a");
  all.remove("x");
  CHECK(std::vector<std::string>(all) == std::vector<std::string>{"b", "a", "c"});
  all.remove_if([](const std::string& s) { return s != "a"; });
  CHECK(std::vector<std::string>(all) == std::vector<std::string>{"a"});
  all.remove("a");
  CHECK(all.empty());
  CHECK(all.begin() == nullptr);

  ThinVector<std::unique_ptr<int>> owners;
  owners.push_back(std::make_unique<int>(7));
  const ThinVector<std::unique_ptr<int>> moved = std::move(owners);
  CHECK(*moved[0] == 7);
}
