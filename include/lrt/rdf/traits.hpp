// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <unordered_map>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/immortal.hpp>
#include <lrt/base/result.hpp>
#include <lrt/rdf/detail/found_traits.hpp>
#include <lrt/rdf/detail/record_fields.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/value.hpp>

namespace lrt::rdf {
inline namespace v0 {

namespace detail {
// Sentences for types without traits. They are in functions because a class whose own static_assert fails causes further errors.
template <class... T>
auto a_c_array() {
  static_assert(always_false<T...>,
                "lrt: a C array has rdf::traits only as the data member of a Record; write std::array or std::vector, for char[N] std::string");
}
template <class... T>
auto a_result() {
  static_assert(always_false<T...>,
                "lrt: a Result is no value; only actions, on_write and on_create may return one; write std::optional for a value that may be absent");
}

LRT_API const Type& boolean_type() noexcept;
LRT_API const Type& float_type() noexcept;
LRT_API const Type& double_type() noexcept;
LRT_API const Type& duration_type() noexcept;
LRT_API const Type& instant_type() noexcept;
LRT_API Type integer_type(std::int64_t lowest, std::uint64_t highest, std::size_t bytes);
LRT_API Type optional_type(const Type& element);
LRT_API Unexpected does_not_fit(const char* what);
LRT_API Unexpected read_only();
/// How many periods of `num` / `den` seconds a duration or an instant has.
/// @par Errors  expected_value: it is no whole number of them, or one below `lowest` or above `highest`
LRT_API Result<std::int64_t> periods_of(std::int64_t nanoseconds, std::int64_t num, std::int64_t den, std::int64_t lowest, std::uint64_t highest,
                                        bool is_instant);

/// The Duration of so many nanoseconds. One that counts in integers must have it exactly.
template <class Duration>
Result<Duration> duration_of(std::int64_t nanoseconds, bool is_instant) {
  using Rep = typename Duration::rep;
  using Period = typename Duration::period;
  if constexpr (std::is_integral_v<Rep>) {
    const Result<std::int64_t> periods = periods_of(nanoseconds, Period::num, Period::den, static_cast<std::int64_t>(std::numeric_limits<Rep>::min()),
                                                    static_cast<std::uint64_t>(std::numeric_limits<Rep>::max()), is_instant);
    if (!periods) return Unexpected{periods.error()};
    return Duration(static_cast<Rep>(*periods));
  } else {
    return std::chrono::duration_cast<Duration>(std::chrono::nanoseconds(nanoseconds));
  }
}
}  // namespace detail

/// Converts a C++ type to and from RDF and every other representation.
///
/// lrt has traits of bool, numbers, std::string, std::filesystem::path, durations, time points of system_clock; of the
/// containers of the standard library and others that are like them; of std::optional, std::unique_ptr, std::shared_ptr,
/// std::variant (lrt/rdf/variant.hpp), std::pair, std::tuple and std::bitset, and of bytes (lrt/rdf/standard_types.hpp);
/// lrt/eigen.hpp has those for Eigen. An enum with a fixed underlying type has its enumerators. For your own structs write
/// LRT_RECORD (lrt/rdf/macros.hpp), or derive a specialisation from Record, and for other enums from Enumeration. For
/// another type a static_assert says what to write.
///
/// Every specialisation has four static members:
///
///     const Type& type();                          // the same object at every call
///     Value encode(const T& value);                // a Value of that type
///     Result<T> decode(const Value& value);        // may refuse values that the Type allows
///     bool same(const T& a, const T& b) noexcept;  // true: both have the same representations; does not allocate
///
/// @par Errors   decode(): expected_value, if the value is not a T; the client gets 422. An exception of encode(): 500.
/// @par Threads  Any, also concurrently: the members have no state. encode() of a pulled property and decode() of what
///               a client sends run on the thread of the user's lambda (see Dispatch). Of a pushed property, publish()
///               calls same() on the publishing thread, and the engine's thread calls encode() unless traits of the
///               user take part.
/// @par Units    The unit of a number is stated by the property, action or field (Facets::unit). Numbers are never
///               converted.
/// @par Implements  R1.5, R1.11, paper 5.2
template <class T, class Enable>
struct traits : detail::FoundTraits<T> {};

/// @cond internal
// Types that have no traits, with what to write instead. FoundTraits has the others.
template <class T, std::size_t N>
struct traits<T[N]> : detail::NoTraits<T[N]> {
  using Sentence = decltype(detail::a_c_array<T>());
};
template <class T>
struct traits<Result<T>> : detail::NoTraits<Result<T>> {
  using Sentence = decltype(detail::a_result<T>());
};
/// @endcond

/// A truth value, as xsd:boolean.
template <>
struct traits<bool> {
  static const Type& type() noexcept { return detail::boolean_type(); }
  static Value encode(bool v) { return Value(v); }
  static Result<bool> decode(const Value& v) {
    if (const bool* b = v.boolean()) return *b;
    return detail::not_a_value_of("a boolean");
  }
  static bool runs_user_code() noexcept { return false; }
  static bool same(bool a, bool b) noexcept { return a == b; }
};

/// Integers, by their size and sign: xsd:byte, short, int, long, unsignedByte, unsignedShort, unsignedInt,
/// unsignedLong. Character types have no traits; std::int8_t and std::uint8_t are numbers. A value outside the range of
/// T is refused: expected_value.
template <class T>
struct traits<T, std::enable_if_t<std::is_integral_v<T> && !std::is_same_v<T, bool> && !detail::is_character<T> && sizeof(T) <= 8>> {
  static const Type& type() {
    static const Immortal<Type> t(detail::integer_type(static_cast<std::int64_t>(std::numeric_limits<T>::min()),
                                                       static_cast<std::uint64_t>(std::numeric_limits<T>::max()), sizeof(T)));
    return *t;
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
  static bool runs_user_code() noexcept { return false; }
  static bool same(T a, T b) noexcept { return a == b; }
};

/// Floating-point numbers: float as xsd:float, double as xsd:double. The text is the shortest decimal that reads back
/// bit-identically. NaN and infinities of the robot are represented; those of clients are refused unless
/// Facets::allow_non_finite() is set.
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
  static bool runs_user_code() noexcept { return false; }
  static bool same(T a, T b) noexcept { return std::memcmp(&a, &b, sizeof(T)) == 0; }
};

/// Text in UTF-8, as xsd:string. Ill-formed bytes are replaced by U+FFFD in representations.
template <>
struct traits<std::string> {
  static const Type& type() noexcept { return detail::text_type(); }
  static Value encode(const std::string& v) { return Value(v); }
  static Result<std::string> decode(const Value& v) {
    if (const std::string* s = v.text()) return *s;
    return detail::not_a_value_of("a text");
  }
  static bool runs_user_code() noexcept { return false; }
  static bool same(const std::string& a, const std::string& b) noexcept { return a == b; }
};

/// Durations, as xsd:dayTimeDuration in nanoseconds, at most 292 years. A duration from a client is refused if T counts
/// in integers and it is no whole number of the period of T: expected_value.
template <class Rep, class Period>
struct traits<std::chrono::duration<Rep, Period>> {
  using T = std::chrono::duration<Rep, Period>;
  static const Type& type() noexcept { return detail::duration_type(); }
  static Value encode(const T& v) { return Value(static_cast<std::int64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(v).count())); }
  static Result<T> decode(const Value& v) {
    if (const std::int64_t* ns = v.integer()) return detail::duration_of<T>(*ns, false);
    return detail::not_a_value_of("a duration");
  }
  static bool runs_user_code() noexcept { return false; }
  static bool same(const T& a, const T& b) noexcept { return a == b; }
};

/// Instants of the system clock, as xsd:dateTime in UTC, in nanoseconds within 292 years of 1970. An instant from a
/// client is refused if `Duration` cannot hold it exactly, as a duration is: expected_value.
template <class Duration>
struct traits<std::chrono::time_point<std::chrono::system_clock, Duration>> {
  using T = std::chrono::time_point<std::chrono::system_clock, Duration>;
  static const Type& type() noexcept { return detail::instant_type(); }
  static Value encode(const T& v) {
    return Value(static_cast<std::int64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(v.time_since_epoch()).count()));
  }
  static Result<T> decode(const Value& v) {
    const std::int64_t* const ns = v.integer();
    if (!ns) return detail::not_a_value_of("an instant");
    const Result<Duration> since_epoch = detail::duration_of<Duration>(*ns, true);
    if (!since_epoch) return Unexpected{since_epoch.error()};
    return T(*since_epoch);
  }
  static bool runs_user_code() noexcept { return false; }
  static bool same(const T& a, const T& b) noexcept { return a == b; }
};

