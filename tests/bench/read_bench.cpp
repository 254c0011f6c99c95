// SPDX-License-Identifier: Apache-2.0
// Timings of rdf::read: bodies of a few triples, documents of 1 MiB, and documents made to be slow.
//
//   read_bench                            the bodies and documents
//   read_bench linear [KiB, default 64]   documents made to be slow, of that size and eight times it: time for each byte of both
//   read_bench serd [MB, default 8]       large documents in Turtle and N-Triples, in turn with the command serdi if it is installed;
//                                         lrt builds a graph, serdi writes what it reads as N-Triples to /dev/null
//
// Prints medians of CPU time. Nothing is asserted.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <sys/resource.h>
#include <unistd.h>

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
  std::printf("%-44s %10.2f us   %7zu bytes   %6zu triples   %6.1f MB/s\n", what, us, text.size(), triples, static_cast<double>(text.size()) / us);
}

std::size_t slow_bytes = std::size_t{64} << 10;

void show_growth(const char* what, const std::function<std::string(std::size_t)>& document, Syntax syntax = Syntax::turtle) {
  const std::string small = document(slow_bytes), large = document(8 * slow_bytes);
  std::size_t triples = 0;
  const double a = 1000 * median(small, syntax, 9, 1, triples) / static_cast<double>(small.size());
  const double b = 1000 * median(large, syntax, 3, 1, triples) / static_cast<double>(large.size());
  std::printf("%-44s %8.2f ns/byte, %8.2f when eight times as long: factor %.2f%s\n", what, a, b, b / a, triples == 0 ? "   (no triples)" : "");
}

