// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/traits.hpp>

#include <algorithm>

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

}  // namespace

std::string term_name(std::string_view name) {
  std::string out;
  for (const char c : name) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
    if (plain) out += c;
    else if (!out.empty() && out.back() != '-') out += '-';
  }
  if (!out.empty() && out.back() == '-') out.pop_back();
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
Describing::~Describing() { innermost = outer_; }
const Type* Describing::type_within(Key key) noexcept {
  for (const Describing* one = innermost; one; one = one->outer_)
    if (one->key_ == key) return &within_itself();
  return nullptr;
}
bool is_within_itself(const Type& type) noexcept {
  const Type* inner = &type;
  while (inner->element) inner = inner->element;
  return inner == &within_itself();
}

std::string_view short_type_name(std::string_view text) noexcept {
#ifdef _MSC_VER
  text = text.substr(text.find("function_of<") + 12);
  text = text.substr(0, text.rfind(">(void)"));
#else
  text = text.substr(text.find("T = ") + 4);
  text = text.substr(0, text.find_first_of(";]"));
#endif
  const std::size_t arguments = text.find('<');
  const std::size_t colons = text.substr(0, arguments).rfind("::");
  if (colons != std::string_view::npos) text = text.substr(colons + 2);
  for (const std::string_view word : {std::string_view("struct "), std::string_view("class ")})
    if (text.substr(0, word.size()) == word) text = text.substr(word.size());
  return text;
}

FieldAccess::~FieldAccess() = default;

void set_absent(FieldDraft& draft, Value value, bool fits) {
  draft.absent = std::make_shared<const Value>(std::move(value));
  draft.loses_absent = !fits;
}

RecordFields::RecordFields(std::string_view type_name) {
  type_.kind = Type::Kind::record;
  type_.name = term_name(type_name);
}
RecordFields::~RecordFields() = default;

void RecordFields::add_class(std::string_view iri) { type_.classes.emplace_back(iri); }
void RecordFields::set_name(std::string_view name) { type_.name = term_name(name); }

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

void EnumeratorNames::add(std::uint64_t value, std::string&& name) {
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
  constexpr std::string_view before = "lrt_values = ";
  const std::size_t begin = function.rfind(before);
  if (begin == std::string_view::npos || !type_.fault.empty()) return;
  // "{Mode::slow, (Mode)1}" by GCC, "<Mode::slow, (Mode)1>" by Clang. A type may have commas within <>.
  std::string_view rest = function.substr(begin + before.size() + 1);
  const auto knows = [](const std::vector<std::uint64_t>& values, std::uint64_t value) {
    return std::find(values.begin(), values.end(), value) != values.end();
  };
  int depth = 0;
  std::size_t start = 0;
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < rest.size() && depth >= 0; ++i) {
    const char c = rest[i];
    if (c == '<' || c == '(' || c == '{') ++depth;
    if (c == '>' || c == ')' || c == '}') --depth;
    if ((c != ',' || depth != 0) && depth >= 0) continue;
    std::string_view text = rest.substr(start, i - start);
    start = i + 1;
    text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
    const std::size_t bracket = text.rfind(')');  // a number if digits follow; in a namespace without a name "::" does
    const char next = bracket == std::string_view::npos ? ':' : bracket + 1 < text.size() ? text[bracket + 1] : '0';
    if (next == ':' && !knows(values_, value) && !knows(nameless_, value)) {
      type_.fault = "the enumerator " + std::string(text) + " has no name; give it one by name(), or state by without_name() that it is no value";
      return;
    }
    ++value;
  }
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
