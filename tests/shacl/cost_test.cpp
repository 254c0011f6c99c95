// SPDX-License-Identifier: Apache-2.0
#include <lrt/shacl/validator.hpp>

#include <atomic>
#include <cstdlib>
#include <new>

#include "tests/shacl/support.hpp"

// The cost of validation in allocations and steps, which do not depend on the machine.

namespace {
std::atomic<std::size_t> allocations{0};
}

void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++allocations;
  return std::malloc(size == 0 ? 1 : size);
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, const std::nothrow_t&) noexcept { std::free(memory); }

namespace {

using lrt::rdf::Graph;
using lrt::shacl::Shapes;
using lrt::shacl::ValidateOptions;

std::string joints(int n) {
  std::string text;
  for (int i = 0; i < n; ++i) {
    const std::string self = "ex:j" + std::to_string(i);
    text += self + " a ex:Joint ; ex:name \"j" + std::to_string(i) + "\" ; ex:angle 1.5 ; ex:next ex:j" + std::to_string((i + 1) % n) +
            " . ex:robot ex:joint " + self + " .\n";
  }
  return text + "ex:robot ex:name \"robot\" ; a ex:Robot . ex:Robot rdfs:subClassOf ex:Thing .\n";
}

const char* const shape = R"(ex:S sh:targetClass ex:Joint ; sh:nodeKind sh:IRI ;
  sh:property [ sh:path ex:name ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:string ; sh:pattern "^j[0-9]+$" ; sh:minLength 2 ; sh:uniqueLang true ] ;
  sh:property [ sh:path ex:angle ; sh:or ( [ sh:datatype xsd:float ] [ sh:datatype xsd:decimal ] ) ; sh:minInclusive -3.2 ; sh:maxInclusive 3.2 ] ;
  sh:property [ sh:path ex:next ; sh:class ex:Joint ; sh:node [ sh:property [ sh:path ex:name ; sh:minCount 1 ] ] ; sh:not [ sh:class ex:Robot ] ] ;
  sh:property [ sh:path ( [ sh:inversePath ex:joint ] ex:name ) ; sh:hasValue "robot" ; sh:in ( "robot" ) ] ;
  sh:property [ sh:path [ sh:inversePath ex:joint ] ; sh:class ex:Thing ; sh:minCount 1 ] ;
  sh:closed true ; sh:ignoredProperties ( rdf:type ) ; sh:disjoint ex:next .)";

std::size_t allocations_of(const Shapes& shapes, const Graph& data) {
  const std::size_t before = allocations;
  const auto report = lrt::shacl::validate(shapes, data);
  const std::size_t count = allocations - before;
  REQUIRE(report);
  CHECK(report->to_text() == "");
  return count;
}

/// The minimum max_steps that the validation needs.
std::size_t steps_of(const Shapes& shapes, const Graph& data) {
  std::size_t low = 0, high = 100'000'000;
  while (low + 1 < high) {
    ValidateOptions options;
    options.max_steps = low + (high - low) / 2;
    (lrt::shacl::validate(shapes, data, options) ? high : low) = options.max_steps;
  }
  return high;
}

}  // namespace

TEST_CASE("satisfied constraints do not allocate", "[shacl]") {
  const Shapes shapes = shacl_test::compile(shape);
  const std::size_t few = allocations_of(shapes, shacl_test::parse(joints(100))), many = allocations_of(shapes, shacl_test::parse(joints(3000)));
  INFO(few << " and " << many << " allocations");
  CHECK(many < few + 25);  // scratch memory grows by doubling; no allocation for each node
  CHECK(few < 60);
}

TEST_CASE("work grows with the focus nodes, also past a node with very many triples", "[shacl]") {
  const Shapes shapes = shacl_test::compile(shape);
  const std::size_t few = steps_of(shapes, shacl_test::parse(joints(100))), many = steps_of(shapes, shacl_test::parse(joints(1000)));
  INFO(few << " and " << many << " steps");
  CHECK(many < few * 11);
  CHECK(many > few * 9);
}
