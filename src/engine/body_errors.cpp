// SPDX-License-Identifier: Apache-2.0
#include "src/engine/body_errors.hpp"

#include <algorithm>

#include <lrt/http/problem.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/value_codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/engine/variants.hpp"

namespace lrt::engine {

namespace {

bool is_json_number(std::string_view text) {
  return rdf::lexical::is_double(text) && text.find_first_of("NI") == std::string_view::npos && text.front() != '+' && text.front() != '.' &&
         text.back() != '.' && (text.front() != '0' || text.size() == 1 || text[1] == '.' || text[1] == 'e' || text[1] == 'E') &&
         text.substr(0, 2) != "-." && text.substr(0, 2) != "-0";
}

std::string json_value(const rdf::TermView& term) {
  constexpr std::size_t max_shown = 200;
  if (term.is_blank() || term.text.size() > max_shown) return {};
  const bool is_text = term.is_iri() || term.datatype == vocab::xsd::string.text;
  if (!is_text && (is_json_number(term.text) || (term.datatype == vocab::xsd::boolean.text && (term.text == "true" || term.text == "false"))))
    return std::string(term.text);
  return http::json_string(term.text);
}

bool lacks_unit(const shacl::ValidationResult& result) {
  const auto predicate = result.path.predicate();
  return (result.component == vocab::sh::MinCountConstraintComponent || result.component == vocab::sh::HasValueConstraintComponent) && predicate &&
         (predicate->view() == rdf::TermView(vocab::vom::unit) || predicate->view() == rdf::TermView(vocab::qudt::hasUnit));
}

}  // namespace

std::vector<BodyError> body_errors(const shacl::Report& report, const std::optional<rdf::ValuePlaces>& places) {
  std::vector<BodyError> errors;
  for (const shacl::ValidationResult& r : report.results()) {
    BodyError error;
    if (const auto predicate = r.path.predicate(); places)
      error.pointer = places->pointer(r.focus.view(), predicate ? std::optional(predicate->view()) : std::nullopt,
                                      r.value ? std::optional(r.value->view()) : std::nullopt);
    if (!errors.empty() && errors.back().pointer == error.pointer && lacks_unit(r) && errors.back().constraint == "sh:MinCountConstraintComponent")
      continue;  // a number that is missing has no unit either
    for (const rdf::Term& m : r.messages) error.detail += (error.detail.empty() ? "" : " ") + std::string(m.view().text);
    error.constraint = rdf::abbreviate(r.component.text);
    const auto repeated =
        std::find_if(errors.begin(), errors.end(), [&](const BodyError& e) { return e.pointer == error.pointer && e.detail == error.detail; });
    if (repeated != errors.end()) {  // the last violation names the kind of the value best
      if (repeated->constraint != "sh:DatatypeConstraintComponent") repeated->constraint = error.constraint;
      continue;
    }
    const rdf::TermView found = r.value ? r.value->view() : r.focus.view();
    if (found.is_literal() || (r.value && found != r.focus.view())) error.value = json_value(found);
    errors.push_back(std::move(error));
  }
  return errors;
}

std::string sentence_of(const std::vector<BodyError>& errors) {
  std::string text;
  for (const BodyError& e : errors) {
    if (!text.empty()) text += "; ";
    if (!e.pointer.empty()) text += "at \"" + e.pointer + "\": ";
    text += e.detail;
  }
  return text;
}

std::string json_of(const std::vector<BodyError>& errors) {
  std::string out = "[";
  for (const BodyError& e : errors) {
    if (out.size() > 1) out += ',';
    out += "{\"detail\":" + http::json_string(e.detail);
    out += ",\"pointer\":" + http::json_string("#" + escaped(e.pointer));
    if (!e.value.empty()) out += ",\"value\":" + e.value;
    if (!e.constraint.empty()) out += ",\"constraint\":" + http::json_string(e.constraint);
    out += '}';
  }
  return out + "]";
}

}  // namespace lrt::engine
