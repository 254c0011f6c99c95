// SPDX-License-Identifier: Apache-2.0
#include "src/engine/representation_cache.hpp"

#include <memory>
#include <string>

#include "src/engine/resources/documents.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::engine;

namespace {

const Audience everybody;

Representation made(Resource& resource, std::size_t base, Variant variant, std::size_t page, std::size_t bytes) {
  return {&resource, base, variant, page, nullptr, {}, 1, 1, {}, std::make_shared<const std::string>(bytes, 'x')};
}

}  // namespace

TEST_CASE("a representation is found by resource, base, variant and page", "[engine][R0.11]") {
  RepresentationCache cache{100'000};
  TermsResource resource, other;
  cache.keep(made(resource, 1, Variant(), 1, 10));
  CHECK(cache.find(resource, 1, Variant(), 1, everybody, nullptr) != nullptr);
  CHECK(cache.find(other, 1, Variant(), 1, everybody, nullptr) == nullptr);
  CHECK(cache.find(resource, 2, Variant(), 1, everybody, nullptr) == nullptr);
  CHECK(cache.find(resource, 1, Variant(rdf::Plain::json), 1, everybody, nullptr) == nullptr);
  CHECK(cache.find(resource, 1, Variant(), 2, everybody, nullptr) == nullptr);
  Representation& newer = cache.keep(made(resource, 1, Variant(), 1, 20));
  CHECK(cache.find(resource, 1, Variant(), 1, everybody, nullptr) == &newer);
  CHECK(resource.representations.size() == 1);
  cache.forget(resource);
  CHECK(cache.find(resource, 1, Variant(), 1, everybody, nullptr) == nullptr);
  CHECK(resource.representations.empty());
}

TEST_CASE("audiences with different rights share no representation", "[engine][security]") {
  RepresentationCache cache{100'000};
  TermsResource resource;
  const auto view = std::make_shared<const security::View>(security::Right::read);
  const Audience reader{view, nullptr}, same{view, std::make_shared<const security::Principal>(security::Principal{"anna", {}})};
  const Audience other{std::make_shared<const security::View>(security::Rights::all()), nullptr};
  Representation of_reader = made(resource, 1, Variant(), 1, 10);
  of_reader.view = view;
  cache.keep(made(resource, 1, Variant(), 1, 10));
  Representation& kept = cache.keep(std::move(of_reader));
  CHECK(resource.representations.size() == 2);
  CHECK(cache.find(resource, 1, Variant(), 1, reader, nullptr) == &kept);
  CHECK(cache.find(resource, 1, Variant(), 1, same, nullptr) == &kept);
  CHECK(cache.find(resource, 1, Variant(), 1, everybody, nullptr) != &kept);
  CHECK(cache.find(resource, 1, Variant(), 1, other, nullptr) == nullptr);
}

TEST_CASE("too many bytes drop what was used least recently, never the newest", "[engine][limits]") {
  RepresentationCache cache{3 * sizeof(Representation) + 3000};
  TermsResource resource;
  for (std::size_t base = 0; base < 3; ++base) cache.keep(made(resource, base, Variant(), 1, 900));
  cache.mark_used(*cache.find(resource, 0, Variant(), 1, everybody, nullptr));
  cache.keep(made(resource, 3, Variant(), 1, 900));
  CHECK(cache.find(resource, 0, Variant(), 1, everybody, nullptr) != nullptr);
  CHECK(cache.find(resource, 1, Variant(), 1, everybody, nullptr) == nullptr);
  const Representation& large = cache.keep(made(resource, 4, Variant(), 1, 100'000));
  CHECK(cache.find(resource, 4, Variant(), 1, everybody, nullptr) == &large);
  CHECK(resource.representations.size() == 1);
  cache.clear();
  CHECK(resource.representations.empty());
}

TEST_CASE("what a representation grows by counts", "[engine][limits]") {
  RepresentationCache cache{2 * sizeof(Representation) + 3000};
  TermsResource resource;
  cache.keep(made(resource, 0, Variant(), 1, 1000));
  Representation& second = cache.keep(made(resource, 1, Variant(), 1, 1000));
  CHECK(resource.representations.size() == 2);
  cache.grown(2000);
  second.event = std::make_shared<const subscription::Message>(subscription::Message{std::make_shared<const std::string>(2000, 'x'), {}});
  cache.keep(made(resource, 2, Variant(), 1, 10));
  CHECK(cache.find(resource, 0, Variant(), 1, everybody, nullptr) == nullptr);
  cache.forget(resource);
}
