// SPDX-License-Identifier: Apache-2.0
#include <lrt/shacl/derive.hpp>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/value_codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/rdf/bytes.hpp"
#include "src/rdf/named_cells.hpp"
#include "src/rdf/value_writer.hpp"
#include "src/shacl/derived_patterns.hpp"

namespace lrt::shacl {
inline namespace v0 {
namespace {

namespace sh = vocab::sh;
namespace xsd = vocab::xsd;
using rdf::Facets;
using rdf::TermId;
using rdf::Type;
using Kind = Type::Kind;

class Deriver {
 public:
  /// @param name  of the shape, if the nodes inside get names too
  Deriver(rdf::Graph& graph, std::string_view vocabulary, bool input, std::string name = {})
      : graph_(graph), vocabulary_(vocabulary), input_(input), name_(std::move(name)) {}

  /// No value at a focus node.
  void absence(TermId shape, const Type& type) {
    const auto none = [&](Iri predicate) { count(property(shape, predicate), sh::maxCount, 0); };
    if (type.kind == Kind::optional) return absence(shape, *type.element);
    if (type.is_number()) return none(vocab::vom::numericalValue);
    if (!type.has_fields()) return none(vocab::rdf_::value);
    if (!type.value_predicate.empty()) return none(Iri(std::string_view(type.value_predicate)));
    for (const rdf::FieldType& field : type.fields) none(Iri(std::string_view(rdf::term_iri(field.predicate, vocabulary_))));
  }

  /// A value at a focus node, which has a scalar by vom:numericalValue or rdf:value.
  void focus(TermId shape, const Type& type, const Facets& facets, bool required) {
    switch (type.kind) {
      case Kind::optional: return focus(shape, *type.element, facets, false);
      case Kind::record: return required ? record(shape, type, facets) : absent_or_record(shape, type, facets);
      case Kind::variant: record(shape, type, facets, required); return exactly_one(shape, type, required);
      case Kind::integer:
      case Kind::real:
        if (required || facets.unit().empty()) return number_node(shape, type, facets, required);
        return absent_or_number(shape, type, facets);
      default: return value(property(shape, vocab::rdf_::value), type, facets, required);
    }
  }

 private:
  // ---- triples

  void add(TermId subject, Iri predicate, TermId object) { graph_.add(subject, graph_.intern(predicate), object); }
  void add(TermId subject, Iri predicate, const rdf::TermView& object) { add(subject, predicate, graph_.intern(object)); }
  void count(TermId shape, Iri which, std::size_t n) { add(shape, which, rdf::literal(std::to_string(n), xsd::integer)); }
  TermId property_at(TermId shape, TermId path) {
    const TermId p = node();
    add(shape, sh::property, p);
    add(p, sh::path, path);
    return p;
  }
  TermId node() { return name_.empty() ? graph_.fresh_blank() : graph_.intern(rdf::iri(name_ + "." + std::to_string(++nodes_))); }
  TermId list(const std::vector<TermId>& members) {
    if (name_.empty()) return graph_.add_list(members);
    return graph_.add_list(members, rdf::named_cells(graph_, name_ + "." + std::to_string(++nodes_), members.size()));
  }
  TermId property(TermId shape, Iri path) { return property_at(shape, graph_.intern(path)); }
  TermId blank_with(Iri predicate, TermId object) {
    const TermId with = node();
    add(with, predicate, object);
    return with;
  }

  // ---- nodes

  void instance(TermId shape, Iri of) { add(shape, sh::class_, TermId(graph_.intern(of))); }

  /// A node with vom:numericalValue and unit.
  void number_node(TermId shape, const Type& type, const Facets& facets, bool required) {
    if (required) instance(shape, vocab::maths::Scalar);
    value(property(shape, vocab::vom::numericalValue), type, Facets(facets).unit(unit::none), required);
    if (!facets.unit().empty()) units(shape, facets.unit());
  }

  /// If the number is missing, the other triples of the node are ignored.
  void absent_or_number(TermId shape, const Type& type, const Facets& facets) {
    const TermId absent = node(), present = node();
    absence(absent, type);
    number_node(present, type, facets, true);
    add(shape, sh::or_, list({absent, present}));
  }

  /// If no field is present, the record is absent, or present without fields if all are optional.
  void absent_or_record(TermId shape, const Type& type, const Facets& facets) {
    bool all_optional = facets.unit().empty();
    for (const rdf::FieldType& field : type.fields) all_optional = all_optional && (field.type->kind == Kind::optional || (input_ && field.absent));
    if (all_optional) return record(shape, type, facets, false);
    const TermId absent = node(), present = node();
    absence(absent, type);
    record(present, type, facets);
    add(shape, sh::or_, list({absent, present}));
  }

  /// The unit in the first vocabulary that has it, and no other one in the second (SPEC 3.3). rdf::completed() has added it to a body that
  /// states it in the second only.
  void units(TermId shape, const Unit& unit) {
    const bool first = !unit.vom.empty();
    const TermId p = property(shape, first ? vocab::vom::unit : vocab::qudt::hasUnit);
    count(p, sh::minCount, 1);
    count(p, sh::maxCount, 1);
    add(p, sh::hasValue, TermId(graph_.intern(first ? unit.vom : unit.qudt)));
    if (!input_) return;
    if (!first) return count(property(shape, vocab::vom::unit), sh::maxCount, 0);
    if (!unit.qudt.empty()) add(property(shape, vocab::qudt::hasUnit), sh::in_, list({graph_.intern(unit.qudt)}));
  }

  /// @param typed  false: the node may be that of an absent record
  void record(TermId shape, const Type& type, const Facets& facets, bool typed = true) {
    for (const std::string& c : type.classes)
      if (typed) instance(shape, Iri(std::string_view(rdf::term_iri(c, vocabulary_))));
    TermId fields = shape;
    if (!type.value_predicate.empty()) {
      fields = property(shape, Iri(std::string_view(type.value_predicate)));
      count(fields, sh::minCount, 1);
      count(fields, sh::maxCount, 1);
      for (const std::string& c : type.value_classes) instance(fields, Iri(std::string_view(c)));
      if (type.value_classes.empty()) add(fields, sh::nodeKind, TermId(graph_.intern(sh::BlankNodeOrIRI)));
    }
    for (const rdf::FieldType& field : type.fields) {
      const std::string predicate = rdf::term_iri(field.predicate, vocabulary_);
      const TermId p = property(fields, Iri(std::string_view(predicate)));
      const std::size_t local = predicate.find_last_of("#/") + 1;
      // In messages about what clients send; else only where the predicate does not say it.
      if (!field.name.empty() && (input_ || predicate.compare(local, std::string::npos, field.name) != 0)) add(p, sh::name, rdf::literal(field.name));
      if (field.facets.has_words()) words(p, sh::name, sh::description, field.facets.words());
      const bool has_default = input_ && field.absent;
      value(p, *field.type, rdf::field_facets(field, facets), type.kind == Kind::record && !has_default);
      if (has_default) default_value(p, field, rdf::field_facets(field, facets));
    }
    if (const Unit unit = rdf::node_unit(type, facets); !unit.empty()) units(shape, unit);
  }

  /// What a client need not state. A shape of values that the robot writes has no default, because the robot states each field.
  void default_value(TermId p, const rdf::FieldType& field, const Facets& facets) {
    count(p, sh::minCount, 0);
    const std::string name = name_.empty() ? std::string() : name_ + "." + std::to_string(++nodes_);
    add(p, sh::defaultValue, rdf::write_object(graph_, name, *field.type, facets, *field.absent, vocabulary_));
  }

  /// An alternative is what its predicate is there for. What its values are is said beside it, so that a report says what is wrong within one.
  /// @param required  false: there may be none
  void exactly_one(TermId shape, const Type& type, bool required) {
    std::vector<TermId> shapes;
    const auto with = [&](TermId in, const rdf::FieldType& field, Iri which, std::size_t n) {
      count(property(in, Iri(std::string_view(rdf::term_iri(field.predicate, vocabulary_)))), which, n);
    };
    for (const rdf::FieldType& field : type.fields) {
      shapes.push_back(node());
      with(shapes.back(), field, sh::minCount, 1);
    }
    if (!required) {
      shapes.push_back(node());
      for (const rdf::FieldType& field : type.fields) with(shapes.back(), field, sh::maxCount, 0);
    }
    add(shape, sh::xone, list(shapes));
  }

  // ---- words

  void words(TermId of, Iri title, Iri description, const rdf::Words& words) {
    for (const auto& [predicate, texts] : {std::pair(title, &words.titles), std::pair(description, &words.descriptions)})
      for (const rdf::Text& t : *texts) add(of, predicate, t.language.empty() ? rdf::literal(t.text) : rdf::tagged_literal(t.text, t.language));
  }
  /// A member of sh:in is a literal, which has no triples of its own: a node beside it has its words. It constrains nothing.
  void name_words(TermId shape, const Type& type) {
    for (std::size_t i = 0; i < type.names.size() && i < type.name_words.size(); ++i) {
      if (type.name_words[i].empty()) continue;
      const TermId about = node();
      add(shape, vocab::rdfs::seeAlso, about);
      add(about, vocab::rdf_::value, rdf::literal(type.names[i]));
      words(about, vocab::dcterms::title, vocab::dcterms::description, type.name_words[i]);
    }
  }

  // ---- values

  /// The one value of a property shape.
  void value(TermId p, const Type& type, const Facets& facets, bool required) {
    if (type.kind == Kind::optional) return value(p, *type.element, facets, false);
    if (required) count(p, sh::minCount, 1);
    count(p, sh::maxCount, 1);
    object(p, type, facets);
  }

  /// The constraints for each value node of a shape.
  void object(TermId shape, const Type& type, const Facets& facets) {
    switch (type.kind) {
      case Kind::optional: return object(shape, *type.element, facets);
      case Kind::record:
        if (type.classes.empty()) add(shape, sh::nodeKind, TermId(graph_.intern(sh::BlankNodeOrIRI)));
        return record(shape, type, facets);
      case Kind::variant:
        if (type.classes.empty()) add(shape, sh::nodeKind, TermId(graph_.intern(sh::BlankNodeOrIRI)));
        record(shape, type, facets);
        return exactly_one(shape, type, true);
      case Kind::list: return members(shape, type, facets);
      case Kind::map: return map(shape, type, facets);
      case Kind::integer:
      case Kind::real:
        if (!facets.unit().empty()) return number_node(shape, type, facets, true);
        return type.kind == Kind::integer ? integer(shape, type, facets) : real(shape, type, facets);
      case Kind::duration: {
        alternatives(shape, {type.datatype, xsd::duration});
        // No years and months: their length varies.
        return add(shape, sh::pattern, rdf::literal(day_time_pattern));
      }
      case Kind::instant:
        add(shape, sh::datatype, rdf::TermView(type.datatype));
        add(shape, sh::pattern, rdf::literal(zone_pattern));
        add(shape, sh::minInclusive, rdf::literal("1677-09-22T00:00:00Z", xsd::dateTime));
        return add(shape, sh::maxInclusive, rdf::literal("2262-04-11T23:47:16Z", xsd::dateTime));
      case Kind::enumeration: {
        std::vector<TermId> names;
        for (const std::string& name : type.names) names.push_back(graph_.intern(rdf::literal(name)));
        name_words(shape, type);
        return add(shape, sh::in_, list(names));
      }
      case Kind::text:
        if (type.is_bytes()) return bytes(shape, type, facets);
        if (facets.min_length() > 0) count(shape, sh::minLength, facets.min_length());
        if (facets.max_length() != std::numeric_limits<std::size_t>::max()) count(shape, sh::maxLength, facets.max_length());
        [[fallthrough]];
      case Kind::boolean: return add(shape, sh::datatype, rdf::TermView(type.datatype));
    }
  }

  /// Base64 of so many bytes. Spaces within it count as characters, and without a bound they are allowed.
  void bytes(TermId shape, const Type& type, const Facets& facets) {
    const std::size_t shortest = std::max(type.shortest, facets.min_length()), longest = std::min(type.longest, facets.max_length());
    if (shortest > 0) count(shape, sh::minLength, rdf::base64_length(shortest));
    if (longest != std::numeric_limits<std::size_t>::max()) count(shape, sh::maxLength, rdf::base64_length(longest));
    add(shape, sh::datatype, rdf::TermView(type.datatype));
  }

  void members(TermId shape, const Type& type, const Facets& facets) { object(cells(shape, type), *type.element, facets); }

  /// A list of nodes with a name and a value. That each name occurs once is checked when the value is read.
  void map(TermId shape, const Type& type, const Facets& facets) {
    const TermId member = cells(shape, type);
    add(member, sh::nodeKind, TermId(graph_.intern(sh::BlankNodeOrIRI)));
    const TermId name = property(member, vocab::schema::name);
    count(name, sh::minCount, 1);
    count(name, sh::maxCount, 1);
    add(name, sh::datatype, TermId(graph_.intern(xsd::string)));
    if (type.key && type.key->kind == Kind::integer) {
      add(name, sh::pattern, rdf::literal(type.key->lowest < 0 ? "^(0|-?[1-9][0-9]*)$" : "^(0|[1-9][0-9]*)$"));  // read_value() checks the range
    } else if (type.key) {
      std::vector<TermId> names;
      for (const std::string& one : type.key->names) names.push_back(graph_.intern(rdf::literal(one)));
      add(name, sh::in_, list(names));
    }
    value(property(member, vocab::schema::value), *type.element, facets, true);
  }

  /// An RDF list: every cell has one rdf:first and one rdf:rest, the last rest is rdf:nil, and the number of cells is in range.
  /// @return  the shape of its members
  TermId cells(TermId shape, const Type& type) {
    const auto rests = [&] { return blank_with(sh::zeroOrMorePath, graph_.intern(vocab::rdf_::rest)); };
    const TermId rest = property_at(shape, rests());
    add(rest, sh::hasValue, TermId(graph_.intern(vocab::rdf_::nil)));
    const TermId end = blank_with(sh::hasValue, graph_.intern(vocab::rdf_::nil)), cell = node();
    for (const Iri predicate : {vocab::rdf_::first, vocab::rdf_::rest}) {
      const TermId p = property(cell, predicate);
      count(p, sh::minCount, 1);
      count(p, sh::maxCount, 1);
    }
    add(rest, sh::or_, list({end, cell}));
    // rdf:nil is one of the nodes that rdf:rest* reaches.
    if (type.shortest > 0) count(rest, sh::minCount, type.shortest + 1);
    if (type.longest != std::numeric_limits<std::size_t>::max()) count(rest, sh::maxCount, type.longest + 1);
    return property_at(shape, list({rests(), graph_.intern(vocab::rdf_::first)}));
  }

  // ---- numbers

  void alternatives(TermId shape, std::initializer_list<Iri> types) {
    std::vector<TermId> shapes;
    for (const Iri t : types) shapes.push_back(blank_with(sh::datatype, graph_.intern(t)));
    add(shape, sh::or_, list(shapes));
  }

  /// A bound in its shortest common form: an integer or a decimal if that is short, else a double.
  TermId bound(double v) {
    char text[32];
    const auto [end, error] = std::to_chars(text, text + 20, v, std::chars_format::fixed);
    if (error != std::errc() || !std::isfinite(v)) return graph_.intern(rdf::literal(rdf::lexical::format(v), xsd::double_));
    const std::string_view digits(text, static_cast<std::size_t>(end - text));
    return graph_.intern(rdf::literal(digits, digits.find('.') == std::string_view::npos ? xsd::integer : xsd::decimal));
  }
  static bool binds(std::optional<double> bound) noexcept { return bound && std::isfinite(*bound); }
  void bounds(TermId shape, const Facets& f) {
    if (binds(f.min())) add(shape, f.min_exclusive() ? sh::minExclusive : sh::minInclusive, bound(*f.min()));
    if (binds(f.max())) add(shape, f.max_exclusive() ? sh::maxExclusive : sh::maxInclusive, bound(*f.max()));
  }

  /// The range of the C++ type is that of its datatype.
  void integer(TermId shape, const Type& type, const Facets& facets) {
    add(shape, sh::datatype, rdf::TermView(type.datatype));
    bounds(shape, facets);
  }

  void real(TermId shape, const Type& type, const Facets& facets) {
    add(shape, sh::datatype, rdf::TermView(type.datatype));
    const bool low = binds(facets.min()), high = binds(facets.max());
    if (!facets.allows_non_finite()) {
      bounds(shape, facets);
      // NaN satisfies no bound, an infinity all on its side.
      if (input_ && (!low || !high)) add(shape, sh::pattern, rdf::literal(finite_pattern));
    } else if (low || high) {
      const TermId number = node();
      bounds(number, facets);
      std::vector<TermId> others;
      for (const std::string_view text : {"NaN", "INF", "+INF", "-INF"}) others.push_back(graph_.intern(rdf::literal(text, type.datatype)));
      add(shape, sh::or_, list({number, blank_with(sh::in_, list(others))}));
    }
  }

  rdf::Graph& graph_;
  std::string vocabulary_;
  bool input_;
  std::string name_;
  std::size_t nodes_ = 0;  ///< that have names
};

}  // namespace

void derive(rdf::Graph& graph, rdf::TermId shape, const rdf::Type& type, const rdf::Facets& facets, std::string_view vocabulary,
            const DeriveOptions& options) {
  Deriver(graph, vocabulary, options.input, options.named ? std::string(graph.term(shape).text) : std::string())
      .focus(shape, type, facets, options.required);
}

void derive_absence(rdf::Graph& graph, rdf::TermId shape, const rdf::Type& type, std::string_view vocabulary) {
  Deriver(graph, vocabulary, false).absence(shape, type);
}

}  // namespace v0
}  // namespace lrt::shacl