/// Arrays, as RDF lists of exactly N members in order. Unit and bounds are those of each member.
template <class T, std::size_t N>
struct traits<std::array<T, N>> {
  static const Type& type() {
    const Type& element = traits<T>::type();  // before `t`, see Describing
    static const Immortal<Type> t(detail::list_type(element, N, N));
    return *t;
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
  static bool runs_user_code() noexcept { return detail::runs_user_code<T>(); }
  static bool same(const std::array<T, N>& a, const std::array<T, N>& b) noexcept {
    for (std::size_t i = 0; i < N; ++i)
      if (!traits<T>::same(a[i], b[i])) return false;
    return true;
  }
};

/// Vectors, as RDF lists of any length, in order. Unit and bounds are those of each member.
template <class T>
struct traits<std::vector<T>> {
  static const Type& type() {
    const Type& element = traits<T>::type();  // before `t`, see Describing
    static const Immortal<Type> t(detail::list_type(element, 0, std::numeric_limits<std::size_t>::max()));
    return *t;
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
  static bool runs_user_code() noexcept { return detail::runs_user_code<T>(); }
  static bool same(const std::vector<T>& a, const std::vector<T>& b) noexcept {
    if (a.size() != b.size()) return false;
    for (std::size_t i = 0; i < a.size(); ++i)
      if (!traits<T>::same(a[i], b[i])) return false;
    return true;
  }
};

/// A value that may be absent. An absent value has no triple, and null or no member in JSON.
template <class T>
struct traits<std::optional<T>> {
  static const Type& type() {
    const Type& element = traits<T>::type();  // before `t`, see Describing
    static const Immortal<Type> t(detail::optional_type(element));
    return *t;
  }
  static Value encode(const std::optional<T>& v) { return v ? traits<T>::encode(*v) : Value(); }
  static Result<std::optional<T>> decode(const Value& v) {
    if (v.is_null()) return std::optional<T>();
    Result<T> inner = traits<T>::decode(v);
    if (!inner) return Unexpected{std::move(inner).error()};
    return std::optional<T>(*std::move(inner));
  }
  static bool runs_user_code() noexcept { return detail::runs_user_code<T>(); }
  static bool same(const std::optional<T>& a, const std::optional<T>& b) noexcept {
    return a.has_value() == b.has_value() && (!a || traits<T>::same(*a, *b));
  }
};

/// Maps from names to values. In JSON and CBOR: an object with a member for each. In RDF: a list of nodes with
/// schema:name and schema:value, in the byte order of the names. Unit and bounds are those of the values. A name occurs
/// once. The name of an integer is its decimal form, and that of an enumerator is that of its traits.
template <class K, class T, class Less, class Allocator>
struct traits<std::map<K, T, Less, Allocator>> : detail::FoundMap<std::map<K, T, Less, Allocator>> {};
/// As std::map.
template <class K, class T, class Hash, class Equal, class Allocator>
struct traits<std::unordered_map<K, T, Hash, Equal, Allocator>> : detail::FoundMap<std::unordered_map<K, T, Hash, Equal, Allocator>> {};

/// Base of rdf::traits for an enum. Its values are texts from a closed set of names; in RDF xsd:string literals.
///
///     template <>
///     struct lrt::rdf::traits<Mode> : lrt::rdf::Enumeration<Mode> {
///       static void describe(Enumeration<Mode>& e) { e.name(Mode::slow, "slow").name(Mode::fast, "fast"); }
///     };
///
/// Each enumerator has a name, and no two have the same. Server::add() returns invalid_option if one has none, as far as
/// the compiler tells: of a scoped enum, or one with an underlying type, the values 0 to 63 are looked at. A value without
/// a name is encoded as an empty text, which no name is: a read that returns it is answered with 500, an action whose
/// output it is fails, and a published one is logged as an error and is like no value. A name that is not in the set is refused: expected_value.
template <class E>
class Enumeration : lrt_described_anywhere {
 public:
  /// Gives an enumerator its name.
  Enumeration& name(E value, std::string text) { return names_.add(number(value), std::move(text)), *this; }
  /// Sets what people call the enumerator of the last name(), in one language. Each call adds a language:
  /// `e.name(Mode::slow, "slow").title("Slow", "en").title("Langsam", "de")`.
  /// @par Errors  expected_rdf (the language), invalid_option (a language twice): from Server::add()
  Enumeration& title(std::string text, std::string language = {}) { return names_.add_title(std::move(text), std::move(language)), *this; }
  /// Adds a sentence or more about the enumerator of the last name(), see title().
  Enumeration& description(std::string text, std::string language = {}) {
    return names_.add_description(std::move(text), std::move(language)), *this;
  }

