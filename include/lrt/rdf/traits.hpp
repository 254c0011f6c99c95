#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/value.hpp>

namespace lrt::rdf {

namespace detail {
template <class T>
inline constexpr bool always_false = false;

const Type& boolean_type() noexcept;
const Type& text_type() noexcept;
const Type& float_type() noexcept;
const Type& double_type() noexcept;
const Type& duration_type() noexcept;
const Type& instant_type() noexcept;
Type integer_type(std::int64_t lowest, std::uint64_t highest, std::size_t bytes);
Type list_type(const Type& element, std::size_t shortest, std::size_t longest);
Type optional_type(const Type& element);
Unexpected not_a_value_of(const char* what);
Unexpected does_not_fit(const char* what);
}  // namespace detail

/// Maps a C++ type to RDF and to every other representation. lrt provides it for bool, integers, float, double, std::string, durations,
/// system_clock time points, and std::array, std::vector and std::optional of these. For your own structs and enums derive a
/// specialisation from Record or Enumeration. Every specialisation has four members:
///
///   static const Type& type();                          // the same object at every call
///   static Value encode(const T& value);                // a Value of that type
///   static Result<T> decode(const Value& value);        // may refuse values that the Type allows
///   static bool same(const T& a, const T& b) noexcept;  // true: both have the same representations; no allocation
template <class T, class Enable = void>
struct traits {
  static_assert(detail::always_false<T>,
                "lrt: this type has no rdf::traits. For a struct write: template <> struct lrt::rdf::traits<S> : lrt::rdf::Record<S> "
                "{ static void describe(Record<S>& r) { r.field(\"x\", &S::x); } };   for an enum: template <> struct "
                "lrt::rdf::traits<E> : lrt::rdf::Enumeration<E> { static void describe(Enumeration<E>& e) { e.name(E::a, \"a\"); } };");
};

template <>
struct traits<bool> {
  static const Type& type() noexcept { return detail::boolean_type(); }
  static Value encode(bool v) { return Value(v); }
  static Result<bool> decode(const Value& v) {
    if (const bool* b = v.boolean()) return *b;
    return detail::not_a_value_of("a boolean");
  }
  static bool same(bool a, bool b) noexcept { return a == b; }
};

/// The integer types, as xsd:byte ... xsd:unsignedLong by their size. Character types are not numbers.
template <class T>
struct traits<T, std::enable_if_t<std::is_integral_v<T> && !std::is_same_v<T, bool> && !std::is_same_v<T, char> &&
                                  !std::is_same_v<T, wchar_t> && !std::is_same_v<T, char16_t> && !std::is_same_v<T, char32_t>>> {
  static const Type& type() {
    static const Type t = detail::integer_type(static_cast<std::int64_t>(std::numeric_limits<T>::min()),
                                               static_cast<std::uint64_t>(std::numeric_limits<T>::max()), sizeof(T));
    return t;
  }
  static Value encode(T v) {
    if constexpr (std::is_signed_v<T>) return Value(static_cast<std::int64_t>(v));
    else return Value(static_cast<std::uint64_t>(v));
  }
  static Result<T> decode(const Value& v) {
    if (const std::int64_t* i = v.integer()) {
      if constexpr (std::is_signed_v<T>) {
        if (*i >= std::numeric_limits<T>::min() && *i <= std::numeric_limits<T>::max()) return static_cast<T>(*i);
      } else {
        if (*i >= 0 && static_cast<std::uint64_t>(*i) <= std::numeric_limits<T>::max()) return static_cast<T>(*i);
      }
      return detail::does_not_fit("an integer");
    }
    if (const std::uint64_t* u = v.large_integer()) {
      if constexpr (!std::is_signed_v<T>) {
        if (*u <= std::numeric_limits<T>::max()) return static_cast<T>(*u);
      }
      return detail::does_not_fit("an integer");
    }
    return detail::not_a_value_of("an integer");
  }
  static bool same(T a, T b) noexcept { return a == b; }
};

/// float as xsd:float, double as xsd:double: the shortest decimal that reads back bit-identically.
template <class T>
struct traits<T, std::enable_if_t<std::is_same_v<T, float> || std::is_same_v<T, double>>> {
  static const Type& type() noexcept {
    if constexpr (std::is_same_v<T, float>) return detail::float_type();
    else return detail::double_type();
  }
  static Value encode(T v) { return Value(static_cast<double>(v)); }
  static Result<T> decode(const Value& v) {
    if (const double* d = v.real()) return static_cast<T>(*d);
    return detail::not_a_value_of("a number");
  }
  static bool same(T a, T b) noexcept { return std::memcmp(&a, &b, sizeof(T)) == 0; }
};

/// Text in UTF-8. Ill-formed bytes are replaced by U+FFFD in representations.
template <>
struct traits<std::string> {
  static const Type& type() noexcept { return detail::text_type(); }
  static Value encode(const std::string& v) { return Value(v); }
  static Result<std::string> decode(const Value& v) {
    if (const std::string* s = v.text()) return *s;
    return detail::not_a_value_of("a text");
  }
  static bool same(const std::string& a, const std::string& b) noexcept { return a == b; }
};

/// Durations as xsd:dayTimeDuration, to the nanosecond, at most 292 years.
template <class Rep, class Period>
struct traits<std::chrono::duration<Rep, Period>> {
  using T = std::chrono::duration<Rep, Period>;
  static const Type& type() noexcept { return detail::duration_type(); }
  static Value encode(const T& v) {
    return Value(static_cast<std::int64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(v).count()));
  }
  static Result<T> decode(const Value& v) {
    if (const std::int64_t* ns = v.integer()) return std::chrono::duration_cast<T>(std::chrono::nanoseconds(*ns));
    return detail::not_a_value_of("a duration");
  }
  static bool same(const T& a, const T& b) noexcept { return a == b; }
};

