#include <lrt/client/generate.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <map>
#include <set>
#include <unordered_map>
#include <utility>

#include <lrt/base/iri.hpp>
#include <lrt/base/utf8.hpp>
#include <lrt/client/units.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/value_codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/client/cpp_text.hpp"

namespace lrt::client {
namespace {

using rdf::Facets;
using rdf::FieldType;
using rdf::Type;
using Kind = Type::Kind;

/// Ends the generation, inside this file only.
struct Refused {
  Error error;
};

std::string last_part(std::string_view iri) {
  while (iri.size() > 1 && (iri.back() == '/' || iri.back() == '#')) iri.remove_suffix(1);
  const std::string part(iri.substr(iri.find_last_of("#/:") + 1));
  Result<std::string> decoded = iri::decode(part);
  return decoded ? *std::move(decoded) : part;
}

/// Scheme and authority, "http://robot:8080".
std::string origin_of(std::string_view iri) {
  const iri::Parts parts = iri::split(iri);
  return std::string(parts.scheme) + "://" + std::string(parts.authority);
}

const Type& without_optional(const Type& type) noexcept { return type.kind == Kind::optional ? without_optional(*type.element) : type; }

// ------------------------------------------------------------------------------------------------------- what a value is

/// Writes what a type and its facets are in one line of text, and in one line for each field.
class Flat {
 public:
  /// @param origin  of the robot: IRIs below it are written without it
  /// @param bounds  whether bounds of numbers count
  Flat(std::string_view origin, bool bounds) : origin_(origin), bounds_(bounds) {}

  using Lines = std::vector<std::pair<std::string, std::string>>;  ///< path, description

  void add(const std::string& path, const Type& type, const Facets& facets, Lines& lines) const {
    std::string text;
    const Type* t = &type;
    for (; t->kind == Kind::optional || t->kind == Kind::list || t->kind == Kind::map; t = t->element) {
      if (t->kind == Kind::optional) text += "optional ";
      else if (t->kind == Kind::map) text += "map of ";
      else text += "list" + length_of(*t) + " of ";
    }
    lines.emplace_back(path, text + one(*t, facets));
    if (t->kind != Kind::record) return;
    std::vector<const FieldType*> fields;
    for (const FieldType& f : t->fields) fields.push_back(&f);
    std::sort(fields.begin(), fields.end(), [](const auto* a, const auto* b) { return a->predicate < b->predicate; });
    for (const FieldType* f : fields) add(path + (path.empty() ? "" : " ") + short_iri(f->predicate), *f->type, rdf::field_facets(*f, facets), lines);
  }
  std::string text(const Type& type, const Facets& facets) const {
    Lines lines;
    add({}, type, facets, lines);
    std::string all;
    for (const auto& [path, line] : lines) all += std::to_string(path.size()) + ":" + path + "=" + line + "\n";
    return all;
  }
  std::string short_iri(std::string_view iri) const {
    if (!origin_.empty() && iri.size() > origin_.size() && iri.substr(0, origin_.size()) == origin_ && iri[origin_.size()] == '/')
      return "~" + std::string(iri.substr(origin_.size()));
    const std::string prefixed = rdf::abbreviate(iri);
    return prefixed.front() == '<' ? std::string(iri) : prefixed;
  }

 private:
  static std::string length_of(const Type& list) {
    if (list.shortest == list.longest) return "[" + std::to_string(list.shortest) + "]";
    if (list.longest == std::numeric_limits<std::size_t>::max()) return list.shortest == 0 ? "" : "[" + std::to_string(list.shortest) + "..]";
    return "[" + std::to_string(list.shortest) + ".." + std::to_string(list.longest) + "]";
  }
  std::string one(const Type& t, const Facets& f) const {
    std::string text;
    switch (t.kind) {
      case Kind::record: {
        text = "record";
        std::vector<std::string> classes;
        for (const std::string& c : t.classes) classes.push_back(short_iri(c));
        std::sort(classes.begin(), classes.end());
        for (const std::string& c : classes) text += " " + c;
        if (!t.value_predicate.empty()) text += " by " + short_iri(t.value_predicate);
        for (const std::string& c : t.value_classes) text += " " + short_iri(c);
        break;
      }
      case Kind::enumeration:
        text = "one of";
        for (const std::string& name : t.names) text += " \"" + name + "\"";
        return text;
      default: text = short_iri(t.datatype.text);
    }
    if (!f.unit().empty()) text += " [" + unit_label(f.unit()) + " " + short_iri((f.unit().qudt.empty() ? f.unit().vom : f.unit().qudt).text) + "]";
    return text + range_of(t, f);
  }
  std::string range_of(const Type& t, const Facets& f) const {
    std::string text;
    if (t.kind == Kind::text && f.min_length() > 0) text += ", at least " + std::to_string(f.min_length()) + " characters";
    if (t.kind == Kind::text && f.max_length() != std::numeric_limits<std::size_t>::max()) text += ", at most " + std::to_string(f.max_length()) + " characters";
    if (!bounds_ || !t.is_number()) return text;
    if (f.min()) text += (f.min_exclusive() ? ", above " : ", at least ") + rdf::lexical::format(*f.min());
    if (f.max()) text += (f.max_exclusive() ? ", below " : ", at most ") + rdf::lexical::format(*f.max());
    return text;
  }

