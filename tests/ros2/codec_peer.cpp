// SPDX-License-Identifier: Apache-2.0
// What oracle_test.py compares with programs of others. Reads lines, of fields with tabs between, and writes one for each:
//
//   read TYPE TEXT PAYLOAD   ->  the value of the payload, and the payload that is made of it again; both ways in big endian as well
//   make TYPE TEXT SEED      ->  a random value, its payload in little endian, and in big endian
//   show TYPE TEXT           ->  the definition: fields and constants
//
// TEXT and payloads are hexadecimal. A value is its parts in order: "i5", "b1", "f" and the bits of a float64, "s" and the bytes of a text, "[3"
// before three members.
#include <cstdio>
#include <cstring>
#include <iostream>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/ros2/definitions.hpp>
#include <lrt/ros2/message_type.hpp>

#include "src/base/base64.hpp"
#include "src/ros2/types/parser.hpp"

using namespace lrt;
using namespace lrt::ros2;
using Value = rdf::Value;

namespace {

std::string hex(std::string_view bytes) {
  constexpr char digits[] = "0123456789abcdef";
  std::string out;
  for (const char c : bytes) {
    out += digits[static_cast<unsigned char>(c) >> 4U];
    out += digits[static_cast<unsigned char>(c) & 15U];
  }
  return out;
}
std::string unhex(std::string_view text) {
  const auto digit = [](char c) { return static_cast<unsigned>(c <= '9' ? c - '0' : c - 'a' + 10); };
  std::string out;
  for (std::size_t i = 0; i + 1 < text.size(); i += 2)
    out += static_cast<char>(static_cast<unsigned char>(digit(text[i]) << 4U | digit(text[i + 1])));
  return out;
}
std::string bytes_of(std::string_view base64) {
  std::string out;
  unsigned group = 0;
  int bits = 0;
  for (const char c : base64) {
    if (c == '=') break;
    group = (group << 6U | static_cast<unsigned>(detail::base64_digit(c))) & 0xFFFFU;
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    out += static_cast<char>(static_cast<unsigned char>(group >> static_cast<unsigned>(bits)));
  }
  return out;
}

void dump(const Value& value, const FieldType& type, std::string& out);
void dump(const Value& value, const Message& message, std::string& out) {
  for (std::size_t i = 0; i < message.fields.size(); ++i) dump(value.sequence()->at(i), message.fields[i].type, out);
}
void dump_one(const Value& value, const FieldType& type, std::string& out) {
  if (type.message) return dump(value, *type.message, out);
  if (!out.empty()) out += ' ';
  if (value.boolean()) out += *value.boolean() ? "b1" : "b0";
  else if (value.integer()) out += "i" + std::to_string(*value.integer());
  else if (value.large_integer()) out += "i" + std::to_string(*value.large_integer());
  else if (value.text()) out += "s" + hex(*value.text());
  else if (value.real()) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, value.real(), sizeof bits);
    char text[24];
    std::snprintf(text, sizeof text, *value.real() != *value.real() ? "fnan" : "f%016llx", static_cast<unsigned long long>(bits));
    out += text;
  }
}
bool is_byte(Kind kind) { return kind == Kind::uint8 || kind == Kind::octet || kind == Kind::character; }
void dump(const Value& value, const FieldType& type, std::string& out) {
  if (type.arity == Arity::single) return dump_one(value, type, out);
  if (!out.empty()) out += ' ';
  if (is_byte(type.kind) && value.text()) {
    const std::string bytes = bytes_of(*value.text());
    out += "[" + std::to_string(bytes.size());
    for (const char c : bytes) out += " i" + std::to_string(static_cast<unsigned char>(c));
    return;
  }
  out += "[" + std::to_string(value.sequence()->size());
  for (const Value& member : *value.sequence()) dump_one(member, type, out);
}

