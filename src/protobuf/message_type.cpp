// SPDX-License-Identifier: Apache-2.0
#include <lrt/protobuf.hpp>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/message.h>
#include <google/protobuf/util/json_util.h>

#include "src/base/base64.hpp"

namespace lrt::protobuf {
inline namespace v0 {
namespace {

namespace pb = google::protobuf;
using rdf::DynamicType;
using rdf::Value;

/// The message of a failure, with the place, which is written from the inside outwards.
struct Fault {
  std::string what, place;

  bool at(const std::string& name) {
    place = place.empty() ? name : name + "/" + place;
    return false;
  }
  bool is(std::string sentence) {
    what = std::move(sentence);
    return false;
  }
  Unexpected error(Errc code) const { return unexpected(code, place.empty() ? what : "\"" + place + "\": " + what); }
};

enum class Form : std::uint8_t { scalar, record, instant, duration, wrapper, json };

Form form_of(const pb::Descriptor& message) {
  switch (message.well_known_type()) {
    case pb::Descriptor::WELLKNOWNTYPE_TIMESTAMP: return Form::instant;
    case pb::Descriptor::WELLKNOWNTYPE_DURATION: return Form::duration;
    case pb::Descriptor::WELLKNOWNTYPE_ANY:
    case pb::Descriptor::WELLKNOWNTYPE_STRUCT:
    case pb::Descriptor::WELLKNOWNTYPE_VALUE:
    case pb::Descriptor::WELLKNOWNTYPE_LISTVALUE: return Form::json;
    case pb::Descriptor::WELLKNOWNTYPE_UNSPECIFIED:
    case pb::Descriptor::WELLKNOWNTYPE_FIELDMASK: return Form::record;
    default: return Form::wrapper;  // DoubleValue and others: one field, "value"
  }
}

}  // namespace

/// How a message, or one value of a field, is read and written.
struct MessageType::Plan {
  /// A field of the message, or a oneof.
  struct Member {
    std::string name;
    const pb::FieldDescriptor* field = nullptr;  // null: a oneof
    std::shared_ptr<const Plan> value{};         // of one value of the field
    bool may_be_absent = false;
    std::vector<Member> alternatives{};  // of a oneof
  };

  Form form = Form::scalar;
  std::vector<Member> members{};  // of a record
};

namespace {

using Plan = MessageType::Plan;

struct Element {
  DynamicType type;
  std::shared_ptr<const Plan> plan;
};

/// Makes types of descriptors.
class Builder {
 public:
  explicit Builder(const Options& options) : options_(options) {}

  Result<Element> message(const pb::Descriptor& descriptor, bool as_json) {
    auto plan = std::make_shared<Plan>();
    plan->form = as_json ? Form::json : form_of(descriptor);
    switch (plan->form) {
      case Form::instant: return Element{DynamicType::of<std::chrono::system_clock::time_point>(), std::move(plan)};
      case Form::duration: return Element{DynamicType::of<std::chrono::nanoseconds>(), std::move(plan)};
      case Form::json: return Element{DynamicType::of<std::string>(), std::move(plan)};
      case Form::wrapper: {
        const pb::FieldDescriptor* const value = descriptor.FindFieldByName("value");
        Result<Element> inner = element(*value, false);
        if (!inner) return inner;
        plan->members.push_back({"value", value, inner->plan});
        return Element{inner->type, std::move(plan)};
      }
      default: return record(descriptor, std::move(plan));
    }
  }

 private:
  Result<Element> record(const pb::Descriptor& descriptor, std::shared_ptr<Plan> plan) {
    if (const auto known = known_.find(&descriptor); known != known_.end()) return known->second;
    if (const auto self = std::find(open_.begin(), open_.end(), &descriptor); self != open_.end()) {
      return unexpected(Errc::invalid_option, "message \"" + descriptor.full_name() + "\" contains itself, by \"" + field_ +
                                                  "\": a value has an end; let Options::field say Field::left_out or Field::as_json of that field");
    }
    open_.push_back(&descriptor);
    std::vector<rdf::DynamicField> fields;
    for (int i = 0; i < descriptor.field_count(); ++i) {
      const pb::FieldDescriptor& field = *descriptor.field(i);
      const pb::OneofDescriptor* const oneof = field.real_containing_oneof();
      if (oneof && oneof->field(0) != &field) continue;  // is there already
      Result<void> added = oneof ? add_oneof(*oneof, fields, plan->members) : add(field, fields, plan->members);
      if (!added) return Unexpected{std::move(added).error()};
    }
    open_.pop_back();
    Result<DynamicType> type = DynamicType::record(descriptor.full_name(), std::move(fields));
    if (!type) return Unexpected{std::move(type).error()};
    return known_[&descriptor] = Element{*type, std::move(plan)};
  }

  Result<void> add(const pb::FieldDescriptor& field, std::vector<rdf::DynamicField>& fields, std::vector<Plan::Member>& members) {
    Field says;
    if (options_.field) options_.field(field, says);
    if (says.left_out) return {};
    field_ = field.full_name();
    const bool may_be_absent = field.has_presence() && !field.is_required() && !field.real_containing_oneof();
    Result<Element> value = field.is_map() ? element(*field.message_type()->map_value(), says.as_json) : element(field, says.as_json);
    if (!value) return Unexpected{std::move(value).error()};
    Result<DynamicType> type = value->type;
    if (field.is_map()) type = DynamicType::map(*type);
    else if (field.is_repeated()) type = DynamicType::list(*type);
    else if (may_be_absent) type = DynamicType::optional(*type);
    if (!type) return unexpected(type.error().code, "field \"" + field.full_name() + "\": " + type.error().message);
    fields.push_back({field.json_name(), *type, says.facets});
    members.push_back({field.json_name(), &field, value->plan, may_be_absent});
    return {};
  }

  Result<void> add_oneof(const pb::OneofDescriptor& oneof, std::vector<rdf::DynamicField>& fields, std::vector<Plan::Member>& members) {
    std::vector<rdf::DynamicField> alternatives;
    Plan::Member member;
    member.name = oneof.name();
    for (int i = 0; i < oneof.field_count(); ++i)
      if (Result<void> r = add(*oneof.field(i), alternatives, member.alternatives); !r) return r;
    if (alternatives.empty()) return {};
    Result<DynamicType> type = DynamicType::variant(oneof.full_name(), std::move(alternatives));
    member.may_be_absent = !options_.oneof_is_required || !options_.oneof_is_required(oneof);
    if (type && member.may_be_absent) type = DynamicType::optional(*type);
    if (!type) return Unexpected{std::move(type).error()};
    fields.push_back({oneof.name(), *type});
    members.push_back(std::move(member));
    return {};
  }

  /// One value of a field.
  Result<Element> element(const pb::FieldDescriptor& field, bool as_json) {
    auto plan = std::make_shared<Plan>();
    const auto scalar = [&](DynamicType type) { return Element{type, std::move(plan)}; };
    switch (field.cpp_type()) {
      case pb::FieldDescriptor::CPPTYPE_INT32: return scalar(DynamicType::of<std::int32_t>());
      case pb::FieldDescriptor::CPPTYPE_INT64: return scalar(DynamicType::of<std::int64_t>());
      case pb::FieldDescriptor::CPPTYPE_UINT32: return scalar(DynamicType::of<std::uint32_t>());
      case pb::FieldDescriptor::CPPTYPE_UINT64: return scalar(DynamicType::of<std::uint64_t>());
      case pb::FieldDescriptor::CPPTYPE_DOUBLE: return scalar(DynamicType::of<double>());
      case pb::FieldDescriptor::CPPTYPE_FLOAT: return scalar(DynamicType::of<float>());
      case pb::FieldDescriptor::CPPTYPE_BOOL: return scalar(DynamicType::of<bool>());
      case pb::FieldDescriptor::CPPTYPE_STRING:
        return scalar(field.type() == pb::FieldDescriptor::TYPE_BYTES ? DynamicType::base64() : DynamicType::of<std::string>());
      case pb::FieldDescriptor::CPPTYPE_ENUM: {
        std::vector<std::string> names;
        for (int i = 0; i < field.enum_type()->value_count(); ++i) names.push_back(field.enum_type()->value(i)->name());
        Result<DynamicType> type = DynamicType::enumeration(std::move(names));
        if (!type) return Unexpected{std::move(type).error()};
        return scalar(*type);
      }
      case pb::FieldDescriptor::CPPTYPE_MESSAGE: return message(*field.message_type(), as_json);
    }
    return unexpected(Errc::invalid_option, "field \"" + field.full_name() + "\": its type is not known");
  }

  const Options& options_;
  std::map<const pb::Descriptor*, Element> known_;
  std::vector<const pb::Descriptor*> open_;
  std::string field_;  // the one that is looked at
};

// Instants that conform to their shape: 1677-09-22T00:00:00Z to 2262-04-11T23:47:16Z.
constexpr std::int64_t first_second = -9'223'286'400, last_second = 9'223'372'036, second = 1'000'000'000;

const pb::FieldDescriptor& seconds_of(const pb::Message& message) { return *message.GetDescriptor()->FindFieldByNumber(1); }
const pb::FieldDescriptor& nanos_of(const pb::Message& message) { return *message.GetDescriptor()->FindFieldByNumber(2); }

/// The name of a key of a map, as in protobuf's JSON.
std::string name_of_key(const pb::Message& entry) {
  const pb::FieldDescriptor& key = *entry.GetDescriptor()->map_key();
  const pb::Reflection& reflection = *entry.GetReflection();
  switch (key.cpp_type()) {
    case pb::FieldDescriptor::CPPTYPE_INT32: return std::to_string(reflection.GetInt32(entry, &key));
    case pb::FieldDescriptor::CPPTYPE_INT64: return std::to_string(reflection.GetInt64(entry, &key));
    case pb::FieldDescriptor::CPPTYPE_UINT32: return std::to_string(reflection.GetUInt32(entry, &key));
    case pb::FieldDescriptor::CPPTYPE_UINT64: return std::to_string(reflection.GetUInt64(entry, &key));
    case pb::FieldDescriptor::CPPTYPE_BOOL: return reflection.GetBool(entry, &key) ? "true" : "false";
    default: return reflection.GetString(entry, &key);
  }
}

/// Reads messages.
class Encoder {
 public:
  bool message(const Plan& plan, const pb::Message& message, Value& out) {
    const pb::Reflection& reflection = *message.GetReflection();
    switch (plan.form) {
      case Form::instant:
      case Form::duration: return time(plan.form, message, out);
      case Form::wrapper: return one(*plan.members.front().value, message, *plan.members.front().field, -1, out);
      case Form::json: {
        std::string text;
        const auto status = pb::util::MessageToJsonString(message, &text);
        if (!status.ok()) return fault.is("it has no JSON: " + status.ToString());
        out = Value(std::move(text));
        return true;
      }
      default: break;
    }
    Value::Sequence members;
    members.reserve(plan.members.size());
    for (const Plan::Member& member : plan.members) {
      Value value;
      const bool good = member.field ? field(member, message, reflection, value) : oneof(member, message, reflection, value);
      if (!good) return fault.at(member.name);
      members.push_back(std::move(value));
    }
    out = Value(std::move(members));
    return true;
  }

  Fault fault;

 private:
  bool time(Form form, const pb::Message& message, Value& out) {
    const pb::Reflection& reflection = *message.GetReflection();
    const std::int64_t seconds = reflection.GetInt64(message, &seconds_of(message)), nanos = reflection.GetInt32(message, &nanos_of(message));
    const bool is_instant = form == Form::instant;
    const bool signs_agree = is_instant ? nanos >= 0 : seconds == 0 || nanos == 0 || (seconds < 0) == (nanos < 0);
    const std::int64_t first = is_instant ? first_second : -last_second;
    if (!signs_agree || nanos >= second || nanos <= -second || seconds < first || seconds > last_second || (seconds == last_second && nanos > 0) ||
        (seconds == -last_second && nanos < 0))
      return fault.is(std::string("expected ") + (is_instant ? "an instant" : "a duration") + " within 292 years, found " + std::to_string(seconds) +
                      " s and " + std::to_string(nanos) + " ns");
    out = Value(seconds * second + nanos);
    return true;
  }

  bool field(const Plan::Member& member, const pb::Message& message, const pb::Reflection& reflection, Value& out) {
    const pb::FieldDescriptor& field = *member.field;
    if (field.is_map()) return map(member, message, reflection, out);
    if (field.is_repeated()) {
      const int size = reflection.FieldSize(message, &field);
      Value::Sequence list(static_cast<std::size_t>(size));
      for (int i = 0; i < size; ++i)
        if (!one(*member.value, message, field, i, list[static_cast<std::size_t>(i)])) return fault.at(std::to_string(i));
      out = Value(std::move(list));
      return true;
    }
    if (field.has_presence() && !reflection.HasField(message, &field)) return member.may_be_absent || fault.is("a required field is not set");
    return one(*member.value, message, field, -1, out);
  }

  bool oneof(const Plan::Member& member, const pb::Message& message, const pb::Reflection& reflection, Value& out) {
    Value::Sequence alternatives(member.alternatives.size());
    bool is_set = false;
    for (std::size_t i = 0; i < alternatives.size(); ++i) {
      const Plan::Member& alternative = member.alternatives[i];
      if (!reflection.HasField(message, alternative.field)) continue;
      if (!one(*alternative.value, message, *alternative.field, -1, alternatives[i])) return fault.at(alternative.name);
      is_set = true;
    }
    if (!is_set) return member.may_be_absent || fault.is("none of its fields is set");
    out = Value(std::move(alternatives));
    return true;
  }

  bool map(const Plan::Member& member, const pb::Message& message, const pb::Reflection& reflection, Value& out) {
    std::map<std::string, Value> entries;
    for (int i = 0; i < reflection.FieldSize(message, member.field); ++i) {
      const pb::Message& entry = reflection.GetRepeatedMessage(message, member.field, i);
      std::string name = name_of_key(entry);
      if (!one(*member.value, entry, *entry.GetDescriptor()->map_value(), -1, entries[name])) return fault.at(name);
    }
    Value::Sequence list;
    list.reserve(entries.size());
    for (auto& [name, value] : entries) list.push_back(Value(Value::Sequence{Value(name), std::move(value)}));
    out = Value(std::move(list));
    return true;
  }

  /// @param index  of a repeated field; -1: it is not repeated
  bool one(const Plan& plan, const pb::Message& in, const pb::FieldDescriptor& field, int index, Value& out) {
    const pb::Reflection& reflection = *in.GetReflection();
    const bool single = index < 0;
    switch (field.cpp_type()) {
      case pb::FieldDescriptor::CPPTYPE_INT32:
        out = Value(std::int64_t{single ? reflection.GetInt32(in, &field) : reflection.GetRepeatedInt32(in, &field, index)});
        return true;
      case pb::FieldDescriptor::CPPTYPE_INT64:
        out = Value(std::int64_t{single ? reflection.GetInt64(in, &field) : reflection.GetRepeatedInt64(in, &field, index)});
        return true;
      case pb::FieldDescriptor::CPPTYPE_UINT32:
        out = Value(std::uint64_t{single ? reflection.GetUInt32(in, &field) : reflection.GetRepeatedUInt32(in, &field, index)});
        return true;
      case pb::FieldDescriptor::CPPTYPE_UINT64:
        out = Value(std::uint64_t{single ? reflection.GetUInt64(in, &field) : reflection.GetRepeatedUInt64(in, &field, index)});
        return true;
      case pb::FieldDescriptor::CPPTYPE_DOUBLE:
        out = Value(single ? reflection.GetDouble(in, &field) : reflection.GetRepeatedDouble(in, &field, index));
        return true;
      case pb::FieldDescriptor::CPPTYPE_FLOAT:
        out = Value(static_cast<double>(single ? reflection.GetFloat(in, &field) : reflection.GetRepeatedFloat(in, &field, index)));
        return true;
      case pb::FieldDescriptor::CPPTYPE_BOOL:
        out = Value(single ? reflection.GetBool(in, &field) : reflection.GetRepeatedBool(in, &field, index));
        return true;
      case pb::FieldDescriptor::CPPTYPE_ENUM: {
        const int number = single ? reflection.GetEnumValue(in, &field) : reflection.GetRepeatedEnumValue(in, &field, index);
        const pb::EnumValueDescriptor* const known = field.enum_type()->FindValueByNumber(number);
        if (!known)
          return fault.is("expected a value of the enum " + field.enum_type()->full_name() + ", found the number " + std::to_string(number));
        out = Value(known->name());
        return true;
      }
      case pb::FieldDescriptor::CPPTYPE_STRING: {
        std::string text = single ? reflection.GetString(in, &field) : reflection.GetRepeatedString(in, &field, index);
        out = Value(field.type() == pb::FieldDescriptor::TYPE_BYTES ? lrt::detail::base64(text) : std::move(text));
        return true;
      }
      case pb::FieldDescriptor::CPPTYPE_MESSAGE:
        return message(plan, single ? reflection.GetMessage(in, &field) : reflection.GetRepeatedMessage(in, &field, index), out);
    }
    return fault.is("its type is not known");
  }
};

std::int64_t signed_of(const Value& value) { return value.integer() ? *value.integer() : 0; }
std::uint64_t unsigned_of(const Value& value) {
  return value.large_integer() ? *value.large_integer() : static_cast<std::uint64_t>(signed_of(value));
}

/// Whether `text` is a T as std::to_string() writes it: then equal keys have equal names.
template <class T>
bool read_key(std::string_view text, T& key) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), key);
  return error == std::errc() && end == text.data() + text.size() && std::to_string(key) == text;
}

