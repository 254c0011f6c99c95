// SPDX-License-Identifier: Apache-2.0
#include <lrt/codegen.hpp>

#include <cmath>
#include <limits>
#include <set>
#include <unordered_map>
#include <utility>

#include <lrt/base/iri.hpp>
#include <lrt/client/units.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/codegen/cpp_text.hpp"
#include "src/codegen/kinds.hpp"
#include "src/codegen/made_of.hpp"
#include "src/codegen/value_lines.hpp"

namespace lrt::codegen {
inline namespace v0 {
namespace {

using rdf::Facets;
using rdf::FieldType;
using rdf::Type;
using Kind = Type::Kind;

/// Thrown to end the generation. Does not leave this file.
struct Refused {
  Error error;
};

class Generator {
 public:
  Generator(const client::Description& robot, const GenerateOptions& options) : robot_(robot), options_(options), kinds_(kinds_of(robot)) {
    for (const std::string& w : robot.warnings) warn(w);
  }

  Generated run() {
    names_ = kind_names(kinds_, scope_, options_);
    for (std::size_t i = 0; i < kinds_.size(); ++i) kind(kinds_[i], names_[i]);
    for (const client::ShapeDescription& s : robot_.shapes) shape(s);
    const std::string list = list_of(parts_of(kinds_, names_, robot_.shapes));
    std::string out =
        "// Made by `lrt generate` of the Blueprints of a robot. Changes are lost when it is made again; `lrt generate --check` tells whether the\n"
        "// robot still has these Blueprints.\n"
        "#pragma once\n\n"
        "#include <array>\n#include <chrono>\n#include <cstdint>\n#include <map>\n#include <optional>\n#include <string>\n"
        "#include <utility>\n";
    out += variants_.empty() ? "" : "#include <variant>\n";
    out +=
        "#include <vector>\n\n"
        "#include <lrt/client.hpp>\n#include <lrt/rdf/traits.hpp>\n";
    if (!notes_.empty()) {
      out += "\n// What C++ cannot express:\n";
      for (const std::string& note : notes_) out += "//   " + cpp::comment_text(note, 2 * options_.max_comment) + "\n";
    }
    if (!types_.empty()) {
      out += "\nnamespace " + options_.name_space + " {\n";
      for (const Made& t : types_) out += "\n" + t.definition;
      out += "\n}  // namespace " + options_.name_space + "\n";
      for (const Made& t : types_) out += "\n" + t.traits;
    }
    if (!classes_.empty()) out += "\nnamespace " + options_.name_space + " {\n" + classes_ + "\n}  // namespace " + options_.name_space + "\n";
    out += "\n" + list;
    if (out.size() > options_.max_bytes) refuse_size();
    return {std::move(out), std::move(warnings_)};
  }

 private:
  struct Made {
    std::string name, definition, traits;
  };
  /// A C++ type.
  struct Cpp {
    std::string type;
    std::string initial;   ///< " = 0"
    std::string datatype;  ///< of its literals, if it is not that of the C++ type
  };

  void warn(const std::string& sentence) {
    if (warnings_.size() < options_.max_warnings) warnings_.push_back(sentence);
  }
  /// A warning that is a comment in the header, too.
  std::nullopt_t note(const std::string& sentence) {
    if (notes_.size() < options_.max_warnings) notes_.push_back(sentence);
    warn(sentence);
    return std::nullopt;
  }
  [[noreturn]] void refuse_size() const {
    throw Refused{{Errc::limit_exceeded, "the header would have more than " + std::to_string(options_.max_bytes) + " bytes"}};
  }
  void count(const std::string& text) {
    bytes_ += text.size();
    if (bytes_ > options_.max_bytes) refuse_size();
  }
  /// Names begin with "::", because lrt has namespaces of its own.
  std::string qualified(const std::string& name) const { return "::" + options_.name_space + "::" + name; }

  // ---- texts

  std::string unit_text(const Facets& f) const {
    return f.unit().empty() ? std::string() : "[" + cpp::comment_text(client::unit_label(f.unit()), options_.max_comment) + "]";
  }
  /// Follows a text: ": [deg], at least 0".
  static std::string with_colon(const std::string& range) { return range.empty() ? range : ": " + range; }
  /// Unit and bounds in words: "[deg], at least 0, below 360".
  std::string range_text(const Type& outer, const Facets& f, bool bounds) const {
    const Type* t = &outer;
    std::vector<std::string> parts;
    if (!f.unit().empty()) parts.push_back(unit_text(f));
    for (; t->kind == Kind::optional || t->kind == Kind::list || t->kind == Kind::map; t = t->element) {
      if (t->kind == Kind::optional) parts.emplace_back("may be absent");
      if (t->kind == Kind::list && t->shortest != t->longest && t->shortest > 0)
        parts.push_back("at least " + std::to_string(t->shortest) + " members");
      if (t->kind == Kind::list && t->shortest != t->longest && t->longest != std::numeric_limits<std::size_t>::max())
        parts.push_back("at most " + std::to_string(t->longest) + " members");
    }
    if (t->is_number() && bounds && f.min()) parts.push_back((f.min_exclusive() ? "above " : "at least ") + rdf::lexical::format(*f.min()));
    if (t->is_number() && bounds && f.max()) parts.push_back((f.max_exclusive() ? "below " : "at most ") + rdf::lexical::format(*f.max()));
    if (t->kind == Kind::text && f.min_length() > 0) parts.push_back("at least " + std::to_string(f.min_length()) + " characters");
    if (t->kind == Kind::text && f.max_length() != std::numeric_limits<std::size_t>::max())
      parts.push_back("at most " + std::to_string(f.max_length()) + " characters");
    std::string text;
    for (const std::string& p : parts) text += (text.empty() ? "" : ", ") + p;
    return text;
  }
  static std::string number_text(double v) {
    std::string text = rdf::lexical::format(v);
    if (text.find_first_of(".e") == std::string::npos && text.size() > 15) text += ".0";
    return text;
  }
  static std::string unit_code_of(const Unit& u) {
    struct Known {
      const Unit& unit;
      const char* name;
    };
    static constexpr Known known[] = {{unit::radian, "radian"},
                                      {unit::degree, "degree"},
                                      {unit::radian_per_second, "radian_per_second"},
                                      {unit::degree_per_second, "degree_per_second"},
                                      {unit::metre, "metre"},
                                      {unit::millimetre, "millimetre"},
                                      {unit::metre_per_second, "metre_per_second"},
                                      {unit::second, "second"},
                                      {unit::newton, "newton"},
                                      {unit::newton_metre, "newton_metre"},
                                      {unit::kilogram, "kilogram"},
                                      {unit::degree_celsius, "degree_celsius"},
                                      {unit::volt, "volt"},
                                      {unit::ampere, "ampere"},
                                      {unit::percent, "percent"},
                                      {unit::one, "one"}};
    for (const Known& k : known)
      if (k.unit == u) return std::string("lrt::unit::") + k.name;
    return "lrt::Unit{lrt::Iri{" + cpp::string_literal(u.qudt.text) + "}, lrt::Iri{" + cpp::string_literal(u.vom.text) + "}, " +
           cpp::string_literal(u.ucum) + ", {}}";
  }
  /// ".unit(lrt::unit::degree).at_least(0).below(360)"
  std::string facets_code(const Type& outer, const Facets& f, bool bounds) const {
    const Type* t = &outer;
    while (t->kind == Kind::optional || t->kind == Kind::list || t->kind == Kind::map) t = t->element;
    std::string text;
    if (!f.unit().empty() && f.unit().qudt.text.size() <= options_.max_text && f.unit().vom.text.size() <= options_.max_text)
      text += ".unit(" + unit_code_of(f.unit()) + ")";
    if (t->is_number() && bounds) {
      if (f.min() && std::isfinite(*f.min())) text += (f.min_exclusive() ? ".above(" : ".at_least(") + number_text(*f.min()) + ")";
      if (f.max() && std::isfinite(*f.max())) text += (f.max_exclusive() ? ".below(" : ".at_most(") + number_text(*f.max()) + ")";
    }
    if (t->kind == Kind::real && f.allows_non_finite()) text += ".allow_non_finite()";
    if (t->kind == Kind::text && (f.min_length() > 0 || f.max_length() != std::numeric_limits<std::size_t>::max()))
      text +=
          ".length(" + std::to_string(f.min_length()) + ", " +
          (f.max_length() == std::numeric_limits<std::size_t>::max() ? std::string("static_cast<std::size_t>(-1)") : std::to_string(f.max_length())) +
          ")";
    return text;
  }

  // ---- types

  static Cpp integer(const Type& t) {
    using D = rdf::lexical::Datatype;
    const auto own = [](const char* type) { return Cpp{type, " = 0", {}}; };
    const auto other = [&](const char* type) { return Cpp{type, " = 0", std::string(t.datatype.text)}; };
    switch (rdf::lexical::datatype_of(t.datatype.text)) {
      case D::byte_: return own("std::int8_t");
      case D::short_: return own("std::int16_t");
      case D::int_: return own("std::int32_t");
      case D::long_: return own("std::int64_t");
      case D::unsigned_byte: return own("std::uint8_t");
      case D::unsigned_short: return own("std::uint16_t");
      case D::unsigned_int: return own("std::uint32_t");
      case D::unsigned_long: return own("std::uint64_t");
      case D::non_negative_integer:
      case D::positive_integer: return other("std::uint64_t");
      default: return other("std::int64_t");
    }
  }

  /// The C++ type of values.
  /// @param hint  a name for it, if its class does not give one
  /// @param where  for warnings
  std::optional<Cpp> type_of(const Type& t, const Facets& facets, const std::string& hint, bool bounds, const std::string& where) {
    const std::string datatype(t.datatype.text);
    if (datatype.size() > options_.max_text) return note(where + ": the IRI of the datatype is too long");
    switch (t.kind) {
      case Kind::boolean: return Cpp{"bool", " = false", {}};
      case Kind::integer: return integer(t);
      case Kind::real: return Cpp{t.single ? "float" : "double", " = 0", t.datatype == vocab::xsd::decimal ? datatype : std::string()};
      case Kind::text: return Cpp{"std::string", {}, t.datatype == vocab::xsd::string ? std::string() : datatype};
      case Kind::duration: return Cpp{"std::chrono::nanoseconds", "{}", {}};
      case Kind::instant: return Cpp{"std::chrono::system_clock::time_point", "{}", t.datatype == vocab::xsd::dateTime ? std::string() : datatype};
      case Kind::enumeration: return enumeration(t, hint, where);
      case Kind::record: return record(t, facets, hint, bounds, where);
      case Kind::variant: return variant(t, facets, hint, bounds, where);
      case Kind::optional: {
        std::optional<Cpp> inner = type_of(*t.element, facets, hint, bounds, where);
        if (inner) inner->type = "std::optional<" + inner->type + ">", inner->initial.clear();
        return inner;
      }
      case Kind::list: {
        std::optional<Cpp> inner = type_of(*t.element, facets, hint, bounds, where);
        if (!inner) return inner;
        const bool fixed = t.shortest == t.longest && t.longest > 0 && t.longest <= options_.max_array;
        inner->type = fixed ? "std::array<" + inner->type + ", " + std::to_string(t.longest) + ">" : "std::vector<" + inner->type + ">";
        inner->initial = fixed ? "{}" : "";
        return inner;
      }
      case Kind::map: {
        std::optional<Cpp> inner = type_of(*t.element, facets, hint, bounds, where);
        if (inner) inner->type = "std::map<std::string, " + inner->type + ">", inner->initial.clear();
        return inner;
      }
    }
    return std::nullopt;
  }

  std::optional<Cpp> enumeration(const Type& t, const std::string& hint, const std::string& where) {
    std::string key = "enum";
    for (const std::string& n : t.names) {
      if (n.size() > options_.max_text) {
        note(where + ": a name of the enumeration is too long; the value is a text");
        return Cpp{"std::string", {}, {}};
      }
      key += std::to_string(n.size()) + ":" + n;
    }
    const auto known = by_form_.find(key);
    if (known != by_form_.end()) return Cpp{known->second.type, " = " + known->second.type + "::" + known->second.initial, {}};
    Made made;
    made.name = scope_.add(cpp::type_name(hint, options_.max_name));
    cpp::Scope scope;
    std::string enumerators, names, first;
    for (const std::string& n : t.names) {
      const std::string id = scope.add(cpp::member_name(n, options_.max_name));
      if (first.empty()) first = id;
      enumerators += "  " + id + ",  ///< " + quoted(n) + "\n";
      names += "    e.name(" + qualified(made.name) + "::" + id + ", " + cpp::string_literal(n) + ");\n";
    }
    made.definition = "enum class " + made.name + " {\n" + enumerators + "};\n";
    const std::string q = qualified(made.name);
    made.traits = "template <>\nstruct lrt::rdf::traits<" + q + "> : lrt::rdf::Enumeration<" + q + "> {\n  static void describe(Enumeration<" + q +
                  ">& e) {\n" + names + "  }\n};\n";
    by_form_[key] = Cpp{made.name, first, {}};
    count(made.definition), count(made.traits);
    Cpp result{made.name, " = " + made.name + "::" + first, {}};
    types_.push_back(std::move(made));
    return result;
  }
  std::string quoted(std::string_view text) const { return "\"" + cpp::comment_text(text, options_.max_comment) + "\""; }

  /// The term that lrt makes of a name in the robot's own vocabulary, "#Grip/width"; empty: it is no such term.
  std::string own_term(std::string_view iri) const {
    const std::string short_form = ValueLines(origin_, true).short_iri(iri);
    const std::size_t hash = iri.find('#');
    return short_form.front() == '~' && hash != std::string_view::npos && hash + 1 < iri.size() ? std::string(iri.substr(hash)) : std::string();
  }
  std::string term_or_iri(const std::string& iri) const {
    const std::string own = own_term(iri);
    return own.empty() ? iri : own;
  }
  static std::string list_of_literals(const std::vector<std::string>& texts) {
    std::string text;
    for (const std::string& t : texts) text += (text.empty() ? "" : ", ") + cpp::string_literal(t);
    return "{" + text + "}";
  }

  std::optional<Cpp> record(const Type& t, const Facets& facets, const std::string& hint, bool bounds, const std::string& where) {
    const std::string key = "record" + ValueLines(origin_, bounds).text(t, Facets(facets).without_bounds().unit(unit::none));
    if (const auto known = by_form_.find(key); known != by_form_.end()) return known->second;
    for (const auto* iris : {&t.classes, &t.value_classes})
      for (const std::string& c : *iris)
        if (c.size() > options_.max_text) return note(where + ": the IRI of a class is too long");
    Made made;
    made.name = scope_.add(cpp::type_name(t.classes.empty() ? hint : decoded_last_part(t.classes.front()), options_.max_name));
    const std::string q = qualified(made.name);
    cpp::Scope scope;
    std::string members, fields, changes;
    std::size_t index = 0;
    for (const FieldType& f : t.fields) {
      const std::string place = where + ", field " + f.name;
      if (f.predicate.size() > options_.max_text || f.name.size() > options_.max_text) {
        note(place.substr(0, options_.max_comment) + ": the predicate is too long; the field is left out");
        continue;
      }
      const Facets own = rdf::field_facets(f, facets);
      const std::optional<Cpp> type = type_of(*f.type, own, f.name, bounds, place);
      if (!type) continue;
      const std::string id = scope.add(cpp::member_name(f.name, options_.max_name));
      const std::string range = range_text(*f.type, own, bounds);
      members += "  " + type->type + " " + id + type->initial + ";" + (range.empty() ? "" : "  ///< " + range) + "\n";
      const std::string term = term_or_iri(f.predicate);
      fields += "    r.field(lrt::Iri{" + cpp::string_literal(term) + "}, &" + q + "::" + id + ")" + facets_code(*f.type, own, bounds) + ";\n";
      changes += changes_of(f, *type, term, made.name, index++);
    }
    const std::string classes = classes_code("r", t);
    std::vector<std::string> value_terms;
    for (const std::string& c : t.value_classes) value_terms.push_back(term_or_iri(c));
    if (t.classes.empty()) changes += "      t.classes.clear();\n";
    if (!t.value_predicate.empty()) {
      changes += "      t.value_predicate = " + cpp::string_literal(t.value_predicate) + ";\n";
      changes += "      t.value_classes = " + list_of_literals(value_terms) + ";\n";
    }
    made.definition = class_comment(t) + "struct " + made.name + " {\n" + members + "};\n";
    made.traits = traits_code("Record", "r", q, classes + fields, changes);
    return add_type(key, std::move(made));
  }

  /// Whether no other program has the C++ type: a struct or an enum of this header is part of it.
  static bool is_own(const Type& type) {
    if (type.kind == Kind::record) return !type.fields.empty() || !type.classes.empty();
    if (type.kind == Kind::enumeration || type.kind == Kind::variant) return true;
    return type.element && is_own(*type.element);
  }

  /// The shape of a variant that may be absent does not state its class. Its terms do: "#Target/moveTo".
  Type with_class(const Type& variant) const {
    Type t = variant;
    std::string owner;
    for (const FieldType& f : t.fields) {
      const std::string own = own_term(f.predicate);
      const std::size_t slash = own.find('/');
      const std::string of = slash == std::string::npos ? std::string() : f.predicate.substr(0, f.predicate.size() - own.size() + slash);
      if (!t.classes.empty() || of.empty() || (!owner.empty() && of != owner)) return t;
      owner = of;
    }
    if (!owner.empty()) t.classes.push_back(owner);
    return t;
  }

  /// One of several alternatives: a std::variant, or a struct that derives from one if the std::variant could have other traits, too.
  std::optional<Cpp> variant(const Type& stated, const Facets& facets, const std::string& hint, bool bounds, const std::string& where) {
    const Type t = with_class(stated);
    const std::string key = "variant" + ValueLines(origin_, bounds).text(t, Facets(facets).without_bounds().unit(unit::none));
    if (const auto known = by_form_.find(key); known != by_form_.end()) return known->second;
    for (const std::string& c : t.classes)
      if (c.size() > options_.max_text) return note(where + ": the IRI of a class is too long");
    Made made;
    made.name = scope_.add(cpp::type_name(t.classes.empty() ? hint : decoded_last_part(t.classes.front()), options_.max_name));
    std::string lines, types, code = "    v.named(" + cpp::string_literal(made.name) + ");\n" + classes_code("v", t), changes;
    std::size_t index = 0;
    bool own_type = false;
    for (const FieldType& f : t.fields) {
      const std::string place = where + ", alternative " + f.name;
      if (f.predicate.size() > options_.max_text || f.name.size() > options_.max_text) {
        note(place.substr(0, options_.max_comment) + ": the predicate is too long; the alternative is left out");
        continue;
      }
      const Facets own = rdf::field_facets(f, facets);
      const bool is_empty = f.type->kind == Kind::record && f.type->fields.empty() && f.type->classes.empty();
      const std::optional<Cpp> type = is_empty ? Cpp{"std::monostate", {}, {}} : type_of(*f.type, own, f.name, bounds, place);
      if (!type) {
        note(place + ": there is no C++ type for it; the alternative is left out");
        continue;
      }
      const std::string range = range_text(*f.type, own, bounds);
      lines += "///   " + quoted(f.name) + ": " + cpp::comment_text(type->type, options_.max_comment) + (range.empty() ? "" : ", " + range) + "\n";
      types += (types.empty() ? "" : ", ") + type->type;
      own_type = own_type || is_own(*f.type);
      const std::string term = term_or_iri(f.predicate);
      code +=
          "    v.alternative<" + std::to_string(index) + ">(lrt::Iri{" + cpp::string_literal(term) + "})" + facets_code(*f.type, own, bounds) + ";\n";
      changes += changes_of(f, *type, term, made.name, index++);
    }
    if (index == 0) return note(where + ": none of its alternatives has a C++ type");
    if (t.classes.empty()) changes += "      t.classes.clear();\n";
    const std::string base = "std::variant<" + types + ">";
    made.definition = class_comment(t) + "/// One of:\n" + lines;
    if (variants_.insert(types).second && own_type) made.definition += "using " + made.name + " = " + base + ";\n";
    else made.definition += "struct " + made.name + " : " + base + " {\n  using " + base + "::variant;\n};\n";
    made.traits = traits_code("Variant", "v", qualified(made.name), code, changes);
    return add_type(key, std::move(made));
  }

  std::string classes_code(const char* object, const Type& t) const {
    std::string text;
    for (const std::string& c : t.classes) text += std::string("    ") + object + ".is(lrt::Iri{" + cpp::string_literal(term_or_iri(c)) + "});\n";
    return text;
  }
  std::string class_comment(const Type& t) const {
    if (t.classes.empty()) return {};
    return "/// " + cpp::comment_text(ValueLines(origin_, true).short_iri(t.classes.front()), options_.max_comment) + "\n";
  }
  /// What rdf::Record and rdf::Variant would make of a field in another way.
  /// @param owner  the name of the record or variant
  static std::string changes_of(const FieldType& f, const Cpp& type, const std::string& term, const std::string& owner, std::size_t index) {
    std::string changes;
    const std::string at = "      t.fields[" + std::to_string(index) + "]";
    // The predicate and name that they derive from the term.
    const std::string name = term.substr(term.find_last_of("#/") + 1);
    const std::string placed = term.front() == '#' ? "#" + owner + "/" + iri::encode_segment(name) : term;
    if (placed != term) changes += at + ".predicate = " + cpp::string_literal(term) + ";\n";
    if (name != f.name) changes += at + ".name = " + cpp::string_literal(f.name) + ";\n";
    if (!type.datatype.empty())
      changes += at + ".type = &lrt::client::with_datatype(*t.fields[" + std::to_string(index) + "].type, lrt::Iri{" +
                 cpp::string_literal(type.datatype) + "});\n";
    return changes;
  }
  /// @param base  of the traits: Record or Variant
  static std::string traits_code(const std::string& base, const std::string& object, const std::string& q, const std::string& code,
                                 const std::string& changes) {
    const std::string type = base + "<" + q + ">";
    std::string text = "template <>\nstruct lrt::rdf::traits<" + q + "> : lrt::rdf::" + type + " {\n  static void describe(" + type + "&" +
                       (code.empty() ? "" : " " + object) + ") {\n" + code + "  }\n";
    if (!changes.empty())
      text += "  static const Type& type() {\n    static const lrt::Immortal<Type> changed([] {\n      Type t = " + type + "::type();\n" + changes +
              "      return t;\n    }());\n    return *changed;\n  }\n";
    return text + "};\n";
  }
  Cpp add_type(const std::string& key, Made made) {
    count(made.definition), count(made.traits);
    Cpp result{made.name, {}, {}};
    by_form_[key] = result;
    types_.push_back(std::move(made));
    return result;
  }

  /// A type of a shape that belongs to no Thing. A type that has no name yet gets one.
  void shape(const client::ShapeDescription& s) {
    origin_ = origin_of(s.iri);
    const Type& type = s.schema.type();
    const std::optional<Cpp> made = type_of(type, s.schema.facets(), s.name, true, s.name);
    if (!made || type.kind == Kind::record || type.kind == Kind::variant || type.kind == Kind::enumeration) return;
    if (!made->datatype.empty()) note(s.name + ": the C++ type does not have the datatype " + made->datatype);
    const std::string range = range_text(type, s.schema.facets(), true);
    const std::string out = "\n/// " + sentence(cpp::comment_text(s.name, options_.max_comment) + with_colon(range)) + "\nusing " +
                            scope_.add(cpp::type_name(s.name, options_.max_name)) + " = " + made->type + ";\n";
    count(out);
    classes_ += out;
  }

  // ---- kinds of Things

  std::string value_arguments(const Cpp& type, const client::Schema& schema) const {
    const std::string plain = "lrt::rdf::traits<" + type.type + ">::type()";
    const std::string described =
        type.datatype.empty() ? plain : "lrt::client::with_datatype(" + plain + ", lrt::Iri{" + cpp::string_literal(type.datatype) + "})";
    return described + ", " + (schema.facets().unit().empty() ? "lrt::unit::none" : unit_code_of(schema.facets().unit()));
  }
  /// The name by which a Thing's member is found: a predicate of a vocabulary, else its own name.
  std::string finder(const std::vector<std::string>& predicates, const std::string& name) const {
    for (const std::string& p : predicates)
      if (p.size() <= options_.max_text && ValueLines(origin_, true).short_iri(p).front() != '~')
        return cpp::string_literal(p) + ", " + cpp::string_literal(name);
    return "\"\", " + cpp::string_literal(name);
  }
  /// The name of a property or action, without percent escapes.
  static std::string decoded(const std::string& name) { return iri::decode(name).value_or(name); }
  static std::string sentence(const std::string& text) { return text.empty() || text.back() == '.' ? text : text + "."; }

  void kind(const ThingKind& k, const std::string& name) {
    origin_ = origin_of(k.things.front()->iri);
    cpp::Scope scope{"thing", "of", "all"};
    std::string members, initial;
    const auto required = [&](std::size_t n) { return n == k.things.size() ? "true" : "false"; };
    const auto titled = [&](const auto& d, std::size_t n, const std::string& range = {}) {
      const std::string title = d.title.empty() ? decoded(d.name) : d.title;
      const rdf::Text* const about = d.words.descriptions.choose({});
      const std::string description = about ? " " + sentence(cpp::comment_text(about->text, options_.max_comment)) : std::string();
      return sentence(cpp::comment_text(title, options_.max_comment) + with_colon(range)) + description +
             (n == k.things.size() ? "" : " Not at each of these Things.");
    };
    for (const auto& [member_name, m] : k.properties) {
      const client::PropertyDescription& p = *m.first;
      if (p.name.size() > options_.max_text) {
        note(name + ": the name of a property is too long; it is left out");
        continue;
      }
      const std::string where = name + ", property " + p.name;
      const std::optional<Cpp> type = p.schema ? type_of(p.schema->type(), p.schema->facets(), decoded(p.name), m.equal_bounds, where) : std::nullopt;
      const std::string id = scope.add(cpp::member_name(decoded(p.name), options_.max_name));
      const std::string found = "members.property(" + finder(p.predicates, p.name) + ", " + required(m.count) + ")";
      if (!type) {
        if (!p.schema) note(where + ": no shape says what the value is; read it as a graph");
        members += "  /// " + titled(p, m.count) + " Its type is not known: property() gives its graph.\n  lrt::client::Untyped " + id + ";\n";
        initial += ",\n        " + id + "(" + found + ")";
        continue;
      }
      const std::string range = range_text(p.schema->type(), p.schema->facets(), m.equal_bounds);
      members += "  /// " + titled(p, m.count, range) + (m.equal_bounds ? "" : " Each Thing has its own bounds.") + "\n";
      members += std::string("  lrt::client::") + (p.writable ? "Writable<" : "Readable<") + type->type + "> " + id + ";\n";
      initial += ",\n        " + id + "(" + found + ", " + value_arguments(*type, *p.schema) + ")";
    }
    for (const auto& [member_name, m] : k.actions) {
      const client::ActionDescription& a = *m.first;
      if (a.name.size() > options_.max_text) {
        note(name + ": the name of an action is too long; it is left out");
        continue;
      }
      const std::string where = name + ", action " + a.name;
      const std::optional<Cpp> input =
          a.input ? type_of(a.input->type(), a.input->facets(), decoded(a.name) + "_input", m.equal_bounds, where) : std::nullopt;
      std::optional<Cpp> output =
          a.output ? type_of(a.output->type(), a.output->facets(), decoded(a.name) + "_output", m.equal_bounds, where) : std::nullopt;
      const std::string id = scope.add(cpp::member_name(decoded(a.name), options_.max_name));
      const std::string found = "members.action(" + finder(a.predicates, a.name) + ", " + required(m.count) + ")";
      if (a.has_input && !input) {
        note(where + ": no C++ type for its input; invoke action() with a graph");
        members += "  /// " + titled(a, m.count) + " The type of its input is not known: action() takes a graph.\n  lrt::client::UntypedAction " +
                   id + ";\n";
        initial += ",\n        " + id + "(" + found + ")";
        continue;
      }
      const std::string range = input ? range_text(a.input->type(), a.input->facets(), m.equal_bounds) : std::string();
      const std::string out_range = output ? range_text(a.output->type(), a.output->facets(), m.equal_bounds) : std::string();
      members += "  /// " + titled(a, m.count) + (a.asynchronous ? " It takes time: wait for the invocation." : "") +
                 (range.empty() ? "" : " Input: " + range + ".") + (out_range.empty() ? "" : " Output: " + out_range + ".") + "\n";
      const std::string in_type = input ? input->type : "void", out_type = output ? output->type : "void";
      members += "  lrt::client::TypedAction<" + in_type + ", " + out_type + "> " + id + ";\n";
      const auto value = [&](const std::optional<Cpp>& type, const std::optional<client::Schema>& schema) {
        return type ? "{" + value_arguments(*type, *schema) + "}" : std::string("{}");
      };
      initial += ",\n        " + id + "(" + found + ", " + value(input, a.input) + ", " + value(output, a.output) + ")";
    }

    std::string names;
    for (std::size_t i = 0; i < k.things.size() && i < 8; ++i) {
      const client::ThingDescription& t = *k.things[i];
      names += (i == 0 ? "" : ", ") + cpp::comment_text(t.title.empty() ? decoded_last_part(t.iri) : t.title, 60);
    }
    if (k.things.size() > 8) names += " and " + std::to_string(k.things.size() - 8) + " more";
    std::vector<std::string> classes;
    for (const std::string& c : k.classes)
      if (c.size() <= options_.max_text && ValueLines(origin_, true).short_iri(c).front() != '~') classes.push_back(c);
    std::string out = "\n/// " + sentence(names) + "\nclass " + name + " {\n public:\n";
    out +=
        "  /// Takes a Thing of this kind, which has the classes, properties and actions.\n  /// @par Errors  expected_value: it is of another "
        "kind\n";
    out += "  static lrt::Result<" + name + "> of(lrt::client::Thing thing) {\n    lrt::client::Members members(std::move(thing), " +
           cpp::string_literal(name) + ", " + list_of_literals(classes) + ");\n    " + name +
           " made(members);\n    if (lrt::Result<void> fits = members.fits(); !fits) return lrt::unexpected(std::move(fits).error());\n    return "
           "made;\n  }\n";
    out += "  /// All Things of this kind that a robot has.\n  static std::vector<" + name +
           "> all(const lrt::client::Robot& robot) { return lrt::client::all_of<" + name + ">(robot); }\n\n";
    out += "  lrt::client::Thing thing;\n" + members;
    out += "\n private:\n  explicit " + name + "(" + "lrt::client::Members& members)\n      : thing(members.thing())" + initial + " {}\n};\n";
    count(out);
    classes_ += out;
  }

  const client::Description& robot_;
  const GenerateOptions& options_;
  std::vector<ThingKind> kinds_;
  std::vector<std::string> names_;
  cpp::Scope scope_;
  std::vector<Made> types_;
  std::set<std::string> variants_;  ///< lists of alternatives in C++
  std::unordered_map<std::string, Cpp> by_form_;
  std::string classes_, origin_;
  std::vector<std::string> notes_, warnings_;
  std::size_t bytes_ = 0;
};

}  // namespace

Result<Generated> generate(const client::Description& robot, const GenerateOptions& options) {
  if (!cpp::is_namespace(options.name_space))
    return unexpected(Errc::invalid_option, "expected a namespace of identifiers, \"acme::robot\", without lrt and std, found \"" +
                                                cpp::comment_text(options.name_space, 100) + "\"");
  try {
    return Generator(robot, options).run();
  } catch (const Refused& refused) { return unexpected(refused.error); }
}

}  // namespace v0
}  // namespace lrt::codegen