void linear() {
  const std::string long_name(7000, 'n');
  const auto documents = [&](const char* what, std::string before, std::function<std::string(std::size_t)> part) {
    show_growth(what, [=](std::size_t bytes) { return repeated(bytes, part, before); });
  };
  documents("plain triples", "", [](std::size_t i) { return "<http://x/" + number(i) + "> <http://x/p> \"" + number(i) + "\" .\n"; });
  documents("labels of blank nodes", "", [](std::size_t i) { return "_:n" + number(i) + " <a:p> _:n" + number(i * 7 % 1000) + " .\n"; });
  documents("nodes in brackets", "", [](std::size_t) { return "[] <a:p> [], [ <a:q> [] ] .\n"; });
  show_growth("one list", [](std::size_t bytes) {
    return repeated(
               bytes, [](std::size_t i) { return number(i) + " "; }, "<a:s> <a:p> (") +
           ") .";
  });
  documents("lists 900 deep", "", [](std::size_t) { return "<a:s> <a:p> " + std::string(900, '(') + std::string(900, ')') + " .\n"; });
  documents("brackets 900 deep", "", [](std::size_t) {
    std::string text = "<a:s> <a:p> ";
    for (int i = 0; i < 900; ++i) text += "[<a:p>";
    return text + " 1" + std::string(900, ']') + " .\n";
  });
  documents(
      "1000 prefixes",
      repeated(60'000,
               [](std::size_t i) { return i < 1000 ? "@prefix p" + number(i) + ": <http://x/" + number(i) + "#> .\n" : std::string(60'000, ' '); }),
      [](std::size_t i) { return "p" + number(i % 1000) + ":s p" + number(i * 7 % 1000) + ":p p" + number(i * 11 % 1000) + ":o .\n"; });
  documents("a prefix of 7000 bytes", "@prefix p: <http://x/" + long_name + "> .\n", [](std::size_t i) { return "p:" + number(i) + " p: p: .\n"; });
  documents("a base of 7000 bytes", "@base <http://x/" + long_name + "/> .\n", [](std::size_t i) { return "<" + number(i) + "> <> <..> .\n"; });
  documents("a base of 3500 segments", "@base <http://x/" + repeated(7000, [](std::size_t) { return "a/"; }) + "> .\n",
            [](std::size_t i) { return "<" + number(i) + "> <> <..> .\n"; });
  documents("a base of 7000 bytes without an authority", "@base <urn:x/" + long_name + "/> .\n",
            [](std::size_t i) { return "<" + number(i) + "> <> <..> .\n"; });
  documents("a reference of many segments", "",
            [](std::size_t) { return "<" + repeated(8000, [](std::size_t) { return "a/../"; }) + "> <a:p> 1 .\n"; });
  documents("IRIs of 8 KiB", "", [&](std::size_t i) { return "<http://x/" + long_name + number(i) + "> <a:p> 1 .\n"; });
  show_growth("one long string", [](std::size_t bytes) { return "<a:s> <a:p> \"" + std::string(bytes, 'x') + "\" ."; });
  show_growth("quotes in a long string",
              [](std::size_t bytes) { return "<a:s> <a:p> \"\"\"" + repeated(bytes, [](std::size_t) { return "\"\"x"; }) + "\"\"\" ."; });
  show_growth("escapes", [](std::size_t bytes) { return "<a:s> <a:p> \"" + repeated(bytes, [](std::size_t) { return "\\u0041"; }) + "\" ."; });
  documents("comments", "<a:s> <a:p> 1 .\n", [](std::size_t) { return "# #\n"; });
  documents("dots in names", "@prefix p: <a:> .\n", [](std::size_t) { return "p:a" + std::string(1000, '.') + "b p:p 1 .\n"; });
  documents("dots in labels", "", [](std::size_t) { return "_:a" + std::string(1000, '.') + "b <a:p> 1 .\n"; });
}

double children_microseconds() {
  rusage usage{};
  ::getrusage(RUSAGE_CHILDREN, &usage);
  const auto us = [](const timeval& time) { return static_cast<double>(time.tv_sec) * 1e6 + static_cast<double>(time.tv_usec); };
  return us(usage.ru_utime) + us(usage.ru_stime);
}

/// Runs serdi on a document; its CPU time.
double serdi_once(const std::string& path, Syntax syntax) {
  const double start = children_microseconds();
  const std::string command =
      std::string("serdi -i ") + (syntax == Syntax::turtle ? "turtle" : "ntriples") + " -o ntriples '" + path + "' > /dev/null";
  if (std::system(command.c_str()) != 0) std::fprintf(stderr, "serdi refused %s\n", path.c_str()), std::exit(1);
  return children_microseconds() - start;
}

/// @return  MB/s of lrt; `serd` becomes that of serdi, or 0
double rate(const std::string& text, Syntax syntax, bool has_serdi, double& serd) {
  std::string path = (std::filesystem::temp_directory_path() / "read_bench_XXXXXX").string();
  const int file = ::mkstemp(path.data());
  if (file < 0) std::perror("mkstemp"), std::exit(1);
  ::close(file);
  std::ofstream(path) << text;
  std::vector<double> ours, theirs;
  std::size_t triples = 0;
  for (int round = 0; round < 5; ++round) {
    ours.push_back(read_once(text, syntax, 1, triples));
    if (has_serdi) theirs.push_back(serdi_once(path, syntax));
  }
  ::unlink(path.c_str());
  if (triples == 0) std::fprintf(stderr, "no triples\n"), std::exit(1);
  const auto middle = [&](std::vector<double>& times) {
    std::sort(times.begin(), times.end());
    return static_cast<double>(text.size()) / times[times.size() / 2];
  };
  serd = has_serdi ? middle(theirs) : 0;
  return middle(ours);
}

void beside_serd(std::size_t bytes) {
  const bool has_serdi = std::system("serdi -v > /dev/null 2>&1") == 0;
  if (!has_serdi) std::printf("serdi is not installed: only lrt is measured\n");
  std::printf("%-28s %10s %10s %8s   %10s %10s %8s %8s\n", "MB/s", "Turtle", "serd", "ratio", "N-Triples", "serd", "ratio", "to serd's Turtle");
  const auto compare = [&](const char* what, const std::string& turtle) {
    const auto graph = lrt::rdf::read(turtle, Syntax::turtle, options());
    if (!graph) std::fprintf(stderr, "%s: %s\n", what, graph.error().message.c_str()), std::exit(1);
    double serd = 0, serd_lines = 0;
    const double ours = rate(turtle, Syntax::turtle, has_serdi, serd);
    const double lines = rate(lrt::rdf::write(*graph, Syntax::n_triples).value(), Syntax::n_triples, has_serdi, serd_lines);
    if (has_serdi)
      std::printf("%-28s %10.1f %10.1f %8.2f   %10.1f %10.1f %8.2f %8.2f\n", what, ours, serd, ours / serd, lines, serd_lines, lines / serd_lines,
                  lines / serd);
    else std::printf("%-28s %10.1f %10s %8s   %10.1f\n", what, ours, "", "", lines);
  };
  const std::string names = prefixes + "@prefix ex: <http://example.org/robot/> .\n";
  compare("readings and poses", repeated(
                                    bytes,
                                    [](std::size_t i) {
                                      return "ex:joint" + number(i) + " a maths:Scalar ;\n  vom:numericalValue \"" + number(i * 37) +
                                             ".25\"^^xsd:double ;\n  vom:unit maths:Degree ;\n  vom:time \"2018-06-04T09:00:" + number(10 + i % 50) +
                                             "Z\"^^xsd:dateTime ;\n  vom:position [ maths:x " + number(i % 7) + ".5 ; maths:y " + number(i % 11) +
                                             " ; maths:z -" + number(i % 13) + ".25 ] ;\n  vom:partOf <http://example.org/robot/arm" + number(i / 7) +
                                             "> .\n";
                                    },
                                    names));
  compare("labels", repeated(
                        bytes,
                        [](std::size_t i) {
                          return "ex:joint" + number(i) + " a ex:Joint ; vom:title \"joint number " + number(i) + " of the robot\"@en , \"Gelenk " +
                                 number(i) + " des Roboters\"@de ; ex:next ex:joint" + number(i + 1) + " .\n";
                        },
                        names));
  compare("one list of numbers", repeated(
                                     bytes, [](std::size_t i) { return number(i) + ".25 "; }, names + "<http://x/> vom:numericalValue (") +
                                     ") .");
  compare("scans of 360 numbers", repeated(
                                      bytes,
                                      [](std::size_t i) {
                                        std::string scan = "ex:scan" + number(i) + " vom:numericalValue (";
                                        for (std::size_t k = 0; k < 360; ++k) scan += " " + number((i * 31 + k * 7) % 30) + "." + number(100 + k);
                                        return scan + " ) .\n";
                                      },
                                      names));
  compare("absolute IRIs", repeated(bytes, [](std::size_t i) {
            return "<http://example.org/robot/joint" + number(i) +
                   "> <http://vocab.arvida.de/2015/06/vom/vocab#next> <http://example.org/robot/joint" + number(i + 1) + "> .\n";
          }));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1 && std::string_view(argv[1]) == "linear") {
    if (argc > 2) slow_bytes = std::strtoull(argv[2], nullptr, 10) << 10;
    linear();
    return 0;
  }
  if (argc > 1 && std::string_view(argv[1]) == "serd") {
    beside_serd((argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 8) * 1'000'000);
    return 0;
  }
  show("4 triples", four_triples, Syntax::turtle, 21, 2000);
  show("12 triples, some in a list", twelve_triples, Syntax::turtle, 21, 2000);
  const std::size_t mib = std::size_t{1} << 20;
  const std::string readings = repeated(
      mib,
      [](std::size_t i) {
        return "<joint/" + number(i) + "> rdf:type maths:Scalar ; vom:numericalValue \"" + number(i) + ".5\"^^xsd:float ; vom:unit maths:Degree .\n";
      },
      prefixes);
  const std::string lines = repeated(mib, [](std::size_t i) {
    return "<http://example.org/joint/" + number(i) + "> <http://vocab.arvida.de/2015/06/vom/vocab#numericalValue> \"" + number(i) +
           ".5\"^^<http://www.w3.org/2001/XMLSchema#float> .\n";
  });
  show("1 MiB of Turtle", readings, Syntax::turtle, 11, 1);
  show("1 MiB of Turtle, numbers in a list",
       repeated(
           mib, [](std::size_t i) { return number(i) + ".25 "; }, prefixes + "<> vom:numericalValue (") +
           ") .",
       Syntax::turtle, 11, 1);
  show("1 MiB of N-Triples", lines, Syntax::n_triples, 11, 1);
}