  std::string origin_;
  bool bounds_;
};

// ------------------------------------------------------------------------------------------------------- kinds of Things

/// A property or action that all Things of a kind have in the same form.
template <class Description>
struct Member {
  const Description* first = nullptr;
  std::size_t count = 0;       ///< Things that have it
  std::string form;            ///< without bounds
  std::string bounded;         ///< with bounds
  bool equal_bounds = true;
};
using PropertyMember = Member<PropertyDescription>;
using ActionMember = Member<ActionDescription>;

struct ThingKind {
  std::string name;
  std::vector<const ThingDescription*> things;
  std::vector<std::string> classes;  ///< that all have
  std::map<std::string, PropertyMember> properties;
  std::map<std::string, ActionMember> actions;
};

std::string form_of(const std::optional<Schema>& schema, const std::string& origin, bool bounds) {
  return schema ? Flat(origin, bounds).text(schema->type(), schema->facets()) : std::string("?");
}
std::string form_of(const PropertyDescription& p, const std::string& origin, bool bounds) {
  return (p.writable ? "w " : "r ") + form_of(p.schema, origin, bounds);
}
std::string form_of(const ActionDescription& a, const std::string& origin, bool bounds) {
  return std::string(a.asynchronous ? "async " : "") + (a.has_input ? form_of(a.input, origin, bounds) : std::string()) + "->" + form_of(a.output, origin, bounds);
}

/// Groups Things by Blueprint. Things with one Blueprint whose values differ by more than bounds are of different kinds.
class Kinds {
 public:
  explicit Kinds(const Description& robot) {
    for (const ThingDescription& thing : robot.things) add(thing);
    name_all();
  }
  const std::vector<ThingKind>& all() const noexcept { return kinds_; }

