// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/traits.hpp>

#include <algorithm>
#include <optional>

#include <lrt/base/immortal.hpp>
#include <lrt/base/iri.hpp>
#include <lrt/rdf/value_codec.hpp>

#include "src/base/utf8.hpp"
#include "src/rdf/record_terms.hpp"
#include "src/rdf/value_faults.hpp"

namespace lrt::rdf {
inline namespace v0 {

FieldName::FieldName(Iri term) : name(term.text.substr(term.text.find_last_of("#/") + 1)), predicate(term.text) {}
FieldName::FieldName(std::string_view own) : name(own), predicate("#" + name) {}
FieldName::FieldName(const std::string& own) : FieldName(std::string_view(own)) {}
FieldName::FieldName(const char* own) : FieldName(std::string_view(own)) {}
FieldName::FieldName(const FieldName& other) = default;
FieldName::FieldName(FieldName&& other) noexcept = default;
FieldName& FieldName::operator=(const FieldName& other) = default;
FieldName& FieldName::operator=(FieldName&& other) noexcept = default;
FieldName::~FieldName() = default;

namespace detail {
namespace {

const void* at(const void* record, std::ptrdiff_t offset) noexcept { return static_cast<const char*>(record) + offset; }
void* at(void* record, std::ptrdiff_t offset) noexcept { return static_cast<char*>(record) + offset; }

/// The type T of "... [with T = X]" (GCC) or "... [T = X]" (Clang).
std::string_view type_in(std::string_view function) noexcept {
#ifdef _MSC_VER
  function = function.substr(function.find("function_of<") + 12);
  function = function.substr(0, function.rfind(">(void)"));
#else
  function = function.substr(function.find("T = ") + 4);
  function = function.substr(0, function.rfind(']'));
#endif
  for (const std::string_view word : {std::string_view("struct "), std::string_view("class ")})
    if (function.substr(0, word.size()) == word) function = function.substr(word.size());
  return function;
}

bool is_bracket(char c, std::string_view those) noexcept { return those.find(c) != std::string_view::npos; }

/// The parts of a qualified name, which "::" separates outside of brackets.
std::vector<std::string_view> parts_of(std::string_view name) {
  std::vector<std::string_view> parts;
  int depth = 0;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (is_bracket(name[i], "<({[")) ++depth;
    if (is_bracket(name[i], ">)}]")) --depth;
    if (depth != 0 || name[i] != ':' || i + 1 == name.size() || name[i + 1] != ':') continue;
    parts.push_back(name.substr(begin, i - begin));
    begin = ++i + 1;
  }
  parts.push_back(name.substr(begin));
  return parts;
}

/// Whether the part before the last ones of a type's name is a class. Compilers write namespaces and classes alike: a name with arguments is that of
/// a class, and one that begins with a capital letter is taken for one. Not a function, or a namespace without a name: "f()", "{anonymous}".
bool looks_like_class(std::string_view part) noexcept {
  return !part.empty() && ((part.front() >= 'A' && part.front() <= 'Z') || part.back() == '>') && !is_bracket(part.back(), ")}");
}

std::string name_of_class(std::string_view type, std::optional<std::size_t> namespaces);

/// The arguments of a template, each without its namespaces: "<my::A, 3>" is "-A-3".
std::string name_of_arguments(std::string_view text) {
  std::string out;
  std::size_t begin = 0;
  int depth = 0;
  for (std::size_t i = 0; i <= text.size(); ++i) {
    if (i < text.size() && is_bracket(text[i], "<({[")) ++depth;
    if (i < text.size() && is_bracket(text[i], ">)}]")) --depth;
    if (i < text.size() && (text[i] != ',' || depth != 0)) continue;
    std::string_view argument = text.substr(begin, i - begin);
    begin = i + 1;
    argument.remove_prefix(std::min(argument.find_first_not_of(' '), argument.size()));
    out.append("-").append(name_of_class(argument, std::nullopt));
  }
  return out;
}

/// The name of a class with its enclosing classes and without namespaces: "Arm.Gains", "LimitsOf-Arm.Gains".
/// @param namespaces  how many of its parts are known to be namespaces, and the others classes
std::string name_of_class(std::string_view type, std::optional<std::size_t> namespaces) {
  const std::vector<std::string_view> parts = parts_of(type);
  std::size_t first = parts.size() - 1;
  while (first > 0 && (namespaces ? first > *namespaces && !is_bracket(parts[first - 1].back(), ")}") : looks_like_class(parts[first - 1]))) --first;
  std::string out;
  for (std::size_t i = first; i < parts.size(); ++i) {
    const std::size_t open = parts[i].find('<'), close = parts[i].rfind('>');
    if (i > first) out += '.';
    out.append(parts[i].substr(0, open));
    if (open != std::string_view::npos && close != std::string_view::npos && close > open)
      out += name_of_arguments(parts[i].substr(open + 1, close - open - 1));
  }
  return out;
}

/// How many namespaces a function lrt_fields() is in, if the type is in the same ones: "void my::arm::lrt_fields(...)".
std::optional<std::size_t> namespaces_of(std::string_view function, std::string_view type, bool is_friend) {
  const std::size_t end = function.find("lrt_fields(");
  if (end == std::string_view::npos) return std::nullopt;
  std::size_t begin = 0;
  int depth = 0;
  for (std::size_t i = 0; i < end; ++i) {  // the last space before it outside of "(anonymous namespace)"
    if (is_bracket(function[i], "<({[")) ++depth;
    if (is_bracket(function[i], ">)}]")) --depth;
    if (function[i] == ' ' && depth == 0) begin = i + 1;
  }
  const std::string_view scope = function.substr(begin, end - begin);  // "my::arm::", or empty
  if (scope.empty()) return is_friend ? std::optional<std::size_t>(0) : std::nullopt;
  if (type.substr(0, scope.size()) != scope) return std::nullopt;
  return parts_of(scope).size() - 1;
}

}  // namespace

std::string term_name(std::string_view name) {
  std::string out;
  for (const char c : name) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
    const bool after_plain = !out.empty() && out.back() != '-' && out.back() != '.';
    if (plain) out += c;
    else if (c == '.' && !out.empty() && out.back() == '-') out.back() = '.';
    else if (after_plain) out += c == '.' ? '.' : '-';
  }
  while (!out.empty() && (out.back() == '-' || out.back() == '.')) out.pop_back();
  return out;
}

void place_terms(Type& record) {
  bool own = record.classes.empty();
  for (FieldType& field : record.fields) {
    if (field.predicate.empty() || field.predicate.front() != '#') continue;
    own = true;
    field.predicate = "#" + record.name + "/" + iri::encode_segment(field.name);
  }
  if (record.classes.empty()) record.classes.push_back("#" + record.name);
  if (!own) record.name.clear();
}

namespace {

/// What is wrong with the default of a field, as a sentence; empty: nothing.
std::string fault_of_default(const FieldType& field, bool loses) {
  if (loses) return "value_if_absent(): the C++ type of the field cannot hold this value";
  if (field.read_only) return "value_if_absent(): clients cannot send a read-only field";
  if (field.type->kind == Type::Kind::optional)
    return "value_if_absent(): a std::optional field that is left out is absent; give it the type without std::optional";
  if (!fault_of_value(*field.type, *field.absent).empty()) return "value_if_absent(): the enumerator has no name";
  if (!within(*field.type, field.facets, *field.absent)) return "value_if_absent(): this value is outside of the bounds of the field";
  return {};
}

/// The innermost record that this thread describes.
thread_local const Describing* innermost = nullptr;

const Type& within_itself() {
  static const Immortal<Type> type([] {
    Type t;
    t.fault = "its record contains itself, so its values have no bounded depth; refer to the other record by a name or an index";
    return t;
  }());
  return *type;
}

}  // namespace

Describing::Describing(Key key) noexcept : key_(key), outer_(innermost) { innermost = this; }
void Describing::end() noexcept {
  if (innermost == this) innermost = outer_;
}
const Type* Describing::type_within(Key key) noexcept {
  for (const Describing* one = innermost; one; one = one->outer_)
    if (one->key_ == key) return &within_itself();
  return nullptr;
}
bool is_within_itself(const Type& type) noexcept {
  const Type* inner = &type;
  for (int depth = 0; inner->element && depth < 64; ++depth) inner = inner->element;  // a type of the user may refer to itself
  if (inner == &within_itself()) return true;
  if (!inner->name.empty()) return false;  // a pair or a tuple has none
  return std::any_of(inner->fields.begin(), inner->fields.end(), [](const FieldType& field) { return is_within_itself(*field.type); });
}

std::string_view short_type_name(std::string_view text) noexcept {
  text = type_in(text);
  const std::size_t arguments = text.find('<');
  const std::size_t colons = text.substr(0, arguments).rfind("::");
  return colons != std::string_view::npos ? text.substr(colons + 2) : text;
}

FieldAccess::~FieldAccess() = default;

void set_absent(FieldDraft& draft, Value value, bool fits) {
  draft.absent = std::make_shared<const Value>(std::move(value));
  draft.loses_absent = !fits;
}

RecordFields::RecordFields(const char* function, Self self) : describing_(reinterpret_cast<Describing::Key>(self)), function_(function) {
  type_.kind = Type::Kind::record;
  type_.name = term_name(name_of_class(type_in(function), std::nullopt));
}
RecordFields::~RecordFields() = default;

const Type& RecordFields::type_of(Self self) {
  if (const Type* fault = Describing::type_within(reinterpret_cast<Describing::Key>(self))) return *fault;
  return self().type_;
}

void RecordFields::add_class(std::string_view iri) { type_.classes.emplace_back(iri); }
void RecordFields::set_name(std::string_view name) { type_.name = term_name(name); }
void RecordFields::set_place(std::string_view function, bool is_friend) {
  const std::string_view type = type_in(function_);
  if (const auto namespaces = namespaces_of(function, type, is_friend)) type_.name = term_name(name_of_class(type, namespaces));
}
FieldDraft& RecordFields::draft(std::string_view name) {
  for (std::size_t i = 0; i < drafts_.size(); ++i)
    if (type_.fields[i].name == name) return *drafts_[i];
  if (type_.fault.empty()) type_.fault = "facets(\"" + std::string(name) + "\") names no field that has been added";
  return no_field_;
}
FieldDraft& RecordFields::draft(const MemberOperations& operations, std::ptrdiff_t offset) {
  for (std::size_t i = 0; i < drafts_.size(); ++i)
    if (members_[i].operations == &operations && members_[i].offset == offset) return *drafts_[i];
  if (type_.fault.empty()) type_.fault = "facets() of a data member that is no field";
  return no_field_;
}

FieldDraft& RecordFields::add(FieldName&& name, const MemberOperations& operations, std::ptrdiff_t offset, bool read_only) {
  const Type& type = operations.type();
  return add(std::move(name), type, is_within_itself(type) || operations.runs_user_code(), read_only, Member{&operations, offset, nullptr});
}
FieldDraft& RecordFields::add(FieldName&& name, const Type& type, bool runs_user_code, bool read_only, std::unique_ptr<FieldAccess> access) {
  return add(std::move(name), type, runs_user_code, read_only, Member{nullptr, 0, std::move(access)});
}
FieldDraft& RecordFields::add(FieldName&& name, const Type& type, bool runs_user_code, bool read_only, Member member) {
  members_.push_back(std::move(member));
  type_.fields.push_back({std::move(name.name), std::move(name.predicate), &type, {}, read_only});
  runs_user_code_ = runs_user_code_ || runs_user_code;
  drafts_.push_back(std::make_unique<FieldDraft>());
  return *drafts_.back();
}
void RecordFields::finish() {
  describing_.end();
  for (std::size_t i = 0; i < drafts_.size(); ++i) {
    FieldType& field = type_.fields[i];
    field.facets = drafts_[i]->facets;
    field.absent = drafts_[i]->absent;
    const std::string fault = field.absent ? fault_of_default(field, drafts_[i]->loses_absent) : std::string();
    if (!fault.empty() && type_.fault.empty()) type_.fault = "field \"" + field.name + "\": " + fault;
  }
  place_terms(type_);
}

Value RecordFields::encode(const void* record) const {
  Value::Sequence out;
  out.reserve(members_.size());
  for (const Member& m : members_) out.push_back(m.access ? m.access->encode(record) : m.operations->encode(at(record, m.offset)));
  return Value(std::move(out));
}
Result<void> RecordFields::decode(const Value& value, void* record) const {
  const Value::Sequence* s = value.sequence();
  if (!s || s->size() != members_.size()) return not_a_value_of("a record");
  for (std::size_t i = 0; i < members_.size(); ++i) {
    const Member& m = members_[i];
    if (!m.access && type_.fields[i].read_only) return read_only();
    Result<void> r = m.access ? m.access->decode((*s)[i], record) : m.operations->decode((*s)[i], at(record, m.offset));
    if (!r) return r;
  }
  return {};
}
bool RecordFields::same(const void* a, const void* b) const noexcept {
  for (const Member& m : members_)
    if (!(m.access ? m.access->same(a, b) : m.operations->same(at(a, m.offset), at(b, m.offset)))) return false;
  return true;
}

EnumeratorNames::EnumeratorNames() {
  type_.kind = Type::Kind::enumeration;
  type_.datatype = vocab::xsd::string;
}
EnumeratorNames::~EnumeratorNames() = default;

namespace {
/// Visits the values of a name_of_values(), with the name of each or an empty text.
template <class Visit>
void each_value(std::string_view function, Visit visit) {
  constexpr std::string_view before = "lrt_values = ";
  const std::size_t begin = function.rfind(before);
  if (begin == std::string_view::npos) return;
  // "{Mode::slow, (Mode)1}" by GCC, "<Mode::slow, (Mode)1>" by Clang. A type may have commas within <>.
  const std::string_view rest = function.substr(begin + before.size() + 1);
  int depth = 0;
  std::size_t start = 0, index = 0;
  for (std::size_t i = 0; i < rest.size() && depth >= 0; ++i) {
    const char c = rest[i];
    if (is_bracket(c, "<({")) ++depth;
    if (is_bracket(c, ">)}")) --depth;
    if ((c != ',' || depth != 0) && depth >= 0) continue;
    std::string_view text = rest.substr(start, i - start);
    start = i + 1;
    text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
    const std::size_t bracket = text.rfind(')');  // a number if digits follow; in a namespace without a name "::" does
    const char next = bracket == std::string_view::npos ? ':' : bracket + 1 < text.size() ? text[bracket + 1] : '0';
    visit(index++, next == ':' ? text : std::string_view());
  }
}
}  // namespace

void EnumeratorNames::add_nameless(std::uint64_t value) {
  nameless_.push_back(value);
  const auto found = std::find(values_.begin(), values_.begin() + static_cast<std::ptrdiff_t>(named_by_compiler_), value);
  if (found == values_.begin() + static_cast<std::ptrdiff_t>(named_by_compiler_)) return;
  type_.names.erase(type_.names.begin() + (found - values_.begin()));
  values_.erase(found);
  --named_by_compiler_;
}
void EnumeratorNames::add_all(std::string_view function, std::uint64_t first, bool powers) {
  each_value(function, [&](std::size_t index, std::string_view text) {
    const std::uint64_t value = powers ? first << index : first + index;
    if (text.empty() || std::find(values_.begin(), values_.end(), value) != values_.end() ||
        std::find(nameless_.begin(), nameless_.end(), value) != nameless_.end())
      return;
    const std::size_t colons = text.rfind("::");
    type_.names.emplace_back(colons == std::string_view::npos ? text : text.substr(colons + 2));
    values_.push_back(value);
  });
  named_by_compiler_ = values_.size();
}
void EnumeratorNames::add(std::uint64_t value, std::string&& name) {
  for (std::size_t i = 0; i < named_by_compiler_; ++i)
    if (values_[i] == value) {  // another name instead of that by the compiler
      values_.erase(values_.begin() + static_cast<std::ptrdiff_t>(i));
      type_.names.erase(type_.names.begin() + static_cast<std::ptrdiff_t>(i));
      --named_by_compiler_;
      break;
    }
  const auto wrong = [&](std::string what) {
    if (type_.fault.empty()) type_.fault = std::move(what);
  };
  if (name.empty()) wrong("an enumerator has an empty name");
  if (utf8::find_invalid(name) || name.find('\0') != std::string::npos) wrong("expected UTF-8 without NUL as name of an enumerator");
  for (std::size_t i = 0; i < values_.size(); ++i) {
    if (type_.names[i] == name) wrong("two enumerators have the name \"" + name + '"');
    if (values_[i] == value) wrong("one enumerator has the names \"" + type_.names[i] + "\" and \"" + name + '"');
  }
  type_.names.push_back(std::move(name));
  values_.push_back(value);
}
void EnumeratorNames::find_nameless(std::string_view function) {
  if (type_.names.empty() && type_.fault.empty()) type_.fault = "no enumerator has a name";
  if (!type_.fault.empty()) return;
  const auto knows = [](const std::vector<std::uint64_t>& values, std::uint64_t value) {
    return std::find(values.begin(), values.end(), value) != values.end();
  };
  each_value(function, [&](std::uint64_t value, std::string_view text) {
    if (!text.empty() && type_.fault.empty() && !knows(values_, value) && !knows(nameless_, value))
      type_.fault = "the enumerator " + std::string(text) + " has no name; give it one by name(), or state by without_name() that it is no value";
  });
}

Words& EnumeratorNames::newest_words() {
  type_.name_words.resize(std::max<std::size_t>(type_.names.size(), 1));
  return type_.name_words.back();
}
void EnumeratorNames::add_title(std::string&& text, std::string&& language) { newest_words().titles.add(std::move(text), std::move(language)); }
void EnumeratorNames::add_description(std::string&& text, std::string&& language) {
  newest_words().descriptions.add(std::move(text), std::move(language));
}
Value EnumeratorNames::encode(std::uint64_t value) const {
  for (std::size_t i = 0; i < values_.size(); ++i)
    if (values_[i] == value) return Value(type_.names[i]);
  return Value(std::string());  // no name
}
const std::uint64_t* EnumeratorNames::find(const Value& name) const noexcept {
  if (const std::string* s = name.text())
    for (std::size_t i = 0; i < values_.size(); ++i)
      if (type_.names[i] == *s) return &values_[i];
  return nullptr;
}

}  // namespace detail
}  // namespace v0
}  // namespace lrt::rdf