/// The bytes of a text in base64, whose spaces do not count.
bool read_base64(std::string_view text, std::string& bytes) {
  unsigned group = 0;
  int digits = 0, padding = 0;
  for (const char c : text) {
    if (c == ' ' || c == '\t' || c == '\n' || c == '\r') continue;
    unsigned digit = 0;
    if (c >= 'A' && c <= 'Z') digit = static_cast<unsigned>(c - 'A');
    else if (c >= 'a' && c <= 'z') digit = static_cast<unsigned>(c - 'a') + 26;
    else if (c >= '0' && c <= '9') digit = static_cast<unsigned>(c - '0') + 52;
    else if (c == '+') digit = 62;
    else if (c == '/') digit = 63;
    else if (c == '=' && digits >= 2) ++padding;
    else return false;
    if (padding > 0 && c != '=') return false;
    group = group << 6 | digit;
    if (++digits < 4) continue;
    for (int i = 0; i < 3 - padding; ++i) bytes += static_cast<char>(group >> (16 - 8 * i) & 0xFFU);
    if (padding > 0 && (padding > 2 || (group & (padding == 2 ? 0xFFFFU : 0xFFU)) != 0)) return false;
    group = 0;
    digits = padding > 0 ? 5 : 0;  // nothing may follow
  }
  return digits == 0 || digits == 5;
}

