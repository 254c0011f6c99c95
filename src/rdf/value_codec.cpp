// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/value_codec.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <tuple>

#include <lrt/base/immortal.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/traits.hpp>

#include "src/base/ascii.hpp"
#include "src/base/utf8.hpp"
#include "src/rdf/bytes.hpp"
#include "src/rdf/exactly_one.hpp"
#include "src/rdf/json_parse.hpp"
#include "src/rdf/named_cells.hpp"
#include "src/rdf/plain_names.hpp"
#include "src/rdf/representable.hpp"
#include "src/rdf/shown.hpp"
#include "src/rdf/value_places.hpp"
#include "src/rdf/value_writer.hpp"
#include "src/rdf/whole_number.hpp"

namespace lrt::rdf {
inline namespace v0 {
namespace {

using Kind = Type::Kind;

/// The text in the lexical space of xsd:string: U+FFFD instead of U+0000 and of what is no UTF-8.
std::string well_formed(const std::string& text) {
  const auto find_bad = [](std::string_view in) {
    const auto invalid = utf8::find_invalid(in);
    const std::size_t nul = in.substr(0, invalid.value_or(in.size())).find('\0');
    return nul != std::string_view::npos ? nul : invalid;
  };
  auto bad = find_bad(text);
  if (!bad) return text;
  std::string out;
  std::string_view rest = text;
  for (; bad; bad = find_bad(rest)) {
    out.append(rest.substr(0, *bad));
    utf8::append(out, U'\uFFFD');
    rest.remove_prefix(*bad + 1);
  }
  return out.append(rest);
}

/// Writes a Value as triples.
class Writer {
 public:
  Writer(Graph& graph, std::string_view vocabulary, TermId focus) : graph_(graph), triples_(graph, vocabulary, focus) {}
  /// Its nodes are blank.
  Writer(Graph& graph, std::string_view vocabulary) : graph_(graph), triples_(graph, vocabulary) {}

  void at(TermId focus, const Type& type, const Facets& facets, const Value& value) {
    if (value.is_null()) return;
    switch (type.kind) {
      case Kind::optional:
        at(focus, *type.element, facets, value);
        if (type.element->kind == Kind::record && is_empty(value)) triples_.present(focus);
        return;
      case Kind::record:
      case Kind::variant: return record(focus, type, facets, value);
      case Kind::integer:
      case Kind::real: return triples_.number(focus, literal_of(type, value), facets.unit());
      default: {
        const ValueWriter::Step step(triples_, value_step);
        triples_.value(focus, object(type, facets, value));
      }
    }
  }

  /// The object of a field.
  TermId object(const Type& type, const Facets& facets, const Value& value);

 private:
  static bool is_empty(const Value& record) {
    if (record.sequence())
      for (const Value& m : *record.sequence())
        if (!m.is_null()) return false;
    return true;
  }

  TermId literal_of(const Type& type, const Value& value) { return graph_.intern(literal(lexical_form(type, value), type.datatype)); }

  void record(TermId node, const Type& type, const Facets& facets, const Value& value) {
    triples_.classes(node, type);
    const Value::Sequence* members = value.sequence();
    if (!members) return;
    std::optional<ValueWriter::Step> inside;
    if (!type.value_predicate.empty()) inside.emplace(triples_, value_step);
    const TermId fields = triples_.value_node(node, type);
    for (std::size_t i = 0; i < type.fields.size() && i < members->size(); ++i) {
      if ((*members)[i].is_null()) continue;
      const FieldType& field = type.fields[i];
      const ValueWriter::Step step(triples_, field.name);
      triples_.field(fields, field, object(*field.type, field_facets(field, facets), (*members)[i]));
    }
    triples_.unit(node, node_unit(type, facets));
  }

  Graph& graph_;
  ValueWriter triples_;
};

TermId Writer::object(const Type& type, const Facets& facets, const Value& value) {
  switch (type.kind) {
    case Kind::optional: return object(*type.element, facets, value);
    case Kind::record:
    case Kind::variant: {
      const TermId node = triples_.node();
      record(node, type, facets, value);
      return node;
    }
    case Kind::list: {
      std::vector<TermId> objects;
      if (const Value::Sequence* members = value.sequence())
        for (const Value& m : *members) {
          if (m.is_null()) continue;
          const ValueWriter::Step step(triples_, objects.size());
          objects.push_back(object(*type.element, facets, m));
        }
      return triples_.list(objects);
    }
    case Kind::map: {
      std::vector<TermId> members;
      if (value.sequence())
        for (const Value& m : *value.sequence()) {
          const Value::Sequence& pair = *m.sequence();
          const ValueWriter::Step step(triples_, members.size());
          members.push_back(triples_.map_member(well_formed(*pair[0].text()), [&] {
            const ValueWriter::Step inside(triples_, value_step);
            return object(*type.element, facets, pair[1]);
          }()));
        }
      return triples_.list(members);
    }
    case Kind::integer:
    case Kind::real: return triples_.number(literal_of(type, value), facets.unit());
    default: return literal_of(type, value);
  }
}

/// Finds what completed() adds and replaces.
class Completion {
 public:
  Completion(const Graph& graph, std::string_view vocabulary) : graph_(graph), vocabulary_(vocabulary) {}

  void at(TermId focus, const Type& type, const Facets& facets) {
    switch (type.kind) {
      case Kind::optional:
        if (is_present(focus, *type.element)) at(focus, *type.element, facets);
        return;
      case Kind::record:
      case Kind::variant: return record(focus, type, facets);
      case Kind::integer:
      case Kind::real: return number(focus, type, facets);
      default: return each(focus, vocab::rdf_::value.text, type, facets);
    }
  }
  std::optional<Graph> graph() const {
    if (added_.empty() && replaced_.empty()) return std::nullopt;
    Graph out;
    for (const Triple& t : graph_.triples()) {
      const auto other = replaced_.find({t.subject, t.predicate, t.object});
      const TermView object = graph_.term(t.object);
      if (other == replaced_.end()) out.add(graph_.term(t.subject), graph_.term(t.predicate), object);
      else out.add(graph_.term(t.subject), graph_.term(t.predicate), literal(other->second.text, other->second.datatype));
    }
    for (const Added& a : added_) out.add(graph_.term(a.subject), a.predicate, iri(a.object));
    return out;
  }

 private:
  static constexpr std::size_t deepest = 64;
  using Place = std::tuple<TermId, TermId, TermId>;
  struct Replaced {
    std::string text;
    Iri datatype;
  };
  struct Added {
    TermId subject;
    Iri predicate;
    std::string object;
  };

  template <class Visit>
  void objects(TermId subject, std::string_view predicate, Visit visit) const {
    if (const auto p = graph_.find(iri(predicate)))
      for (const Triple& t : graph_.match(subject, *p, std::nullopt)) visit(t);
  }
  bool has(TermId subject, std::string_view predicate) const {
    const auto p = graph_.find(iri(predicate));
    return p && !graph_.match(subject, *p, std::nullopt).empty();
  }
  bool has(TermId subject, Iri predicate, Iri object) const {
    return !object.empty() && graph_.contains(graph_.term(subject), TermView(predicate), TermView(object));
  }
  bool is_present(TermId focus, const Type& type) const {
    if (type.kind == Kind::optional) return is_present(focus, *type.element);
    if (type.is_number()) return has(focus, vocab::vom::numericalValue.text);
    if (!type.has_fields()) return has(focus, vocab::rdf_::value.text);
    if (!type.value_predicate.empty() && has(focus, type.value_predicate)) return true;
    for (const FieldType& field : type.fields)
      if (has(focus, term_iri(field.predicate, vocabulary_))) return true;
    return false;
  }
  void add(TermId subject, Iri predicate, std::string object) { added_.push_back({subject, predicate, std::move(object)}); }

  void classes(TermId node, const std::vector<std::string>& wanted) {
    std::vector<std::string> missing;
    for (const std::string& c : wanted) {
      const std::string of = term_iri(c, vocabulary_);
      if (!has(node, vocab::rdf_::type, Iri(std::string_view(of)))) missing.push_back(of);
    }
    if (missing.size() == wanted.size() && has(node, vocab::rdf_::type.text)) return;  // it is something else
    for (std::string& m : missing) add(node, vocab::rdf_::type, std::move(m));
  }
  void unit(TermId node, const Unit& u) {
    if (u.vom.empty() || u.qudt.empty()) return;
    if (has(node, vocab::qudt::hasUnit, u.qudt) && !has(node, vocab::vom::unit.text)) add(node, vocab::vom::unit, std::string(u.vom.text));
  }
  void number(TermId node, const Type& type, const Facets& facets) {
    static const Immortal<std::vector<std::string>> scalar(std::size_t{1}, std::string(vocab::maths::Scalar.text));
    classes(node, *scalar);
    unit(node, facets.unit());
    objects(node, vocab::vom::numericalValue.text, [&](const Triple& t) { literal_at(t, type); });
  }
  void record(TermId node, const Type& type, const Facets& facets) {
    classes(node, type.classes);
    unit(node, node_unit(type, facets));
    const auto fields = [&](TermId at) {
      for (const FieldType& field : type.fields) each(at, term_iri(field.predicate, vocabulary_), *field.type, field_facets(field, facets));
    };
    if (type.value_predicate.empty()) return fields(node);
    objects(node, type.value_predicate, [&](const Triple& t) {
      if (graph_.term(t.object).is_literal()) return;
      classes(t.object, type.value_classes);
      fields(t.object);
    });
  }
  void each(TermId subject, const std::string_view predicate, const Type& type, const Facets& facets) {
    objects(subject, predicate, [&](const Triple& t) { object(t, type, facets); });
  }

  /// The object of a field or the member of a list.
  void object(const Triple& t, const Type& type, const Facets& facets) {
    if (type.kind == Kind::optional) return object(t, *type.element, facets);
    if (graph_.term(t.object).is_literal()) return type.is_number() && facets.unit().empty() ? literal_at(t, type) : void();
    if (depth_ >= deepest) return;
    ++depth_;
    if (type.is_number() && !facets.unit().empty()) number(t.object, type, facets);
    else if (type.has_fields()) record(t.object, type, facets);
    else if (type.kind == Kind::list) cells(t.object, [&](const Triple& member) { object(member, *type.element, facets); });
    else if (type.kind == Kind::map)
      cells(t.object, [&](const Triple& member) { each(member.object, vocab::schema::value.text, *type.element, facets); });
    --depth_;
  }
  template <class Visit>
  void cells(TermId head, Visit visit) {
    const auto rest = graph_.find(vocab::rdf_::rest);
    std::size_t left = graph_.size();  // a list may have no end
    for (std::optional<TermId> cell = head; cell && left > 0; --left) {
      objects(*cell, vocab::rdf_::first.text, visit);
      cell = rest ? graph_.object(*cell, *rest) : std::nullopt;
    }
  }

  void literal_at(const Triple& t, const Type& type) {
    const TermView term = graph_.term(t.object);
    if (!term.is_literal() || term.datatype == type.datatype.text) return;
    if (std::optional<std::string> text = held(type, term)) replaced_[{t.subject, t.predicate, t.object}] = {*std::move(text), type.datatype};
  }
  /// The text in the type's datatype of a number of another one; nullopt: the C++ type cannot hold it.
  static std::optional<std::string> held(const Type& type, const TermView& term);
  static bool holds_real(const Type& type, const TermView& term);

  const Graph& graph_;
  std::string_view vocabulary_;
  std::map<Place, Replaced> replaced_;
  std::vector<Added> added_;
  std::size_t depth_ = 0;
};

constexpr std::string_view xsd_namespace = "http://www.w3.org/2001/XMLSchema#";

/// The local name of an XML Schema datatype, or an empty view.
std::string_view xsd_name(const TermView& term) noexcept {
  return term.is_literal() && term.datatype.substr(0, xsd_namespace.size()) == xsd_namespace ? term.datatype.substr(xsd_namespace.size())
                                                                                             : std::string_view();
}

enum class IntegerForm : std::uint8_t { no, yes, ill_typed };

/// Whether a literal is an xsd:integer or of a derived type, and within its range.
IntegerForm integer_form(const TermView& term) noexcept {
  const lexical::Datatype datatype = term.is_literal() ? lexical::datatype_of(term.datatype) : lexical::Datatype::unknown;
  if (!lexical::is_integer_type(datatype)) return IntegerForm::no;
  return lexical::is_well_formed(term.text, datatype) ? IntegerForm::yes : IntegerForm::ill_typed;
}

/// The text of an integer: of an integer datatype as it stands, of xsd:decimal, float and double if the number is whole.
std::optional<std::string> integer_text(const TermView& term) {
  switch (integer_form(term)) {
    case IntegerForm::yes: return std::string(term.text);
    case IntegerForm::ill_typed: return std::nullopt;
    case IntegerForm::no: break;
  }
  const lexical::Datatype datatype = term.is_literal() ? lexical::datatype_of(term.datatype) : lexical::Datatype::unknown;
  const bool is_decimal = datatype == lexical::Datatype::decimal && lexical::is_decimal(term.text);
  if (!is_decimal && datatype != lexical::Datatype::float_ && datatype != lexical::Datatype::double_) return std::nullopt;
  return whole_number(term.text, datatype);
}

std::optional<std::string> Completion::held(const Type& type, const TermView& term) {
  if (type.kind != Kind::integer) return holds_real(type, term) ? std::optional(std::string(term.text)) : std::nullopt;
  std::optional<std::string> text = integer_text(term);
  if (!text) return std::nullopt;
  bool fits = false;
  if (const auto value = lexical::parse_int64(*text)) {
    fits = *value >= type.lowest && (*value < 0 || static_cast<std::uint64_t>(*value) <= type.highest);
  } else {
    const auto large = lexical::parse_uint64(*text);
    fits = large && *large <= type.highest;
  }
  return fits ? std::move(text) : std::nullopt;
}

bool Completion::holds_real(const Type& type, const TermView& term) {
  const IntegerForm form = integer_form(term);
  if (form == IntegerForm::ill_typed) return false;
  if (type.datatype == vocab::xsd::decimal && !lexical::is_decimal(term.text)) return false;  // an exponent
  const std::string_view name = xsd_name(term);
  if (name == "float"     ? !lexical::is_double(term.text)
      : name == "double"  ? !lexical::is_double(term.text)
      : name == "decimal" ? !lexical::is_decimal(term.text)
                          : form != IntegerForm::yes)
    return false;
  if (name == "float" && type.kind == Kind::real && !type.single) return true;  // NaN and infinities, too
  if (term.text.find('N') != std::string_view::npos) return true;
  return type.single ? lexical::representable_float(term.text).has_value() : lexical::representable_double(term.text).has_value();
}

/// Whether the seconds of a duration or an instant have a tenth decimal, which parse_duration() and parse_instant() would drop.
bool has_parts_of_nanoseconds(std::string_view text) noexcept {
  const std::size_t point = text.find('.');
  if (point == std::string_view::npos) return false;
  const std::string_view decimals = text.substr(point + 1, text.find_first_not_of("0123456789", point + 1) - point - 1);
  return decimals.size() > 9 && decimals.find_first_not_of('0', 9) != std::string_view::npos;
}

std::string expected_range(const Facets& f) {
  std::string text;
  if (f.min()) text += (f.min_exclusive() ? " above " : " of at least ") + lexical::format(*f.min());
  if (f.max()) text += std::string(f.min() ? " and" : "") + (f.max_exclusive() ? " below " : " at most ") + lexical::format(*f.max());
  return text;
}

/// @param single  the value is a float; bounds are rounded to float too, so that 0.1F is at most 0.1
template <class Number>
bool in_range(const Facets& f, Number v, bool single = false) noexcept {
  const auto x = static_cast<long double>(v);
  const auto bound = [&](double b) { return static_cast<long double>(single ? static_cast<double>(static_cast<float>(b)) : b); };
  if (f.min() && !(f.min_exclusive() ? x > bound(*f.min()) : x >= bound(*f.min()))) return false;
  if (f.max() && !(f.max_exclusive() ? x < bound(*f.max()) : x <= bound(*f.max()))) return false;
  return true;
}

std::optional<double> widened(std::optional<float> value) noexcept { return value ? std::optional(static_cast<double>(*value)) : std::nullopt; }

/// @param rounded  infinity or 0
std::string out_of_range(const Type& type, std::string_view text, double rounded) {
  std::string expected = "a finite number";
  if (rounded == 0) expected = std::string("0 or a number that a ") + (type.single ? "float of 32" : "double of 64") + " bits can hold";
  else if (type.single && lexical::representable_double(text)) expected = "a number that a float of 32 bits can hold";
  return "expected " + expected + ", found " + std::string(text.substr(0, 80));
}

std::string expected_of(const Type& type, const Facets& facets) {
  switch (type.kind) {
    case Kind::boolean: return "true or false (xsd:boolean)";
    case Kind::integer: {
      std::string text = "an integer";
      const std::string range = expected_range(facets);
      if (!range.empty()) return text + range;
      return text + " from " + std::to_string(type.lowest) + " to " + std::to_string(type.highest);
    }
    case Kind::real: return std::string(facets.allows_non_finite() ? "a number" : "a finite number") + expected_range(facets);
    case Kind::text:
      if (!type.is_bytes()) return "a text (xsd:string)";
      return "bytes in base64 (xsd:base64Binary)" +
             (type.shortest == type.longest ? ", " + std::to_string(type.shortest) + " of them" : std::string());
    case Kind::enumeration: {
      std::string text = "one of";
      for (std::size_t i = 0; i < type.names.size(); ++i) text += (i ? ", \"" : " \"") + type.names[i] + '"';
      return text;
    }
    case Kind::duration:
      return "a duration (xsd:dayTimeDuration) from " + lexical::format(std::chrono::nanoseconds::min()) + " to " +
             lexical::format(std::chrono::nanoseconds::max());
    case Kind::instant: return "an instant with time zone (xsd:dateTime)";
    case Kind::list: return "an RDF list";
    case Kind::map: return "an RDF list of nodes with schema:name and schema:value";
    case Kind::record:
    case Kind::variant: return "a node";
    case Kind::optional: return expected_of(*type.element, facets);
  }
  return {};
}

/// A total order of the values of one type.
int compare(const Value& a, const Value& b) noexcept {
  const auto order = [](const auto& x, const auto& y) { return x < y ? -1 : y < x ? 1 : 0; };
  if (a.text() && b.text()) return a.text()->compare(*b.text());
  if (a.integer() && b.integer()) return order(*a.integer(), *b.integer());
  if (a.large_integer() && b.large_integer()) return order(*a.large_integer(), *b.large_integer());
  if (a.boolean() && b.boolean()) return order(*a.boolean(), *b.boolean());
  if (a.real() && b.real()) {
    std::uint64_t x = 0, y = 0;  // NaN, too, has a place
    std::memcpy(&x, a.real(), sizeof x);
    std::memcpy(&y, b.real(), sizeof y);
    return order(x, y);
  }
  const Value::Sequence *x = a.sequence(), *y = b.sequence();
  if (x && y) {
    for (std::size_t i = 0; i < x->size() && i < y->size(); ++i)
      if (const int n = compare((*x)[i], (*y)[i]); n != 0) return n;
    return order(x->size(), y->size());
  }
  const auto kind = [](const Value& v) {
    return v.is_null() ? 0 : v.integer() ? 1 : v.large_integer() ? 2 : v.boolean() ? 3 : v.real() ? 4 : v.text() ? 5 : 6;
  };
  return order(kind(a), kind(b));
}

/// The second of two equal members.
std::optional<std::size_t> find_twice(const Value::Sequence& members) {
  std::vector<std::size_t> order(members.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const int n = compare(members[a], members[b]);
    return n != 0 ? n < 0 : a < b;
  });
  std::optional<std::size_t> twice;
  for (std::size_t i = 1; i < order.size(); ++i)
    if (compare(members[order[i - 1]], members[order[i]]) == 0 && (!twice || order[i] < *twice)) twice = order[i];
  return twice;
}

/// Whether a name of a map is the text of a value of its key type.
bool is_key(const Type& key, const std::string& name) noexcept {
  if (key.kind != Kind::integer) return std::find(key.names.begin(), key.names.end(), name) != key.names.end();
  const auto number = lexical::parse_int64(name);
  if (number) {
    return std::to_string(*number) == name && *number >= key.lowest && (*number < 0 || static_cast<std::uint64_t>(*number) <= key.highest);
  }
  const auto large = lexical::parse_uint64(name);
  return large && std::to_string(*large) == name && *large <= key.highest;
}

/// The way to a step as a property path, predicates and "[0]" between slashes.
std::string path_to(const std::vector<ValueStep>& steps, std::size_t at, std::string_view vocabulary) {
  if (at == ValueStep::none) return {};
  std::string path = path_to(steps, steps[at].outer, vocabulary);
  if (!path.empty()) path += '/';
  return path + (steps[at].predicate.empty() ? "[" + std::to_string(steps[at].member) + "]" : abbreviate(term_iri(steps[at].predicate, vocabulary)));
}

std::string pointer_to(const std::vector<ValueStep>& steps, std::size_t at) {
  if (at == ValueStep::none) return {};
  const ValueStep& step = steps[at];
  std::string pointer = pointer_to(steps, step.outer);
  if (step.key) json::append_step(pointer, *step.key);
  else if (step.record) json::append_step(pointer, member_names(*step.record)[step.member]);
  else if (step.member != ValueStep::none) json::append_step(pointer, std::to_string(step.member));
  return pointer;
}

class ValueReader {
 public:
  /// @param mismatches  nullptr: everything is visited, also what does not fit, and steps() keeps it
  ValueReader(const Graph& graph, std::string_view vocabulary, std::vector<PlacedMismatch>* mismatches)
      : graph_(graph), vocabulary_(vocabulary), mismatches_(mismatches) {}

  Value at(TermId focus, const Type& type, const Facets& facets) {
    switch (type.kind) {
      case Kind::optional: {
        const Type& inner = *type.element;
        if (inner.has_fields() && !has_record(focus, inner) && !keeps_all()) return Value();
        const Iri carrier = inner.is_number() ? vocab::vom::numericalValue : vocab::rdf_::value;
        if (!inner.has_fields() && !graph_.object(graph_.term(focus), carrier)) return Value();
        return at(focus, inner, facets);
      }
      case Kind::record:
      case Kind::variant: return record(focus, type, facets);
      case Kind::integer:
      case Kind::real: return number(focus, type, facets);
      default: return only({focus, vocab::rdf_::value.text}, type, facets);
    }
  }
  std::vector<ValueStep> steps() && { return std::move(steps_); }

 private:
  static constexpr std::size_t deepest = 64;

  bool keeps_all() const noexcept { return mismatches_ == nullptr; }
  /// A graph may lead to its nodes on more ways than it has triples: then the rest is left out.
  bool is_spent(std::size_t triples) noexcept {
    if (!keeps_all()) return false;
    if (triples > left_) return true;
    left_ -= triples;
    return false;
  }

  Value fail(std::string message) {
    if (keeps_all() && at_ != ValueStep::none) steps_[at_].is_mismatch = true;
    else if (!keeps_all() && mismatches_->size() < 16)
      mismatches_->push_back({{path_to(steps_, at_, vocabulary_), std::move(message)}, pointer_to(steps_, at_)});
    return Value();
  }

  /// The reader is at a step during its lifetime.
  struct Visit {
    Visit(ValueReader& reader, ValueStep step) : owner(reader), before(reader.at_) {
      step.outer = before;
      owner.at_ = owner.steps_.size();
      owner.steps_.push_back(step);
      ++owner.depth_;
    }
    Visit(const Visit&) = delete;
    Visit& operator=(const Visit&) = delete;
    ~Visit() {
      owner.at_ = before;
      if (!owner.keeps_all()) owner.steps_.pop_back();
      --owner.depth_;
    }
    ValueReader& owner;
    std::size_t before;
  };

  std::vector<TermId> values(TermId focus, std::string_view predicate) const {
    std::vector<TermId> out;
    if (const auto p = graph_.find(iri(predicate)))
      for (const Triple& t : graph_.match(focus, *p, std::nullopt)) out.push_back(t.object);
    return out;
  }

  /// Whether an optional record is present: a field is, or ValueWriter::present() says so.
  bool has_record(TermId focus, const Type& type) const {
    if (!type.value_predicate.empty() && !values(focus, type.value_predicate).empty()) return true;
    for (const FieldType& field : type.fields)
      if (!values(focus, term_iri(field.predicate, vocabulary_)).empty()) return true;
    if (type.kind == Kind::variant) return false;
    for (const TermId type_of_it : values(focus, vocab::rdf_::type.text))
      if (graph_.term(type_of_it) == TermView(vocab::rdfs::Resource)) return true;
    return false;
  }

  /// The only value of a predicate, as a field's object.
  /// @param step  without its object
  Value only(ValueStep step, const Type& type, const Facets& facets) {
    const std::vector<TermId> found = values(step.subject, term_iri(step.predicate, vocabulary_));
    if (found.empty()) {
      if (type.kind == Kind::optional && !keeps_all()) return Value();
      const Visit visit(*this, step);
      return type.kind == Kind::optional ? Value() : fail("expected " + expected_of(type, facets) + ", found none");
    }
    Value value;
    if (is_spent(found.size())) return value;
    for (const TermId one : found) {
      step.object = one;
      const Visit visit(*this, step);
      if (found.size() > 1 && !keeps_all()) return fail("expected one value, found " + std::to_string(found.size()));
      value = object(one, type, facets);
    }
    return value;
  }

  Value number(TermId node, const Type& type, const Facets& facets) {
    Value value = only({node, vocab::vom::numericalValue.text}, type, without_unit(facets));
    check_unit(node, facets.unit());
    return value;
  }

  static Facets without_unit(Facets facets) { return facets.unit(unit::none); }

  /// SPEC 3.3, Units: at least one of the two predicates is present, and each must have the declared unit.
  void check_unit(TermId node, const Unit& unit) {
    if (unit.empty()) return;
    std::size_t given = 0;
    const auto check = [&](Iri predicate, Iri wanted) {
      const Visit visit(*this, {node, predicate.text});
      for (const TermId found : values(node, predicate.text)) {
        ++given;
        const TermView term = graph_.term(found);
        if (wanted.empty())
          fail("expected no " + abbreviate(predicate.text) + " (the unit is " + abbreviate(unit.qudt.text) + "), found " + shown(term));
        else if (!(term == TermView(wanted))) fail("expected " + abbreviate(wanted.text) + ", found " + shown(term));
      }
    };
    check(vocab::vom::unit, unit.vom);
    check(vocab::qudt::hasUnit, unit.qudt);
    if (given == 0) {
      const bool vom = !unit.vom.empty();
      const Visit visit(*this, {node, vom ? vocab::vom::unit.text : vocab::qudt::hasUnit.text});
      fail("expected " + abbreviate(vom ? unit.vom.text : unit.qudt.text) + ", found none");
    }
  }

  Value record(TermId node, const Type& type, const Facets& facets) {
    check_unit(node, node_unit(type, facets));
    if (type.value_predicate.empty()) return fields(node, type, facets);
    const std::vector<TermId> found = values(node, type.value_predicate);
    if (found.size() != 1 && !keeps_all()) {
      const Visit visit(*this, {node, type.value_predicate});
      return fail("expected one node, found " + std::to_string(found.size()));
    }
    Value value;
    if (is_spent(found.size())) return value;
    for (const TermId one : found) {
      const Visit visit(*this, {node, type.value_predicate, one});
      if (graph_.term(one).is_literal()) value = fail("expected a node, found " + shown(graph_.term(one)));
      else value = fields(one, type, facets);
    }
    return value;
  }

  /// The fields that are present, of a variant.
  Value alternatives(TermId node, const Type& type, const Facets& facets) {
    Value::Sequence members(type.fields.size());
    ExactlyOne one;
    for (std::size_t i = 0; i < type.fields.size(); ++i) {
      const FieldType& field = type.fields[i];
      const bool is_present = !values(node, term_iri(field.predicate, vocabulary_)).empty();
      one.add(field.name, is_present);
      if (is_present) members[i] = only({node, field.predicate, {}, &type, i}, *field.type, field_facets(field, facets));
    }
    return one.holds() ? Value(std::move(members)) : fail(one.message());
  }

  Value fields(TermId node, const Type& type, const Facets& facets) {
    if (type.kind == Kind::variant) return alternatives(node, type, facets);
    Value::Sequence members;
    members.reserve(type.fields.size());
    for (std::size_t i = 0; i < type.fields.size(); ++i) {
      const FieldType& field = type.fields[i];
      if (field.absent && !keeps_all() && values(node, term_iri(field.predicate, vocabulary_)).empty()) {
        members.push_back(*field.absent);
        continue;
      }
      members.push_back(only({node, field.predicate, {}, &type, i}, *field.type, field_facets(field, facets)));
    }
    return Value(std::move(members));
  }

  Value object(TermId id, const Type& type, const Facets& facets) {
    if (depth_ > deepest) return fail("nested too deeply");
    if (type.kind == Kind::optional) return object(id, *type.element, facets);
    const TermView term = graph_.term(id);
    switch (type.kind) {
      case Kind::record:
      case Kind::variant:
        if (term.is_literal()) return fail("expected a node, found " + shown(term));
        return record(id, type, facets);
      case Kind::list: {
        const auto members = graph_.list(id);
        if (!members) return fail("expected an RDF list, found " + shown(term));
        if (is_spent(members->size())) return Value();
        if (members->size() < type.shortest || members->size() > type.longest) {
          Value refused = fail("expected a list of " +
                               (type.shortest == type.longest ? std::to_string(type.shortest)
                                                              : std::to_string(type.shortest) + " to " + std::to_string(type.longest)) +
                               " members, found " + std::to_string(members->size()));
          if (!keeps_all()) return refused;
        }
        Value::Sequence out;
        out.reserve(members->size());
        for (std::size_t i = 0; i < members->size(); ++i) {
          const Visit visit(*this, {id, {}, (*members)[i], nullptr, i});
          out.push_back(object((*members)[i], *type.element, facets));
        }
        if (type.each_once && !keeps_all() && mismatches_->empty()) {
          if (const auto twice = find_twice(out)) {
            const Visit visit(*this, {id, {}, (*members)[*twice], nullptr, *twice});
            return fail("expected each member once, found " + shown(graph_.term((*members)[*twice])) + " twice");
          }
        }
        return Value(std::move(out));
      }
      case Kind::map: return map(id, type, facets);
      default:
        if (type.is_number() && !facets.unit().empty()) {
          if (term.is_literal()) return fail("expected a node with a value and a unit, found " + shown(term));
          return number(id, type, facets);
        }
        return scalar(term, type, facets);
    }
  }

  Value map(TermId id, const Type& type, const Facets& facets) {
    const auto nodes = graph_.list(id);
    if (!nodes) return fail("expected " + expected_of(type, facets) + ", found " + shown(graph_.term(id)));
    if (is_spent(nodes->size())) return Value();
    std::map<std::string, Value> members;
    for (std::size_t i = 0; i < nodes->size(); ++i) {
      const TermId node = (*nodes)[i];
      ValueStep step{id, {}, node, nullptr, i};
      if (const auto names = values(node, vocab::schema::name.text); !names.empty()) step.key = graph_.term(names.front()).text;
      const Visit visit(*this, step);
      const Value name = only({node, vocab::schema::name.text}, detail::text_type(), {});
      Value value = only({node, vocab::schema::value.text}, *type.element, facets);
      if (!name.text()) continue;  // a mismatch
      if (type.key && !is_key(*type.key, *name.text())) {
        fail("expected " + expected_of(*type.key, {}) + " as name, found \"" + *name.text() + '"');
        continue;
      }
      if (!members.emplace(*name.text(), std::move(value)).second) return fail("expected each name once, found \"" + *name.text() + "\" twice");
    }
    Value::Sequence out;
    for (auto& [name, value] : members) out.push_back(Value(Value::Sequence{Value(name), std::move(value)}));
    return Value(std::move(out));
  }

  Value scalar(const TermView& term, const Type& type, const Facets& facets) {
    const auto refuse = [&] { return fail("expected " + expected_of(type, facets) + ", found " + shown(term)); };
    if (!term.is_literal()) return refuse();
    const bool own_datatype = term.datatype == type.datatype.text;
    switch (type.kind) {
      case Kind::boolean: {
        const auto b = lexical::parse_boolean(term.text);
        return own_datatype && b ? Value(*b) : refuse();
      }
      case Kind::integer: {
        const std::optional<std::string> text = integer_text(term);
        if (!text) return refuse();
        if (const auto i = lexical::parse_int64(*text); i && *i < 0) return *i >= type.lowest && in_range(facets, *i) ? Value(*i) : refuse();
        const auto u = lexical::parse_uint64(*text);
        return u && *u <= type.highest && in_range(facets, *u) ? Value(*u) : refuse();
      }
      case Kind::real: {
        const std::string_view name = xsd_name(term);
        const bool floating = name == "float" || name == "double";
        const bool lexically_right = floating            ? lexical::is_double(term.text)
                                     : name == "decimal" ? lexical::is_decimal(term.text)
                                                         : integer_form(term) == IntegerForm::yes;
        if (!lexically_right) return refuse();
        const auto number = type.single ? widened(lexical::parse_float(term.text)) : lexical::parse_double(term.text);
        if (!number) return refuse();
        if (lexical::is_rounded_away(term.text, *number)) return fail(out_of_range(type, term.text, *number));
        const double value = *number;
        const bool is_special = !std::isfinite(value);
        if (is_special && !facets.allows_non_finite()) return refuse();
        return is_special || in_range(facets, value, type.single) ? Value(value) : refuse();
      }
      case Kind::duration: {
        const bool fits = own_datatype || term.datatype == vocab::xsd::duration.text;
        const auto ns = lexical::parse_duration(term.text);
        if (fits && ns && has_parts_of_nanoseconds(term.text)) return fail("expected a duration in whole nanoseconds, found " + shown(term));
        return fits && ns ? Value(static_cast<std::int64_t>(ns->count())) : refuse();
      }
      case Kind::instant: {
        const auto ns = lexical::parse_instant(term.text);
        if (own_datatype && ns && has_parts_of_nanoseconds(term.text)) return fail("expected an instant in whole nanoseconds, found " + shown(term));
        return own_datatype && ns ? Value(static_cast<std::int64_t>(ns->count())) : refuse();
      }
      case Kind::enumeration:
        for (const std::string& name : type.names)
          if (own_datatype && name == term.text) return Value(name);
        return refuse();
      default: {
        if (!own_datatype) return refuse();
        Value value{std::string(term.text)};
        if (type.is_bytes()) return bytes(type, facets, std::move(value));
        if (!lexical::is_well_formed(term.text, lexical::Datatype::string)) return refuse();
        return within(type, facets, value) ? value
                                           : fail("expected a text of " + std::to_string(facets.min_length()) + " to " +
                                                  std::to_string(facets.max_length()) + " characters, found " + shown(term));
      }
    }
  }

  Value bytes(const Type& type, const Facets& facets, Value value) {
    const std::optional<std::string> found = bytes_of(*value.text());
    if (!found) return fail("expected " + expected_of(type, facets) + ", found " + shown(literal(*value.text(), type.datatype)));
    if (found->size() >= std::max(type.shortest, facets.min_length()) && found->size() <= std::min(type.longest, facets.max_length())) return value;
    return fail("expected " + std::to_string(std::max(type.shortest, facets.min_length())) + " to " +
                std::to_string(std::min(type.longest, facets.max_length())) + " bytes, found " + std::to_string(found->size()));
  }

  const Graph& graph_;
  std::string_view vocabulary_;
  std::vector<PlacedMismatch>* mismatches_;
  std::vector<ValueStep> steps_;  ///< up to here, or all of them
  std::size_t at_ = ValueStep::none;
  std::size_t left_ = graph_.size();  ///< triples that may still be followed to keep all
  std::size_t depth_ = 0;
};

}  // namespace

TermId write_object(Graph& graph, std::string_view name, const Type& type, const Facets& facets, const Value& value, std::string_view vocabulary) {
  return name.empty() ? Writer(graph, vocabulary).object(type, facets, value)
                      : Writer(graph, vocabulary, graph.intern(iri(name))).object(type, facets, value);
}

ValueWriter::ValueWriter(Graph& graph, std::string_view vocabulary, TermId focus) : ValueWriter(graph, vocabulary) {
  const TermView name = graph.term(focus);
  if (!name.is_iri()) return;
  name_ = name.text;
  if (name_.find('#') == std::string::npos) name_ += '#';
}

/// A field is written with letters, digits and "_", so that "." and "-" separate.
ValueWriter::Step::Step(ValueWriter& writer, std::string_view field) : writer_(writer), before_(writer.name_.size()) {
  std::string& name = writer.name_;
  if (name.empty()) return;
  if (name.back() != '#') name += '.';
  for (const char c : field) {
    if (lrt::detail::is_alpha(c) || lrt::detail::is_digit(c) || c == '_') name += c;
    else lrt::detail::append_percent(name, c);
  }
}

TermId ValueWriter::list(const std::vector<TermId>& members) {
  return name_.empty() ? graph_.add_list(members) : graph_.add_list(members, named_cells(graph_, name_, members.size()));
}

void ValueWriter::number(TermId node, TermId literal, const Unit& u) {
  add(node, vocab::rdf_::type, graph_.intern(vocab::maths::Scalar));
  add(node, vocab::vom::numericalValue, literal);
  unit(node, u);
}

TermId ValueWriter::number(TermId literal, const Unit& u) {
  if (u.empty()) return literal;
  const TermId at = node();
  number(at, literal, u);
  return at;
}

void ValueWriter::value(TermId focus, TermId object) { add(focus, vocab::rdf_::value, object); }

void ValueWriter::classes(TermId node, const Type& record) {
  for (const std::string& c : record.classes) graph_.add(node, graph_.intern(vocab::rdf_::type), graph_.intern(iri(term_iri(c, vocabulary_))));
  if (!record.quantity_kind.empty()) add(node, vocab::vom::quantityKind, graph_.intern(record.quantity_kind));
}

TermId ValueWriter::value_node(TermId node, const Type& record) {
  if (record.value_predicate.empty()) return node;
  const TermId value = this->node();
  graph_.add(node, graph_.intern(iri(record.value_predicate)), value);
  for (const std::string& c : record.value_classes) add(value, vocab::rdf_::type, graph_.intern(iri(term_iri(c, vocabulary_))));
  return value;
}

void ValueWriter::field(TermId node, const FieldType& field, TermId object) {
  graph_.add(node, graph_.intern(iri(term_iri(field.predicate, vocabulary_))), object);
}

void ValueWriter::unit(TermId node, const Unit& u) {
  if (!u.vom.empty()) add(node, vocab::vom::unit, graph_.intern(u.vom));
  if (!u.qudt.empty()) add(node, vocab::qudt::hasUnit, graph_.intern(u.qudt));
}

TermId ValueWriter::map_member(std::string_view name, TermId object) {
  const TermId member = node();
  add(member, vocab::rdf_::type, graph_.intern(vocab::schema::PropertyValue));
  add(member, vocab::schema::name, graph_.intern(literal(name)));
  add(member, vocab::schema::value, object);
  return member;
}

void ValueWriter::present(TermId focus) { add(focus, vocab::rdf_::type, graph_.intern(vocab::rdfs::Resource)); }

namespace {

/// The shortest xsd:decimal that reads back bit-identically: without an exponent.
std::string decimal_form(double number) {
  char text[1100];  // the smallest double has 1074 decimals
  const auto end = std::to_chars(text, text + sizeof text, number, std::chars_format::fixed).ptr;
  return std::string(text, end);
}

}  // namespace

std::string lexical_form(const Type& type, const Value& value) {
  switch (type.kind) {
    case Kind::boolean: return value.boolean() && *value.boolean() ? "true" : "false";
    case Kind::integer:
      if (const auto* i = value.integer()) return std::to_string(*i);
      return value.large_integer() ? std::to_string(*value.large_integer()) : "0";
    case Kind::real: {
      const double number = value.real() ? *value.real() : 0;
      if (type.datatype == vocab::xsd::decimal && std::isfinite(number)) return decimal_form(number);
      return type.single ? lexical::format(static_cast<float>(number)) : lexical::format(number);
    }
    case Kind::duration: return lexical::format(std::chrono::nanoseconds(value.integer() ? *value.integer() : 0));
    case Kind::instant: return lexical::format_instant(std::chrono::nanoseconds(value.integer() ? *value.integer() : 0));
    default: return value.text() ? well_formed(*value.text()) : std::string();
  }
}

std::string term_iri(std::string_view term, std::string_view vocabulary) {
  if (term.empty() || term.front() != '#') return std::string(term);
  return std::string(vocabulary).append(term.substr(1));
}

void write_value(Graph& graph, TermId focus, const Type& type, const Facets& facets, const Value& value, std::string_view vocabulary) {
  Writer(graph, vocabulary, focus).at(focus, type, facets, value);
}

Result<Value> read_value(const Graph& graph, TermId focus, const Type& type, const Facets& facets, std::string_view vocabulary,
                         std::vector<Mismatch>& mismatches) {
  std::vector<PlacedMismatch> found;
  Result<Value> value = read_value(graph, focus, type, facets, vocabulary, found);
  for (PlacedMismatch& m : found) mismatches.push_back(std::move(m.mismatch));
  return value;
}

std::optional<Graph> completed(const Graph& graph, TermId focus, const Type& type, const Facets& facets, std::string_view vocabulary) {
  Completion completion(graph, vocabulary);
  completion.at(focus, type, facets);
  return completion.graph();
}

bool within(const Type& type, const Facets& facets, const Value& value) noexcept {
  switch (type.kind) {
    case Kind::optional: return value.is_null() || within(*type.element, facets, value);
    case Kind::integer:
      if (const auto* i = value.integer()) return in_range(facets, *i);
      return value.large_integer() && in_range(facets, *value.large_integer());
    case Kind::real:
      if (!value.real()) return false;
      return std::isfinite(*value.real()) ? in_range(facets, *value.real(), type.single) : facets.allows_non_finite();
    case Kind::text: {
      if (!value.text()) return false;
      if (type.is_bytes()) {
        const std::optional<std::string> found = bytes_of(*value.text());
        return found && found->size() >= facets.min_length() && found->size() <= facets.max_length();
      }
      std::size_t length = 0;
      for (const char c : *value.text()) length += (static_cast<unsigned char>(c) & 0xC0) != 0x80;
      return length >= facets.min_length() && length <= facets.max_length();
    }
    case Kind::list:
      if (!value.sequence()) return false;
      for (const Value& m : *value.sequence())
        if (!within(*type.element, facets, m)) return false;
      return true;
    case Kind::map:
      if (!value.sequence()) return false;
      for (const Value& m : *value.sequence())
        if (!m.sequence() || m.sequence()->size() != 2 || !within(*type.element, facets, (*m.sequence())[1])) return false;
      return true;
    case Kind::record:
      if (!value.sequence() || value.sequence()->size() != type.fields.size()) return false;
      for (std::size_t i = 0; i < type.fields.size(); ++i)
        if (!within(*type.fields[i].type, type.fields[i].facets, (*value.sequence())[i])) return false;
      return true;
    case Kind::variant: {
      if (!value.sequence() || value.sequence()->size() != type.fields.size()) return false;
      std::size_t present = 0;
      for (std::size_t i = 0; i < type.fields.size(); ++i) {
        const Value& member = (*value.sequence())[i];
        if (member.is_null()) continue;
        if (++present > 1 || !within(*type.fields[i].type, field_facets(type.fields[i], facets), member)) return false;
      }
      return present == 1;
    }
    default: return !value.is_null();
  }
}

std::string target_class(const Type& type, std::string_view vocabulary) {
  if (type.kind == Kind::optional) return target_class(*type.element, vocabulary);
  if (type.is_number()) return std::string(vocab::maths::Scalar.text);
  return type.classes.empty() ? std::string() : term_iri(type.classes.front(), vocabulary);
}

std::string abbreviate(std::string_view text) {
  const std::string* best_prefix = nullptr;
  std::size_t best = 0;
  for (const auto& [prefix, space] : default_prefixes()) {
    if (space.size() > best && text.size() > space.size() && text.substr(0, space.size()) == space) {
      best = space.size();
      best_prefix = &prefix;
    }
  }
  if (best_prefix && text.find_first_of("/#", best) == std::string_view::npos) return *best_prefix + ":" + std::string(text.substr(best));
  return "<" + std::string(text) + ">";
}

}  // namespace v0