  /// Names each enumerator as it is spelled in the program, in the order of the values: those from `low` to `high`, and
  /// without arguments also each power of two. An enumerator outside has no name: so give the range that you use. name()
  /// replaces a name, without_name() removes one. An enum without traits of its own, and without LRT_ENUM, is named so.
  /// @tparam low, high  -16 (0 if the underlying type is unsigned) to 127, or all of one byte; at most 1024 values
  template <std::int64_t low = detail::lowest_named<E>, std::int64_t high = detail::highest_named<E>>
  Enumeration& name_all();
  /// States that an enumerator is no value of its own, such as the number of the others: it has no name.
  Enumeration& without_name(E value) { return names_.add_nameless(number(value)), *this; }

  static const Type& type() { return instance().names_.type(); }
  static Value encode(const E& v) { return instance().names_.encode(number(v)); }
  static Result<E> decode(const Value& v) {
    if (const std::uint64_t* found = instance().names_.find(v)) return static_cast<E>(static_cast<std::underlying_type_t<E>>(*found));
    return detail::not_a_value_of("one of the names");
  }
  static bool runs_user_code() noexcept { return &traits<E>::encode != &Enumeration::encode; }
  static bool same(const E& a, const E& b) noexcept { return a == b; }

  /// @cond internal
  struct Described {};
  explicit Enumeration(Described) {
    traits<E>::describe(*this);
    if constexpr (std::is_base_of_v<detail::NamedByCompiler, traits<E>>) names_.find_nameless({});
    else names_.find_nameless(detail::first_values<E>());
  }
  /// @endcond