using Random = std::mt19937_64;
Value random_of(const FieldType& type, Random& random);
Value random_of(const Message& message, Random& random) {
  Value::Sequence members;
  for (const Field& field : message.fields) members.push_back(random_of(field.type, random));
  return Value(std::move(members));
}
std::string random_text(std::uint32_t bound, Random& random) {
  std::string text;
  for (std::size_t n = random() % 12; n > 0 && (bound == 0 || text.size() < bound); --n) text += static_cast<char>(' ' + random() % 95);
  return text;
}
Value random_one(const FieldType& type, Random& random) {
  if (type.message) return random_of(*type.message, random);
  if (const auto range = range_of(type.kind)) {
    const std::uint64_t bits = random() >> (random() % 64);
    if (range->lowest < 0) {
      const std::uint64_t span = range->highest + (std::uint64_t{0} - static_cast<std::uint64_t>(range->lowest));
      return Value(static_cast<std::int64_t>(static_cast<std::uint64_t>(range->lowest) + (span == ~std::uint64_t{0} ? bits : bits % (span + 1))));
    }
    const std::uint64_t n = range->highest == ~std::uint64_t{0} ? bits : bits % (range->highest + 1);
    if (n > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) return Value(n);
    return Value(static_cast<std::int64_t>(n));
  }
  switch (type.kind) {
    case Kind::boolean: return Value(random() % 2 == 1);
    case Kind::string:
    case Kind::wstring: return Value(random_text(type.text_bound, random));
    default: break;
  }
  if (random() % 8 == 0) return Value(random() % 2 == 0 ? std::numeric_limits<double>::infinity() : std::numeric_limits<double>::quiet_NaN());
  if (type.kind == Kind::float32) return Value(static_cast<double>(static_cast<float>(static_cast<double>(random()) / 1e7 - 1e3)));
  return Value(static_cast<double>(random()) / 1e13 - 1e5);
}
Value random_of(const FieldType& type, Random& random) {
  if (type.arity == Arity::single) return random_one(type, random);
  std::size_t length = type.arity == Arity::array ? type.size : random() % 5;
  if (type.arity == Arity::bounded_sequence) length = std::min<std::size_t>(length, type.size);
  if (is_byte(type.kind)) {
    std::string bytes;
    for (std::size_t i = 0; i < length; ++i) bytes += static_cast<char>(static_cast<unsigned char>(random()));
    return Value(detail::base64(bytes));
  }
  Value::Sequence members;
  for (std::size_t i = 0; i < length; ++i) members.push_back(random_one(type, random));
  return Value(std::move(members));
}

std::string show(const Message& message) {
  std::string out;
  for (const Field& f : message.fields) {
    out += "field " + f.name + " " + (f.type.message ? f.type.message->name : std::string(to_string(f.type.kind)));
    out += " " + std::to_string(static_cast<int>(f.type.arity)) + " " + std::to_string(f.type.size) + " " + std::to_string(f.type.text_bound);
    std::string initial;
    if (f.initial) dump(*f.initial, f.type, initial);
    out += " " + (f.initial ? initial : "-") + ";";
  }
  for (const Constant& c : message.constants) {
    std::string value;
    FieldType type;
    type.kind = c.kind;
    dump(c.value, type, value);
    out += "constant " + c.name + " " + std::string(to_string(c.kind)) + " " + value + ";";
  }
  return out;
}

std::string answer(const std::vector<std::string>& words) {
  Definitions known;
  const std::string type = words.at(1);
  if (Result<void> r = known.add_text(type.substr(0, type.find('_', type.rfind('/'))), unhex(words.at(2))); !r) return "error\t" + r.error().message;
  const Result<MessagePtr> message = known.message(type);
  if (!message) return "error\t" + message.error().message;
  if (words[0] == "show") return "shown\t" + show(**message);
  MessageOptions options;
  options.times = false;
  const Result<MessageType> codec = MessageType::of(*message, options);
  if (!codec) return "error\t" + codec.error().message;
  if (words[0] == "make") {
    Random random(std::stoull(words.at(3)));
    const Value value = random_of(**message, random);
    if (Result<void> r = codec->type().check(value); !r) return "error\t" + r.error().message;
    const Result<std::string> little = codec->encode(value, true), big = codec->encode(value, false);
    if (!little || !big) return "error\t" + (little ? big : little).error().message;
    std::string text;
    dump(value, **message, text);
    return "made\t" + text + "\t" + hex(*little) + "\t" + hex(*big);
  }
  const Result<Value> value = codec->decode(unhex(words.at(3)));
  if (!value) return "error\t" + value.error().message;
  if (Result<void> r = codec->type().check(*value); !r) return "error\t" + r.error().message;
  const Result<std::string> little = codec->encode(*value, true), big = codec->encode(*value, false);
  if (!little || !big) return "error\t" + (little ? big : little).error().message;
  const Result<Value> again = codec->decode(*big);
  if (!again || !rdf::same(*again, *value)) return "error\tbig endian is another value";
  std::string text;
  dump(*value, **message, text);
  return "read\t" + text + "\t" + hex(*little);
}

}  // namespace

int main() {
  std::ios::sync_with_stdio(false);
  for (std::string line; std::getline(std::cin, line);) {
    std::vector<std::string> words;
    std::size_t at = 0;
    for (std::size_t tab = line.find('\t'); tab != std::string::npos; tab = line.find('\t', at))
      words.push_back(line.substr(at, tab - at)), at = tab + 1;
    words.push_back(line.substr(at));
    std::cout << answer(words) << '\n' << std::flush;
  }
}
