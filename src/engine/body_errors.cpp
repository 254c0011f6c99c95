// SPDX-License-Identifier: Apache-2.0
#include "src/engine/body_errors.hpp"

#include <algorithm>
#include <map>

#include <lrt/http/problem.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/value_codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/engine/variants.hpp"
#include "src/rdf/plain_names.hpp"

namespace lrt::engine {
inline namespace v0 {

namespace {

using Kind = rdf::Type::Kind;

std::string step(const std::string& pointer, std::string_view name) {
  std::string out = pointer + "/";
  for (const char c : name) {
    if (c == '~') out += "~0";
    else if (c == '/') out += "~1";
    else out += c;
  }
  return out;
}

/// The paths at which the nodes of a body would be in its plain form.
class Places {
 public:
  struct Place {
    std::string pointer;
    const rdf::Type* type;
  };

  Places(const rdf::Graph& body, std::string_view vocabulary) : body_(body), vocabulary_(vocabulary) {}

  /// A value at a focus node: see write_value().
  void focus(rdf::TermId node, const rdf::Type& outer) {
    const rdf::Type& type = without_optional(outer);
    if (type.kind == Kind::record) return add(node, type, {});
    nodes_[key(node)] = {{}, &type};
    if (!type.is_number()) each_object(node, vocab::rdf_::value.text, [&](rdf::TermId value) { add(value, type, {}); });
  }
  const Place* find(const rdf::TermView& node) const {
    const auto found = nodes_.find(rdf::to_string(node));
    return found == nodes_.end() ? nullptr : &found->second;
  }
  /// The place of a value that a result is about.
  std::string pointer_of(const shacl::ValidationResult& result) const {
    const Place* place = find(result.focus.view());
    if (!place) return {};
    const auto predicate = result.path.predicate();
    if (place->type->kind == Kind::record && predicate) {
      const std::vector<std::string> names = rdf::member_names(*place->type);
      for (std::size_t i = 0; i < names.size(); ++i)
        if (rdf::term_iri(place->type->fields[i].predicate, vocabulary_) == predicate->view().text) return step(place->pointer, names[i]);
    }
    if (place->type->kind == Kind::list && result.value) {
      const auto head = body_.find(result.focus.view());
      const auto members = head ? body_.list(*head) : std::nullopt;
      for (std::size_t i = 0; members && i < members->size(); ++i)
        if (body_.term((*members)[i]) == result.value->view()) return step(place->pointer, std::to_string(i));
    }
    return place->pointer;
  }

 private:
  static const rdf::Type& without_optional(const rdf::Type& type) { return type.kind == Kind::optional ? without_optional(*type.element) : type; }
  std::string key(rdf::TermId id) const { return rdf::to_string(body_.term(id)); }

  template <class Take>
  void each_object(rdf::TermId subject, std::string_view predicate, Take take) {
    if (const auto p = body_.find(rdf::iri(predicate)))
      for (const rdf::Triple& t : body_.match(subject, *p, std::nullopt)) take(t.object);
  }

  /// The object of a field or a member of a list. A node that two fields share has the place of the first.
  void add(rdf::TermId node, const rdf::Type& outer, const std::string& pointer) {
    const rdf::Type& type = without_optional(outer);
    if (!nodes_.emplace(key(node), Place{pointer, &type}).second) return;
    if (type.kind == Kind::record) {
      if (type.value_predicate.empty()) return fields(node, type, pointer);
      each_object(node, type.value_predicate, [&](rdf::TermId value) {
        if (nodes_.emplace(key(value), Place{pointer, &type}).second) fields(value, type, pointer);
      });
    } else if (type.kind == Kind::list) {
      const auto members = body_.list(node);
      for (std::size_t i = 0; members && i < members->size(); ++i)
        if (!body_.term((*members)[i]).is_literal()) add((*members)[i], *type.element, step(pointer, std::to_string(i)));
    } else if (type.kind == Kind::map) {
      for (const rdf::TermId member : body_.list(node).value_or(std::vector<rdf::TermId>())) {
        std::string place = pointer;
        each_object(member, vocab::schema::name.text, [&](rdf::TermId name) { place = step(pointer, body_.term(name).text); });
        nodes_.emplace(key(member), Place{place, &type});
        each_object(member, vocab::schema::value.text, [&](rdf::TermId value) {
          if (!body_.term(value).is_literal()) add(value, *type.element, place);
        });
      }
    }
  }

  void fields(rdf::TermId node, const rdf::Type& record, const std::string& pointer) {
    const std::vector<std::string> names = rdf::member_names(record);
    for (std::size_t i = 0; i < names.size(); ++i)
      each_object(node, rdf::term_iri(record.fields[i].predicate, vocabulary_),
                  [&](rdf::TermId value) { add(value, *record.fields[i].type, step(pointer, names[i])); });
  }

  const rdf::Graph& body_;
  std::string_view vocabulary_;
  std::map<std::string, Place> nodes_;
};

/// The place of a property path: predicates as abbreviate() writes them, and "[0]" for members of lists, between slashes.
std::string pointer_of(std::string_view path, const rdf::Type& outer, std::string_view vocabulary) {
  std::string pointer;
  const rdf::Type* type = &outer;
  while (!path.empty()) {
    const std::size_t from = path.front() == '<' ? path.find('>') : 0, end = std::min(path.find('/', from), path.size());
    const std::string_view segment = path.substr(0, end);
    path.remove_prefix(std::min(end + 1, path.size()));
    while (type->kind == Kind::optional) type = type->element;
    if (segment.front() == '[') {
      pointer = step(pointer, std::string(segment.substr(1, segment.size() - 2)));
      type = type->element ? type->element : type;
    } else if (type->kind == Kind::record) {
      const std::vector<std::string> names = rdf::member_names(*type);
      for (std::size_t i = 0; i < names.size(); ++i) {
        if (rdf::abbreviate(rdf::term_iri(type->fields[i].predicate, vocabulary)) != segment) continue;
        pointer = step(pointer, names[i]);
        type = type->fields[i].type;
        break;
      }
    }
  }
  return pointer;
}

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

std::vector<BodyError> body_errors(const shacl::Report& report, const rdf::Graph& body, std::optional<rdf::TermId> focus, const rdf::Type* type,
                                   std::string_view vocabulary) {
  Places places(body, vocabulary);
  if (type && focus) places.focus(*focus, *type);
  std::vector<BodyError> errors;
  for (const shacl::ValidationResult& r : report.results()) {
    BodyError error;
    error.pointer = places.pointer_of(r);
    if (!errors.empty() && errors.back().pointer == error.pointer && lacks_unit(r) && errors.back().constraint == "sh:MinCountConstraintComponent")
      continue;                                  // a number that is missing has no unit either
    if (type && !focus && r.path.predicate()) {  // the whole value is missing
      const std::vector<std::string> names = rdf::member_names(*type);
      for (std::size_t i = 0; i < names.size(); ++i)
        if (rdf::term_iri(type->fields[i].predicate, vocabulary) == r.path.predicate()->view().text) error.pointer = step({}, names[i]);
    }
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

std::vector<BodyError> body_errors(const std::vector<rdf::Mismatch>& mismatches, const rdf::Type& type, std::string_view vocabulary) {
  std::vector<BodyError> errors;
  for (const rdf::Mismatch& m : mismatches) errors.push_back({pointer_of(m.path, type, vocabulary), m.message});
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

}  // namespace v0
}  // namespace lrt::engine