/// Writes messages from values that are of their types.
class Decoder {
 public:
  bool message(const Plan& plan, const Value& value, pb::Message& out) {
    const pb::Reflection& reflection = *out.GetReflection();
    switch (plan.form) {
      case Form::instant:
      case Form::duration: {
        const std::int64_t time = signed_of(value);
        std::int64_t seconds = time / second, nanos = time % second;
        if (plan.form == Form::instant && nanos < 0) --seconds, nanos += second;
        reflection.SetInt64(&out, &seconds_of(out), seconds);
        reflection.SetInt32(&out, &nanos_of(out), static_cast<std::int32_t>(nanos));
        return true;
      }
      case Form::wrapper: return one(*plan.members.front().value, value, *plan.members.front().field, out, false);
      case Form::json: {
        const auto status = pb::util::JsonStringToMessage(*value.text(), &out);
        return status.ok() || fault.is("expected JSON of a " + out.GetDescriptor()->full_name() + ": " + status.ToString());
      }
      default: break;
    }
    const Value::Sequence& values = *value.sequence();
    for (std::size_t i = 0; i < plan.members.size(); ++i) {
      const Plan::Member& member = plan.members[i];
      if (values[i].is_null()) continue;
      if (!(member.field ? field(member, values[i], out) : oneof(member, values[i], out))) return fault.at(member.name);
    }
    return true;
  }

