// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/variant.hpp>

#include <algorithm>
#include <string>

#include <lrt/base/immortal.hpp>

#include "src/base/ascii.hpp"
#include "src/rdf/record_terms.hpp"

namespace lrt::rdf {
inline namespace v0 {
namespace detail {
namespace {

using Kind = Type::Kind;

bool is_capital(char c) noexcept { return c >= 'A' && c <= 'Z'; }
bool is_part_of_name(char c) noexcept { return lrt::detail::is_alpha(c) || lrt::detail::is_digit(c) || c == '_'; }

/// The name of a class or an enum without what encloses it and without arguments; small capitals up to the second word: "pidGains".
std::string small_name(std::string_view type_name) {
  type_name = type_name.substr(0, type_name.find('<'));
  std::size_t begin = type_name.size();
  while (begin > 0 && is_part_of_name(type_name[begin - 1])) --begin;
  std::string name(type_name.substr(begin));
  for (std::size_t i = 0; i < name.size() && is_capital(name[i]); ++i) {
    const bool begins_word = i > 0 && i + 1 < name.size() && name[i + 1] >= 'a' && name[i + 1] <= 'z';
    if (begins_word) break;
    name[i] = static_cast<char>(name[i] - 'A' + 'a');
  }
  return name;
}

/// What an alternative without a given name is called; empty: nothing plain.
std::string plain_name(const Type& type, std::string_view type_name) {
  if (&type == &nothing_type()) return "none";
  switch (type.kind) {
    case Kind::boolean: return "boolean";
    case Kind::integer: return "integer";
    case Kind::real: return "number";
    case Kind::text: return "text";
    case Kind::duration: return "duration";
    case Kind::instant: return "instant";
    case Kind::list: return "list";
    case Kind::map: return "map";
    case Kind::enumeration:
    case Kind::record: return small_name(type_name);
    case Kind::variant: return type_name.substr(0, 8) == "variant<" ? std::string() : small_name(type_name);
    case Kind::optional: break;
  }
  return {};
}

/// "MoveJ-or-MoveL".
std::string joined_name(const std::vector<FieldType>& alternatives) {
  std::string name;
  for (const FieldType& a : alternatives) {
    if (!name.empty()) name += "-or-";
    const std::size_t begin = name.size();
    name += term_name(a.name);
    if (begin < name.size() && name[begin] >= 'a' && name[begin] <= 'z') name[begin] = static_cast<char>(name[begin] - 'a' + 'A');
  }
  return name;
}

std::string fault_of(const std::vector<FieldType>& alternatives) {
  const std::string remedy =
      "; give it a name: template <> struct lrt::rdf::traits<V> : lrt::rdf::Variant<V> { static void describe(Variant<V>& v) { "
      "v.alternative<";
  for (std::size_t i = 0; i < alternatives.size(); ++i) {
    const auto give = [&] { return remedy + std::to_string(i) + ">(\"name\"); } };"; };
    if (alternatives[i].name.empty()) return "the alternative " + std::to_string(i) + " of a variant has no name" + give();
    for (std::size_t j = 0; j < i; ++j) {
      const std::string both = "the alternatives " + std::to_string(j) + " and " + std::to_string(i) + " of a variant have the same ";
      if (alternatives[j].name == alternatives[i].name) return both + "name \"" + alternatives[i].name + '"' + give();
      if (alternatives[j].predicate == alternatives[i].predicate) return both + "predicate " + alternatives[i].predicate;
    }
  }
  return {};
}

}  // namespace

const Type& nothing_type() noexcept {
  static const Immortal<Type> t([] {
    Type type;
    type.kind = Kind::record;
    return type;
  }());
  return *t;
}

Alternatives::Alternatives(const AlternativeOperations* operations, std::size_t count, std::string_view type_name) : operations_(operations) {
  type_.kind = Kind::variant;
  type_.name = term_name(type_name);
  type_.fields.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    type_.fields[i].type = &operations_[i].value->type();
    runs_user_code_ = runs_user_code_ || is_within_itself(*type_.fields[i].type) || operations_[i].value->runs_user_code();
  }
}
Alternatives::~Alternatives() = default;

void Alternatives::add_class(std::string_view iri) { type_.classes.emplace_back(iri); }
void Alternatives::set_name(std::string_view name) { type_.name = term_name(name); }

Facets& Alternatives::name(std::size_t index, FieldName&& name) {
  FieldType& field = type_.fields[index];
  if (!field.predicate.empty() && type_.fault.empty())
    type_.fault = "one alternative of a variant has the names \"" + field.name + "\" and \"" + name.name + '"';
  field.name = std::move(name.name);
  field.predicate = std::move(name.predicate);
  return field.facets;
}

void Alternatives::finish() {
  for (std::size_t i = 0; i < type_.fields.size(); ++i) {
    FieldType& field = type_.fields[i];
    if (!field.predicate.empty()) continue;
    field.name = plain_name(*field.type, operations_[i].type_name());
    field.predicate = "#" + field.name;
  }
  if (type_.fault.empty()) type_.fault = fault_of(type_.fields);
  if (type_.name.empty()) type_.name = joined_name(type_.fields);
  place_terms(type_);
}

Value Alternatives::encode(const void* variant) const {
  Value::Sequence out(type_.fields.size());
  for (std::size_t i = 0; i < out.size(); ++i)
    if (const void* value = operations_[i].find(variant)) {
      out[i] = operations_[i].value->encode(value);
      break;
    }
  return Value(std::move(out));
}

Result<void> Alternatives::decode(const Value& value, void* made) const {
  const Value::Sequence* s = value.sequence();
  if (!s || s->size() != type_.fields.size()) return not_a_value_of("a variant");
  const auto is_present = [](const Value& v) { return !v.is_null(); };
  if (std::count_if(s->begin(), s->end(), is_present) != 1) return not_a_value_of("exactly one alternative");
  const auto active = static_cast<std::size_t>(std::find_if(s->begin(), s->end(), is_present) - s->begin());
  return operations_[active].decode((*s)[active], made);
}

bool Alternatives::same(const void* a, const void* b) const noexcept {
  for (std::size_t i = 0; i < type_.fields.size(); ++i) {
    const void *first = operations_[i].find(a), *second = operations_[i].find(b);
    if (first && second) return operations_[i].value->same(first, second);
    if (first || second) return false;
  }
  return true;  // both are valueless
}

}  // namespace detail
}  // namespace v0
}  // namespace lrt::rdf
