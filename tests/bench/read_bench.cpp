// Timings of rdf::read: bodies of a few triples, documents of 1 MiB, and documents made to be slow.
//
//   read_bench                            the bodies and documents
//   read_bench linear [KiB, default 64]   documents made to be slow, of that size and eight times it: time for each byte of both
//
// Prints medians of CPU time. Nothing is asserted.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/rdf/codec.hpp>

#include "tests/bench/cpu.hpp"

namespace {

using lrt::rdf::Syntax;

const std::string target = "http://example.org/baxter/right_s1/actions/rotate";
const std::string prefixes =
    "@prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> .\n@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .\n"
    "@prefix vom: <http://vocab.arvida.de/2015/06/vom/vocab#> .\n"
    "@prefix maths: <http://vocab.arvida.de/2015/06/maths/vocab#> .\n";

/// Figure 5b of the paper, with a time.
const std::string four_triples = prefixes +
                                 "<>\n  rdf:type maths:Scalar ;\n  vom:numericalValue \"43.6\"^^xsd:float ;\n"
                                 "  vom:unit maths:Degree ;\n  vom:time \"2018-06-04T09:00:00Z\"^^xsd:dateTime .\n";

/// A pose: nodes in brackets, a list, several datatypes.
const std::string twelve_triples = prefixes +
                                   "<> a maths:Pose ;\n  vom:frame <../frame> ;\n"
                                   "  vom:position [ maths:x 0.25 ; maths:y \"1.5\"^^xsd:double ; maths:z -3e-1 ] ;\n"
                                   "  vom:title \"the pose of a joint\"@en ;\n  vom:limits ( 0 6.28 ) .\n";

std::string repeated(std::size_t bytes, const std::function<std::string(std::size_t)>& part, std::string text = {}) {
  for (std::size_t i = 0; text.size() < bytes; ++i) text += part(i);
  return text;
}
std::string number(std::size_t i) { return std::to_string(i); }

lrt::rdf::ReadOptions options() {
  lrt::rdf::ReadOptions o;
  o.base = target;
  o.max_triples = 10'000'000;
  o.max_bytes = std::size_t{1} << 30;
  return o;
}

double read_once(const std::string& text, Syntax syntax, std::size_t repeats, std::size_t& triples) {
  const double start = bench::cpu_microseconds(0);
  for (std::size_t i = 0; i < repeats; ++i) {
    const auto graph = lrt::rdf::read(text, syntax, options());
    triples = graph ? graph->size() : 0;
  }
  return (bench::cpu_microseconds(0) - start) / static_cast<double>(repeats);
}

double median(const std::string& text, Syntax syntax, std::size_t rounds, std::size_t repeats, std::size_t& triples) {
  std::vector<double> times;
  for (std::size_t round = 0; round < rounds; ++round) times.push_back(read_once(text, syntax, repeats, triples));
  std::sort(times.begin(), times.end());
  return times[times.size() / 2];
}

void show(const char* what, const std::string& text, Syntax syntax, std::size_t rounds, std::size_t repeats) {
  std::size_t triples = 0;
  const double us = median(text, syntax, rounds, repeats, triples);
  std::printf("%-44s %10.2f us   %7zu bytes   %6zu triples   %6.1f MB/s\n", what, us, text.size(), triples,
              static_cast<double>(text.size()) / us);
}

std::size_t slow_bytes = std::size_t{64} << 10;

void show_growth(const char* what, const std::function<std::string(std::size_t)>& document, Syntax syntax = Syntax::turtle) {
  const std::string small = document(slow_bytes), large = document(8 * slow_bytes);
  std::size_t triples = 0;
  const double a = 1000 * median(small, syntax, 9, 1, triples) / static_cast<double>(small.size());
  const double b = 1000 * median(large, syntax, 3, 1, triples) / static_cast<double>(large.size());
  std::printf("%-44s %8.2f ns/byte, %8.2f when eight times as long: factor %.2f%s\n", what, a, b, b / a,
              triples == 0 ? "   (no triples)" : "");
}

void linear() {
  const std::string long_name(7000, 'n');
  const auto documents = [&](const char* what, std::string before, std::function<std::string(std::size_t)> part) {
    show_growth(what, [=](std::size_t bytes) { return repeated(bytes, part, before); });
  };
  documents("plain triples", "",
            [](std::size_t i) { return "<http://x/" + number(i) + "> <http://x/p> \"" + number(i) + "\" .\n"; });
  documents("labels of blank nodes", "",
            [](std::size_t i) { return "_:n" + number(i) + " <a:p> _:n" + number(i * 7 % 1000) + " .\n"; });
  documents("nodes in brackets", "", [](std::size_t) { return "[] <a:p> [], [ <a:q> [] ] .\n"; });
  show_growth("one list", [](std::size_t bytes) {
    return repeated(
               bytes, [](std::size_t i) { return number(i) + " "; }, "<a:s> <a:p> (") +
           ") .";
  });
  documents("lists 900 deep", "",
            [](std::size_t) { return "<a:s> <a:p> " + std::string(900, '(') + std::string(900, ')') + " .\n"; });
  documents("brackets 900 deep", "", [](std::size_t) {
    std::string text = "<a:s> <a:p> ";
    for (int i = 0; i < 900; ++i) text += "[<a:p>";
    return text + " 1" + std::string(900, ']') + " .\n";
  });
  documents("1000 prefixes",
            repeated(60'000,
                     [](std::size_t i) {
                       return i < 1000 ? "@prefix p" + number(i) + ": <http://x/" + number(i) + "#> .\n"
                                       : std::string(60'000, ' ');
                     }),
            [](std::size_t i) {
              return "p" + number(i % 1000) + ":s p" + number(i * 7 % 1000) + ":p p" + number(i * 11 % 1000) + ":o .\n";
            });
  documents("a prefix of 7000 bytes", "@prefix p: <http://x/" + long_name + "> .\n",
            [](std::size_t i) { return "p:" + number(i) + " p: p: .\n"; });
  documents("a base of 7000 bytes", "@base <http://x/" + long_name + "/> .\n",
            [](std::size_t i) { return "<" + number(i) + "> <> <..> .\n"; });
  documents("a base of 3500 segments", "@base <http://x/" + repeated(7000, [](std::size_t) { return "a/"; }) + "> .\n",
            [](std::size_t i) { return "<" + number(i) + "> <> <..> .\n"; });
  documents("a base of 7000 bytes without an authority", "@base <urn:x/" + long_name + "/> .\n",
            [](std::size_t i) { return "<" + number(i) + "> <> <..> .\n"; });
  documents("a reference of many segments", "",
            [](std::size_t) { return "<" + repeated(8000, [](std::size_t) { return "a/../"; }) + "> <a:p> 1 .\n"; });
  documents("IRIs of 8 KiB", "", [&](std::size_t i) { return "<http://x/" + long_name + number(i) + "> <a:p> 1 .\n"; });
  show_growth("one long string", [](std::size_t bytes) { return "<a:s> <a:p> \"" + std::string(bytes, 'x') + "\" ."; });
  show_growth("quotes in a long string", [](std::size_t bytes) {
    return "<a:s> <a:p> \"\"\"" + repeated(bytes, [](std::size_t) { return "\"\"x"; }) + "\"\"\" .";
  });
  show_growth("escapes", [](std::size_t bytes) {
    return "<a:s> <a:p> \"" + repeated(bytes, [](std::size_t) { return "\\u0041"; }) + "\" .";
  });
  documents("comments", "<a:s> <a:p> 1 .\n", [](std::size_t) { return "# #\n"; });
  documents("dots in names", "@prefix p: <a:> .\n", [](std::size_t) { return "p:a" + std::string(1000, '.') + "b p:p 1 .\n"; });
  documents("dots in labels", "", [](std::size_t) { return "_:a" + std::string(1000, '.') + "b <a:p> 1 .\n"; });
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1 && std::string_view(argv[1]) == "linear") {
    if (argc > 2) slow_bytes = std::strtoull(argv[2], nullptr, 10) << 10;
    linear();
    return 0;
  }
  show("4 triples", four_triples, Syntax::turtle, 21, 2000);
  show("12 triples, some in a list", twelve_triples, Syntax::turtle, 21, 2000);
  const std::size_t mib = std::size_t{1} << 20;
  const std::string readings = repeated(
      mib,
      [](std::size_t i) {
        return "<joint/" + number(i) + "> rdf:type maths:Scalar ; vom:numericalValue \"" + number(i) +
               ".5\"^^xsd:float ; vom:unit maths:Degree .\n";
      },
      prefixes);
  const std::string lines = repeated(mib, [](std::size_t i) {
    return "<http://example.org/joint/" + number(i) + "> <http://vocab.arvida.de/2015/06/vom/vocab#numericalValue> \"" +
           number(i) + ".5\"^^<http://www.w3.org/2001/XMLSchema#float> .\n";
  });
  show("1 MiB of Turtle", readings, Syntax::turtle, 11, 1);
  show("1 MiB of Turtle, numbers in a list",
       repeated(
           mib, [](std::size_t i) { return number(i) + ".25 "; }, prefixes + "<> vom:numericalValue (") +
           ") .",
       Syntax::turtle, 11, 1);
  show("1 MiB of N-Triples", lines, Syntax::n_triples, 11, 1);
}
