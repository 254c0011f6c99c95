// SPDX-License-Identifier: Apache-2.0
#include "src/query/parser.hpp"

#include <string>

#include "src/base/utf8.hpp"
#include "src/query/grammar.hpp"

namespace lrt::query {

Result<std::shared_ptr<const Query>> parse(std::string_view text, const ParseOptions& options) {
  if (text.size() > options.max_bytes) {
    return unexpected(Errc::limit_exceeded,
                      "found a query of " + std::to_string(text.size()) + " bytes, expected at most " + std::to_string(options.max_bytes));
  }
  if (const auto at = utf8::find_invalid(text)) return rdf::misread(text, *at, utf8::fault_of(text));
  if (!options.base.empty() && !iri::is_absolute(options.base)) {
    return unexpected(Errc::expected_iri, "base: expected an absolute IRI, found <" + std::string(options.base) + ">");
  }
  const Source source(text);
  return Grammar(source, options).run();
}

}  // namespace lrt::query
