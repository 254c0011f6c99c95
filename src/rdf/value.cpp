// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/value.hpp>

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
Value::Value(const Value& other) = default;
Value::Value(Value&& other) noexcept = default;
Value& Value::operator=(const Value& other) = default;
Value& Value::operator=(Value&& other) noexcept = default;
Value::~Value() = default;

}  // namespace lrt::rdf
