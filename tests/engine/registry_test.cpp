// SPDX-License-Identifier: Apache-2.0
#include "src/engine/registry.hpp"

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <lrt/thing.hpp>

#include "src/engine/representation_cache.hpp"
#include "src/engine/resources/documents.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/model/spec.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::engine;

namespace {

struct Tree {
  ~Tree() { registry.clear(); }
  ThingNode& add(const std::string& path) { return registry.add_thing(std::make_unique<ThingNode>(Thing{path}.release())); }
  std::string parent(const std::string& path) {
    const ThingNode* thing = registry.find_thing(path);
    return thing->parent ? thing->parent->self.path : "/";
  }
  static std::vector<std::string> paths(const std::vector<ThingNode*>& things) {
    std::vector<std::string> all;
    for (const ThingNode* t : things) all.push_back(t->self.path);
    return all;
  }
  RepresentationCache cache{1000};
  Registry registry{cache};
};

using Paths = std::vector<std::string>;

}  // namespace

TEST_CASE("a resource is found by its path and by its id, until it is removed", "[engine][R0.3]") {
  Tree tree;
  TermsResource first, second;
  CHECK(tree.registry.add(first));
  CHECK_FALSE(tree.registry.add(second));  // the path is taken
  CHECK(tree.registry.find(TermsResource::location) == &first);
  const ResourceId id = first.id;
  CHECK(id != ResourceId{});
  CHECK(tree.registry.find(id) == &first);
  tree.registry.remove(second);  // takes nothing from the first
  CHECK(tree.registry.find(TermsResource::location) == &first);
  tree.registry.remove(first);
  CHECK(tree.registry.find(TermsResource::location) == nullptr);
  CHECK(tree.registry.find(id) == nullptr);
  CHECK(tree.registry.add(second));
  CHECK(second.id != id);  // never used twice
  const Ref<TermsResource> ref(second);
  CHECK(tree.registry.find(ref) == &second);
  tree.registry.remove(second);
  CHECK(tree.registry.find(ref) == nullptr);
}

TEST_CASE("a Thing below another is its child, in whatever order they come", "[engine][R1.11]") {
  Tree tree;
  tree.add("a/b/c");
  CHECK(Tree::paths(tree.registry.roots()) == Paths{"/a/b/c"});
  tree.add("a");
  tree.add("a/x");
  tree.add("ab");  // not below /a
  CHECK(Tree::paths(tree.registry.roots()) == Paths{"/a", "/ab"});
  CHECK(Tree::paths(tree.registry.find_thing("/a")->children) == Paths{"/a/b/c", "/a/x"});
  tree.add("a/b");
  CHECK(tree.parent("/a/b/c") == "/a/b");
  CHECK(tree.parent("/a/b") == "/a");
  CHECK(Tree::paths(tree.registry.find_thing("/a")->children) == Paths{"/a/x", "/a/b"});
}

TEST_CASE("the children of a Thing that is removed move up", "[engine][R1.11]") {
  Tree tree;
  tree.add("a");
  ThingNode& middle = tree.add("a/b");
  tree.add("a/b/c");
  const auto structure = tree.registry.structure();
  const auto removed = tree.registry.remove_thing(middle);
  CHECK(removed.get() == &middle);
  CHECK(tree.registry.find_thing("/a/b") == nullptr);
  CHECK(tree.parent("/a/b/c") == "/a");
  CHECK(tree.registry.structure() != structure);
  const auto root = tree.registry.remove_thing(*tree.registry.find_thing("/a"));
  CHECK(Tree::paths(tree.registry.roots()) == Paths{"/a/b/c"});
}

TEST_CASE("spellings of a path have one canonical form", "[engine][R0.3]") {
  CHECK(canonical_path("/arm/j1").value() == "/arm/j1");
  CHECK(canonical_path("/%61rm").value() == "/arm");
  CHECK(canonical_path("/a b").value() == canonical_path("/a%20b").value());
  CHECK(canonical_path("/%c3%a4").value() == canonical_path("/%C3%A4").value());
  for (const char* bad : {"/%00", "/%ff", "/%2e%2e/x", "/./x", "/%zz"}) {
    CAPTURE(bad);
    CHECK_FALSE(canonical_path(bad));
  }
}