 private:
  static std::uint64_t number(E value) noexcept { return static_cast<std::uint64_t>(static_cast<std::underlying_type_t<E>>(value)); }
  [[gnu::noinline]] static const Enumeration& instance() {
    static const Immortal<Enumeration> self(Described{});
    return *self;
  }
  detail::EnumeratorNames names_;
};

namespace detail {
template <class T>
struct Unwrapped {
  using type = T;
};
template <class T>
struct Unwrapped<std::reference_wrapper<T>> {
  using type = std::remove_cv_t<T>;
};
/// The type in which a lambda's result is stored. Text views become std::string, and std::ref(x) a copy of x.
template <class T>
using stored_t = std::conditional_t<is_text_view<std::decay_t<T>>, std::string, typename Unwrapped<std::decay_t<T>>::type>;

template <class T>
inline constexpr bool is_result = false;
template <class T>
inline constexpr bool is_result<Result<T>> = true;
}  // namespace detail

/// Name and predicate of a field of a Record: a vocabulary term, or a name of your own. For an own name the predicate
/// is `<vocabulary>Type/name`, a term of the server's vocabulary (Options::vocabulary): one IRI for all values of the
/// C++ type.
///
/// @par Threads  Distinct objects: any. One object: one thread at a time.
class LRT_API FieldName {
 public:
  // Compiled once: each field has a name.
  /// @{
  /// The constructors are implicit: this is an argument of Record::field(). The name of a term is the part after its
  /// last '#' or '/'.
  FieldName(Iri term);                // NOLINT: an argument of field()
  FieldName(std::string_view own);    // NOLINT
  FieldName(const std::string& own);  // NOLINT
  FieldName(const char* own);         // NOLINT
  /// @}
  FieldName(const FieldName& other);
  FieldName(FieldName&& other) noexcept;
  FieldName& operator=(const FieldName& other);
  FieldName& operator=(FieldName&& other) noexcept;
  ~FieldName();

  /// @{
  /// Name, for people and JSON; and predicate, an absolute IRI, or "#name" until the name of the record is known.
  std::string name, predicate;
  /// @}
};

namespace detail {
/// The name of T in what the compiler calls a function with the argument T, without namespaces.
LRT_API std::string_view short_type_name(std::string_view function) noexcept;
template <class T>
const char* function_of() noexcept {
#ifdef _MSC_VER
  return __FUNCSIG__;
#else
  return __PRETTY_FUNCTION__;
#endif
}
/// What the compiler calls a type, without namespaces: "PidGains", "LimitsOf<true>".
template <class T>
std::string_view type_name() noexcept {
  return short_type_name(function_of<T>());
}
template <class T>
struct OperationsOf {
  static const Type& type() { return traits<T>::type(); }
  static Value encode(const void* member) { return traits<T>::encode(*static_cast<const T*>(member)); }
  static Result<void> decode([[maybe_unused]] const Value& v, [[maybe_unused]] void* member) {
    if constexpr (std::is_assignable_v<T&, T>) {
      Result<T> r = traits<T>::decode(v);
      if (!r) return Unexpected{std::move(r).error()};
      *static_cast<T*>(member) = *std::move(r);
      return {};
    } else {
      return read_only();
    }
  }
  static bool same(const void* a, const void* b) noexcept { return traits<T>::same(*static_cast<const T*>(a), *static_cast<const T*>(b)); }
  static bool runs_user_code() noexcept { return detail::runs_user_code<T>(); }
};
/// char[N]: a text of at most N - 1 bytes.
template <std::size_t N>
struct OperationsOf<char[N]> {
  static const Type& type() { return text_type(); }
  static std::string_view text(const void* member) noexcept {
    const void* end = std::memchr(member, 0, N);
    const char* begin = static_cast<const char*>(member);
    return {begin, end ? static_cast<std::size_t>(static_cast<const char*>(end) - begin) : N};
  }
  static Value encode(const void* member) { return Value(std::string(text(member))); }
  static Result<void> decode(const Value& v, void* member) {
    const std::string* found = v.text();
    if (!found) return not_a_value_of("a text");
    if (found->size() >= N || found->find('\0') != std::string::npos) return not_a_value_of("a text that fits into its array, without U+0000");
    std::memset(member, 0, N);
    std::memcpy(member, found->data(), found->size());
    return {};
  }
  static bool same(const void* a, const void* b) noexcept { return text(a) == text(b); }
  static bool runs_user_code() noexcept { return false; }
};
/// T[N]: a list of N members, which may be arrays.
template <class T, std::size_t N>
struct OperationsOf<T[N]> {
  using Member = OperationsOf<T>;
  static const T* begin(const void* member) noexcept { return *static_cast<const T(*)[N]>(member); }
  static const Type& type() {
    const Type& element = Member::type();  // before `t`, see Describing
    static const Immortal<Type> t(list_type(element, N, N));
    return *t;
  }
  static Value encode(const void* member) {
    Value::Sequence out;
    out.reserve(N);
    for (std::size_t i = 0; i < N; ++i) out.push_back(Member::encode(begin(member) + i));
    return Value(std::move(out));
  }
  static Result<void> decode(const Value& v, void* member) {
    const Value::Sequence* members = v.sequence();
    if (!members || members->size() != N) return not_a_value_of("a list of the array's length");
    for (std::size_t i = 0; i < N; ++i)
      if (Result<void> r = Member::decode((*members)[i], *static_cast<T(*)[N]>(member) + i); !r) return r;
    return {};
  }
  static bool same(const void* a, const void* b) noexcept {
    for (std::size_t i = 0; i < N; ++i)
      if (!Member::same(begin(a) + i, begin(b) + i)) return false;
    return true;
  }
  static bool runs_user_code() noexcept { return Member::runs_user_code(); }
};
/// The longest text of an array of characters, or of an array of such arrays; 0: it has none.
template <class T>
inline constexpr std::size_t longest_text = 0;
template <std::size_t N>
inline constexpr std::size_t longest_text<char[N]> = N - 1;
template <class T, std::size_t N>
inline constexpr std::size_t longest_text<T[N]> = longest_text<T>;
template <class T>
inline constexpr MemberOperations operations_of{OperationsOf<T>::type, OperationsOf<T>::encode, OperationsOf<T>::decode, OperationsOf<T>::same,
                                                OperationsOf<T>::runs_user_code};

/// A field of the type M by a getter, and by a setter if it is writable. Derived classes have what depends on the record.
template <class M, bool writable>
class GetterField : public FieldAccess {
 public:
  Value encode(const void* record) const final { return traits<M>::encode(get(record)); }
  Result<void> decode([[maybe_unused]] const Value& v, [[maybe_unused]] void* record) const final {
    if constexpr (writable) {
      Result<M> r = traits<M>::decode(v);
      if (!r) return Unexpected{std::move(r).error()};
      return set(record, *std::move(r));
    } else {
      return read_only();
    }
  }
  bool same(const void* a, const void* b) const noexcept final {
    try {
      return traits<M>::same(get(a), get(b));
    } catch (...) {  // of the getter: encode() throws it where it is reported
      return false;
    }
  }

