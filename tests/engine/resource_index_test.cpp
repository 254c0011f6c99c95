// SPDX-License-Identifier: Apache-2.0
#include "src/engine/resource_index.hpp"

#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "tests/support/catch.hpp"

using namespace lrt::engine;

namespace {

struct Node final : Resource {
  explicit Node(const std::string& name) : Resource(name, nullptr) {}
  void describe(const Description&) const override {}
  void describe_types(About&, const Description&) const override {}
  const ResourceKind& kind() const noexcept override {
    static constexpr ResourceKind kind{"node"};
    return kind;
  }
};

}  // namespace

TEST_CASE("both indices find what a map finds, whatever is added and removed", "[engine]") {
  PathIndex by_path;
  IdIndex by_id;
  std::map<std::string, std::unique_ptr<Node>> all;
  std::map<ResourceId, Node*> ids;
  std::vector<ResourceId> gone;
  std::mt19937 random(7);
  for (int step = 0; step < 20'000; ++step) {
    const std::string path = "/n" + std::to_string(random() % 700);
    const auto known = all.find(path);
    CHECK(by_path.find(path) == (known == all.end() ? nullptr : known->second.get()));
    if (known == all.end()) {
      Node& made = *all.emplace(path, std::make_unique<Node>(path)).first->second;
      by_path.add(made);
      by_id.add(made);
      CHECK(ids.emplace(made.id, &made).second);  // no id is used twice
    } else {
      by_path.remove(*known->second);
      by_id.remove(*known->second);
      gone.push_back(known->second->id);
      ids.erase(known->second->id);
      all.erase(known);
    }
  }
  for (const auto& [id, node] : ids) CHECK(by_id.find(id) == node);
  for (const ResourceId id : gone) CHECK(by_id.find(id) == nullptr);
  for (const auto& [path, node] : all) CHECK(by_path.find(path) == node.get());
  CHECK(by_id.find(ResourceId{}) == nullptr);
  by_path.clear();
  by_id.clear();
  for (const auto& [path, node] : all) CHECK(by_path.find(path) == nullptr);
  for (const auto& [id, node] : ids) CHECK(by_id.find(id) == nullptr);
}
