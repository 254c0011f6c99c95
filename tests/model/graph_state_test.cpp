// SPDX-License-Identifier: Apache-2.0
#include "src/model/graph_state.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <new>
#include <vector>

#include <lrt/rdf/vocab.hpp>

#include "tests/support/catch.hpp"

using namespace lrt;
using model::GraphState;

TEST_CASE("each new state of a graph is saved after it is shown, and one that cannot be saved is not made", "[model][world]") {
  const auto state = GraphState::create("/world/map", {}, "http://lrt.invalid/shapes", nullptr).value();
  std::vector<std::uint64_t> saved;
  bool has_memory = true;
  int listened = 0;
  state->set_listener([&] { ++listened; });
  state->set_saver([&](const GraphState::Version& version) -> std::function<void()> {
    if (!has_memory) throw std::bad_alloc();
    CHECK(state->version().revision + 1 == version.revision);
    return [&, revision = version.revision] {
      CHECK(state->version().revision == revision);
      saved.push_back(revision);
    };
  });
  const auto adds = [&](int n) {
    return state->update([n](model::GraphEdit& edit) { edit.add(rdf::iri("#x"), vocab::rdfs::label, edit.term_of(n)); });
  };
  CHECK(adds(1));
  has_memory = false;
  CHECK(adds(2).error().code == Errc::failed);
  CHECK(state->version().graph->size() == 1);
  CHECK(state->version().revision == 2);
  has_memory = true;
  CHECK(adds(3));
  CHECK(state->version().graph->size() == 2);
  CHECK(saved == std::vector<std::uint64_t>{2, 3});
  CHECK(listened == 2);
}