 private:
  virtual M get(const void* record) const = 0;
  virtual Result<void> set(void* record, M&& value) const = 0;
};
}  // namespace detail

/// @cond internal
namespace detail {
/// The type of the default of a field: that of the field, for a C array the type with its values.
template <class M>
struct DefaultOf {
  using type = M;
};
template <std::size_t N>
struct DefaultOf<char[N]> {
  using type = std::string;
};
template <class T, std::size_t N>
struct DefaultOf<T[N]> {
  using type = std::array<typename DefaultOf<T>::type, N>;
};

/// Whether a V can be given as an M: a number as one of the same kind, a whole number also as a fraction, and what converts to an M.
template <class V, class M>
constexpr bool is_default_for() noexcept {
  if constexpr (std::is_same_v<V, M>) return true;
  else if constexpr (std::is_arithmetic_v<V> && std::is_arithmetic_v<M>)
    return !std::is_same_v<V, bool> && !std::is_same_v<M, bool> && !is_character<V> && (std::is_integral_v<V> || std::is_floating_point_v<M>);
  else return std::is_convertible_v<const V&, M> && !std::is_arithmetic_v<V>;
}
template <class N>
constexpr bool is_negative(N n) noexcept {
  if constexpr (std::is_signed_v<N>) return n < N{};
  else return false;
}
}  // namespace detail
/// @endcond

/// A field while describe() runs: `r.field("gain", &S::gain).unit(unit::none).between(0, 10).value_if_absent(1.5)`. Its
/// functions are those of Facets, and value_if_absent(). It converts to Facets&, which stays valid.
///
/// @tparam M  the type of the field
/// @par Threads  That of describe().
template <class M>
class Field {
 public:
  /// @cond internal
  explicit Field(detail::FieldDraft& draft) noexcept : draft_(&draft) {}
  /// @endcond
  /// Of the field; valid as long as its record.
  operator Facets&() const noexcept { return draft_->facets; }  // NOLINT: a function that takes facets takes a field

  /// Declares the value that the field has if a client leaves it out of a PUT, of a POST or of an action's input, or
  /// removes it by PATCH. Without this, a client must state every field that is not a std::optional; a C++ initialiser of
  /// the member is never used. Clients read the default in the Blueprint (sh:defaultValue) and in the JSON Schema.
  ///
  /// @param value  of the field's type. A number of another type must keep its value: 1 is a double, 1.5 is no int.
  /// @par Errors   invalid_option, from Server::add(): the value is outside of the field's bounds or of its C++ type; the
  ///               field is read-only or a std::optional
  Field value_if_absent(const M& value) const { return set_absent(traits<M>::encode(value), true); }
  /// @cond internal
  template <class V>
  Field value_if_absent(const V& value) const {
    if constexpr (!detail::is_default_for<std::decay_t<const V>, M>()) {
      static_assert(detail::always_false<V>,
                    "lrt: the value of value_if_absent() must have the type of the field and keep its whole content; "
                    "write a value of the field's C++ type");
      return *this;
    } else if constexpr (std::is_integral_v<V> && std::is_integral_v<M>) {
      const M kept = static_cast<M>(value);
      return set_absent(traits<M>::encode(kept), static_cast<V>(kept) == value && detail::is_negative(kept) == detail::is_negative(value));
    } else if constexpr (std::is_arithmetic_v<V>) {
      return set_absent(traits<M>::encode(static_cast<M>(value)), true);
    } else {
      return set_absent(traits<M>::encode(M(value)), true);
    }
  }
  /// @endcond

