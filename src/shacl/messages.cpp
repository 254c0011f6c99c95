#include "src/shacl/messages.hpp"

#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/value_codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/shacl/plan.hpp"

namespace lrt::shacl {
namespace {

/// Turtle's short forms.
bool is_bare(const rdf::TermView& term) noexcept {
  if (!term.is_literal() || term.text.size() > 40) return false;
  if (term.datatype == vocab::xsd::integer.text) return rdf::lexical::is_integer(term.text);
  if (term.datatype == vocab::xsd::decimal.text)
    return rdf::lexical::is_decimal(term.text) && term.text.find('.') != std::string_view::npos && term.text.back() != '.';
  return term.datatype == vocab::xsd::boolean.text && (term.text == "true" || term.text == "false");
}

}  // namespace

std::string shown(const rdf::TermView& term) {
  constexpr std::size_t longest = 80;
  if (term.is_iri()) return rdf::abbreviate(term.text);
  if (is_bare(term)) return std::string(term.text);
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

std::string shown_shape(const Plan& plan, std::uint32_t shape) {
  const rdf::TermView id = plan.graph.term(plan.shapes[shape].id);
  if (!id.is_blank()) return shown(id);
  for (const Iri name : {vocab::sh::name, vocab::rdfs::label})
    if (const auto text = plan.graph.object(id, name); text && text->is_literal())
      return "the shape " + shown(rdf::literal(text->text));
  return "the shape given there";
}

std::string counted(std::size_t n, const char* one, const char* many) {
  return std::to_string(n) + " " + (n == 1 ? one : many);
}

}  // namespace lrt::shacl
