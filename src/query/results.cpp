// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/query/answer.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/turns.hpp"
#include "src/base/utf8.hpp"
#include "src/base/quote.hpp"
#include "src/rdf/n_triples.hpp"

namespace lrt::query {
inline namespace v0 {
namespace {

using rdf::TermView;

/// Whether a literal is written without a datatype: xsd:string, or it has a language.
bool is_plain(const TermView& term) noexcept { return !term.language.empty() || term.datatype == vocab::xsd::string.text; }

// --- JSON

void append_json(std::string& out, const TermView& term) {
  out += term.is_iri() ? R"({"type":"uri","value":)" : term.is_blank() ? R"({"type":"bnode","value":)" : R"({"type":"literal","value":)";
  append_quoted(out, term.text);
  if (term.is_literal() && !term.language.empty()) {
    out += R"(,"xml:lang":)";
    append_quoted(out, term.language);
  } else if (term.is_literal() && !is_plain(term)) {
    out += R"(,"datatype":)";
    append_quoted(out, term.datatype);
  }
  out += '}';
}

std::string json(const Table& table) {
  std::string out = R"({"head":{"vars":[)";
  for (std::size_t i = 0; i < table.columns(); ++i) {
    if (i != 0) out += ',';
    append_quoted(out, table.variables()[i]);
  }
  out += R"(]},"results":{"bindings":[)";
  for (std::size_t row = 0; row < table.rows(); ++row) {
    if (row % Turns::units_between_rests == 0) Turns::rest_now();
    out += row == 0 ? "\n{" : ",\n{";
    bool first = true;
    for (std::size_t i = 0; i < table.columns(); ++i) {
      const auto term = table.at(row, i);
      if (!term) continue;
      if (!first) out += ',';
      first = false;
      append_quoted(out, table.variables()[i]);
      out += ':';
      append_json(out, *term);
    }
    out += '}';
  }
  return out += "]}}\n";
}

// --- XML

constexpr std::string_view xml_head = "<?xml version=\"1.0\"?>\n<sparql xmlns=\"http://www.w3.org/2005/sparql-results#\">\n";

/// Appends character data that is also fit for an attribute. False: XML 1.0 has no such character (2.2).
bool append_xml(std::string& out, std::string_view text) {
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t from = at;
    const char32_t c = utf8::decode(text, at);
    switch (c) {
      case '&': out += "&amp;"; break;
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '"': out += "&quot;"; break;
      case '\t': out += "&#9;"; break;
      case '\n': out += "&#10;"; break;
      case '\r': out += "&#13;"; break;
      default:
        if (c < 0x20 || c == 0xFFFE || c == 0xFFFF) return false;
        out.append(text, from, at - from);
    }
  }
  return true;
}

bool append_xml(std::string& out, const TermView& term) {
  if (!term.is_literal()) {
    out += term.is_iri() ? "<uri>" : "<bnode>";
    if (!append_xml(out, term.text)) return false;
    out += term.is_iri() ? "</uri>" : "</bnode>";
    return true;
  }
  out += "<literal";
  if (!term.language.empty()) {
    out += " xml:lang=\"";
    if (!append_xml(out, term.language)) return false;
    out += '"';
  } else if (!is_plain(term)) {
    out += " datatype=\"";
    if (!append_xml(out, term.datatype)) return false;
    out += '"';
  }
  out += '>';
  if (!append_xml(out, term.text)) return false;
  out += "</literal>";
  return true;
}

Result<std::string> xml(const Table& table) {
  std::string out(xml_head);
  out += "<head>";
  std::vector<std::string> names;  // as in attributes
  for (const std::string& variable : table.variables()) {
    std::string& name = names.emplace_back();
    if (!append_xml(name, variable)) return unexpected(Errc::unsupported_syntax, "a variable contains a character that XML 1.0 does not allow");
    out += "<variable name=\"" + name + "\"/>";
  }
  out += "</head>\n<results>\n";
  for (std::size_t row = 0; row < table.rows(); ++row) {
    if (row % Turns::units_between_rests == 0) Turns::rest_now();
    out += "<result>";
    for (std::size_t i = 0; i < table.columns(); ++i) {
      const auto term = table.at(row, i);
      if (!term) continue;
      out += "<binding name=\"" + names[i] + "\">";
      if (!append_xml(out, *term)) {
        return unexpected(Errc::unsupported_syntax, "row " + std::to_string(row + 1) + ", ?" + table.variables()[i] +
                                                        ": found a character that XML 1.0 does not allow; use another format");
      }
      out += "</binding>";
    }
    out += "</result>\n";
  }
  return out += "</results>\n</sparql>\n";
}

// --- CSV and TSV

/// A field of CSV (RFC 4180 2): in quotes if it has what separates fields, or space at an end, which readers may drop.
void append_csv(std::string& out, std::string_view text) {
  const bool padded = !text.empty() && (text.front() == ' ' || text.back() == ' ');
  if (!padded && text.find_first_of("\",\r\n") == std::string_view::npos) {
    out += text;
    return;
  }
  out += '"';
  for (const char c : text) {
    if (c == '"') out += '"';
    out += c;
  }
  out += '"';
}

std::string csv(const Table& table) {
  std::string out;
  for (std::size_t i = 0; i < table.columns(); ++i) {
    if (i != 0) out += ',';
    append_csv(out, table.variables()[i]);
  }
  out += "\r\n";
  for (std::size_t row = 0; row < table.rows(); ++row) {
    if (row % Turns::units_between_rests == 0) Turns::rest_now();
    for (std::size_t i = 0; i < table.columns(); ++i) {
      if (i != 0) out += ',';
      const auto term = table.at(row, i);
      if (term && term->is_blank()) (out += "_:") += term->text;
      else if (term && !term->text.empty()) append_csv(out, term->text);
      else if (table.columns() == 1) out += "\"\"";  // readers skip an empty line
    }
    out += "\r\n";
  }
  return out;
}

/// Whether a literal can stand as a number of Turtle and SPARQL: digits as the datatype of the abbreviation has them.
bool is_abbreviated(const TermView& term) noexcept {
  std::string_view text = term.text;
  if (!text.empty() && (text.front() == '+' || text.front() == '-')) text.remove_prefix(1);
  const auto digits = [&text] {
    const std::size_t n = std::min(text.find_first_not_of("0123456789"), text.size());
    text.remove_prefix(n);
    return n;
  };
  const std::size_t whole = digits();
  if (term.datatype == vocab::xsd::integer.text) return whole != 0 && text.empty();
  const bool point = !text.empty() && text.front() == '.';
  if (point) text.remove_prefix(1);
  const std::size_t fraction = point ? digits() : 0;
  if (term.datatype == vocab::xsd::decimal.text) return point && fraction != 0 && text.empty();
  if (term.datatype != vocab::xsd::double_.text || whole + fraction == 0 || text.empty() || (text.front() != 'e' && text.front() != 'E'))
    return false;
  text.remove_prefix(1);
  if (!text.empty() && (text.front() == '+' || text.front() == '-')) text.remove_prefix(1);
  return digits() != 0 && text.empty();
}

std::string tsv(const Table& table) {
  std::string out;
  for (std::size_t i = 0; i < table.columns(); ++i) (out += i != 0 ? "\t?" : "?") += table.variables()[i];
  out += '\n';
  for (std::size_t row = 0; row < table.rows(); ++row) {
    if (row % Turns::units_between_rests == 0) Turns::rest_now();
    for (std::size_t i = 0; i < table.columns(); ++i) {
      if (i != 0) out += '\t';
      const auto term = table.at(row, i);
      if (!term) continue;
      if (term->is_literal() && is_abbreviated(*term)) out += term->text;
      else rdf::append_n_triples(out, *term);  // on one line, without tabs
    }
    out += '\n';
  }
  return out;
}

}  // namespace

Result<std::string> write(const Table& table, ResultFormat format) {
  switch (format) {
    case ResultFormat::json: return json(table);
    case ResultFormat::xml: return xml(table);
    case ResultFormat::csv: return csv(table);
    case ResultFormat::tsv: break;
  }
  return tsv(table);
}

Result<std::string> write(bool yes, ResultFormat format) {
  const std::string text = yes ? "true" : "false";
  if (format == ResultFormat::json) return R"({"head":{},"boolean":)" + text + "}\n";
  if (format == ResultFormat::xml) return std::string(xml_head) + "<head/>\n<boolean>" + text + "</boolean>\n</sparql>\n";
  return unexpected(Errc::unsupported_syntax, std::string(media_type(format)) + " cannot represent the result of ASK; JSON and XML can");
}

}  // namespace v0
}  // namespace lrt::query