/// Instants as xsd:dateTime in UTC.
template <class Duration>
struct traits<std::chrono::time_point<std::chrono::system_clock, Duration>> {
  using T = std::chrono::time_point<std::chrono::system_clock, Duration>;
  static const Type& type() noexcept { return detail::instant_type(); }
  static Value encode(const T& v) {
    return Value(static_cast<std::int64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(v.time_since_epoch()).count()));
  }
  static Result<T> decode(const Value& v) {
    if (const std::int64_t* ns = v.integer()) return T(std::chrono::duration_cast<Duration>(std::chrono::nanoseconds(*ns)));
    return detail::not_a_value_of("an instant");
  }
  static bool same(const T& a, const T& b) noexcept { return a == b; }
};

namespace detail {
template <class T, class Sequence>
Value encode_list(const Sequence& members) {
  Value::Sequence out;
  out.reserve(members.size());
  for (const auto& m : members) out.push_back(traits<T>::encode(m));
  return Value(std::move(out));
}
}  // namespace detail

/// Fixed arrays as RDF lists of exactly N members, in order.
template <class T, std::size_t N>
struct traits<std::array<T, N>> {
  static const Type& type() {
    static const Type t = detail::list_type(traits<T>::type(), N, N);
    return t;
  }
  static Value encode(const std::array<T, N>& v) { return detail::encode_list<T>(v); }
  static Result<std::array<T, N>> decode(const Value& v) {
    const Value::Sequence* s = v.sequence();
    if (!s || s->size() != N) return detail::not_a_value_of("a list of the array's length");
    std::array<T, N> out{};
    for (std::size_t i = 0; i < N; ++i) {
      Result<T> member = traits<T>::decode((*s)[i]);
      if (!member) return Unexpected{std::move(member).error()};
      out[i] = *std::move(member);
    }
    return out;
  }
  static bool same(const std::array<T, N>& a, const std::array<T, N>& b) noexcept {
    for (std::size_t i = 0; i < N; ++i)
      if (!traits<T>::same(a[i], b[i])) return false;
    return true;
  }
};

/// Vectors as RDF lists, in order.
template <class T>
struct traits<std::vector<T>> {
  static const Type& type() {
    static const Type t = detail::list_type(traits<T>::type(), 0, std::numeric_limits<std::size_t>::max());
    return t;
  }
  static Value encode(const std::vector<T>& v) { return detail::encode_list<T>(v); }
  static Result<std::vector<T>> decode(const Value& v) {
    const Value::Sequence* s = v.sequence();
    if (!s) return detail::not_a_value_of("a list");
    std::vector<T> out;
    out.reserve(s->size());
    for (const Value& m : *s) {
      Result<T> member = traits<T>::decode(m);
      if (!member) return Unexpected{std::move(member).error()};
      out.push_back(*std::move(member));
    }
    return out;
  }
  static bool same(const std::vector<T>& a, const std::vector<T>& b) noexcept {
    if (a.size() != b.size()) return false;
    for (std::size_t i = 0; i < a.size(); ++i)
      if (!traits<T>::same(a[i], b[i])) return false;
    return true;
  }
};

/// A value that may be absent. An absent value has no triple.
template <class T>
struct traits<std::optional<T>> {
  static const Type& type() {
    static const Type t = detail::optional_type(traits<T>::type());
    return t;
  }
  static Value encode(const std::optional<T>& v) { return v ? traits<T>::encode(*v) : Value(); }
  static Result<std::optional<T>> decode(const Value& v) {
    if (v.is_null()) return std::optional<T>();
    Result<T> inner = traits<T>::decode(v);
    if (!inner) return Unexpected{std::move(inner).error()};
    return std::optional<T>(*std::move(inner));
  }
  static bool same(const std::optional<T>& a, const std::optional<T>& b) noexcept {
    return a.has_value() == b.has_value() && (!a || traits<T>::same(*a, *b));
  }
};

