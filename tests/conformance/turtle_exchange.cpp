// SPDX-License-Identifier: Apache-2.0
#include <iostream>
#include <iterator>
#include <string>
#include <string_view>

#include <lrt/rdf/codec.hpp>

// Turtle documents on the standard input, separated by NUL, as N-Triples on the standard output, separated by NUL; "error: ..." for
// a document that is refused. The base is http://base/a/b.

int main() {
  const std::string all((std::istreambuf_iterator<char>(std::cin)), std::istreambuf_iterator<char>());
  for (std::string_view rest = all; !rest.empty();) {
    const std::string_view document = rest.substr(0, rest.find('\0'));
    rest.remove_prefix(document.size() + (document.size() < rest.size()));
    const auto graph = lrt::rdf::read(document, lrt::rdf::Syntax::turtle, {"http://base/a/b"});
    std::cout << (graph ? lrt::rdf::write(*graph, lrt::rdf::Syntax::n_triples).value() : "error: " + graph.error().message) << '\0';
  }
}