  Fault fault;

 private:
  bool field(const Plan::Member& member, const Value& value, pb::Message& out) {
    if (member.field->is_map()) return map(member, value, out);
    if (!member.field->is_repeated()) return one(*member.value, value, *member.field, out, false);
    std::size_t index = 0;
    for (const Value& v : *value.sequence()) {
      if (!one(*member.value, v, *member.field, out, true)) return fault.at(std::to_string(index));
      ++index;
    }
    return true;
  }

  bool oneof(const Plan::Member& member, const Value& value, pb::Message& out) {
    const Value::Sequence& values = *value.sequence();
    for (std::size_t i = 0; i < member.alternatives.size(); ++i)
      if (!values[i].is_null() && !one(*member.alternatives[i].value, values[i], *member.alternatives[i].field, out, false))
        return fault.at(member.alternatives[i].name);
    return true;
  }

  bool map(const Plan::Member& member, const Value& value, pb::Message& out) {
    for (const Value& pair : *value.sequence()) {
      const std::string& name = *(*pair.sequence())[0].text();
      pb::Message& entry = *out.GetReflection()->AddMessage(&out, member.field);
      if (!set_key(name, entry) || !one(*member.value, (*pair.sequence())[1], *entry.GetDescriptor()->map_value(), entry, false))
        return fault.at(name);
    }
    return true;
  }