Result<Value> read_value(const Graph& graph, TermId focus, const Type& type, const Facets& facets, std::string_view vocabulary,
                         std::vector<PlacedMismatch>& mismatches) {
  Value value = ValueReader(graph, vocabulary, &mismatches).at(focus, type, facets);
  if (mismatches.empty()) return value;
  const Mismatch& first = mismatches.front().mismatch;
  return unexpected(Errc::expected_value, first.path + ": " + first.message);
}

ValuePlaces::ValuePlaces(const Graph& graph, TermId focus, const Type& type, const Facets& facets, std::string_view vocabulary)
    : graph_(graph), vocabulary_(vocabulary) {
  ValueReader reader(graph, vocabulary, nullptr);
  (void)reader.at(focus, type, facets);
  steps_ = std::move(reader).steps();
}

std::string ValuePlaces::pointer(const TermView& node, const std::optional<TermView>& predicate, const std::optional<TermView>& value) const {
  const auto id = graph_.find(node);
  const auto member = value ? graph_.find(*value) : std::nullopt;
  std::size_t best = ValueStep::none;
  for (std::size_t i = 0; id && i < steps_.size(); ++i) {
    const ValueStep& step = steps_[i];
    if (step.subject == *id &&
        (step.predicate.empty() ? member && step.object == member : predicate && term_iri(step.predicate, vocabulary_) == predicate->text))
      return pointer_to(steps_, i);
    if (step.object == id && (best == ValueStep::none || (step.is_mismatch && !steps_[best].is_mismatch))) best = i;
  }
  return pointer_to(steps_, best);
}

}  // namespace lrt::rdf