  /// Facets::unit().
  Field unit(const Unit& u) const { return draft_->facets.unit(u), *this; }
  /// Facets::unit_of().
  Field unit_of(const Facets& other) const { return draft_->facets.unit_of(other), *this; }
  /// Facets::at_least().
  Field at_least(double v) const { return draft_->facets.at_least(v), *this; }
  /// Facets::above().
  Field above(double v) const { return draft_->facets.above(v), *this; }
  /// Facets::at_most().
  Field at_most(double v) const { return draft_->facets.at_most(v), *this; }
  /// Facets::below().
  Field below(double v) const { return draft_->facets.below(v), *this; }
  /// Facets::between().
  Field between(double low, double high) const { return draft_->facets.between(low, high), *this; }
  /// Facets::without_bounds().
  Field without_bounds() const { return draft_->facets.without_bounds(), *this; }
  /// Facets::allow_non_finite().
  Field allow_non_finite() const { return draft_->facets.allow_non_finite(), *this; }
  /// Facets::length().
  Field length(std::size_t min, std::size_t max) const { return draft_->facets.length(min, max), *this; }
  /// Facets::title().
  Field title(std::string text, std::string language = {}) const { return draft_->facets.title(std::move(text), std::move(language)), *this; }
  /// Facets::description().
  Field description(std::string text, std::string language = {}) const {
    return draft_->facets.description(std::move(text), std::move(language)), *this;
  }
  /// Facets::merge().
  Field merge(const Facets& other) const { return draft_->facets.merge(other), *this; }

 private:
  Field set_absent(Value value, bool fits) const {
    detail::set_absent(*draft_, std::move(value), fits);
    return *this;
  }
  detail::FieldDraft* draft_;
};

/// Base of rdf::traits for a struct or class. The user lists its fields:
///
///     template <>
///     struct lrt::rdf::traits<S> : lrt::rdf::Record<S> {
///       static void describe(Record<S>& r) {
///         r.field("x", &S::x);                            // a data member; also of type char[N] (a text) or T[N] (a list)
///         r.field("speed", &S::speed, &S::set_speed);     // a getter and a setter
///         r.field("load", &S::load);                      // a getter: read-only
///         r.field("v", [](const S& s) { return s.v(); }, [](S& s, double v) { s.drive(v); });   // lambdas; the first alone: read-only
///       }
///     };
///
/// field() returns the Field, for unit, bounds, title, description and a default. A field is optional exactly if its C++ type is
/// std::optional. A client may leave out a field that is optional or has a default (Field::value_if_absent()).
///
/// A record without is() has the class `<vocabulary>Type`. Type is the name of the C++ type with its enclosing classes and
/// without namespaces, "Arm.Gains" (docs/types.md says how they are told apart), or that of named(). If two types of one
/// server have the same name and different fields, Server::add() returns an error.
///
/// A value with a read-only field, or with a const data member, cannot be decoded. If on_write, on_create or the input
/// of an action needs such a value, Server::add() returns an error that names the field.
///
/// A getter that is not const is called on a copy. Of overloaded getters the const one is used, and of overloaded
/// setters the one that takes what the getter returns. A setter may return Result<void>, or false for a value that it
/// does not accept: 422. A getter that throws is answered with 500.
///
/// @par Threads  describe() runs once, at the first use. Getters and setters run where rdf::traits says.
template <class S>
class Record : lrt_described_anywhere {
 public:
  /// Adds an rdf:type.
  Record& is(Iri type) { return fields_.add_class(type.text), *this; }
  /// Sets the name of the C++ type in the server's vocabulary: letters, digits, '-', '_' and '.'. Use it if two namespaces
  /// have types of the same name, and to keep the terms when the C++ type is renamed.
  Record& named(std::string_view name) { return fields_.set_name(name), *this; }
  /// @{
  /// A field that has been added: its facets by its name, or the Field of a data member, which also has value_if_absent().
  /// Without such a field Server::add() returns invalid_option.
  Facets& facets(std::string_view name) { return fields_.draft(name).facets; }
  template <class M, class C, class = std::enable_if_t<std::is_object_v<M> && std::is_base_of_v<C, S>>>
  auto facets(M C::*member) {
    using Member = std::remove_cv_t<M>;
    return Field<typename detail::DefaultOf<Member>::type>(fields_.draft(detail::operations_of<Member>, detail::offset_of<M, S>(member)));
  }
  /// @}
  /// @{
  /// Adds a field: a data member, or a read-only field by a getter or a callable of const S&.
  template <class Get>
  auto field(FieldName name, Get get) {
    if constexpr (std::is_member_object_pointer_v<Get>) {
      return add_member(std::move(name), get);
    } else {
      return add_getter(std::move(name), std::move(get), nullptr);
    }
  }
  template <class R>
  auto field(FieldName name, R (S::*get)() const) {
    return add_getter(std::move(name), get, nullptr);
  }
  /// @}
  /// @{
  /// Adds a field by a getter and a setter: member functions or callables of const S& and of (S&, value).
  template <class Get, class Set>
  auto field(FieldName name, Get get, Set set) {
    return add_getter(std::move(name), std::move(get), std::move(set));
  }
  template <class R, class Q, class A>
  auto field(FieldName name, R (S::*get)() const, Q (S::*set)(A)) {
    return add_getter(std::move(name), get, set);
  }
  template <class R>
  auto field(FieldName name, R (S::*get)() const, void (S::*set)(std::decay_t<R>)) {
    return add_getter(std::move(name), get, set);
  }
  /// @}

