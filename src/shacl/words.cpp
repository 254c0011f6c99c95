#include "src/shacl/words.hpp"

#include <lrt/rdf/value_codec.hpp>
#include <lrt/rdf/vocab.hpp>

namespace lrt::shacl {

std::string shown(const rdf::TermView& term) {
  constexpr std::size_t longest = 80;
  if (term.is_iri()) return rdf::abbreviate(term.text);
  std::size_t length = term.text.size();
  if (length > longest) {
    length = longest;
    while (length > 0 && (static_cast<unsigned char>(term.text[length]) & 0xC0) == 0x80) --length;
  }
  rdf::TermView cut(term.kind, term.text.substr(0, length), vocab::xsd::string.text, {});
  std::string text = rdf::to_string(cut);
  if (length < term.text.size()) text += " (cut)";
  if (!term.is_literal()) return text;
  if (!term.language.empty()) return text + "@" + std::string(term.language);
  return term.datatype == vocab::xsd::string.text ? text : text + "^^" + rdf::abbreviate(term.datatype);
}

std::string counted(std::size_t n, const char* one, const char* many) { return std::to_string(n) + " " + (n == 1 ? one : many); }

}  // namespace lrt::shacl
