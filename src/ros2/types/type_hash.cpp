// SPDX-License-Identifier: Apache-2.0
#include "src/ros2/types/type_hash.hpp"

#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include <openssl/evp.h>

#include "src/base/quote.hpp"
#include "src/base/third_party_call.hpp"

namespace lrt::ros2 {

namespace {

// type_description_interfaces/msg/FieldType
constexpr unsigned id_nested = 1, id_bounded_string = 21, id_bounded_wstring = 22;
constexpr unsigned to_array = 48, to_bounded_sequence = 96, to_sequence = 144;

struct KindId {
  Kind kind;
  unsigned id;
};
// A char of .msg is an uint8 of IDL; a byte is an octet.
constexpr KindId kind_ids[] = {{Kind::message, 1}, {Kind::int8, 2},     {Kind::uint8, 3},    {Kind::int16, 4},
                               {Kind::uint16, 5},  {Kind::int32, 6},    {Kind::uint32, 7},   {Kind::int64, 8},
                               {Kind::uint64, 9},  {Kind::float32, 10}, {Kind::float64, 11}, {Kind::boolean, 15},
                               {Kind::octet, 16},  {Kind::string, 17},  {Kind::wstring, 18}, {Kind::character, 3}};

std::string sha256(std::string_view bytes) {
  const ThirdPartyCall call;
  if (!call) return {};
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned size = 0;
  const bool good = EVP_Digest(bytes.data(), bytes.size(), digest, &size, EVP_sha256(), nullptr) == 1;
  [[maybe_unused]] static const bool closed = ThirdPartyCall::close_at_exit();
  if (!good) return {};
  std::string text;
  constexpr char digits[] = "0123456789abcdef";
  for (unsigned i = 0; i < size; ++i) {
    text += digits[digest[i] >> 4U];
    text += digits[digest[i] & 0x0FU];
  }
  return text;
}

Description::Member nested(std::string_view name, std::string_view type) { return {name, id_nested, 0, 0, type}; }

MessagePtr event_of(std::string_view name, MessagePtr request, MessagePtr response) {
  const auto single = [](Kind kind) {
    FieldType t;
    t.kind = kind;
    return t;
  };
  const auto of = [](MessagePtr message, Arity arity, std::uint32_t size) {
    FieldType t;
    t.kind = Kind::message;
    t.arity = arity;
    t.size = size;
    t.message = std::move(message);
    return t;
  };
  auto time = std::make_shared<Message>();
  time->name = "builtin_interfaces/msg/Time";
  time->fields = {{"sec", single(Kind::int32)}, {"nanosec", single(Kind::uint32)}};
  auto info = std::make_shared<Message>();
  info->name = "service_msgs/msg/ServiceEventInfo";
  FieldType gid = single(Kind::character);
  gid.arity = Arity::array;
  gid.size = 16;
  info->fields = {{"event_type", single(Kind::uint8)},
                  {"stamp", of(std::move(time), Arity::single, 0)},
                  {"client_gid", std::move(gid)},
                  {"sequence_number", single(Kind::int64)}};
  auto event = std::make_shared<Message>();
  event->name = std::string(name) + "_Event";
  event->fields = {{"info", of(std::move(info), Arity::single, 0)},
                   {"request", of(std::move(request), Arity::bounded_sequence, 1)},
                   {"response", of(std::move(response), Arity::bounded_sequence, 1)}};
  return event;
}

/// A pointer to what the caller owns.
MessagePtr borrowed(const Message& message) { return MessagePtr(std::shared_ptr<void>(), &message); }

void add_service(Description& to, std::string_view name, const Message& request, const Message& response) {
  const MessagePtr event = event_of(name, borrowed(request), borrowed(response));
  to.begin(name);
  to.add(nested("request_message", request.name));
  to.add(nested("response_message", response.name));
  to.add(nested("event_message", event->name));
  to.add(request);
  to.add(response);
  to.add(*event);
}

}  // namespace

void Description::begin(std::string_view type) {
  if (first_.empty()) first_ = type;
  open_ = &types_[std::string(type)];
  open_->clear();
}

void Description::add(const Member& member) {
  if (!open_->empty()) *open_ += ", ";
  *open_ += "{\"name\": " + json_string(member.name) + ", \"type\": {\"type_id\": " + std::to_string(member.type_id) +
            ", \"capacity\": " + std::to_string(member.capacity) + ", \"string_capacity\": " + std::to_string(member.string_capacity) +
            ", \"nested_type_name\": " + json_string(member.nested) + "}}";
}

void Description::add(const Message& message) {
  if (knows(message.name)) return;
  begin(message.name);
  if (message.fields.empty()) add(Member{"structure_needs_at_least_one_member", 3});
  for (const Field& field : message.fields)
    add(Member{field.name, type_id_of(field.type), field.type.size, field.type.text_bound,
               field.type.message ? std::string_view(field.type.message->name) : std::string_view()});
  for (const Field& field : message.fields)
    if (field.type.message) add(*field.type.message);
}

std::string Description::hash() const {
  const auto individual = [](const std::string& name, const std::string& fields) {
    return "{\"type_name\": " + json_string(name) + ", \"fields\": [" + fields + "]}";
  };
  std::string others;
  for (const auto& [name, fields] : types_) {
    if (name == first_) continue;
    if (!others.empty()) others += ", ";
    others += individual(name, fields);
  }
  const auto first = types_.find(first_);
  const std::string json = "{\"type_description\": " + individual(first_, first != types_.end() ? first->second : std::string()) +
                           ", \"referenced_type_descriptions\": [" + others + "]}";
  return "RIHS01_" + sha256(json);
}

std::string hash_of(const Message& message) {
  Description description;
  description.add(message);
  return description.hash();
}

std::string hash_of_service(std::string_view name, const Message& request, const Message& response) {
  Description description;
  add_service(description, name, request, response);
  return description.hash();
}

std::string hash_of_action(const ActionDefinition& action) {
  Description description;
  const std::string send = action.name + "_SendGoal", get = action.name + "_GetResult";
  description.begin(action.name);
  description.add(nested("goal", action.goal->name));
  description.add(nested("result", action.result->name));
  description.add(nested("feedback", action.feedback->name));
  description.add(nested("send_goal_service", send));
  description.add(nested("get_result_service", get));
  description.add(nested("feedback_message", action.feedback_message->name));
  add_service(description, send, *action.send_goal_request, *action.send_goal_response);
  add_service(description, get, *action.get_result_request, *action.get_result_response);
  description.add(*action.feedback_message);
  return description.hash();
}

unsigned type_id_of(const FieldType& type) noexcept {
  unsigned id = 0;
  for (const KindId& k : kind_ids)
    if (k.kind == type.kind) id = k.id;
  if (type.text_bound != 0) id = type.kind == Kind::string ? id_bounded_string : id_bounded_wstring;
  switch (type.arity) {
    case Arity::single: return id;
    case Arity::array: return id + to_array;
    case Arity::bounded_sequence: return id + to_bounded_sequence;
    case Arity::sequence: return id + to_sequence;
  }
  return id;
}

std::optional<FieldType> type_of_id(unsigned id, std::uint64_t capacity, std::uint64_t string_capacity) noexcept {
  constexpr std::uint64_t largest = std::numeric_limits<std::uint32_t>::max();
  if (id > to_sequence + to_array || capacity > largest || string_capacity > largest) return std::nullopt;
  FieldType type;
  type.arity = id > to_sequence ? Arity::sequence : id > to_bounded_sequence ? Arity::bounded_sequence : id > to_array ? Arity::array : Arity::single;
  if (type.arity == Arity::array || type.arity == Arity::bounded_sequence) {
    if (capacity == 0) return std::nullopt;
    type.size = static_cast<std::uint32_t>(capacity);
  }
  id -= type.arity == Arity::sequence           ? to_sequence
        : type.arity == Arity::bounded_sequence ? to_bounded_sequence
        : type.arity == Arity::array            ? to_array
                                                : 0;
  if (id == id_bounded_string || id == id_bounded_wstring) {
    if (string_capacity == 0) return std::nullopt;
    type.kind = id == id_bounded_string ? Kind::string : Kind::wstring;
    type.text_bound = static_cast<std::uint32_t>(string_capacity);
    return type;
  }
  for (const KindId& k : kind_ids) {
    if (k.id != id) continue;
    type.kind = k.kind;
    return type;
  }
  return std::nullopt;
}

}  // namespace lrt::ros2