  bool set_key(const std::string& name, pb::Message& entry) {
    const pb::FieldDescriptor& key = *entry.GetDescriptor()->map_key();
    const pb::Reflection& reflection = *entry.GetReflection();
    const auto set = [&](auto number, auto store) {
      if (!read_key(name, number)) return fault.is(std::string("expected a key of type ") + key.type_name() + " in decimal digits");
      store(number);
      return true;
    };
    switch (key.cpp_type()) {
      case pb::FieldDescriptor::CPPTYPE_INT32: return set(std::int32_t{}, [&](auto n) { reflection.SetInt32(&entry, &key, n); });
      case pb::FieldDescriptor::CPPTYPE_INT64: return set(std::int64_t{}, [&](auto n) { reflection.SetInt64(&entry, &key, n); });
      case pb::FieldDescriptor::CPPTYPE_UINT32: return set(std::uint32_t{}, [&](auto n) { reflection.SetUInt32(&entry, &key, n); });
      case pb::FieldDescriptor::CPPTYPE_UINT64: return set(std::uint64_t{}, [&](auto n) { reflection.SetUInt64(&entry, &key, n); });
      case pb::FieldDescriptor::CPPTYPE_BOOL:
        if (name != "true" && name != "false") return fault.is("expected the key \"true\" or \"false\"");
        return reflection.SetBool(&entry, &key, name == "true"), true;
      default: return reflection.SetString(&entry, &key, name), true;
    }
  }

