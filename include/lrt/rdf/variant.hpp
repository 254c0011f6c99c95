// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>

#include <lrt/base/immortal.hpp>
#include <lrt/base/result.hpp>
#include <lrt/rdf/detail/alternatives.hpp>
#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/value.hpp>

namespace lrt::rdf {
inline namespace v0 {

/// @cond internal
namespace detail {
template <class... T>
std::variant<T...> variant_of(const std::variant<T...>*);
/// The std::variant that V is or derives from.
template <class V>
using VariantOf = decltype(variant_of(static_cast<const V*>(nullptr)));
template <class V, std::size_t index>
using AlternativeOf = std::remove_cv_t<std::variant_alternative_t<index, VariantOf<V>>>;

template <class T, class... All>
inline constexpr std::size_t occurrences = (std::size_t{0} + ... + (std::is_same_v<T, All> ? 1 : 0));

template <class T, class V>
struct AlternativesOfType;
template <class T, class... All>
struct AlternativesOfType<T, std::variant<All...>> {
  static constexpr std::size_t count = occurrences<T, std::remove_cv_t<All>...>;
  static constexpr bool are_unique = ((occurrences<std::remove_cv_t<All>, std::remove_cv_t<All>...> == 1) && ...);
  static constexpr std::size_t index() noexcept {
    std::size_t at = 0;
    bool found = false;
    ((found = found || std::is_same_v<T, std::remove_cv_t<All>>, at += found ? 0 : 1), ...);
    return at;
  }
};

template <class V, std::size_t index>
struct AlternativeAt {
  using T = AlternativeOf<V, index>;
  static_assert(!may_be_absent<T>,
                "lrt: an alternative of a variant cannot be absent; write the variant without std::optional and add std::monostate");

  static const void* find(const void* variant) noexcept {
    return std::get_if<index>(static_cast<const VariantOf<V>*>(static_cast<const V*>(variant)));
  }
  static Result<void> decode(const Value& v, void* made) {
    Result<T> r = traits<T>::decode(v);
    if (!r) return Unexpected{std::move(r).error()};
    std::optional<V>& out = *static_cast<std::optional<V>*>(made);
    if constexpr (std::is_constructible_v<V, std::in_place_index_t<index>, T>) out.emplace(std::in_place_index<index>, *std::move(r));
    else out.emplace(V{VariantOf<V>(std::in_place_index<index>, *std::move(r))});
    return {};
  }
};

template <class V, class Indices = std::make_index_sequence<std::variant_size_v<VariantOf<V>>>>
struct AlternativesTable;
template <class V, std::size_t... index>
struct AlternativesTable<V, std::index_sequence<index...>> {
  static constexpr AlternativeOperations all[] = {{&operations_of<AlternativeOf<V, index>>, type_name<AlternativeOf<V, index>>,
                                                   AlternativeAt<V, index>::find, AlternativeAt<V, index>::decode}...};
};

LRT_API const Type& nothing_type() noexcept;
}  // namespace detail
/// @endcond

/// Nothing, as an alternative of a variant: a node without triples, {} in JSON and CBOR.
template <>
struct traits<std::monostate> {
  static const Type& type() noexcept { return detail::nothing_type(); }
  static Value encode(std::monostate) { return Value(Value::Sequence()); }
  static Result<std::monostate> decode(const Value& v) {
    if (v.sequence() && v.sequence()->empty()) return std::monostate();
    return detail::not_a_value_of("an object without members");
  }
  static bool runs_user_code() noexcept { return false; }
  static bool same(std::monostate, std::monostate) noexcept { return true; }
};

/// Base of rdf::traits for a std::variant, or for a struct that derives from one. A value is exactly one alternative, and
/// its name says which:
///
///     using Motion = std::variant<MoveJ, MoveL>;   // {"moveJ": {...}} or {"moveL": {...}}
///
/// A std::variant whose alternatives have names of their own needs no traits. The name of a struct or an enum is that of
/// the C++ type, with small letters where it begins: MoveJ is "moveJ", PIDGains "pidGains". Other types are "boolean",
/// "integer", "number", "text", "duration", "instant", "list", "map", and std::monostate is "none". For other names, and
/// for two alternatives of one type:
///
///     using Target = std::variant<double, double, std::string>;
///     template <>
///     struct lrt::rdf::traits<Target> : lrt::rdf::Variant<Target> {
///       static void describe(Variant<Target>& v) {
///         v.named("Target");
///         v.alternative<0>("angle").unit(lrt::unit::radian).between(-3, 3);
///         v.alternative<1>("height").unit(lrt::unit::metre);
///         v.alternative<std::string>("place");
///       }
///     };
///
/// In RDF a variant is a node with exactly one predicate, that of the active alternative, as a record with one field is;
/// terms and classes are those of Record. A variant without named() has the names of its alternatives: `MoveJ-or-MoveL`.
/// So its terms change if an alternative is added: give one that you keep a name. A body with no alternative or with
/// several is refused: 422.
///
/// A variant that is valueless by an exception has no representation: a read that returns it is answered with 500, an
/// action whose output it is fails, and a published one is logged as an error and is like no value.
///
/// If two alternatives have the same name, or one has none, Server::add() returns invalid_option.
///
/// @par Threads  describe() runs once, at the first use. Encoding and decoding run where rdf::traits says.
template <class V>
class Variant {
 public:
  /// Adds an rdf:type.
  Variant& is(Iri type) { return alternatives_.add_class(type.text), *this; }
  /// Sets the name of the variant in the server's vocabulary, as Record::named().
  Variant& named(std::string_view name) { return alternatives_.set_name(name), *this; }
  /// Sets the name and the predicate of an alternative, by its index.
  /// @return  the facets of its values; valid as long as the process runs
  template <std::size_t index>
  Facets& alternative(FieldName name) {
    static_assert(index < std::variant_size_v<detail::VariantOf<V>>, "lrt: the variant has no alternative with this index");
    return alternatives_.name(index, std::move(name));
  }
  /// Sets the name and the predicate of an alternative, by its type if that occurs once.
  /// @return  the facets of its values; valid as long as the process runs
  template <class T>
  Facets& alternative(FieldName name) {
    using All = detail::AlternativesOfType<T, detail::VariantOf<V>>;
    static_assert(All::count != 0, "lrt: the variant has no alternative of this type");
    static_assert(All::count < 2, "lrt: the variant has several alternatives of this type; name them by index: alternative<0>(\"name\")");
    return alternatives_.name(All::index(), std::move(name));
  }

  static const Type& type() {
    if (const Type* fault = detail::Describing::type_within(reinterpret_cast<detail::Describing::Key>(&Variant::type))) return *fault;
    return instance().alternatives_.type();
  }
  static Value encode(const V& v) { return instance().alternatives_.encode(std::addressof(v)); }
  static Result<V> decode(const Value& v) {
    std::optional<V> made;
    if (Result<void> r = instance().alternatives_.decode(v, std::addressof(made)); !r) return Unexpected{std::move(r).error()};
    return *std::move(made);
  }
  static bool runs_user_code() noexcept { return &traits<V>::encode != &Variant::encode || instance().alternatives_.runs_user_code(); }
  static bool same(const V& a, const V& b) noexcept { return instance().alternatives_.same(std::addressof(a), std::addressof(b)); }

  /// @cond internal
  struct Described {};
  explicit Variant(Described, const detail::Describing& = detail::Describing(reinterpret_cast<detail::Describing::Key>(&Variant::type)))
      : alternatives_(detail::AlternativesTable<V>::all, std::variant_size_v<detail::VariantOf<V>>,
                      std::is_same_v<V, detail::VariantOf<V>> ? std::string_view() : detail::type_name<V>()) {
    traits<V>::describe(*this);
    alternatives_.finish();
  }
  /// @endcond

 private:
  [[gnu::noinline]] static const Variant& instance() {
    static const Immortal<Variant> self(Described{});
    return *self;
  }
  detail::Alternatives alternatives_;
};

/// Variants whose alternatives have names of their own: see Variant.
template <class... T>
struct traits<std::variant<T...>> : Variant<std::variant<T...>> {
  /// Gives no names.
  static void describe(Variant<std::variant<T...>>&) {
    static_assert(detail::AlternativesOfType<void, std::variant<T...>>::are_unique,
                  "lrt: two alternatives of this std::variant have the same type, so that their names do not say which one it is; give each a name: "
                  "template <> struct lrt::rdf::traits<V> : lrt::rdf::Variant<V> { static void describe(Variant<V>& v) { "
                  "v.alternative<0>(\"first\"); v.alternative<1>(\"second\"); } };");
  }
};

}  // namespace v0
}  // namespace lrt::rdf
