// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <lrt/base/iri.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/unique_function.hpp>
#include <lrt/rdf/unit.hpp>

namespace lrt {
inline namespace v0 {

/// Immutable bytes, shared by all clients without a copy. Null: no bytes.
using Bytes = std::shared_ptr<const std::string>;

/// The layout of numbers in a binary representation, for its description in RDF.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
struct Layout {
  /// The order of the bytes of a number.
  enum class ByteOrder : std::uint8_t { little_endian, big_endian };

  Iri element_type;                ///< xsd:double: IEEE 754 binary64; xsd:float: binary32; xsd:unsignedByte ... xsd:long by their size
  std::vector<std::size_t> shape;  ///< length of each axis, the last one varies fastest: {480, 640, 3}
  ByteOrder byte_order = ByteOrder::little_endian;  ///< order of the bytes of each number
  Unit unit{};                                      ///< of the numbers; empty: the property's unit
};

}  // namespace v0
}  // namespace lrt

/// @cond internal
namespace lrt::model {
inline namespace v0 {

/// Whether to_bytes() takes it.
template <class E>
inline constexpr bool makes_bytes = std::is_convertible_v<E, Bytes> || std::is_convertible_v<E, std::string>;
template <class E>
inline constexpr bool makes_bytes<Result<E>> = makes_bytes<E>;

template <class Encoded>
Result<Bytes> to_bytes(Encoded&& encoded) {
  using E = std::decay_t<Encoded>;
  if constexpr (std::is_convertible_v<E, Bytes>) {
    return Bytes(std::forward<Encoded>(encoded));
  } else if constexpr (std::is_convertible_v<E, std::string>) {
    return Bytes(std::make_shared<const std::string>(std::forward<Encoded>(encoded)));
  } else {
    if (!encoded) return Unexpected{std::forward<Encoded>(encoded).error()};
    return to_bytes(*std::forward<Encoded>(encoded));
  }
}

}  // namespace v0
}  // namespace lrt::model
/// @endcond
