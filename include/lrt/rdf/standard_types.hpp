// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/immortal.hpp>
#include <lrt/base/result.hpp>
#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/value.hpp>

/// @file
/// Traits of pointers that own, of pairs and tuples, and of bytes. Those of std::deque, list, set and other containers need no header: see
/// rdf::traits.
/// @par Threads  Any, as rdf::traits says.

namespace lrt::rdf {
inline namespace v0 {

namespace detail {
LRT_API const Type& byte_type();
/// The type of bytes: xsd:base64Binary.
LRT_API Type bytes_type(std::size_t shortest, std::size_t longest);
LRT_API Value encode_bytes(const std::byte* bytes, std::size_t count);
/// @return  the bytes as characters; expected_value: the value is no base64
LRT_API Result<std::string> decode_bytes(const Value& value);
/// @param elements  of a pair or a tuple, in order
LRT_API Type tuple_type(const Type* const* elements, std::size_t count, bool is_pair);

/// @cond internal
template <class T>
inline constexpr bool may_be_absent<std::optional<T>> = true;
template <class T>
inline constexpr bool may_be_absent<std::unique_ptr<T>> = true;
template <class T>
inline constexpr bool may_be_absent<std::shared_ptr<T>> = true;
/// @endcond

/// Traits of a pointer that owns: those of std::optional.
template <class P, class T>
struct OwnerTraits {
  static const Type& type() {
    const Type& element = traits<T>::type();
    static const Immortal<Type> t(optional_type(element));
    return *t;
  }
  static Value encode(const P& v) { return v ? traits<T>::encode(*v) : Value(); }
  static Result<P> decode(const Value& v) {
    if (v.is_null()) return P();
    Result<T> inner = traits<T>::decode(v);
    if (!inner) return Unexpected{std::move(inner).error()};
    return P(new T(*std::move(inner)));
  }
  static bool runs_user_code() noexcept { return detail::runs_user_code<T>(); }
  static bool same(const P& a, const P& b) noexcept { return a == b || (a && b && traits<T>::same(*a, *b)); }
};

template <class Tuple, bool is_pair, class... T>
struct TupleTraits {
  static const Type& type() {
    const Type* const elements[] = {&traits<T>::type()..., nullptr};
    static const Immortal<Type> t(tuple_type(elements, sizeof...(T), is_pair));
    return *t;
  }
  static Value encode(const Tuple& v) { return encode(v, std::index_sequence_for<T...>()); }
  static Result<Tuple> decode(const Value& v) {
    const Value::Sequence* s = v.sequence();
    if (!s || s->size() != sizeof...(T)) return not_a_value_of("a value for each member of the tuple");
    Tuple out{};
    if (Result<void> r = decode(*s, out, std::index_sequence_for<T...>()); !r) return Unexpected{std::move(r).error()};
    return out;
  }
  static bool runs_user_code() noexcept { return (detail::runs_user_code<T>() || ...); }
  static bool same(const Tuple& a, const Tuple& b) noexcept { return same(a, b, std::index_sequence_for<T...>()); }

 private:
  template <std::size_t... i>
  static Value encode([[maybe_unused]] const Tuple& v, std::index_sequence<i...>) {
    Value::Sequence out;
    out.reserve(sizeof...(T));
    (out.push_back(traits<T>::encode(std::get<i>(v))), ...);
    return Value(std::move(out));
  }
  template <class M>
  static bool decode_one(const Value& v, M& member, Result<void>& result) {
    Result<M> r = traits<M>::decode(v);
    if (!r) return result = Unexpected{std::move(r).error()}, false;
    member = *std::move(r);
    return true;
  }
  template <std::size_t... i>
  static Result<void> decode([[maybe_unused]] const Value::Sequence& s, [[maybe_unused]] Tuple& out, std::index_sequence<i...>) {
    Result<void> result;
    (void)(decode_one<T>(s[i], std::get<i>(out), result) && ...);
    return result;
  }
  template <std::size_t... i>
  static bool same([[maybe_unused]] const Tuple& a, [[maybe_unused]] const Tuple& b, std::index_sequence<i...>) noexcept {
    return (traits<T>::same(std::get<i>(a), std::get<i>(b)) && ...);
  }
};

/// Traits of a container of bytes: base64.
template <class Bytes>
struct BytesTraits {
  static Value encode(const Bytes& v) { return encode_bytes(v.data(), v.size()); }
  static bool runs_user_code() noexcept { return false; }
  static bool same(const Bytes& a, const Bytes& b) noexcept { return a == b; }
};
}  // namespace detail

/// A value that may be absent, as std::optional: nullptr is absent. Of a std::shared_ptr<const T> each decoded value is a
/// new object. Not for arrays, and not with a deleter of your own.
template <class T>
struct traits<std::unique_ptr<T>, std::enable_if_t<!std::is_array_v<T>>> : detail::OwnerTraits<std::unique_ptr<T>, std::remove_const_t<T>> {};
/// As std::unique_ptr.
template <class T>
struct traits<std::shared_ptr<T>, std::enable_if_t<!std::is_array_v<T>>> : detail::OwnerTraits<std::shared_ptr<T>, std::remove_const_t<T>> {};
/// @cond internal
template <class T, class Delete>
struct traits<std::unique_ptr<T, Delete>, std::enable_if_t<std::is_array_v<T> || !std::is_same_v<Delete, std::default_delete<T>>>>
    : detail::Refused<std::unique_ptr<T, Delete>, detail::Refusal::pointer> {};
template <class T>
struct traits<std::shared_ptr<T>, std::enable_if_t<std::is_array_v<T>>> : detail::Refused<std::shared_ptr<T>, detail::Refusal::pointer> {};
/// @endcond

/// Pairs, as records with the fields `first` and `second`: rdf:_1 and rdf:_2 of a rdf:Seq. Both have the bounds of their
/// own type only.
template <class A, class B>
struct traits<std::pair<A, B>> : detail::TupleTraits<std::pair<A, B>, true, A, B> {};
/// Tuples, as records with the fields `0`, `1` and so on, as std::get() counts them: rdf:_1, rdf:_2 ... of a rdf:Seq.
template <class... T>
struct traits<std::tuple<T...>> : detail::TupleTraits<std::tuple<T...>, false, T...> {};

/// A byte, as a number: xsd:unsignedByte.
template <>
struct traits<std::byte> {
  static const Type& type() { return detail::byte_type(); }
  static Value encode(std::byte v) { return Value(std::uint64_t{std::to_integer<std::uint8_t>(v)}); }
  static Result<std::byte> decode(const Value& v) {
    if (const std::int64_t* i = v.integer(); i && *i >= 0 && *i <= 255) return static_cast<std::byte>(*i);
    return detail::not_a_value_of("an integer from 0 to 255");
  }
  static bool runs_user_code() noexcept { return false; }
  static bool same(std::byte a, std::byte b) noexcept { return a == b; }
};

/// Bytes, as xsd:base64Binary: a text in JSON, a byte string in CBOR. Facets::length() counts bytes. A std::vector of
/// std::uint8_t is a list of numbers, because that is what it says; Property::octets() and representation() write large data
/// without base64.
template <>
struct traits<std::vector<std::byte>> : detail::BytesTraits<std::vector<std::byte>> {
  static const Type& type() {
    static const Immortal<Type> t(detail::bytes_type(0, std::numeric_limits<std::size_t>::max()));
    return *t;
  }
  static Result<std::vector<std::byte>> decode(const Value& v) {
    const Result<std::string> found = detail::decode_bytes(v);
    if (!found) return Unexpected{found.error()};
    std::vector<std::byte> out(found->size());
    if (!out.empty()) std::memcpy(out.data(), found->data(), out.size());
    return out;
  }
};
/// Exactly N bytes, as xsd:base64Binary.
template <std::size_t N>
struct traits<std::array<std::byte, N>> : detail::BytesTraits<std::array<std::byte, N>> {
  static const Type& type() {
    static const Immortal<Type> t(detail::bytes_type(N, N));
    return *t;
  }
  static Result<std::array<std::byte, N>> decode(const Value& v) {
    const Result<std::string> found = detail::decode_bytes(v);
    if (!found) return Unexpected{found.error()};
    if (found->size() != N) return detail::not_a_value_of("base64 of the array's length");
    std::array<std::byte, N> out{};
    if constexpr (N > 0) std::memcpy(out.data(), found->data(), N);
    return out;
  }
};

namespace detail {
/// std::byte[N]: as std::array.
template <std::size_t N>
struct OperationsOf<std::byte[N]> {
  static const Type& type() { return traits<std::array<std::byte, N>>::type(); }
  static Value encode(const void* member) { return encode_bytes(static_cast<const std::byte*>(member), N); }
  static Result<void> decode(const Value& v, void* member) {
    const auto found = traits<std::array<std::byte, N>>::decode(v);
    if (!found) return Unexpected{found.error()};
    std::memcpy(member, found->data(), N);
    return {};
  }
  static bool same(const void* a, const void* b) noexcept { return std::memcmp(a, b, N) == 0; }
  static bool runs_user_code() noexcept { return false; }
};
}  // namespace detail

/// @cond internal
template <class E>
template <std::int64_t low, std::int64_t high>
Enumeration<E>& Enumeration<E>::name_all() {
  using Number = std::underlying_type_t<E>;
  using Limits = std::numeric_limits<Number>;
  if constexpr (!detail::HasFixedType<E>::value) {
    (void)detail::refuse<E, detail::Refusal::plain_enum>();
  } else {
    constexpr std::int64_t first = std::is_unsigned_v<Number> || low >= static_cast<std::int64_t>(Limits::min())
                                       ? (std::is_unsigned_v<Number> && low < 0 ? 0 : low)
                                       : static_cast<std::int64_t>(Limits::min());
    constexpr std::int64_t last =
        high < 0 || static_cast<std::uint64_t>(high) <= static_cast<std::uint64_t>(Limits::max()) ? high : static_cast<std::int64_t>(Limits::max());
    static_assert(first <= last && last - first < 1024, "lrt: name_all() names at most 1024 values, from the lower to the higher one");
    if constexpr (first <= last && last - first < 1024) {
      names_.add_all(detail::name_of_range<E, first>(std::make_index_sequence<static_cast<std::size_t>(last - first + 1)>()),
                     static_cast<std::uint64_t>(first), false);
      constexpr std::size_t bits = static_cast<std::size_t>(Limits::digits);
      if constexpr (low == detail::lowest_named<E> && high == detail::highest_named<E> && sizeof(E) > 1)
        names_.add_all(detail::name_of_powers<E, 7>(std::make_index_sequence<bits - 7>()), 128, true);
    }
  }
  return *this;
}
/// @endcond

}  // namespace v0
}  // namespace lrt::rdf
