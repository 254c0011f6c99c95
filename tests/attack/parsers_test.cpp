#include <lrt/rdf/codec.hpp>

#include <chrono>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <string>

#include <lrt/shacl/validator.hpp>

#include "tests/support/catch.hpp"

// Inputs that were expensive for their size. Each prints its time, which no test asserts: how the work is bounded is tested beside each part.
// LRT_ATTACK_FACTOR=4 makes them four times as long.

namespace {

namespace rdf = lrt::rdf;

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
        rdf::read(std::string("@prefix sh: <http://www.w3.org/ns/shacl#> . <s> sh:targetObjectsOf <p> ; sh:pattern \"") +
                      pattern + "\" .",
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
        CHECK(std::string(report->results()[0].messages[0].view().text).find("stopped at its limit of work") !=
              std::string::npos);
      });
    }
  }
}