 private:
  void add(const ThingDescription& thing) {
    std::string key = thing.kind;
    if (key.empty())
      for (const std::string& c : thing.classes) key += " " + c;
    for (const std::size_t i : by_key_[key])
      if (fits(kinds_[i], thing)) return join(kinds_[i], thing);
    by_key_[key].push_back(kinds_.size());
    join(kinds_.emplace_back(), thing);
  }
  /// Kinds that differ only in what has no place in C++, such as links between Things, become one.
  void unite() {
    std::vector<ThingKind> united;
    for (ThingKind& kind : kinds_) {
      const auto same = std::find_if(united.begin(), united.end(), [&](const ThingKind& other) { return is_same(kind, other); });
      if (same == united.end()) {
        united.push_back(std::move(kind));
        continue;
      }
      const std::string name = std::min(std::pair(same->name.size(), same->name), std::pair(kind.name.size(), kind.name)).second;
      for (const ThingDescription* thing : kind.things) join(*same, *thing);
      same->name = name;
    }
    kinds_ = std::move(united);
    for (ThingKind& kind : kinds_) std::sort(kind.things.begin(), kind.things.end(), [](const auto* a, const auto* b) { return a->iri < b->iri; });
  }
  static bool is_same(const ThingKind& a, const ThingKind& b) {
    const auto same = [](const auto& x, const auto& y) {
      return x.size() == y.size() && std::equal(x.begin(), x.end(), y.begin(), [](const auto& p, const auto& q) { return p.first == q.first && p.second.form == q.second.form; });
    };
    return a.classes == b.classes && same(a.properties, b.properties) && same(a.actions, b.actions);
  }
  template <class Members, class Descriptions>
  static bool agree(const Members& members, const Descriptions& descriptions, const std::string& origin) {
    return std::all_of(descriptions.begin(), descriptions.end(), [&](const auto& d) {
      const auto known = members.find(d.name);
      return known == members.end() || known->second.form == form_of(d, origin, false);
    });
  }
  static bool fits(const ThingKind& kind, const ThingDescription& thing) {
    const std::string origin = origin_of(thing.iri);
    return agree(kind.properties, thing.properties, origin) && agree(kind.actions, thing.actions, origin);
  }
  template <class Members, class Descriptions>
  static void join(Members& members, const Descriptions& descriptions, const std::string& origin) {
    std::set<std::string> seen;
    for (const auto& d : descriptions) {
      if (!seen.insert(d.name).second) continue;
      auto& member = members[d.name];
      const std::string bounded = form_of(d, origin, true);
      if (!member.first) member.first = &d, member.form = form_of(d, origin, false), member.bounded = bounded;
      else if (member.bounded != bounded) member.equal_bounds = false;
      ++member.count;
    }
  }
  static void join(ThingKind& kind, const ThingDescription& thing) {
    if (kind.things.empty()) {
      kind.classes = thing.classes;
    } else {
      std::vector<std::string> common;
      std::set_intersection(kind.classes.begin(), kind.classes.end(), thing.classes.begin(), thing.classes.end(), std::back_inserter(common));
      kind.classes = std::move(common);
    }
    kind.things.push_back(&thing);
    const std::string origin = origin_of(thing.iri);
    join(kind.properties, thing.properties, origin);
    join(kind.actions, thing.actions, origin);
  }
  static std::string wanted_name(const ThingKind& kind) {
    const ThingDescription& first = *kind.things.front();
    const std::string own = last_part(first.kind);
    if (!own.empty() && own != "blueprint" && own != "Blueprint") return own;
    if (!first.classes.empty()) return last_part(first.classes.front());
    return first.title.empty() ? last_part(first.iri) : first.title;
  }
  /// In the order of the names, so that the numbers of equal ones do not depend on addresses.
  void name_all() {
    for (ThingKind& kind : kinds_) kind.name = wanted_name(kind);
    unite();
    std::stable_sort(kinds_.begin(), kinds_.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  }

  std::vector<ThingKind> kinds_;
  std::map<std::string, std::vector<std::size_t>> by_key_;
};

// ------------------------------------------------------------------------------------------------------------------ list

constexpr std::string_view list_begin = "// Made of:\n", list_line = "//   ", digest_line = "// Digest: ";

/// Text of a line of the list: printable ASCII.
std::string escaped(std::string_view text) {
  constexpr char digits[] = "0123456789ABCDEF";
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x20 && byte < 0x7F && c != '%' && c != '\\' && c != '|' && c != '?') out += c;
    else out += '%', out += digits[byte >> 4], out += digits[byte & 15];
  }
  return out;
}
std::string unescaped(std::string_view text) { return iri::decode(text).value_or(std::string(text)); }

std::string digest_of(std::string_view text) {
  std::uint64_t hash = 14695981039346656037U;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211U;
  constexpr char digits[] = "0123456789abcdef";
  std::string out;
  for (int shift = 60; shift >= 0; shift -= 4) out += digits[hash >> shift & 15];
  return out;
}

/// What a header is made of: kind of Thing, part, path of a field -> what it is.
using Parts = std::map<std::vector<std::string>, std::string>;

void add_value(Parts& parts, const std::string& kind, const std::string& part, const std::optional<Schema>& schema, const std::string& origin, bool bounds) {
  if (!schema) {
    parts[{kind, part, ""}] = "a value that no shape describes";
    return;
  }
  Flat::Lines lines;
  Flat(origin, bounds).add({}, schema->type(), schema->facets(), lines);
  for (auto& [path, text] : lines) parts[{kind, part, path}] = std::move(text);
}

Parts parts_of(const std::vector<ThingKind>& kinds, const std::vector<std::string>& names, const std::vector<ShapeDescription>& shapes) {
  Parts parts;
  for (const ShapeDescription& s : shapes) {
    const std::string origin = origin_of(s.iri);
    add_value(parts, Flat(origin, true).short_iri(s.iri), "shape", s.schema, origin, true);
  }
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    const ThingKind& kind = kinds[i];
    const std::string origin = origin_of(kind.things.front()->iri);
    const Flat flat(origin, true);
    std::string classes;
    for (const std::string& c : kind.classes) classes += (classes.empty() ? "" : " ") + flat.short_iri(c);
    parts[{names[i], "", ""}] = classes.empty() ? "no class" : classes;
    const auto predicates = [&](const std::vector<std::string>& all) {
      std::string text;
      for (const std::string& p : all) text += " " + flat.short_iri(p);
      return text;
    };
    for (const auto& [name, member] : kind.properties) {
      const PropertyDescription& p = *member.first;
      parts[{names[i], "property " + name, "by"}] = (p.writable ? "writable" : "read-only") + predicates(p.predicates);
      add_value(parts, names[i], "property " + name, p.schema, origin, member.equal_bounds);
    }
    for (const auto& [name, member] : kind.actions) {
      const ActionDescription& a = *member.first;
      parts[{names[i], "action " + name, "by"}] = (a.asynchronous ? "asynchronous" : "synchronous") + predicates(a.predicates);
      if (a.has_input) add_value(parts, names[i], "input of action " + name, a.input, origin, member.equal_bounds);
      if (a.output) add_value(parts, names[i], "output of action " + name, a.output, origin, member.equal_bounds);
    }
  }
  return parts;
}