  bool one(const Plan& plan, const Value& value, const pb::FieldDescriptor& field, pb::Message& out, bool adds) {
    const pb::Reflection& reflection = *out.GetReflection();
    switch (field.cpp_type()) {
      case pb::FieldDescriptor::CPPTYPE_INT32: {
        const auto number = static_cast<std::int32_t>(signed_of(value));
        return adds ? reflection.AddInt32(&out, &field, number) : reflection.SetInt32(&out, &field, number), true;
      }
      case pb::FieldDescriptor::CPPTYPE_INT64:
        return adds ? reflection.AddInt64(&out, &field, signed_of(value)) : reflection.SetInt64(&out, &field, signed_of(value)), true;
      case pb::FieldDescriptor::CPPTYPE_UINT32: {
        const auto number = static_cast<std::uint32_t>(unsigned_of(value));
        return adds ? reflection.AddUInt32(&out, &field, number) : reflection.SetUInt32(&out, &field, number), true;
      }
      case pb::FieldDescriptor::CPPTYPE_UINT64:
        return adds ? reflection.AddUInt64(&out, &field, unsigned_of(value)) : reflection.SetUInt64(&out, &field, unsigned_of(value)), true;
      case pb::FieldDescriptor::CPPTYPE_DOUBLE:
        return adds ? reflection.AddDouble(&out, &field, *value.real()) : reflection.SetDouble(&out, &field, *value.real()), true;
      case pb::FieldDescriptor::CPPTYPE_FLOAT: {
        const auto number = static_cast<float>(*value.real());
        return adds ? reflection.AddFloat(&out, &field, number) : reflection.SetFloat(&out, &field, number), true;
      }
      case pb::FieldDescriptor::CPPTYPE_BOOL:
        return adds ? reflection.AddBool(&out, &field, *value.boolean()) : reflection.SetBool(&out, &field, *value.boolean()), true;
      case pb::FieldDescriptor::CPPTYPE_ENUM: {
        const pb::EnumValueDescriptor* const known = field.enum_type()->FindValueByName(*value.text());
        if (!known) return fault.is("expected a name of the enum " + field.enum_type()->full_name());
        return adds ? reflection.AddEnum(&out, &field, known) : reflection.SetEnum(&out, &field, known), true;
      }
      case pb::FieldDescriptor::CPPTYPE_STRING: {
        std::string text;
        if (field.type() != pb::FieldDescriptor::TYPE_BYTES) text = *value.text();
        else if (!read_base64(*value.text(), text)) return fault.is("expected base64 (RFC 4648 4)");
        return adds ? reflection.AddString(&out, &field, std::move(text)) : reflection.SetString(&out, &field, std::move(text)), true;
      }
      case pb::FieldDescriptor::CPPTYPE_MESSAGE:
        return message(plan, value, adds ? *reflection.AddMessage(&out, &field) : *reflection.MutableMessage(&out, &field));
    }
    return fault.is("its type is not known");
  }
};

