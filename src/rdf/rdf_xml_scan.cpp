#include "src/rdf/rdf_xml_scan.hpp"

#include <lrt/base/utf8.hpp>

#include "src/base/ascii.hpp"
#include "src/rdf/turtle_scan.hpp"

namespace lrt::rdf {
namespace {

constexpr std::size_t npos = std::string_view::npos;
constexpr std::string_view spaces = " \t\r\n";

/// What stands in quotes behind a name, white space and "="; `from` is its offset, or npos if there is no such thing.
std::string_view attribute_value(std::string_view text, std::size_t behind_name, std::size_t& from) {
  from = text.find_first_not_of(spaces, behind_name);
  if (from == npos || text[from] != '=') return from = npos, std::string_view();
  from = text.find_first_not_of(spaces, from + 1);
  if (from == npos || (text[from] != '"' && text[from] != '\'')) return from = npos, std::string_view();
  const std::size_t end = text.find(text[from], from + 1);
  ++from;
  return text.substr(from, end == npos ? npos : end - from);
}

}  // namespace

Result<void> scan_rdf_xml(std::string_view text) {
  if (const auto at = utf8::find_invalid(text)) return misread(text, *at, "invalid UTF-8");
  if (const std::size_t at = text.find('\0'); at != npos) return misread(text, at, "U+0000 is not accepted");

  // The prolog (XML 1.0 2.8): white space, comments and instructions before the root element.
  std::size_t at = text.substr(0, 3) == "\xEF\xBB\xBF" ? 3 : 0;
  for (;;) {
    at = text.find_first_not_of(spaces, at);
    if (at == npos || text[at] != '<') break;
    const std::string_view rest = text.substr(at);
    if (rest.substr(0, 2) == "<?") {
      const std::size_t end = rest.find("?>");
      const std::string_view instruction = rest.substr(0, end);
      if (const std::size_t name = instruction.find("encoding"); instruction.substr(0, 5) == "<?xml" && name != npos) {
        std::size_t from = 0;
        const std::string_view encoding = attribute_value(instruction, name + 8, from);
        if (!detail::iequals_ascii(encoding, "utf-8") && !detail::iequals_ascii(encoding, "us-ascii")) {
          return misread(text, at, "expected the encoding UTF-8");
        }
      }
      if (end == npos) break;
      at += end + 2;
    } else if (rest.substr(0, 4) == "<!--") {
      const std::size_t end = rest.find("-->", 4);
      if (end == npos) break;
      at += end + 3;
    } else if (rest.substr(0, 2) == "<!") {
      return misread(text, at, "a document type declaration is not accepted");
    } else {
      break;
    }
  }

  constexpr std::string_view lang = "xml:lang";
  for (at = text.find(lang); at != npos; at = text.find(lang, at + 1)) {
    std::size_t from = 0;
    if (attribute_value(text, at + lang.size(), from).size() > max_language_tag) {
      return misread(text, from, "language tag of more than " + std::to_string(max_language_tag) + " bytes");
    }
  }
  return {};
}

}  // namespace lrt::rdf
