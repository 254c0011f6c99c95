// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/value.hpp>

#include <type_traits>
#include <utility>
#include <variant>

namespace lrt::rdf {

Value::Value() noexcept = default;
Value::Value(bool v) noexcept : data_(v) {}
Value::Value(std::int64_t v) noexcept : data_(v) {}
Value::Value(std::uint64_t v) noexcept : data_(v) {
  if (v <= static_cast<std::uint64_t>(INT64_MAX)) data_ = static_cast<std::int64_t>(v);
}
Value::Value(double v) noexcept : data_(v) {}
Value::Value(std::string v) noexcept : data_(std::move(v)) {}
Value::Value(Sequence v) noexcept : data_(std::move(v)) {}
/// Not the copy of std::variant: libstdc++ 12 destroys what it has not made if memory is exhausted, because it takes this variant for one that is never
/// without a value.
Value::Value(const Value& other) {
  std::visit([this](const auto& content) { data_ = std::decay_t<decltype(content)>(content); }, other.data_);
}
Value::Value(Value&& other) noexcept = default;
Value& Value::operator=(const Value& other) { return *this = Value(other); }
Value& Value::operator=(Value&& other) noexcept = default;
Value::~Value() = default;

}  // namespace lrt::rdf