  static const Type& type() { return detail::RecordFields::type_of(&Record::fields); }
  static Value encode(const S& v) { return fields().encode(std::addressof(v)); }
  static Result<S> decode(const Value& v) {
    if constexpr (!std::is_default_constructible_v<S>) {
      static_assert(detail::always_false<S>,
                    "lrt: this struct has no default constructor, which Record needs to make a value of what a client sends; add one, or write "
                    "decode() yourself in rdf::traits<S>");
      return detail::not_a_value_of("a record");
    } else {
      S out{};
      if (Result<void> r = decode_fields(v, out); !r) return Unexpected{std::move(r).error()};
      return out;
    }
  }
  static bool runs_user_code() noexcept { return &traits<S>::encode != &Record::encode || fields().runs_user_code(); }
  static bool same(const S& a, const S& b) noexcept { return fields().same(std::addressof(a), std::addressof(b)); }

  /// @cond internal
  /// What decode() does, with an object that exists. After an error some fields have changed.
  static Result<void> decode_fields(const Value& v, S& out) { return fields().decode(v, std::addressof(out)); }
  void set_place(std::string_view function, bool is_friend) { fields_.set_place(function, is_friend); }
  struct Described {};
  explicit Record(Described) : fields_(detail::function_of<S>(), &Record::fields) {
    traits<S>::describe(*this);
    fields_.finish();
  }
  /// @endcond

 private:
  /// A data member that is not at a fixed place, because a virtual base has it, or that is volatile.
  template <class M, class Pointer>
  struct MovingMember final : detail::FieldAccess {
    explicit MovingMember(Pointer p) : pointer(p) {}
    Value encode(const void* s) const override { return traits<M>::encode(static_cast<const S*>(s)->*pointer); }
    Result<void> decode([[maybe_unused]] const Value& v, [[maybe_unused]] void* s) const override {
      if constexpr (std::is_assignable_v<decltype(std::declval<S&>().*pointer), M>) {
        Result<M> r = traits<M>::decode(v);
        if (!r) return Unexpected{std::move(r).error()};
        static_cast<S*>(s)->*pointer = *std::move(r);
        return {};
      } else {
        return detail::read_only();
      }
    }
    bool same(const void* a, const void* b) const noexcept override {
      return traits<M>::same(static_cast<const S*>(a)->*pointer, static_cast<const S*>(b)->*pointer);
    }
    Pointer pointer;
  };
  /// A field by a getter, and by a setter unless Set is std::nullptr_t.
  template <class M, class Get, class Set>
  struct GetterOf final : detail::GetterField<M, !std::is_same_v<Set, std::nullptr_t>> {
    GetterOf(Get g, Set s) : getter(std::move(g)), setter(std::move(s)) {}
    M get(const void* record) const override {
      const S& s = *static_cast<const S*>(record);
      if constexpr (std::is_invocable_v<const Get&, const S&>) {
        return M(std::invoke(getter, s));
      } else {
        S copy(s);
        return M(std::invoke(getter, copy));
      }
    }
    Result<void> set([[maybe_unused]] void* record, [[maybe_unused]] M&& value) const override {
      if constexpr (std::is_same_v<Set, std::nullptr_t>) {
        return detail::read_only();
      } else {
        using R = std::invoke_result_t<const Set&, S&, M>;
        S& s = *static_cast<S*>(record);
        if constexpr (std::is_same_v<R, bool>) {
          if (!std::invoke(setter, s, std::move(value))) return detail::not_a_value_of("a value that the setter accepts");
        } else if constexpr (detail::is_result<R>) {
          if (R done = std::invoke(setter, s, std::move(value)); !done) return Unexpected{std::move(done).error()};
        } else {
          std::invoke(setter, s, std::move(value));
        }
        return {};
      }
    }
    Get getter;
    Set setter;
  };

