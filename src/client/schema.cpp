// SPDX-License-Identifier: Apache-2.0
#include <lrt/client/schema.hpp>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <deque>
#include <limits>
#include <mutex>
#include <set>
#include <utility>

#include <lrt/base/immortal.hpp>
#include <lrt/base/iri.hpp>
#include <lrt/client/units.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/value_codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/client/constraints.hpp"
#include "src/rdf/integer_range.hpp"
#include "src/rdf/plain.hpp"
#include "src/shacl/derived_patterns.hpp"

namespace lrt::client {
inline namespace v0 {

namespace sh = vocab::sh;
namespace xsd = vocab::xsd;
using rdf::Facets;
using rdf::Graph;
using rdf::TermId;
using rdf::TermView;
using rdf::Type;
using Kind = Type::Kind;

struct LRT_LOCAL Schema::Data {
  std::deque<Type> types;         ///< all that `type` points to
  std::deque<std::string> texts;  ///< IRIs of datatypes
  const Type* type = nullptr;     ///< nullptr: nothing is usable
  Facets facets;
  std::vector<std::string> classes;  ///< of the focus node, besides those of the type
  bool former_unit = false;          ///< the shape asks for qudt:unit
  std::vector<std::string> warnings;
  rdf::Term shape;
  std::string name;
};

namespace {

/// Whether a unit with these IRIs may be kept until the process ends, as Facets does. Their number is limited, because servers may name many.
bool may_keep_unit(const Unit& unit) {
  if (!unit.ucum.empty()) return true;  // one of lrt's
  constexpr std::size_t most = 4'096;
  struct Kept {
    std::mutex mutex;  // guards `iris`
    std::set<std::pair<std::string, std::string>> iris;
  };
  static Immortal<Kept> units;
  std::pair<std::string, std::string> key(unit.vom.text, unit.qudt.text);
  const std::lock_guard lock(units->mutex);
  if (units->iris.size() >= most) return units->iris.count(key) > 0;
  units->iris.insert(std::move(key));
  return true;
}

/// A type with its facets.
struct Made {
  const Type* type = nullptr;
  Facets facets;
};

bool is_unit(std::string_view predicate) noexcept {
  return predicate == vocab::vom::unit.text || predicate == vocab::qudt::hasUnit.text || predicate == vocab::qudt::unit.text;
}

std::string last_part(std::string_view iri) {
  while (iri.size() > 1 && (iri.back() == '/' || iri.back() == '#')) iri.remove_suffix(1);
  return std::string(iri.substr(iri.find_last_of("#/:") + 1));
}

}  // namespace

class SchemaReader {
 public:
  SchemaReader(const Graph& graph, const SchemaOptions& options)
      : graph_(graph),
        options_(options),
        shapes_(graph, options, [this](const std::string& sentence) { warn(sentence); }),
        data_(std::make_shared<Schema::Data>()) {}

  Schema read(TermId shape) {
    data_->shape = graph_.term(shape);
    Constraints c;
    shapes_.gather(shape, c);
    if (const auto label = graph_.object(graph_.term(shape), TermView(vocab::rdfs::label)); label && label->is_literal()) {
      if (label->text.size() > options_.max_text)
        refuse_shape(Errc::limit_exceeded, "a label of more than " + std::to_string(options_.max_text) + " bytes at " + shown(graph_.term(shape)));
      data_->name = label->text;
    } else if (!c.names.empty()) {
      data_->name = c.names.front();
    }
    if (const std::optional<Made> made = focus(std::move(c))) {
      data_->type = made->type;
      data_->facets = made->facets;
    }
    if (suppressed_ > 0) data_->warnings.push_back(std::to_string(suppressed_) + " more warnings are not shown");
    if (!data_->type) data_->warnings.push_back("the shape " + shown(graph_.term(shape)) + " says nothing of a value that a type can express");
    return Schema(std::move(data_));
  }

 private:
  // ---- messages

  /// Makes a step of the path during its lifetime.
  struct Step {
    Step(SchemaReader& reader, std::string_view predicate) : owner(reader), length(reader.path_.size()) {
      if (!owner.path_.empty()) owner.path_ += '/';
      owner.path_ += shortened(predicate == "[]" ? std::string(predicate) : rdf::abbreviate(predicate));
      if (++owner.depth_ > owner.options_.max_depth)
        refuse_shape(Errc::limit_exceeded,
                     "shapes nested more than " + std::to_string(owner.options_.max_depth) + " deep at " + shortened(owner.path_));
    }
    ~Step() {
      owner.path_.resize(length);
      --owner.depth_;
    }
    Step(const Step&) = delete;
    Step& operator=(const Step&) = delete;
    SchemaReader& owner;
    std::size_t length;
  };

  std::nullopt_t warn(const std::string& sentence) {
    std::string whole = (path_.empty() ? std::string("the value") : path_) + ": " + sentence;
    if (std::find(data_->warnings.begin(), data_->warnings.end(), whole) != data_->warnings.end()) return std::nullopt;
    if (data_->warnings.size() >= options_.max_warnings) ++suppressed_;
    else data_->warnings.push_back(std::move(whole));
    return std::nullopt;
  }

  // ---- types

  const Type* keep(Type type) { return &data_->types.emplace_back(std::move(type)); }
  const Type* optional(const Type* element) {
    if (element->kind == Kind::optional) return element;
    Type t;
    t.kind = Kind::optional;
    t.element = element;
    return keep(std::move(t));
  }
  Iri kept(const std::string& text) { return Iri(std::string_view(data_->texts.emplace_back(text))); }

  /// Property shapes whose values are being read. A shape that contains itself has no finite type.
  struct Inside {
    Inside(SchemaReader& reader, const std::vector<TermId>& shapes) : owner(reader), before(reader.inside_.size()) {
      owner.inside_.insert(owner.inside_.end(), shapes.begin(), shapes.end());
    }
    ~Inside() { owner.inside_.resize(before); }
    Inside(const Inside&) = delete;
    Inside& operator=(const Inside&) = delete;
    SchemaReader& owner;
    std::size_t before;
  };
  bool is_recursive(const std::vector<TermId>& shapes) const {
    return std::any_of(shapes.begin(), shapes.end(), [&](TermId s) { return std::find(inside_.begin(), inside_.end(), s) != inside_.end(); });
  }

  /// A value at a focus node.
  std::optional<Made> focus(Constraints c) {
    if (const auto present = take_present(c)) {
      shapes_.gather(*present, c);
      std::optional<Made> made = focus_present(c);
      if (made) made->type = optional(made->type);
      return made;
    }
    return focus_present(c);
  }
  std::optional<Made> focus_present(Constraints& c) {
    if (std::optional<Made> made = variant(c)) return made;
    resolve_alternatives(c);
    mention_others(c);
    const std::size_t units = unit_fields(c);
    if (const Field* number = c.field(vocab::vom::numericalValue); number && c.fields.size() == units + 1) {
      if (std::optional<Made> made = field(*number)) {
        const bool is_number = made->type->is_number() || (made->type->kind == Kind::optional && made->type->element->is_number());
        if (is_number && made->facets.unit().empty()) {
          made->facets.unit(unit_of(c));
          for (const std::string& of : c.classes)
            if (of != vocab::maths::Scalar.text) data_->classes.push_back(of);
          return made;
        }
      }
    }
    if (const Field* value = c.field(vocab::rdf_::value); value && c.fields.size() == 1) {
      std::optional<Made> made = field(*value);
      const Type* type = made ? (made->type->kind == Kind::optional ? made->type->element : made->type) : nullptr;
      // Numbers and records are at other places of a focus node.
      if (type && !type->is_number() && type->kind != Kind::record) {
        data_->classes = c.classes;
        return made;
      }
    }
    if (c.fields.empty() && (!c.datatypes.empty() || !c.one_of.empty() || !c.members.empty()))
      return warn("the shape describes literals or lists, not a node with a value");
    if (c.fields.empty() && c.classes.empty()) return std::nullopt;
    std::optional<Made> made = record(c);
    if (made && made->type->fields.empty()) return std::nullopt;
    return made;
  }

  /// The value nodes of a predicate.
  std::optional<Made> field(const Field& f) { return field(f, shapes_.constraints_of(f.shapes)); }
  std::optional<Made> field(const Field& f, const Constraints& c) {
    const Step step(*this, f.predicate);
    if (is_recursive(f.shapes))
      return warn(std::string("the shape contains itself, which a type cannot") + (c.min_count > 0 ? "; the value is required" : ""));
    const Inside inside(*this, f.shapes);
    if (c.min_count > 1) return warn("at least " + std::to_string(c.min_count) + " values are required, and a type has one");
    if (c.max_count > 1) warn("more than one value is allowed, and the type has one");
    std::optional<Made> made = object(c);
    if (!made && c.min_count > 0) warn("this value is required, so what is written without it does not conform");
    if (made && c.min_count == 0) made->type = optional(made->type);
    return made;
  }

  /// A value that conforms to these constraints.
  std::optional<Made> object(Constraints c) {
    if (!c.members.empty()) return list(c);
    if (std::optional<Made> made = variant(c)) return made;
    resolve_alternatives(c);
    mention_others(c);
    if (!c.fields.empty()) {
      const std::size_t units = unit_fields(c);
      const bool is_scalar = std::all_of(c.classes.begin(), c.classes.end(), [](const std::string& of) { return of == vocab::maths::Scalar.text; });
      const Field* number = c.field(vocab::vom::numericalValue);
      if (number && units > 0 && c.fields.size() == units + 1 && is_scalar) {
        const std::size_t warned = data_->warnings.size();
        std::optional<Made> made = field(*number);
        const Unit unit = unit_of(c);
        if (made && made->type->is_number() && made->facets.unit().empty() && !unit.empty()) {
          made->facets.unit(unit);
          return made;
        }
        data_->warnings.resize(std::min(warned, data_->warnings.size()));  // the record repeats it
      }
      return record(c);
    }
    if (!c.one_of.empty()) return enumeration(c);
    if (!c.datatypes.empty()) return literal(c);
    if (!c.exactly.empty()) return constant(c);
    if (c.node_kind == sh::IRI.text) return warn("the value is an IRI, which a type does not have");
    if (!c.classes.empty()) {
      if (c.min_count > 0)
        warn("the value is a " + shortened(rdf::abbreviate(c.classes.front())) + " of which the shape says nothing; a new node is written");
      return c.min_count > 0 ? record(c)
                             : warn("the value is a link to a " + shortened(rdf::abbreviate(c.classes.front())) + ", which a type does not have");
    }
    if (c.has_bounds()) {
      c.datatypes.emplace_back(xsd::double_.text);
      warn("no datatype; numbers are taken as xsd:double because of the bounds");
      return literal(c);
    }
    if (c.has_lengths() || !c.patterns.empty() || c.node_kind == sh::Literal.text) {
      c.datatypes.emplace_back(xsd::string.text);
      warn("no datatype; the value is taken as a text");
      return literal(c);
    }
    return warn("the shape does not say what the value is");
  }

  std::optional<Made> list(const Constraints& c) {
    Type t;
    t.kind = Kind::list;
    const Constraints cells = shapes_.constraints_of(c.cells);
    // rdf:nil is one of the nodes that rdf:rest* reaches.
    if (cells.min_count > 1) t.shortest = cells.min_count - 1;
    if (cells.max_count != std::numeric_limits<std::size_t>::max()) t.longest = cells.max_count > 0 ? cells.max_count - 1 : 0;
    Constraints members = shapes_.constraints_of(c.members);
    if (members.min_count > 1) t.shortest = std::max(t.shortest, members.min_count);
    members.min_count = members.max_count = 1;
    const Step step(*this, "[]");
    if (is_recursive(c.members)) return warn("the shape contains itself, which a type cannot");
    const Inside inside(*this, c.members);
    if (std::optional<Made> map = map_of(members)) return map;
    std::optional<Made> element = object(std::move(members));
    if (!element) return std::nullopt;
    t.element = element->type;
    return Made{keep(std::move(t)), element->facets};
  }

  /// A list of nodes with schema:name and schema:value.
  std::optional<Made> map_of(const Constraints& members) {
    const Field *name = members.field(vocab::schema::name), *value_field = members.field(vocab::schema::value);
    const bool typed =
        std::any_of(members.classes.begin(), members.classes.end(), [](const std::string& c) { return c != vocab::schema::PropertyValue.text; });
    if (!name || !value_field || members.fields.size() != 2 || typed) return std::nullopt;
    const Constraints key = shapes_.constraints_of(name->shapes);
    if (key.min_count != 1 || key.datatypes != std::vector<std::string>{std::string(xsd::string.text)}) return std::nullopt;
    Constraints of = shapes_.constraints_of(value_field->shapes);
    if (of.min_count != 1) return std::nullopt;
    std::optional<Made> element = field(*value_field, of);
    if (!element) return std::nullopt;
    Type t;
    t.kind = Kind::map;
    t.element = element->type;
    return Made{keep(std::move(t)), element->facets};
  }

  struct Alternatives {
    std::vector<Field> fields;
    bool may_be_absent = false;
  };
  /// The alternatives of sh:xone, each of which requires one predicate that the others do not have; one of them may be that none is there.
  /// Constraints of these predicates may also be outside of it. nullopt: it is another sh:xone, or there is none.
  std::optional<Alternatives> alternatives_of(const Constraints& c) {
    Alternatives result;
    std::vector<Field>& all = result.fields;
    if (c.exclusive.empty() || !c.alternatives.empty() || !c.datatypes.empty() || !c.one_of.empty() || !c.exactly.empty()) return std::nullopt;
    for (const std::vector<TermId>& members : c.exclusive) {
      if (members.size() > options_.max_fields)
        refuse_shape(Errc::limit_exceeded, "more than " + std::to_string(options_.max_fields) + " alternatives");
      std::vector<Field> found;
      for (const TermId m : members) {
        if (graph_.term(m).is_literal()) refuse_shape(Errc::expected_value, "expected shapes in sh:xone, found " + shown(graph_.term(m)));
        if (is_absent(m)) {
          result.may_be_absent = true;
          continue;
        }
        const std::optional<Field> required = required_field(m);
        if (!required) return std::nullopt;
        const auto same = [&](const Field& f) { return f.predicate == required->predicate; };
        if (std::any_of(found.begin(), found.end(), same)) return std::nullopt;
        found.push_back(*required);
      }
      // Two documents that describe one shape repeat its lists.
      const auto is_same = [](const Field& a, const Field& b) { return a.predicate == b.predicate; };
      if (!all.empty() && !std::equal(all.begin(), all.end(), found.begin(), found.end(), is_same)) return std::nullopt;
      if (all.empty()) all = std::move(found);
      else
        for (std::size_t i = 0; i < all.size(); ++i) all[i].shapes.insert(all[i].shapes.end(), found[i].shapes.begin(), found[i].shapes.end());
    }
    for (const Field& outside : c.fields) {
      if (outside.predicate == vocab::rdf_::type.text || shapes_.constraints_of(outside.shapes).max_count == 0) continue;
      const auto of = std::find_if(all.begin(), all.end(), [&](const Field& f) { return f.predicate == outside.predicate; });
      if (of == all.end()) return std::nullopt;
      of->shapes.insert(of->shapes.end(), outside.shapes.begin(), outside.shapes.end());
    }
    if (all.empty()) return std::nullopt;
    return result;
  }
  /// The one field that a shape requires, if it says nothing else but that other ones are absent.
  std::optional<Field> required_field(TermId shape) {
    Constraints c;
    shapes_.gather_part(shape, c);
    if (!c.datatypes.empty() || !c.one_of.empty() || !c.exactly.empty() || !c.members.empty() || !c.alternatives.empty() || !c.exclusive.empty() ||
        !c.classes.empty() || !c.others.empty())
      return std::nullopt;
    std::optional<Field> found;
    for (const Field& f : c.fields) {
      const Constraints of = shapes_.constraints_of(f.shapes);
      if (of.max_count == 0) continue;
      if (found || of.min_count == 0) return std::nullopt;
      found = f;
    }
    return found;
  }
  std::optional<Made> variant(const Constraints& c) {
    const std::optional<Alternatives> alternatives = alternatives_of(c);
    if (!alternatives) return std::nullopt;
    mention_others(c);
    Type t;
    t.kind = Kind::variant;
    t.classes = c.classes.empty() ? c.target_classes : c.classes;
    for (const Field& f : c.fields)
      if (f.predicate == vocab::rdf_::type.text) add_types(t, shapes_.constraints_of(f.shapes));
    for (const Field& f : alternatives->fields) {
      const Constraints of = shapes_.constraints_of(f.shapes);
      const std::string name = name_of(f.predicate, of);
      if (const std::optional<Made> made = says_nothing(of) ? record(of) : field(f, of))
        t.fields.push_back({name, f.predicate, made->type, made->facets});
      else warn("the alternative " + shortened(name) + " is not part of the type");
    }
    if (t.fields.empty()) return std::nullopt;
    const Type* const type = keep(std::move(t));
    return Made{alternatives->may_be_absent ? optional(type) : type, {}};
  }
  /// A node without content: only its presence matters.
  static bool says_nothing(const Constraints& c) {
    const bool is_node = c.node_kind == sh::BlankNodeOrIRI.text || c.node_kind == sh::BlankNode.text || (c.node_kind.empty() && c.max_count == 1);
    return is_node && c.fields.empty() && c.datatypes.empty() && c.one_of.empty() && c.exactly.empty() && c.members.empty() &&
           c.alternatives.empty() && c.exclusive.empty() && c.patterns.empty() && !c.has_bounds() && !c.has_lengths() && c.max_count > 0;
  }

  std::optional<Made> record(const Constraints& c) {
    Type t;
    t.kind = Kind::record;
    t.classes = c.classes.empty() ? c.target_classes : c.classes;
    Made made;
    made.facets.unit(unit_of(c));
    if (c.fields.size() == unit_fields(c) + 1 && c.field(vocab::vom::quantityValue)) {
      Constraints inner = shapes_.constraints_of(c.field(vocab::vom::quantityValue)->shapes);
      if (inner.min_count == 1 && inner.max_count == 1 && !inner.fields.empty() && unit_fields(inner) == 0 &&
          !inner.field(vocab::vom::quantityValue) && !is_recursive(c.field(vocab::vom::quantityValue)->shapes)) {
        const Inside inside(*this, c.field(vocab::vom::quantityValue)->shapes);
        const Step step(*this, vocab::vom::quantityValue.text);
        resolve_alternatives(inner);
        mention_others(inner);
        t.value_predicate = vocab::vom::quantityValue.text;
        t.value_classes = inner.classes;
        add_fields(t, inner);
        made.type = keep(std::move(t));
        return made;
      }
    }
    add_fields(t, c);
    made.type = keep(std::move(t));
    return made;
  }
  void add_fields(Type& t, const Constraints& c) {
    std::vector<std::pair<double, rdf::FieldType>> fields;
    for (const Field& f : c.fields) {
      if (is_unit(f.predicate)) continue;
      Constraints of = shapes_.constraints_of(f.shapes);
      if (of.max_count == 0) continue;
      if (f.predicate == vocab::rdf_::type.text) {
        add_types(t, of);
        continue;
      }
      const std::optional<Made> made = field(f, of);
      if (made) fields.push_back({of.order, with_default({name_of(f.predicate, of), f.predicate, made->type, made->facets}, of)});
    }
    std::stable_sort(fields.begin(), fields.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    for (auto& f : fields) t.fields.push_back(std::move(f.second));
  }
  /// A field that may be left out because it has a default is no optional one: its value always exists.
  rdf::FieldType with_default(rdf::FieldType field, const Constraints& c) const {
    if (c.with_default.empty() || field.type->kind != Kind::optional) return field;
    Type shape;
    shape.kind = Kind::record;
    shape.fields.push_back({{}, std::string(sh::defaultValue.text), field.type->element, field.facets});
    std::vector<rdf::Mismatch> mismatches;
    const Result<rdf::Value> value = rdf::read_value(graph_, c.with_default.front(), shape, {}, {}, mismatches);
    if (!value || !value->sequence()) return field;
    field.absent = std::make_shared<const rdf::Value>(value->sequence()->front());
    field.type = field.type->element;
    return field;
  }
  /// rdf:type with sh:hasValue is a class.
  void add_types(Type& t, const Constraints& types) {
    for (const TermId value : types.exactly)
      if (const TermView of = graph_.term(value);
          of.is_iri() && iri::is_absolute(of.text) && std::find(t.classes.begin(), t.classes.end(), of.text) == t.classes.end())
        t.classes.emplace_back(of.text);
  }
  std::string name_of(const std::string& predicate, const Constraints& c) const {
    std::string last = last_part(predicate);
    for (const std::string& name : c.names)
      if (iri::encode_segment(name) == last) return name;
    if (options_.stated_names)
      for (const std::string& name : c.names)
        if (!name.empty() && name.find_first_of(" \t\r\n") == std::string::npos) return name;
    return last.empty() ? predicate : last;
  }

  std::optional<Made> enumeration(const Constraints& c) {
    Type t;
    t.kind = Kind::enumeration;
    t.datatype = xsd::string;
    const auto members = graph_.list(c.one_of.front());
    if (!members) refuse_shape(Errc::expected_value, "expected an RDF list as sh:in at " + (path_.empty() ? "the value" : shortened(path_)));
    if (members->size() > options_.max_names)
      refuse_shape(Errc::limit_exceeded, "more than " + std::to_string(options_.max_names) + " members of sh:in");
    // Two documents that describe one shape repeat its lists.
    const auto differs = [&](TermId head) { return graph_.list(head) != members; };
    if (std::any_of(c.one_of.begin(), c.one_of.end(), differs)) warn("only the first of several sh:in is part of the type");
    std::set<std::string> seen;
    bool texts = !members->empty();
    for (const TermId m : *members) {
      const TermView term = graph_.term(m);
      texts = texts && term.is_literal() && term.datatype == xsd::string.text;
      if (!texts) break;
      if (term.text.size() > options_.max_text)
        refuse_shape(Errc::limit_exceeded, "a name of more than " + std::to_string(options_.max_text) + " bytes in sh:in");
      if (seen.insert(std::string(term.text)).second) t.names.emplace_back(term.text);
    }
    if (texts) return Made{keep(std::move(t)), {}};
    if (!members->empty() && graph_.term(members->front()).is_literal()) {
      Constraints of = c;
      if (of.datatypes.empty()) of.datatypes.emplace_back(graph_.term(members->front()).datatype);
      warn("the values of sh:in are not texts; the type has only their datatype");
      return literal(of);
    }
    return warn("the values of sh:in are IRIs, which a type does not have");
  }

  /// sh:hasValue without a datatype.
  std::optional<Made> constant(Constraints c) {
    const TermView term = graph_.term(c.exactly.front());
    if (!term.is_literal()) return warn("the value is " + shown(term) + ", which a type does not have");
    if (term.text.size() > options_.max_text)
      refuse_shape(Errc::limit_exceeded, "a value of more than " + std::to_string(options_.max_text) + " bytes in sh:hasValue");
    if (term.datatype == xsd::string.text) {
      Type t;
      t.kind = Kind::enumeration;
      t.datatype = xsd::string;
      t.names.emplace_back(term.text);
      return Made{keep(std::move(t)), {}};
    }
    c.datatypes.emplace_back(term.datatype);
    warn("the value is always " + shown(term) + "; the type has only its datatype");
    return literal(c);
  }

  std::optional<Made> literal(const Constraints& c) {
    using D = rdf::lexical::Datatype;
    const std::string& iri = c.datatypes.front();
    if (std::any_of(c.datatypes.begin(), c.datatypes.end(), [&](const std::string& d) { return d != iri; }))
      warn("only the first of several sh:datatype is part of the type");
    if (!iri::is_absolute(iri)) return warn("the datatype " + shortened(iri) + " is no absolute IRI");
    const D datatype = rdf::lexical::datatype_of(iri);
    Type t;
    Made made;
    t.datatype = kept(iri);
    switch (datatype) {
      case D::boolean: t.kind = Kind::boolean; break;
      case D::float_:
      case D::double_:
      case D::decimal:
        t.kind = Kind::real;
        t.single = datatype == D::float_;
        break;
      case D::day_time_duration: t.kind = Kind::duration; break;
      case D::date_time:
      case D::date_time_stamp: t.kind = Kind::instant; break;
      case D::lang_string: return warn("a text with a language is not part of types");
      default:
        if (rdf::lexical::is_integer_type(datatype)) t.kind = Kind::integer, integer_range(t, datatype);
        else t.kind = Kind::text;
    }
    if (t.kind == Kind::real || t.kind == Kind::integer) number_facets(c, t, made.facets);
    else if (t.kind == Kind::instant) instant_bounds(c);
    else if (c.has_bounds()) warn("bounds of " + shortened(rdf::abbreviate(iri)) + " are not part of the type");
    if (t.is_bytes()) bytes_of(t, c);
    else if (t.kind == Kind::text) made.facets.length(c.min_length, c.max_length);
    else if (c.has_lengths()) warn("sh:minLength and sh:maxLength are not part of the type");
    for (const std::string& pattern : c.patterns) {
      const bool own = (t.kind == Kind::duration && pattern == shacl::day_time_pattern) ||
                       (t.kind == Kind::real && pattern == shacl::finite_pattern) || (t.kind == Kind::instant && pattern == shacl::zone_pattern);
      if (!own) warn("sh:pattern \"" + shortened(pattern) + "\" is not part of the type");
    }
    made.type = keep(std::move(t));
    return made;
  }

  /// Four characters of base64 are one to three bytes.
  static void bytes_of(Type& t, const Constraints& c) {
    if (c.min_length > 3) t.shortest = c.min_length / 4 * 3 - 2;
    if (c.max_length != std::numeric_limits<std::size_t>::max()) t.longest = c.max_length / 4 * 3;
  }

  /// As far as a Type can state it: of negative integers, from -2^63.
  static void integer_range(Type& t, rdf::lexical::Datatype datatype) {
    const rdf::lexical::IntegerRange range = rdf::lexical::range_of(datatype);
    t.lowest = range.lowest.empty() ? std::numeric_limits<std::int64_t>::min() : rdf::lexical::parse_int64(range.lowest).value();
    if (range.highest.empty()) t.highest = std::numeric_limits<std::uint64_t>::max();
    else t.highest = rdf::lexical::parse_uint64(range.highest).value_or(0);  // -1
  }

  void number_facets(const Constraints& c, const Type& t, Facets& facets) {
    const auto each = [&](const auto& bounds, auto set) {
      for (const auto& [exclusive, id] : bounds) {
        const TermView term = graph_.term(id);
        const auto number = rdf::lexical::parse_double(term.text);
        if (number && !std::isnan(*number)) set(*number, exclusive);
        else warn("the bound " + shown(term) + " is no number");
      }
    };
    each(c.lower, [&](double v, bool exclusive) {
      if (!facets.min() || v > *facets.min() || (v == *facets.min() && exclusive)) (exclusive ? facets.above(v) : facets.at_least(v));
    });
    each(c.upper, [&](double v, bool exclusive) {
      if (!facets.max() || v < *facets.max() || (v == *facets.max() && exclusive)) (exclusive ? facets.below(v) : facets.at_most(v));
    });
    const bool excludes = std::find(c.patterns.begin(), c.patterns.end(), shacl::finite_pattern) != c.patterns.end();
    const bool bounded = facets.min() && facets.max();
    if (t.kind == Kind::real && t.datatype != xsd::decimal && (c.non_finite || (!excludes && !bounded))) facets.allow_non_finite();
  }
  /// Bounds that only limit the instant to 64 bits of nanoseconds belong to the type.
  void instant_bounds(const Constraints& c) {
    const auto own = [&](const auto& bounds, std::string_view text) {
      return std::all_of(bounds.begin(), bounds.end(), [&](const auto& b) { return graph_.term(b.second).text == text; });
    };
    if (!own(c.lower, "1677-09-22T00:00:00Z") || !own(c.upper, "2262-04-11T23:47:16Z")) warn("bounds of xsd:dateTime are not part of the type");
  }

  // ---- units

  static std::size_t unit_fields(const Constraints& c) {
    return static_cast<std::size_t>(std::count_if(c.fields.begin(), c.fields.end(), [](const Field& f) { return is_unit(f.predicate); }));
  }
  /// The IRI that a unit's predicate must have; empty: none.
  std::string unit_iri(const Field* f) {
    if (!f) return {};
    const Constraints c = shapes_.constraints_of(f->shapes);
    if (c.max_count == 0) return {};
    std::vector<TermId> allowed = c.exactly;
    if (allowed.empty() && !c.one_of.empty()) {
      if (const auto members = graph_.list(c.one_of.front())) allowed = *members;
    }
    if (allowed.empty()) {
      if (c.min_count > 0) warn("the shape does not say which unit is meant");
      return {};
    }
    const TermView first = graph_.term(allowed.front());
    if (!first.is_iri() || !iri::is_absolute(first.text) || first.text.size() > options_.max_text)
      return warn("the unit " + shown(first) + " is no IRI"), std::string();
    if (allowed.size() > 1) warn("of several units, only " + shown(first) + " is part of the type");
    return std::string(first.text);
  }
  Unit unit_of(const Constraints& c) {
    const std::string vom = unit_iri(c.field(vocab::vom::unit));
    std::string qudt = unit_iri(c.field(vocab::qudt::hasUnit));
    if (qudt.empty() && c.field(vocab::qudt::unit)) {
      qudt = unit_iri(c.field(vocab::qudt::unit));
      if (!qudt.empty()) data_->former_unit = true;
    }
    if (vom.empty() && qudt.empty()) return unit::none;
    const Unit found = find_unit(kept(vom).text, kept(qudt).text);
    if (may_keep_unit(found)) return found;
    warn("too many different units; this one is not part of the type");
    return unit::none;
  }

  // ---- alternatives

  void mention_others(const Constraints& c) {
    for (const std::string& other : c.others) warn(other + " is not part of the type");
  }

  /// Whether a shape only requires that all of its paths are absent.
  bool is_absent(TermId shape) {
    Constraints c;
    shapes_.gather(shape, c);
    if (c.fields.empty() || !c.datatypes.empty() || !c.alternatives.empty() || !c.exclusive.empty() || !c.classes.empty() || !c.one_of.empty())
      return false;
    return std::all_of(c.fields.begin(), c.fields.end(), [&](const Field& f) { return shapes_.constraints_of(f.shapes).max_count == 0; });
  }
  /// Removes the alternatives of an absent and a present value. Returns the shape of the present one.
  std::optional<TermId> take_present(Constraints& c) {
    for (auto it = c.alternatives.begin(); it != c.alternatives.end(); ++it) {
      if (it->size() != 2) continue;
      for (const std::size_t absent : {std::size_t{0}, std::size_t{1}}) {
        if (graph_.term((*it)[0]).is_literal() || graph_.term((*it)[1]).is_literal() || !is_absent((*it)[absent])) continue;
        const TermId present = (*it)[1 - absent];
        c.alternatives.erase(it);
        return present;
      }
    }
    return std::nullopt;
  }

  static int rank(std::string_view datatype) noexcept {
    using D = rdf::lexical::Datatype;
    const D d = rdf::lexical::datatype_of(datatype);
    switch (d) {
      case D::double_: return 9;
      case D::float_: return 8;
      case D::decimal: return 7;
      case D::integer: return 6;
      case D::day_time_duration: return 5;
      case D::string: return 4;
      default: return rdf::lexical::is_integer_type(d) ? 5 : 0;
    }
  }
  /// A number with bounds, or one of NaN and the infinities: rdf::Facets::allow_non_finite().
  bool take_non_finite(Constraints& c, const std::vector<TermId>& members) {
    if (members.size() != 2 || c.datatypes.empty()) return false;
    Constraints bounds, special;
    shapes_.gather(members[0], bounds);
    shapes_.gather(members[1], special);
    if (!bounds.has_bounds() || special.one_of.size() != 1 || special.has_bounds()) return false;
    const auto values = graph_.list(special.one_of.front());
    if (!values || values->empty()) return false;
    for (const TermId v : *values)
      if (const std::string_view text = graph_.term(v).text; text != "NaN" && text != "INF" && text != "+INF" && text != "-INF") return false;
    c.lower.insert(c.lower.end(), bounds.lower.begin(), bounds.lower.end());
    c.upper.insert(c.upper.end(), bounds.upper.begin(), bounds.upper.end());
    c.non_finite = true;
    return true;
  }
  void resolve_alternatives(Constraints& c) {
    while (!c.alternatives.empty() || !c.exclusive.empty()) {
      std::vector<std::vector<TermId>>& lists = c.alternatives.empty() ? c.exclusive : c.alternatives;
      const char* const name = c.alternatives.empty() ? "sh:xone" : "sh:or";
      const std::vector<TermId> members = std::move(lists.back());
      lists.pop_back();
      if (members.empty()) continue;
      for (const TermId m : members)
        if (graph_.term(m).is_literal())
          refuse_shape(Errc::expected_value, std::string("expected shapes in ") + name + ", found " + shown(graph_.term(m)));
      if (take_non_finite(c, members)) continue;
      std::string best;
      int best_rank = -1;
      bool only_datatypes = true;
      for (const TermId m : members) {
        Constraints alternative;
        shapes_.gather_part(m, alternative);
        only_datatypes = only_datatypes && alternative.datatypes.size() == 1 && alternative.fields.empty() && !alternative.has_bounds() &&
                         alternative.one_of.empty() && alternative.patterns.empty() && !alternative.has_lengths() &&
                         alternative.alternatives.empty() && alternative.exclusive.empty();
        if (!only_datatypes) break;
        if (const int r = rank(alternative.datatypes.front()); r > best_rank) best_rank = r, best = alternative.datatypes.front();
      }
      if (only_datatypes) {
        c.datatypes.push_back(best);
        continue;
      }
      if (members.size() > 1) warn("only the first of " + std::to_string(members.size()) + " alternatives of " + name + " is part of the type");
      shapes_.gather_part(members.front(), c);
    }
  }

  const Graph& graph_;
  const SchemaOptions& options_;
  ShapeReader shapes_;
  std::shared_ptr<Schema::Data> data_;
  std::vector<TermId> inside_;
  std::string path_;
  std::size_t depth_ = 0, suppressed_ = 0;
};

Result<Schema> Schema::read(const Graph& shapes, const TermView& shape, const SchemaOptions& options) {
  const auto id = shape.is_literal() ? std::nullopt : shapes.find(shape);
  if (!id || shapes.match(*id, std::nullopt, std::nullopt).empty())
    return unexpected(Errc::expected_value, "the shapes graph has no shape " + shown(shape));
  try {
    return SchemaReader(shapes, options).read(*id);
  } catch (const RefusedShape& refused) { return unexpected(refused.error); }
}

bool Schema::usable() const noexcept { return data_->type != nullptr; }
const Type& Schema::type() const noexcept { return assert(usable()), *data_->type; }
const Facets& Schema::facets() const noexcept { return data_->facets; }
const std::vector<std::string>& Schema::warnings() const noexcept { return data_->warnings; }
TermView Schema::shape() const noexcept { return data_->shape.view(); }
const std::string& Schema::name() const noexcept { return data_->name; }

Result<rdf::Value> Schema::read_value(const Graph& graph, TermId focus, std::vector<rdf::Mismatch>* mismatches) const {
  std::vector<rdf::Mismatch> own;
  std::vector<rdf::Mismatch>& found = mismatches ? *mismatches : own;
  const auto former = data_->former_unit ? graph.find(vocab::qudt::unit) : std::nullopt;
  if (!former) return rdf::read_value(graph, focus, type(), facets(), {}, found);
  Graph renamed;
  for (const rdf::Triple& t : graph.triples())
    renamed.add(graph.term(t.subject), t.predicate == *former ? TermView(vocab::qudt::hasUnit) : graph.term(t.predicate), graph.term(t.object));
  return rdf::read_value(renamed, renamed.intern(graph.term(focus)), type(), facets(), {}, found);
}

void Schema::write_value(Graph& graph, TermId focus, const rdf::Value& value) const {
  const std::size_t before = graph.size();
  rdf::write_value(graph, focus, type(), facets(), value, {});
  complete(graph, focus, before);
}

Result<void> Schema::write_plain_value(Graph& graph, TermId focus, std::string_view body, const MediaType& media_type, std::size_t max_values) const {
  const std::optional<rdf::Plain> format = rdf::plain_of(media_type);
  if (!format) return unexpected(Errc::unsupported_syntax, "expected JSON, text, CBOR or octets, found " + media_type.to_string());
  const std::size_t before = graph.size();
  if (Result<void> r = rdf::read_plain(body, *format, type(), facets(), {}, max_values, graph, focus); !r) return r;
  complete(graph, focus, before);
  return {};
}

void Schema::complete(Graph& graph, TermId focus, std::size_t first_triple) const {
  const std::size_t end = graph.size();
  if (end == first_triple) return;  // an absent value
  for (const std::string& of : data_->classes) graph.add(focus, graph.intern(vocab::rdf_::type), graph.intern(rdf::iri(of)));
  if (!data_->former_unit) return;
  const TermId has_unit = graph.intern(vocab::qudt::hasUnit), former = graph.intern(vocab::qudt::unit);
  for (std::size_t i = first_triple; i < end; ++i)
    if (const rdf::Triple t = graph.triples()[i]; t.predicate == has_unit) graph.add(t.subject, former, t.object);
}

}  // namespace v0
}  // namespace lrt::client
