// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/standard_types.hpp>

#include <lrt/rdf/vocab.hpp>

#include "src/base/base64.hpp"
#include "src/rdf/bytes.hpp"

namespace lrt::rdf {
inline namespace v0 {

namespace detail {

const Type& byte_type() {
  static const Immortal<Type> t(integer_type(0, 255, 1));
  return *t;
}

Type bytes_type(std::size_t shortest, std::size_t longest) {
  Type t;
  t.kind = Type::Kind::text;
  t.datatype = vocab::xsd::base64Binary;
  t.shortest = shortest;
  t.longest = longest;
  return t;
}

Value encode_bytes(const std::byte* bytes, std::size_t count) {
  return Value(lrt::detail::base64(std::string_view(reinterpret_cast<const char*>(bytes), count)));  // NOLINT: char may alias
}

Result<std::string> decode_bytes(const Value& value) {
  std::optional<std::string> found = value.text() ? bytes_of(*value.text()) : std::nullopt;
  if (!found) return not_a_value_of("bytes in base64");
  return *std::move(found);
}

Type tuple_type(const Type* const* elements, std::size_t count, bool is_pair) {
  Type t;
  t.kind = Type::Kind::record;
  t.classes.emplace_back(vocab::rdf_::Seq.text);
  for (std::size_t i = 0; i < count; ++i) {
    FieldType field;
    field.name = !is_pair ? std::to_string(i) : i == 0 ? "first" : "second";
    field.predicate = std::string("http://www.w3.org/1999/02/22-rdf-syntax-ns#_").append(std::to_string(i + 1));
    field.type = elements[i];
    t.fields.push_back(std::move(field));
  }
  return t;
}

}  // namespace detail
}  // namespace v0
}  // namespace lrt::rdf