  template <class Declared, class C>
  auto add_member(FieldName&& name, Declared C::*pointer) {
    if constexpr (!std::is_base_of_v<C, S> || !std::is_invocable_v<Declared C::*, S&>) {
      static_assert(detail::always_false<C>,
                    "lrt: the data member of a field must be one of the struct that is described; for one of its members write a lambda: "
                    "field(name, [](const S& s) { return s.part.x; })");
      return none();
    } else {
      using M = std::remove_cv_t<Declared>;
      constexpr bool read_only = std::is_const_v<std::remove_all_extents_t<Declared>>;
      if constexpr (std::is_array_v<M> && read_only) {
        static_assert(detail::always_false<S>, "lrt: a const C array cannot be a field; write a lambda: field(name, [](const S& s) { return ...; })");
        return none();
      } else if constexpr (detail::is_reference_wrapper<M>) {
        return add_getter(
            std::move(name), [pointer](const S& s) -> const auto& { return (s.*pointer).get(); }, nullptr);
      } else if constexpr (detail::is_member_by_load<M>) {
        using Loaded = std::decay_t<decltype(std::declval<const M&>().load())>;
        return add_getter(
            std::move(name), [pointer](const S& s) { return (s.*pointer).load(); },
            [pointer](S& s, Loaded value) { (s.*pointer).store(std::move(value)); });
      } else if constexpr (!std::is_convertible_v<Declared C::*, Declared S::*> || std::is_volatile_v<Declared>) {
        const Type& type = traits<M>::type();
        return Field<M>(fields_.add(std::move(name), type, detail::is_within_itself(type) || detail::runs_user_code<M>(), read_only,
                                    std::make_unique<MovingMember<M, Declared C::*>>(pointer)));
      } else if constexpr (detail::longest_text<M> > 0) {
        return Field<typename detail::DefaultOf<M>::type>(
                   fields_.add(std::move(name), detail::operations_of<M>, detail::offset_of<Declared, S>(pointer), false))
            .length(0, detail::longest_text<M>);
      } else {
        return Field<typename detail::DefaultOf<M>::type>(
            fields_.add(std::move(name), detail::operations_of<M>, detail::offset_of<Declared, S>(pointer), read_only));
      }
    }
  }
  template <class Get, class Set>
  auto add_getter(FieldName&& name, Get get, Set set) {
    constexpr bool is_const = std::is_invocable_v<const Get&, const S&>;
    constexpr bool read_only = std::is_same_v<Set, std::nullptr_t>;
    if constexpr (!is_const && !std::is_invocable_v<const Get&, S&>) {
      static_assert(detail::always_false<Get>,
                    "lrt: a field expects a data member, a getter without parameters, or a callable of const S&; give a callable: "
                    "field(name, [](const S& s) { return ...; })");
      return none();
    } else {
      using Read = std::invoke_result_t<const Get&, std::conditional_t<is_const, const S&, S&>>;
      if constexpr (std::is_void_v<Read>) {
        static_assert(detail::always_false<Get>, "lrt: the getter of a field returns nothing; give it first and the setter second");
        return none();
      } else {
        using M = detail::stored_t<Read>;
        if constexpr (!read_only && !std::is_invocable_v<const Set&, S&, M>) {
          static_assert(detail::always_false<Set>,
                        "lrt: the setter of a field expects a member function or a callable (S&, value) that takes what the getter returns; give a "
                        "callable: field(name, get, [](S& s, T value) { ... })");
          return none();
        } else {
          return Field<M>(fields_.add(std::move(name), traits<M>::type(), true, read_only,
                                      std::make_unique<GetterOf<M, Get, Set>>(std::move(get), std::move(set))));
        }
      }
    }
  }
  /// Follows a static_assert.
  static Facets none() { return {}; }
  [[gnu::noinline]] static const detail::RecordFields& fields() {  // with the initialisation: once for each struct, not once for each use
    static const Immortal<Record> self(Described{});
    return self->fields_;
  }
  detail::RecordFields fields_;
};

namespace detail {
template <class T, class = void>
struct own_traits : std::false_type {};
template <class T>
struct own_traits<T, std::void_t<decltype(traits<T>::runs_user_code())>> : std::true_type {};

/// Whether decode() of T's traits is that of Record. Then decode_fields() does the same without a Result<T>.
template <class T, class = void>
inline constexpr bool is_decoded_in_place = false;
template <class T>
inline constexpr bool
    is_decoded_in_place<T, std::void_t<decltype(traits<T>::decode_fields), std::enable_if_t<&traits<T>::decode == &Record<T>::decode>>> =
        std::is_default_constructible_v<T>;

/// Whether values of T may have parts with names. False for the types of which lrt knows that they have none.
template <class T>
inline constexpr bool may_have_parts = std::is_class_v<T>;
template <>
inline constexpr bool may_have_parts<std::string> = false;
template <class Rep, class Period>
inline constexpr bool may_have_parts<std::chrono::duration<Rep, Period>> = false;
template <class Clock, class Duration>
inline constexpr bool may_have_parts<std::chrono::time_point<Clock, Duration>> = false;
template <class T, class Allocator>
inline constexpr bool may_have_parts<std::vector<T, Allocator>> = false;
template <class T, std::size_t N>
inline constexpr bool may_have_parts<std::array<T, N>> = false;
template <class T>
inline constexpr bool may_have_parts<std::optional<T>> = may_have_parts<T>;

template <class T>
bool runs_user_code() noexcept {
  if constexpr (own_traits<T>::value) return traits<T>::runs_user_code();
  else return true;
}
}  // namespace detail

}  // namespace v0
}  // namespace lrt::rdf

#include <lrt/rdf/standard_types.hpp>  // needs what is above
#include <lrt/rdf/variant.hpp>         // has traits of std::variant