std::string list_of(const Parts& parts) {
  std::string text;
  for (const auto& [key, what] : parts) text.append(list_line) += escaped(key[0]) + " | " + escaped(key[1]) + " | " + escaped(key[2]) + " | " + escaped(what) + "\n";
  return text;
}

/// The names of the classes of kinds, which are made first: types take other ones.
std::vector<std::string> kind_names(const std::vector<ThingKind>& kinds, cpp::Scope& scope, const GenerateOptions& options) {
  std::vector<std::string> names;
  for (const ThingKind& kind : kinds) names.push_back(scope.add(cpp::type_name(kind.name, options.max_name)));
  return names;
}

// ---------------------------------------------------------------------------------------------------------------- header

class Generator {
 public:
  Generator(const Description& robot, const GenerateOptions& options) : robot_(robot), options_(options), kinds_(robot) {
    for (const std::string& w : robot.warnings) warn(w);
  }

  Generated run() {
    names_ = kind_names(kinds_.all(), scope_, options_);
    for (std::size_t i = 0; i < kinds_.all().size(); ++i) kind(kinds_.all()[i], names_[i]);
    for (const ShapeDescription& s : robot_.shapes) shape(s);
    const std::string list = list_of(parts_of(kinds_.all(), names_, robot_.shapes));
    std::string out =
        "// Made by `lrt generate` of the Blueprints of a robot. Changes are lost when it is made again; `lrt generate --check` tells whether the\n"
        "// robot still has these Blueprints.\n"
        "#pragma once\n\n"
        "#include <array>\n#include <chrono>\n#include <cstdint>\n#include <map>\n#include <optional>\n#include <string>\n#include <utility>\n#include <vector>\n\n"
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
    out += "\n";
    out.append(list_begin) += list;
    out.append(digest_line) += digest_of(list) + "\n";
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
  [[noreturn]] void refuse_size() const { throw Refused{{Errc::limit_exceeded, "the header would have more than " + std::to_string(options_.max_bytes) + " bytes"}}; }
  void count(const std::string& text) {
    bytes_ += text.size();
    if (bytes_ > options_.max_bytes) refuse_size();
  }
  /// From the global scope, because lrt has namespaces of its own.
  std::string qualified(const std::string& name) const { return "::" + options_.name_space + "::" + name; }

  // ---- texts

  std::string unit_text(const Facets& f) const { return f.unit().empty() ? std::string() : "[" + cpp::comment_text(unit_label(f.unit()), options_.max_comment) + "]"; }
  /// After a text: ": [deg], at least 0".
  static std::string with_colon(const std::string& range) { return range.empty() ? range : ": " + range; }
  /// Unit and bounds for people: "[deg], at least 0, below 360".
  std::string range_text(const Type& outer, const Facets& f, bool bounds) const {
    const Type* t = &outer;
    std::vector<std::string> parts;
    if (!f.unit().empty()) parts.push_back(unit_text(f));
    for (; t->kind == Kind::optional || t->kind == Kind::list || t->kind == Kind::map; t = t->element) {
      if (t->kind == Kind::optional) parts.emplace_back("may be absent");
      if (t->kind == Kind::list && t->shortest != t->longest && t->shortest > 0) parts.push_back("at least " + std::to_string(t->shortest) + " members");
      if (t->kind == Kind::list && t->shortest != t->longest && t->longest != std::numeric_limits<std::size_t>::max())
        parts.push_back("at most " + std::to_string(t->longest) + " members");
    }
    if (t->is_number() && bounds && f.min()) parts.push_back((f.min_exclusive() ? "above " : "at least ") + rdf::lexical::format(*f.min()));
    if (t->is_number() && bounds && f.max()) parts.push_back((f.max_exclusive() ? "below " : "at most ") + rdf::lexical::format(*f.max()));
    if (t->kind == Kind::text && f.min_length() > 0) parts.push_back("at least " + std::to_string(f.min_length()) + " characters");
    if (t->kind == Kind::text && f.max_length() != std::numeric_limits<std::size_t>::max()) parts.push_back("at most " + std::to_string(f.max_length()) + " characters");
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
    static const Known known[] = {{unit::radian, "radian"},
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
    return "lrt::Unit{lrt::Iri{" + cpp::string_literal(u.qudt.text) + "}, lrt::Iri{" + cpp::string_literal(u.vom.text) + "}, " + cpp::string_literal(u.ucum) + ", {}}";
  }
  /// ".unit(lrt::unit::degree).at_least(0).below(360)"
  std::string facets_code(const Type& outer, const Facets& f, bool bounds) const {
    const Type* t = &outer;
    while (t->kind == Kind::optional || t->kind == Kind::list || t->kind == Kind::map) t = t->element;
    std::string text;
    if (!f.unit().empty() && f.unit().qudt.text.size() <= options_.max_text && f.unit().vom.text.size() <= options_.max_text) text += ".unit(" + unit_code_of(f.unit()) + ")";
    if (t->is_number() && bounds) {
      if (f.min() && std::isfinite(*f.min())) text += (f.min_exclusive() ? ".above(" : ".at_least(") + number_text(*f.min()) + ")";
      if (f.max() && std::isfinite(*f.max())) text += (f.max_exclusive() ? ".below(" : ".at_most(") + number_text(*f.max()) + ")";
    }
    if (t->kind == Kind::real && f.allows_non_finite()) text += ".allow_non_finite()";
    if (t->kind == Kind::text && (f.min_length() > 0 || f.max_length() != std::numeric_limits<std::size_t>::max()))
      text += ".length(" + std::to_string(f.min_length()) + ", " +
              (f.max_length() == std::numeric_limits<std::size_t>::max() ? std::string("static_cast<std::size_t>(-1)") : std::to_string(f.max_length())) + ")";
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
    made.traits = "template <>\nstruct lrt::rdf::traits<" + q + "> : lrt::rdf::Enumeration<" + q + "> {\n  static void describe(Enumeration<" + q + ">& e) {\n" + names + "  }\n};\n";
    by_form_[key] = Cpp{made.name, first, {}};
    count(made.definition), count(made.traits);
    Cpp result{made.name, " = " + made.name + "::" + first, {}};
    types_.push_back(std::move(made));
    return result;
  }
  std::string quoted(std::string_view text) const { return "\"" + cpp::comment_text(text, options_.max_comment) + "\""; }

  /// The term that lrt makes of a name in the robot's own vocabulary, "#Grip/width"; empty: it is no such term.
  std::string own_term(std::string_view iri) const {
    const std::string short_form = Flat(origin_, true).short_iri(iri);
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
    const std::string key = "record" + Flat(origin_, bounds).text(t, Facets(facets).without_bounds().unit(unit::none));
    if (const auto known = by_form_.find(key); known != by_form_.end()) return known->second;
    for (const auto* iris : {&t.classes, &t.value_classes})
      for (const std::string& c : *iris)
        if (c.size() > options_.max_text) return note(where + ": the IRI of a class is too long");
    Made made;
    made.name = scope_.add(cpp::type_name(t.classes.empty() ? hint : last_part(t.classes.front()), options_.max_name));
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
      const std::string at = "      t.fields[" + std::to_string(index) + "]";
      // What Record makes of it.
      const std::string name = term.substr(term.find_last_of("#/") + 1);
      const std::string placed = term.front() == '#' ? "#" + made.name + "/" + iri::encode_segment(name) : term;
      if (placed != term) changes += at + ".predicate = " + cpp::string_literal(term) + ";\n";
      if (name != f.name) changes += at + ".name = " + cpp::string_literal(f.name) + ";\n";
      if (!type->datatype.empty()) changes += at + ".type = &lrt::client::with_datatype(*t.fields[" + std::to_string(index) + "].type, lrt::Iri{" + cpp::string_literal(type->datatype) + "});\n";
      ++index;
    }
    std::string classes;
    std::vector<std::string> value_terms;
    for (const std::string& c : t.classes) classes += "    r.is(lrt::Iri{" + cpp::string_literal(term_or_iri(c)) + "});\n";
    for (const std::string& c : t.value_classes) value_terms.push_back(term_or_iri(c));
    if (t.classes.empty()) changes += "      t.classes.clear();\n";
    if (!t.value_predicate.empty()) {
      changes += "      t.value_predicate = " + cpp::string_literal(t.value_predicate) + ";\n";
      changes += "      t.value_classes = " + list_of_literals(value_terms) + ";\n";
    }
    made.definition = t.classes.empty() ? std::string() : "/// " + cpp::comment_text(Flat(origin_, true).short_iri(t.classes.front()), options_.max_comment) + "\n";
    made.definition += "struct " + made.name + " {\n" + members + "};\n";
    const bool uses = !classes.empty() || !fields.empty();
    made.traits = "template <>\nstruct lrt::rdf::traits<" + q + "> : lrt::rdf::Record<" + q + "> {\n  static void describe(" + (uses ? "Record<" + q + ">& r" : "Record<" + q + ">&") + ") {\n" +
                  classes + fields + "  }\n";
    if (!changes.empty())
      made.traits += "  static const Type& type() {\n    static const lrt::Immortal<Type> changed([] {\n      Type t = Record<" + q + ">::type();\n" + changes +
                     "      return t;\n    }());\n    return *changed;\n  }\n";
    made.traits += "};\n";
    count(made.definition), count(made.traits);
    const Cpp result{made.name, {}, {}};
    by_form_[key] = result;
    types_.push_back(std::move(made));
    return result;
  }

  /// A type of a shape that belongs to no Thing. What is no struct and no enum gets a name.
  void shape(const ShapeDescription& s) {
    origin_ = origin_of(s.iri);
    const Type& type = s.schema.type();
    const std::optional<Cpp> made = type_of(type, s.schema.facets(), s.name, true, s.name);
    if (!made || type.kind == Kind::record || type.kind == Kind::enumeration) return;
    if (!made->datatype.empty()) note(s.name + ": the C++ type does not have the datatype " + made->datatype);
    const std::string range = range_text(type, s.schema.facets(), true);
    const std::string out = "\n/// " + sentence(cpp::comment_text(s.name, options_.max_comment) + with_colon(range)) + "\nusing " +
                            scope_.add(cpp::type_name(s.name, options_.max_name)) + " = " + made->type + ";\n";
    count(out);
    classes_ += out;
  }

  // ---- kinds of Things

  std::string value_arguments(const Cpp& type, const Schema& schema) const {
    const std::string plain = "lrt::rdf::traits<" + type.type + ">::type()";
    const std::string described = type.datatype.empty() ? plain : "lrt::client::with_datatype(" + plain + ", lrt::Iri{" + cpp::string_literal(type.datatype) + "})";
    return described + ", " + (schema.facets().unit().empty() ? "lrt::unit::none" : unit_code_of(schema.facets().unit()));
  }
  /// The name by which a Thing's member is found: a predicate of a vocabulary, else its own name.
  std::string finder(const std::vector<std::string>& predicates, const std::string& name) const {
    for (const std::string& p : predicates)
      if (p.size() <= options_.max_text && Flat(origin_, true).short_iri(p).front() != '~') return cpp::string_literal(p) + ", " + cpp::string_literal(name);
    return "\"\", " + cpp::string_literal(name);
  }
  static std::string sentence(const std::string& text) { return text.empty() || text.back() == '.' ? text : text + "."; }

  void kind(const ThingKind& k, const std::string& name) {
    origin_ = origin_of(k.things.front()->iri);
    cpp::Scope scope{"thing", "of", "all"};
    std::string members, initial;
    const auto required = [&](std::size_t n) { return n == k.things.size() ? "true" : "false"; };
    const auto titled = [&](const auto& d, std::size_t n, const std::string& range = {}) {
      const std::string title = d.title.empty() ? d.name : d.title;
      return sentence(cpp::comment_text(title, options_.max_comment) + with_colon(range)) + (n == k.things.size() ? "" : " Not at each of these Things.");
    };
    for (const auto& [member_name, m] : k.properties) {
      const PropertyDescription& p = *m.first;
      if (p.name.size() > options_.max_text) {
        note(name + ": the name of a property is too long; it is left out");
        continue;
      }
      const std::string where = name + ", property " + p.name;
      const std::optional<Cpp> type = p.schema ? type_of(p.schema->type(), p.schema->facets(), p.name, m.equal_bounds, where) : std::nullopt;
      const std::string id = scope.add(cpp::member_name(p.name, options_.max_name));
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
      const ActionDescription& a = *m.first;
      if (a.name.size() > options_.max_text) {
        note(name + ": the name of an action is too long; it is left out");
        continue;
      }
      const std::string where = name + ", action " + a.name;
      const std::optional<Cpp> input = a.input ? type_of(a.input->type(), a.input->facets(), a.name + "_input", m.equal_bounds, where) : std::nullopt;
      std::optional<Cpp> output = a.output ? type_of(a.output->type(), a.output->facets(), a.name + "_output", m.equal_bounds, where) : std::nullopt;
      const std::string id = scope.add(cpp::member_name(a.name, options_.max_name));
      const std::string found = "members.action(" + finder(a.predicates, a.name) + ", " + required(m.count) + ")";
      if (a.has_input && !input) {
        note(where + ": no C++ type for its input; invoke action() with a graph");
        members += "  /// " + titled(a, m.count) + " The type of its input is not known: action() takes a graph.\n  lrt::client::UntypedAction " + id + ";\n";
        initial += ",\n        " + id + "(" + found + ")";
        continue;
      }
      const std::string range = input ? range_text(a.input->type(), a.input->facets(), m.equal_bounds) : std::string();
      const std::string out_range = output ? range_text(a.output->type(), a.output->facets(), m.equal_bounds) : std::string();
      members += "  /// " + titled(a, m.count) + (a.asynchronous ? " It takes time: wait for the invocation." : "") + (range.empty() ? "" : " Input: " + range + ".") +
                 (out_range.empty() ? "" : " Output: " + out_range + ".") + "\n";
      const std::string in_type = input ? input->type : "void", out_type = output ? output->type : "void";
      members += "  lrt::client::TypedAction<" + in_type + ", " + out_type + "> " + id + ";\n";
      const auto value = [&](const std::optional<Cpp>& type, const std::optional<Schema>& schema) {
        return type ? "{" + value_arguments(*type, *schema) + "}" : std::string("{}");
      };
      initial += ",\n        " + id + "(" + found + ", " + value(input, a.input) + ", " + value(output, a.output) + ")";
    }

    std::string names;
    for (std::size_t i = 0; i < k.things.size() && i < 8; ++i) {
      const ThingDescription& t = *k.things[i];
      names += (i == 0 ? "" : ", ") + cpp::comment_text(t.title.empty() ? last_part(t.iri) : t.title, 60);
    }
    if (k.things.size() > 8) names += " and " + std::to_string(k.things.size() - 8) + " more";
    std::vector<std::string> classes;
    for (const std::string& c : k.classes)
      if (c.size() <= options_.max_text && Flat(origin_, true).short_iri(c).front() != '~') classes.push_back(c);
    std::string out = "\n/// " + sentence(names) + "\nclass " + name + " {\n public:\n";
    out += "  /// Takes a Thing of this kind, which has the classes, properties and actions.\n  /// @par Errors  expected_value: it is of another kind\n";
    out += "  static lrt::Result<" + name + "> of(lrt::client::Thing thing) {\n    lrt::client::Members members(std::move(thing), " + cpp::string_literal(name) + ", " +
           list_of_literals(classes) + ");\n    " + name + " made(members);\n    if (lrt::Result<void> fits = members.fits(); !fits) return lrt::unexpected(std::move(fits).error());\n    return made;\n  }\n";
    out += "  /// All Things of this kind that a robot has.\n  static std::vector<" + name + "> all(const lrt::client::Robot& robot) { return lrt::client::all_of<" + name + ">(robot); }\n\n";
    out += "  lrt::client::Thing thing;\n" + members;
    out += "\n private:\n  explicit " + name + "(" + "lrt::client::Members& members)\n      : thing(members.thing())" + initial + " {}\n};\n";
    count(out);
    classes_ += out;
  }

  const Description& robot_;
  const GenerateOptions& options_;
  Kinds kinds_;
  std::vector<std::string> names_;
  cpp::Scope scope_;
  std::vector<Made> types_;
  std::unordered_map<std::string, Cpp> by_form_;
  std::string classes_, origin_;
  std::vector<std::string> notes_, warnings_;
  std::size_t bytes_ = 0;
};

/// The list of a header.
Result<Parts> read_list(std::string_view header) {
  const auto unreadable = [](const char* why) { return unexpected(Errc::expected_value, std::string("expected a header that was made by lrt generate: ") + why); };
  const std::size_t begin = header.rfind(list_begin);
  if (begin == std::string_view::npos || (begin > 0 && header[begin - 1] != '\n')) return unreadable("it has no list of what it was made of");
  std::string_view rest = header.substr(begin + list_begin.size());
  const std::size_t end = rest.find(digest_line);
  if (end == std::string_view::npos) return unreadable("it has no digest");
  const std::string_view list = rest.substr(0, end);
  if (rest.substr(end + digest_line.size(), 16) != digest_of(list)) return unreadable("the list at its end has been changed");
  Parts parts;
  for (std::string_view lines = list; !lines.empty();) {
    const std::size_t line_end = std::min(lines.find('\n'), lines.size());
    std::string_view line = lines.substr(0, line_end);
    lines.remove_prefix(std::min(line_end + 1, lines.size()));
    if (line.substr(0, list_line.size()) != list_line) return unreadable("the list at its end is damaged");
    line.remove_prefix(list_line.size());
    std::vector<std::string> cells;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t bar = line.find(" | ");
      if (bar == std::string_view::npos) return unreadable("the list at its end is damaged");
      cells.push_back(unescaped(line.substr(0, bar)));
      line.remove_prefix(bar + 3);
    }
    parts[std::move(cells)] = unescaped(line);
  }
  return parts;
}