/// The same bytes for the same content, whatever the order of the entries of a map.
std::string bytes_of(const pb::Message& message) {
  std::string bytes;
  pb::io::StringOutputStream stream(&bytes);
  pb::io::CodedOutputStream coded(&stream);
  coded.SetSerializationDeterministic(true);
  message.SerializePartialToCodedStream(&coded);
  coded.Trim();
  return bytes;
}

}  // namespace

MessageType::MessageType(DynamicType type, std::shared_ptr<const Plan> plan) : type_(type), plan_(std::move(plan)) {}

Result<MessageType> MessageType::of(const pb::Descriptor& message, const Options& options) {
  Result<Element> made = Builder(options).message(message, false);
  if (!made) return Unexpected{std::move(made).error()};
  return MessageType(made->type, made->plan);
}

MessageType MessageType::of_generated(const pb::Descriptor& message, const Options& options) {
  Result<MessageType> made = of(message, options);
  if (made) return *std::move(made);
  return MessageType(DynamicType::refused(made.error().message), nullptr);
}

Result<Value> MessageType::encode(const pb::Message& message) const {
  if (!plan_) return unexpected(Errc::invalid_option, type_->fault);
  Encoder encoder;
  Value value;
  if (!encoder.message(*plan_, message, value)) return encoder.fault.error(Errc::failed);
  if (Result<void> r = type_.check(value); !r) return unexpected(Errc::failed, r.error().message);
  return value;
}

Result<void> MessageType::decode(const Value& value, pb::Message& message) const {
  message.Clear();
  if (!plan_) return unexpected(Errc::invalid_option, type_->fault);
  if (Result<void> r = type_.check(value); !r) return r;
  Decoder decoder;
  if (decoder.message(*plan_, value, message)) return {};
  message.Clear();
  return decoder.fault.error(Errc::expected_value);
}

namespace detail {
bool same(const pb::Message& a, const pb::Message& b) noexcept {
  try {
    return bytes_of(a) == bytes_of(b);
  } catch (...) {  // out of memory: counts as a change
    return false;
  }
}
}  // namespace detail

}  // namespace v0
}  // namespace lrt::protobuf