/// Base of `traits` for an enum. Its values are strings from a closed set of names.
template <class E>
class Enumeration {
 public:
  Enumeration& name(E value, std::string text) {
    type_.names.push_back(std::move(text));
    values_.push_back(value);
    return *this;
  }

  static const Type& type() { return instance().type_; }
  static Value encode(const E& v) {
    const Enumeration& self = instance();
    for (std::size_t i = 0; i < self.values_.size(); ++i)
      if (self.values_[i] == v) return Value(self.type_.names[i]);
    return Value();
  }
  static Result<E> decode(const Value& v) {
    const Enumeration& self = instance();
    if (const std::string* s = v.text())
      for (std::size_t i = 0; i < self.values_.size(); ++i)
        if (self.type_.names[i] == *s) return self.values_[i];
    return detail::not_a_value_of("one of the names");
  }
  static bool same(const E& a, const E& b) noexcept { return a == b; }

 private:
  static const Enumeration& instance() {
    static const Enumeration self = [] {
      Enumeration e;
      e.type_.kind = Type::Kind::enumeration;
      e.type_.datatype = vocab::xsd::string;
      traits<E>::describe(e);
      return e;
    }();
    return self;
  }
  Type type_;
  std::vector<E> values_;
};

/// Base of `traits` for a struct. The user lists its fields. A field is optional if its C++ type is std::optional, and only then.
template <class S>
class Record {
 public:
  /// Adds an rdf:type.
  Record& is(Iri type) { return type_.classes.emplace_back(type.text), *this; }
  /// Adds a field with a vocabulary term as its predicate. Returns the field's facets, for unit and bounds.
  template <class M>
  Facets& field(Iri predicate, M S::*member) {
    const std::size_t at = predicate.text.find_last_of("#/");
    return add(std::string(at == std::string_view::npos ? predicate.text : predicate.text.substr(at + 1)), std::string(predicate.text),
               member);
  }
  /// Adds a field with a name of your own. Its predicate is `<blueprint#name>`, which the Thing's Blueprint documents.
  template <class M>
  Facets& field(std::string_view name, M S::*member) {
    return add(std::string(name), "#" + std::string(name), member);
  }

  static const Type& type() { return instance().type_; }
  static Value encode(const S& v) {
    const Record& self = instance();
    Value::Sequence out;
    out.reserve(self.members_.size());
    for (const auto& m : self.members_) out.push_back(m->encode(v));
    return Value(std::move(out));
  }
  static Result<S> decode(const Value& v) {
    const Record& self = instance();
    const Value::Sequence* s = v.sequence();
    if (!s || s->size() != self.members_.size()) return detail::not_a_value_of("a record");
    S out{};
    for (std::size_t i = 0; i < self.members_.size(); ++i)
      if (Result<void> r = self.members_[i]->decode((*s)[i], out); !r) return Unexpected{std::move(r).error()};
    return out;
  }
  static bool same(const S& a, const S& b) noexcept {
    for (const auto& m : instance().members_)
      if (!m->same(a, b)) return false;
    return true;
  }

 private:
  struct Member {
    virtual ~Member() = default;
    virtual Value encode(const S&) const = 0;
    virtual Result<void> decode(const Value&, S&) const = 0;
    virtual bool same(const S&, const S&) const noexcept = 0;
  };
  template <class M>
  struct MemberOf final : Member {
    explicit MemberOf(M S::*p) : pointer(p) {}
    Value encode(const S& s) const override { return traits<M>::encode(s.*pointer); }
    Result<void> decode(const Value& v, S& s) const override {
      Result<M> r = traits<M>::decode(v);
      if (!r) return Unexpected{std::move(r).error()};
      s.*pointer = *std::move(r);
      return {};
    }
    bool same(const S& a, const S& b) const noexcept override { return traits<M>::same(a.*pointer, b.*pointer); }
    M S::*pointer;
  };

  template <class M>
  Facets& add(std::string name, std::string predicate, M S::*member) {
    members_.push_back(std::make_unique<MemberOf<M>>(member));
    type_.fields.push_back({std::move(name), std::move(predicate), &traits<M>::type(), {}});
    return type_.fields.back().facets;
  }
  static const Record& instance() {
    static const Record self = [] {
      Record r;
      r.type_.kind = Type::Kind::record;
      traits<S>::describe(r);
      return r;
    }();
    return self;
  }
  Type type_;
  std::vector<std::unique_ptr<Member>> members_;
};

namespace detail {
/// The type in which a lambda's result is stored. Text views become std::string.
template <class T>
struct stored {
  using type = std::decay_t<T>;
};
template <>
struct stored<const char*> {
  using type = std::string;
};
template <>
struct stored<std::string_view> {
  using type = std::string;
};
template <class T>
using stored_t = typename stored<std::decay_t<T>>::type;
}  // namespace detail

}  // namespace lrt::rdf
