// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/codec.hpp>

#include <chrono>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <string>

#include <lrt/shacl/validator.hpp>

#include "src/rdf/hash.hpp"
#include "tests/support/allocations.hpp"
#include "tests/support/catch.hpp"

// Inputs that were expensive for their size. Each prints its time, which no test asserts: how the work is bounded is tested beside each part.
// LRT_ATTACK_FACTOR=4 makes them four times as long.

namespace {

namespace rdf = lrt::rdf;
using rdf::Prefixes;

std::size_t factor() {
  const char* const text = std::getenv("LRT_ATTACK_FACTOR");
  return text ? std::strtoul(text, nullptr, 10) : 1;
}

std::string repeated(std::string_view text, std::size_t bytes) {
  std::string out;
  while (out.size() < bytes) out += text;
  return out;
}

template <class Work>
void timed(std::string_view name, std::size_t bytes, Work&& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  std::cout << name << ": " << bytes << " bytes, " << ms << " ms\n";
}

}  // namespace

TEST_CASE("texts for which a pattern is quadratic", "[attack]") {
  for (const char* pattern : {"[0-9]+ kg", "\\\\d{3000}x", "([0-9]+)\\\\1 kg"}) {
    const auto shapes =
        rdf::read(std::string("@prefix sh: <http://www.w3.org/ns/shacl#> . <s> sh:targetObjectsOf <p> ; sh:pattern \"") + pattern + "\" .",
                  rdf::Syntax::turtle, [] {
                    rdf::ReadOptions options;
                    options.base = "http://robot/";
                    return options;
                  }());
    REQUIRE(shapes);
    const auto compiled = lrt::shacl::Shapes::compile(*shapes);
    REQUIRE(compiled);
    for (const std::size_t size : {65'536 * factor(), 131'072 * factor()}) {
      rdf::Graph data;
      data.add(rdf::iri("http://robot/a"), rdf::iri("http://robot/p"), rdf::literal(repeated("1", size) + "ygx"));
      timed(pattern, size, [&] {
        const auto report = lrt::shacl::validate(*compiled, data);
        REQUIRE(report);
        REQUIRE(report->results().size() == 1);
        CHECK(std::string(report->results()[0].messages[0].view().text).find("stopped at its limit of work") != std::string::npos);
      });
    }
  }
}

TEST_CASE("references to lrt's own context share it", "[attack][json_ld]") {
  const Prefixes prefixes = {{"ex", "http://example.org/"}};  // as of a robot with a vocabulary of its own
  rdf::ReadOptions options;
  options.base = "http://robot/";
  options.context = "http://robot/c";
  for (const bool own_prefixes : {false, true}) {
    options.context_prefixes = own_prefixes ? &prefixes : nullptr;
    const auto cost = [&](const std::string& text, const char* name) {
      const auto first = rdf::read(text, rdf::Syntax::json_ld, options);  // parses the context once for the process
      if (!first) FAIL(first.error().message);
      const std::size_t before = lrt::test::allocations;
      timed(name, text.size(), [&] { CHECK(rdf::read(text, rdf::Syntax::json_ld, options)); });
      return lrt::test::allocations - before;
    };
    CHECK(cost(R"({"@context":"c","x":1})", "one reference to the own context") < 100);
    const char* const in_arrays = R"({"@context":[{},"c"]},)";
    const char* const after_terms = R"({"@context":[{"a":"e:a"},"c","c",{"b":"e:b"},"c"]},)";
    const char* const nested = R"({"@context":"c"},)";
    for (const char* object : {in_arrays, after_terms, nested}) {
      // Objects with terms are few: the terms of a document are limited.
      const std::size_t bytes = object == after_terms ? 80'000 : 1'000'000 * factor();
      std::string text =
          R"({"@context":{"@base":"http://robot/)" + repeated("long/", 4'000) + R"("},"http://e/p":[)" + repeated(object, bytes) + "1]}";
      const std::size_t objects = text.size() / std::string_view(object).size();
      CHECK(cost(text, object) < 60 * objects);
    }
  }
}

TEST_CASE("triples chosen for a hash without a seed", "[attack]") {
  constexpr std::size_t terms = 1'000, window = 256, slots = 32'768;
  const auto unseeded = [](std::uint32_t s, std::uint32_t p, std::uint32_t o) {
    return rdf::fold_multiply((static_cast<std::uint64_t>(s) << 32 | p) ^ 0xA0761D6478BD642Fu, o ^ 0xE7037ED1A0B428DBu);
  };
  const auto name = [](std::size_t k) { return k == 1 ? std::string("<p>") : "<" + std::to_string(k) + ">"; };
  std::string text = name(0) + name(1);  // the terms of a document are numbered as they appear: <0> is 0, the predicate is 1
  for (std::size_t k = 2; k < terms; ++k) text += name(k) + (k + 1 < terms ? "," : ".");
  std::size_t chosen = 0;
  for (std::uint32_t s = 0; s < terms; ++s)
    for (std::uint32_t o = 2; o < terms; ++o)
      if (s != 1 && (unseeded(s, 1, o) & (slots - 1)) < window) text += name(s) + name(1) + name(o) + ".", ++chosen;
  rdf::ReadOptions options;
  options.base = "http://r/";
  timed(std::to_string(chosen) + " chosen triples", text.size(), [&] {
    const auto graph = rdf::read(text, rdf::Syntax::turtle, options);
    if (!graph) FAIL(graph.error().message);
    CHECK(graph->size() > chosen);
  });
}