std::string where_of(const std::vector<std::string>& key) {
  std::string text = key[0] + (key[1].empty() ? "" : ", " + key[1]);
  if (key[2] == "by") return text;
  if (key[2].empty()) return text;
  std::string fields;
  for (std::size_t at = 0; at <= key[2].size();) {
    const std::size_t space = std::min(key[2].find(' ', at), key[2].size());
    fields += (fields.empty() ? "" : "/") + last_part(key[2].substr(at, space - at));
    at = space + 1;
  }
  return text + ", field " + fields;
}

std::string message_text(const std::string& text) { return cpp::comment_text(text, 400); }

}  // namespace

Result<Generated> generate(const Description& robot, const GenerateOptions& options) {
  if (!cpp::is_namespace(options.name_space))
    return unexpected(Errc::invalid_option, "expected a namespace of identifiers, \"acme::robot\", without lrt and std, found \"" + message_text(options.name_space) + "\"");
  try {
    return Generator(robot, options).run();
  } catch (const Refused& refused) {
    return unexpected(refused.error);
  }
}

Result<std::vector<std::string>> check(std::string_view header, const Description& robot, const GenerateOptions& options) {
  const Result<Parts> made_of = read_list(header);
  if (!made_of) return Unexpected{made_of.error()};
  cpp::Scope scope;
  const Kinds kinds(robot);
  const Parts now = parts_of(kinds.all(), kind_names(kinds.all(), scope, options), robot.shapes);
  std::vector<std::string> differences;
  std::set<std::pair<std::string, std::string>> reported;  // kinds and parts that are missing or new as a whole
  const auto missing = [&](const Parts& from, const Parts& in, const char* who, const char* verb) {
    for (const auto& [key, what] : from) {
      if (in.count(key) > 0) continue;
      const auto has = [&](auto equal) { return std::any_of(in.begin(), in.end(), [&](const auto& other) { return equal(other.first); }); };
      const bool has_kind = has([&](const auto& k) { return k[0] == key[0]; });
      const bool has_part = has([&](const auto& k) { return k[0] == key[0] && k[1] == key[1]; });
      const std::string part = has_kind ? key[1] : std::string();
      if ((!has_kind || !has_part) && !reported.insert({key[0], part + verb}).second) continue;
      const std::vector<std::string> place = !has_kind ? std::vector<std::string>{key[0], "", ""} : !has_part ? std::vector<std::string>{key[0], key[1], ""} : key;
      differences.push_back(message_text(where_of(place)) + ": " + who + (has_part ? ": " + message_text(what) : std::string()));
    }
  };
  for (const auto& [key, what] : *made_of)
    if (const auto other = now.find(key); other != now.end() && other->second != what)
      differences.push_back(message_text(where_of(key)) + ": the header has " + message_text(what) + ", the robot has " + message_text(other->second));
  missing(*made_of, now, "the robot does not have it any more", "-");
  missing(now, *made_of, "the header does not have it yet", "+");
  std::sort(differences.begin(), differences.end());
  return differences;
}

}  // namespace lrt::client
