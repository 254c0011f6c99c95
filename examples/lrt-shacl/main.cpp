// SPDX-License-Identifier: Apache-2.0
// Validates an RDF file against the shapes of another. Needs no server.
//
//   lrt-shacl [--format turtle|n-triples|rdf-xml|text] DATA SHAPES [BASE-IRI]
//
// Prints the report on standard output. Exit status: 0 the data conform, 1 they do not, 2 an error (printed on standard error). The suffix of a
// file selects its syntax: .ttl, .nt, .rdf or .xml; "-" reads Turtle from standard input.

#include <fstream>
#include <iostream>
#include <iterator>
#include <string>
#include <vector>

#include <lrt/rdf/codec.hpp>
#include <lrt/shacl/validator.hpp>

namespace {

constexpr const char* usage = "usage: lrt-shacl [--format turtle|n-triples|rdf-xml|text] DATA SHAPES [BASE-IRI]\n";
constexpr int conforms = 0, does_not_conform = 1, not_judged = 2;

bool ends_with(const std::string& text, std::string_view end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

lrt::Result<lrt::rdf::Graph> read_file(const std::string& name, const std::string& base) {
  std::string text;
  if (name == "-") {
    text.assign(std::istreambuf_iterator<char>(std::cin), {});
  } else {
    std::ifstream in(name, std::ios::binary);
    if (!in) return lrt::unexpected(lrt::Errc::io_error, "cannot be opened");
    text.assign(std::istreambuf_iterator<char>(in), {});
    if (in.bad()) return lrt::unexpected(lrt::Errc::io_error, "cannot be read");
  }
  auto syntax = lrt::rdf::Syntax::turtle;
  if (ends_with(name, ".nt")) syntax = lrt::rdf::Syntax::n_triples;
  else if (ends_with(name, ".rdf") || ends_with(name, ".xml")) syntax = lrt::rdf::Syntax::rdf_xml;
  else if (name != "-" && !ends_with(name, ".ttl")) return lrt::unexpected(lrt::Errc::unsupported_syntax, "expected .ttl, .nt, .rdf or .xml");
  lrt::rdf::ReadOptions options;
  options.base = base;
  options.max_triples = 10'000'000;
  return lrt::rdf::read(text, syntax, options);
}

int fail(const std::string& reason) {
  std::cerr << "lrt-shacl: " << reason << '\n';
  return not_judged;
}

int run(const std::vector<std::string>& arguments) {
  std::string format = "turtle";
  std::vector<std::string> names;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    if (arguments[i] == "--help" || arguments[i] == "-h") {
      std::cout << usage;
      return 0;
    }
    if (arguments[i] == "--format" && i + 1 < arguments.size()) format = arguments[++i];
    else if (arguments[i].rfind("--", 0) == 0) return fail("unknown option " + arguments[i] + "\n" + usage);
    else names.push_back(arguments[i]);
  }
  if (names.size() < 2 || names.size() > 3) return fail(std::string("expected DATA and SHAPES\n") + usage);
  if (format != "turtle" && format != "n-triples" && format != "rdf-xml" && format != "text") return fail("unknown format " + format + "\n" + usage);
  const std::string base = names.size() == 3 ? names[2] : "http://localhost/";

  const auto data = read_file(names[0], base);
  if (!data) return fail(names[0] + ": " + data.error().message);
  auto shapes_graph = read_file(names[1], base);
  if (!shapes_graph) return fail(names[1] + ": " + shapes_graph.error().message);
  const auto shapes = lrt::shacl::Shapes::compile(*std::move(shapes_graph));
  if (!shapes) return fail(names[1] + ": " + shapes.error().message);
  if (shapes->size() == 0) return fail(names[1] + ": there is no shape in it, so nothing would be judged");
  lrt::shacl::ValidateOptions options;
  options.max_steps = 10'000'000'000;
  const auto report = lrt::shacl::validate(*shapes, *data, options);
  if (!report) return fail(report.error().message);

  if (format == "text") {
    std::cout << report->to_text();
  } else {
    const auto syntax = format == "turtle"      ? lrt::rdf::Syntax::turtle
                        : format == "n-triples" ? lrt::rdf::Syntax::n_triples
                                                : lrt::rdf::Syntax::rdf_xml;
    const auto written = lrt::rdf::write(report->to_graph(), syntax);
    if (!written) return fail(written.error().message);
    std::cout << *written;
  }
  std::cout.flush();
  if (!std::cout) return fail("standard output cannot be written");
  return report->conforms() ? conforms : does_not_conform;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run({argv + 1, argv + argc});
  } catch (const std::exception& e) { return fail(e.what()); }
}
