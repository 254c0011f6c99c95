// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/language.hpp>

namespace lrt::rdf {
inline namespace v0 {

/// The common form of values between C++ and all representations: rdf::traits<T> converts a T to it, every codec reads and writes it. A Type
/// describes its structure; a Value does not contain its datatype.
///
/// null: an absent optional. boolean. integer: int64, or uint64 above its range; durations and instants in nanoseconds. real: float and
/// double. text: strings and names of enumerators. sequence: lists, records in the order of their fields, and maps as
/// sequences of two, the name and the value, in the order of the names.
class LRT_API Value {
 public:
  using Sequence = std::vector<Value>;

  // Compiled once: every file that uses lrt has values.
  Value() noexcept;
  explicit Value(bool v) noexcept;
  explicit Value(std::int64_t v) noexcept;
  explicit Value(std::uint64_t v) noexcept;
  explicit Value(double v) noexcept;
  explicit Value(std::string v) noexcept;
  explicit Value(Sequence v) noexcept;
  Value(const Value& other);
  Value(Value&& other) noexcept;
  Value& operator=(const Value& other);
  Value& operator=(Value&& other) noexcept;
  ~Value();

  bool is_null() const noexcept { return data_.index() == 0; }
  const bool* boolean() const noexcept { return std::get_if<bool>(&data_); }
  const std::int64_t* integer() const noexcept { return std::get_if<std::int64_t>(&data_); }
  const std::uint64_t* large_integer() const noexcept { return std::get_if<std::uint64_t>(&data_); }
  const double* real() const noexcept { return std::get_if<double>(&data_); }
  const std::string* text() const noexcept { return std::get_if<std::string>(&data_); }
  const Sequence* sequence() const noexcept { return std::get_if<Sequence>(&data_); }

 private:
  std::variant<std::monostate, bool, std::int64_t, std::uint64_t, double, std::string, Sequence> data_;
};

/// True if both are bit-identical: NaN equals NaN, 0.0 does not equal -0.0.
LRT_API bool same(const Value& a, const Value& b) noexcept;

}  // namespace v0
}  // namespace lrt::rdf
