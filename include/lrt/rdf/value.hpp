// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/language.hpp>

namespace lrt::rdf {
inline namespace v0 {

/// The common form of values between C++ and all representations: rdf::traits<T> converts a T to it, and every codec
/// reads and writes it. A Type describes its structure; a Value does not contain its datatype.
///
/// | content   | for |
/// |-----------|-----|
/// | null      | an absent std::optional |
/// | boolean   | bool |
/// | integer   | int64, or uint64 above the range of int64; durations and instants in nanoseconds |
/// | real      | float and double |
/// | text      | strings and names of enumerators |
/// | sequence  | lists; records, in the order of their fields; variants, as records with one field that is not null; maps, as sequences of two (name and value) in the order of the names |
///
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
class LRT_API Value {
 public:
  using Sequence = std::vector<Value>;  ///< content of a list, record or map

  // Compiled once: every file that uses lrt has values.
  /// Null.
  Value() noexcept;
  /// @{
  /// A value with this content.
  explicit Value(bool v) noexcept;
  explicit Value(std::int64_t v) noexcept;
  explicit Value(std::uint64_t v) noexcept;
  explicit Value(double v) noexcept;
  explicit Value(std::string v) noexcept;
  explicit Value(Sequence v) noexcept;
  /// @}
  Value(const Value& other);
  Value(Value&& other) noexcept;
  Value& operator=(const Value& other);
  Value& operator=(Value&& other) noexcept;
  ~Value();

  bool is_null() const noexcept { return data_.index() == 0; }  ///< whether there is no content
  /// @{
  /// The content; nullptr if it is of another kind. Valid until the object is changed.
  const bool* boolean() const noexcept { return std::get_if<bool>(&data_); }
  const std::int64_t* integer() const noexcept { return std::get_if<std::int64_t>(&data_); }
  const std::uint64_t* large_integer() const noexcept { return std::get_if<std::uint64_t>(&data_); }
  const double* real() const noexcept { return std::get_if<double>(&data_); }
  const std::string* text() const noexcept { return std::get_if<std::string>(&data_); }
  const Sequence* sequence() const noexcept { return std::get_if<Sequence>(&data_); }
  /// @}

 private:
  std::variant<std::monostate, bool, std::int64_t, std::uint64_t, double, std::string, Sequence> data_;
};

/// Whether both are bit-identical: NaN equals NaN, 0.0 does not equal -0.0.
/// @par Threads  Any.
/// @par Time     Linear in the values. Does not allocate.
LRT_API bool same(const Value& a, const Value& b) noexcept;

}  // namespace v0
}  // namespace lrt::rdf
