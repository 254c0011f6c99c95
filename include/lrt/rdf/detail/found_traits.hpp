// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/immortal.hpp>
#include <lrt/base/result.hpp>
#include <lrt/rdf/detail/record_fields.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/value.hpp>

// rdf::traits of types that have no specialisation, by what their class has: a container of any library is a list, a set or a map, and the
// header of none is included here.

namespace lrt::rdf {
inline namespace v0 {

template <class T, class Enable = void>
struct traits;
template <class S>
class Record;
template <class E>
class Enumeration;

namespace detail {
template <class... T>
inline constexpr bool always_false = false;

template <class T>
inline constexpr bool is_character =
    std::is_same_v<T, char> || std::is_same_v<T, wchar_t> || std::is_same_v<T, char16_t> || std::is_same_v<T, char32_t>
#ifdef __cpp_char8_t
    || std::is_same_v<T, char8_t>
#endif
    ;
template <class T>
inline constexpr bool is_text_view = std::is_same_v<T, std::string_view> || std::is_same_v<T, const char*> || std::is_same_v<T, char*>;

/// Members for types without traits, so that the static_assert is the only error.
template <class T>
struct NoTraits {
  static const Type& type();
  static Value encode(const T& value);
  static Result<std::decay_t<T>> decode(const Value& value);
  static bool same(const T& a, const T& b) noexcept;
};
template <>
struct NoTraits<void> {
  static const Type& type();
};
template <class T>
struct NoTraits<T&> : NoTraits<T> {};

/// True if traits<T>::encode calls code of the user. Specialisations of lrt state it by a fifth member,
/// runs_user_code().
template <class T>
bool runs_user_code() noexcept;
LRT_API const Type& text_type() noexcept;
LRT_API Type list_type(const Type& element, std::size_t shortest, std::size_t longest);
LRT_API Type set_type(const Type& element);
LRT_API Type map_type(const Type& element, const Type* key = nullptr);
LRT_API Unexpected not_a_value_of(const char* what);
LRT_API Unexpected not_in_set();

// ---- why a type has no traits

enum class Refusal : std::uint8_t {
  undescribed,
  plain_enum,
  character,
  wide_text,
  wide_number,
  text_view,
  view,
  pointer,
  reference,
  function,
  any_value,
  a_union,
  mutex,
  atomic,
  multimap,
  adaptor,
};

/// A function, because a class whose own static_assert fails causes further errors.
template <class T, Refusal why>
auto refuse() {
  static_assert(
      why != Refusal::undescribed,
      "lrt: this type has no rdf::traits. For a struct write, in its namespace: LRT_RECORD(S, x, y) with the names of its data members; for "
      "getters, setters and units: template <> struct lrt::rdf::traits<S> : lrt::rdf::Record<S> { static void describe(Record<S>& r) { "
      "r.field(\"x\", &S::x); } };");
  static_assert(
      why != Refusal::plain_enum,
      "lrt: the compiler does not tell the enumerators of an enum without a fixed underlying type; write LRT_ENUM(E, a, b) in its namespace, "
      "or make it an enum class");
  static_assert(why != Refusal::character, "lrt: a character is neither a number nor a text; write std::string for a text, std::int8_t for a number");
  static_assert(why != Refusal::wide_text, "lrt: texts are UTF-8; convert this one and write std::string");
  static_assert(why != Refusal::wide_number,
                "lrt: no datatype of RDF holds this number as it is; write double for long double, std::int64_t, std::uint64_t or std::string for "
                "__int128");
  static_assert(why != Refusal::text_view,
                "lrt: a std::string_view or const char* does not own its text; write std::string here (only what a lambda returns, and the "
                "input of an action without a Responder, may be a view)");
  static_assert(why != Refusal::view, "lrt: a view does not own its members; write std::vector or std::array");
  static_assert(
      why != Refusal::pointer,
      "lrt: a pointer is no value; write the type that it points to, or std::optional, std::unique_ptr or std::shared_ptr of it if the value "
      "may be absent");
  static_assert(why != Refusal::reference, "lrt: a reference is no value; write the type that it refers to, or a getter that returns it");
  static_assert(why != Refusal::function, "lrt: a function is no value; register what it does as an action, or the value that it returns");
  static_assert(why != Refusal::any_value, "lrt: a std::any does not say which types it may have; write std::variant of them");
  static_assert(why != Refusal::a_union, "lrt: a union does not say which of its members has the value; write std::variant");
  static_assert(why != Refusal::mutex, "lrt: a mutex is no value; leave it out of the fields, and lock it in a getter");
  static_assert(why != Refusal::atomic, "lrt: a std::atomic cannot be copied; return load(), or make it the data member of a Record");
  static_assert(why != Refusal::multimap,
                "lrt: a name of a map occurs once; write std::map from the key to a std::vector of the values instead of a multimap");
  static_assert(why != Refusal::adaptor, "lrt: a stack or queue does not show its members; write the container below it, std::deque or std::vector");
}
template <class T, Refusal why>
struct Refused : NoTraits<T> {
  using Sentence = decltype(refuse<T, why>());
};

// ---- what a class has

#define LRT_DETAIL_HAS(name, ...)     \
  template <class T, class = void>    \
  inline constexpr bool name = false; \
  template <class T>                  \
  inline constexpr bool name<T, std::void_t<__VA_ARGS__>> = true
// The macros LRT_RECORD and LRT_ENUM declare these functions, which are found by their argument.
LRT_DETAIL_HAS(has_fields, decltype(lrt_fields(std::declval<Record<T>&>())));
LRT_DETAIL_HAS(has_names, decltype(lrt_names(std::declval<Enumeration<T>&>())));
LRT_DETAIL_HAS(is_range, typename T::value_type, decltype(std::declval<const T&>().begin() != std::declval<const T&>().end()));
LRT_DETAIL_HAS(has_push_back, decltype(std::declval<T&>().push_back(std::declval<typename T::value_type>())));
LRT_DETAIL_HAS(has_insert_after,
               decltype(std::declval<T&>().insert_after(std::declval<T&>().before_begin(), std::declval<typename T::value_type>())));
LRT_DETAIL_HAS(has_key, typename T::key_type, decltype(std::declval<T&>().insert(std::declval<typename T::value_type>())));
LRT_DETAIL_HAS(has_mapped, typename T::mapped_type);
LRT_DETAIL_HAS(has_each_once, decltype(std::declval<T&>().insert(std::declval<typename T::value_type>()).second));
LRT_DETAIL_HAS(is_ordered, decltype(std::declval<const T&>() < std::declval<const T&>()));
LRT_DETAIL_HAS(is_text, typename T::traits_type, decltype(std::declval<const T&>().c_str()));
LRT_DETAIL_HAS(is_path, decltype(T::preferred_separator), decltype(std::declval<const T&>().root_name()));
LRT_DETAIL_HAS(is_bits, decltype(std::declval<const T&>().test(std::size_t())), decltype(std::declval<const T&>().to_ullong()));
LRT_DETAIL_HAS(is_complex, typename T::value_type, decltype(T(std::declval<const T&>().real(), std::declval<const T&>().imag())));
LRT_DETAIL_HAS(is_atomic, decltype(std::declval<const T&>().load()), decltype(std::declval<const T&>().is_lock_free()));
LRT_DETAIL_HAS(is_lock, decltype(std::declval<T&>().lock()), decltype(std::declval<T&>().unlock()));
LRT_DETAIL_HAS(is_weak_pointer, typename T::element_type, decltype(std::declval<const T&>().lock()));
LRT_DETAIL_HAS(is_any, decltype(std::declval<const T&>().has_value()), decltype(std::declval<const T&>().type()));
LRT_DETAIL_HAS(is_view, typename T::element_type, decltype(std::declval<const T&>().data()), decltype(std::declval<const T&>().size()));
LRT_DETAIL_HAS(is_adaptor, typename T::container_type);
#undef LRT_DETAIL_HAS
template <class T>
inline constexpr bool is_function_object = false;
template <class R, class... A>
inline constexpr bool is_function_object<std::function<R(A...)>> = true;
template <class T>
inline constexpr bool is_reference_wrapper = false;
template <class T>
inline constexpr bool is_reference_wrapper<std::reference_wrapper<T>> = true;

/// Whether a data member of a record is read by load() and written by store(). Only classes can be.
template <class T>
constexpr bool has_load() {
  if constexpr (std::is_class_v<T>) return is_atomic<T>;
  else return false;
}
template <class T>
inline constexpr bool is_member_by_load = has_load<T>();
/// @{
/// The defaults of Enumeration::name_all(): of one byte all values.
template <class E>
inline constexpr std::int64_t lowest_named = std::is_unsigned_v<std::underlying_type_t<E>> ? 0
                                             : sizeof(E) == 1                              ? -128
                                                                                           : -16;
template <class E>
inline constexpr std::int64_t highest_named = std::is_unsigned_v<std::underlying_type_t<E>> && sizeof(E) == 1 ? 255 : 127;
/// @}

// ---- traits of containers

template <class T, class Sequence>
Value encode_list(const Sequence& members) {
  Value::Sequence out;
  out.reserve(static_cast<std::size_t>(std::distance(members.begin(), members.end())));
  for (const auto& m : members) out.push_back(traits<T>::encode(m));
  return Value(std::move(out));
}
template <class T, class Sequence>
bool same_list(const Sequence& a, const Sequence& b) noexcept {
  auto x = a.begin();
  auto y = b.begin();
  for (; x != a.end() && y != b.end(); ++x, ++y)
    if (!traits<T>::same(*x, *y)) return false;
  return !(x != a.end()) && !(y != b.end());
}

/// Traits of a sequence: std::deque, list, forward_list and those of other libraries.
template <class C>
struct ListTraits {
  using T = typename C::value_type;
  static const Type& type() {
    const Type& element = traits<T>::type();  // before the guard of the static object: a struct may contain itself
    static const Immortal<Type> t(list_type(element, 0, std::numeric_limits<std::size_t>::max()));
    return *t;
  }
  static Value encode(const C& v) { return encode_list<T>(v); }
  static Result<C> decode(const Value& v) {
    const Value::Sequence* s = v.sequence();
    if (!s) return not_a_value_of("a list");
    C out;
    if constexpr (has_push_back<C>) {
      for (const Value& m : *s) {
        Result<T> member = traits<T>::decode(m);
        if (!member) return Unexpected{std::move(member).error()};
        out.push_back(*std::move(member));
      }
    } else {
      auto last = out.before_begin();
      for (const Value& m : *s) {
        Result<T> member = traits<T>::decode(m);
        if (!member) return Unexpected{std::move(member).error()};
        last = out.insert_after(last, *std::move(member));
      }
    }
    return out;
  }
  static bool runs_user_code() noexcept { return detail::runs_user_code<T>(); }
  static bool same(const C& a, const C& b) noexcept { return same_list<T>(a, b); }
};

/// Traits of a set: a list in the order of the members, if they have one. Of a set, and not of a multiset, each member occurs once.
template <class C>
struct SetTraits {
  using T = typename C::value_type;
  static constexpr bool each_once = has_each_once<C>;
  static const Type& type() {
    const Type& element = traits<T>::type();
    static const Immortal<Type> t(each_once ? set_type(element) : list_type(element, 0, std::numeric_limits<std::size_t>::max()));
    return *t;
  }
  static Value encode(const C& v) {
    if constexpr (!is_ordered<T>) {
      return encode_list<T>(v);
    } else {
      std::vector<const T*> members;
      for (const T& m : v) members.push_back(std::addressof(m));
      std::stable_sort(members.begin(), members.end(), [](const T* a, const T* b) { return *a < *b; });
      Value::Sequence out;
      out.reserve(members.size());
      for (const T* m : members) out.push_back(traits<T>::encode(*m));
      return Value(std::move(out));
    }
  }
  static Result<C> decode(const Value& v) {
    const Value::Sequence* s = v.sequence();
    if (!s) return not_a_value_of("a list");
    C out;
    for (const Value& m : *s) {
      Result<T> member = traits<T>::decode(m);
      if (!member) return Unexpected{std::move(member).error()};
      if constexpr (each_once) {
        if (!out.insert(*std::move(member)).second) return not_in_set();
      } else {
        out.insert(*std::move(member));
      }
    }
    return out;
  }
  static bool runs_user_code() noexcept { return detail::runs_user_code<T>(); }
  static bool same(const C& a, const C& b) noexcept {
    if (a.size() != b.size()) return false;
    if constexpr (each_once) {
      for (const T& m : a)
        if (const auto other = b.find(m); other == b.end() || !traits<T>::same(m, *other)) return false;
      return true;
    } else {
      return same_list<T>(a, b);  // of an unordered_multiset in another order: it is written again
    }
  }
};

template <class K>
inline constexpr bool is_whole_number = std::is_integral_v<K> && !std::is_same_v<K, bool> && !is_character<K> && sizeof(K) <= 8;

template <class K, bool is_name>
auto not_a_key() {
  static_assert(is_name,
                "lrt: the keys of a map are names: std::string, an integer or an enumeration; write a std::vector of a struct with a field "
                "for the key instead");
}
template <class T, bool is_absent>
auto not_a_member() {
  static_assert(!is_absent, "lrt: a member of a map cannot be absent; write the map without std::optional and leave the member out");
}
template <class T>
inline constexpr bool may_be_absent = false;

/// The text that is a key's name, and the key of a name.
template <class K>
struct KeyTraits {
  static constexpr bool is_number = is_whole_number<K>;
  static constexpr bool is_text_key = !is_number && !std::is_enum_v<K>;
  static const Type* type() {
    if constexpr (is_text_key) return nullptr;
    else return &traits<K>::type();
  }
  static std::string name(const K& key) {
    if constexpr (is_text_key) {
      return std::string(key.begin(), key.end());
    } else if constexpr (is_number) {
      return std::to_string(key);
    } else {
      const Value value = traits<K>::encode(key);
      return value.text() ? *value.text() : std::string();
    }
  }
  static Result<K> key(const std::string& name) {
    if constexpr (is_text_key) {
      return K(name.begin(), name.end());
    } else if constexpr (is_number) {
      K out{};
      const char* const end = name.data() + name.size();
      const auto [at, error] = std::from_chars(name.data(), end, out);
      if (error != std::errc() || at != end || std::to_string(out) != name) return not_a_value_of("an integer of the C++ type as the name");
      return out;
    } else {
      return traits<K>::decode(Value(name));
    }
  }
};

template <class K>
constexpr bool is_key() {
  if constexpr (std::is_enum_v<K>) return true;
  else if constexpr (std::is_class_v<K>) return is_text<K> && std::is_same_v<typename K::value_type, char>;
  else return is_whole_number<K>;
}

/// Traits of a map. Its members are in the byte order of the names.
template <class Map>
struct MapTraits {
  using K = typename Map::key_type;
  using T = typename Map::mapped_type;
  using Key = KeyTraits<K>;

  static const Type& type() {
    const Type& element = traits<T>::type();
    static const Immortal<Type> t(map_type(element, Key::type()));
    return *t;
  }
  static Value encode(const Map& v) {
    std::vector<std::pair<std::string, const T*>> members;
    members.reserve(v.size());
    for (const auto& m : v) members.emplace_back(Key::name(m.first), std::addressof(m.second));
    std::sort(members.begin(), members.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    Value::Sequence out;
    out.reserve(members.size());
    for (auto& m : members) out.push_back(Value(Value::Sequence{Value(std::move(m.first)), traits<T>::encode(*m.second)}));
    return Value(std::move(out));
  }
  static Result<Map> decode(const Value& v) {
    const Value::Sequence* s = v.sequence();
    if (!s) return not_a_value_of("a map");
    Map out;
    for (const Value& m : *s) {
      const Value::Sequence* pair = m.sequence();
      if (!pair || pair->size() != 2 || !pair->front().text()) return not_a_value_of("a map");
      Result<K> key = Key::key(*pair->front().text());
      if (!key) return Unexpected{std::move(key).error()};
      Result<T> member = traits<T>::decode(pair->back());
      if (!member) return Unexpected{std::move(member).error()};
      out.emplace(*std::move(key), *std::move(member));
    }
    return out;
  }
  static bool runs_user_code() noexcept { return detail::runs_user_code<T>() || (std::is_enum_v<K> && detail::runs_user_code<K>()); }
  static bool same(const Map& a, const Map& b) noexcept {
    if (a.size() != b.size()) return false;
    for (const auto& m : a)
      if (const auto other = b.find(m.first); other == b.end() || !traits<T>::same(m.second, other->second)) return false;
    return true;
  }
};
template <class T>
struct UnnamedMap : NoTraits<T> {
  using Sentence = decltype(not_a_key<typename T::key_type, is_key<typename T::key_type>()>());
};
template <class T>
struct MapOfAbsent : NoTraits<T> {
  using Sentence = decltype(not_a_member<T, true>());
};
template <class T>
using FoundMap = std::conditional_t<!is_key<typename T::key_type>(), UnnamedMap<T>,
                                    std::conditional_t<may_be_absent<typename T::mapped_type>, MapOfAbsent<T>, MapTraits<T>>>;

/// Traits of std::bitset: a list of booleans, that with the value 1 first.
template <class B>
struct BitsTraits {
  using Bit = std::decay_t<decltype(std::declval<const B&>().test(0))>;
  static constexpr std::size_t count = B().size();
  static const Type& type() {
    static const Immortal<Type> t(list_type(traits<Bit>::type(), count, count));
    return *t;
  }
  static Value encode(const B& v) {
    Value::Sequence out;
    out.reserve(count);
    for (std::size_t i = 0; i < count; ++i) out.push_back(Value(v.test(i)));
    return Value(std::move(out));
  }
  static Result<B> decode(const Value& v) {
    const Value::Sequence* s = v.sequence();
    if (!s || s->size() != count) return not_a_value_of("a list of a boolean for each bit");
    B out;
    for (std::size_t i = 0; i < count; ++i) {
      const bool* bit = (*s)[i].boolean();
      if (!bit) return not_a_value_of("a list of a boolean for each bit");
      out[i] = *bit;
    }
    return out;
  }
  static bool runs_user_code() noexcept { return false; }
  static bool same(const B& a, const B& b) noexcept { return a == b; }
};

/// Traits of std::complex: a list of its real and its imaginary part.
template <class C>
struct ComplexTraits {
  using T = typename C::value_type;
  static const Type& type() {
    static const Immortal<Type> t(list_type(traits<T>::type(), 2, 2));
    return *t;
  }
  static Value encode(const C& v) { return Value(Value::Sequence{traits<T>::encode(v.real()), traits<T>::encode(v.imag())}); }
  static Result<C> decode(const Value& v) {
    const Value::Sequence* s = v.sequence();
    if (!s || s->size() != 2) return not_a_value_of("a list of a real and an imaginary part");
    Result<T> real = traits<T>::decode(s->front());
    if (!real) return Unexpected{std::move(real).error()};
    Result<T> imaginary = traits<T>::decode(s->back());
    if (!imaginary) return Unexpected{std::move(imaginary).error()};
    return C(*real, *imaginary);
  }
  static bool runs_user_code() noexcept { return detail::runs_user_code<T>(); }
  static bool same(const C& a, const C& b) noexcept { return traits<T>::same(a.real(), b.real()) && traits<T>::same(a.imag(), b.imag()); }
};

/// Traits of std::filesystem::path and of strings with an allocator: a text.
template <class T>
struct TextTraits {
  static const Type& type() noexcept { return text_type(); }
  static Value encode(const T& v) {
    if constexpr (is_path<T>) return Value(v.string());
    else return Value(std::string(v.begin(), v.end()));
  }
  static Result<T> decode(const Value& v) {
    if (const std::string* s = v.text()) return T(s->begin(), s->end());
    return not_a_value_of("a text");
  }
  static bool runs_user_code() noexcept { return false; }
  static bool same(const T& a, const T& b) noexcept {
    if constexpr (is_path<T>) return a.native() == b.native();
    else return a == b;
  }
};

// ---- which traits

template <class S>
auto describe_more(Record<S>& r, int) -> decltype(lrt_describe(r)) {
  return lrt_describe(r);
}
template <class S>
void describe_more(Record<S>&, long) {}
/// Traits of a struct that LRT_RECORD describes.
template <class S>
struct MacroRecord : Record<S> {
  static void describe(Record<S>& r) {
    lrt_fields(r);
    detail::describe_more(r, 0);
  }
};
/// Traits of an enum that LRT_ENUM describes.
template <class E>
struct MacroEnumeration : Enumeration<E> {
  static void describe(Enumeration<E>& e) { lrt_names(e); }
};
/// Traits of an enum whose enumerators the compiler names.
struct NamedByCompiler {};
template <class E>
struct CompilerEnumeration : Enumeration<E>, NamedByCompiler {
  static void describe(Enumeration<E>& e) { e.name_all(); }
};

template <class T>
struct Is {
  using type = T;
};
template <class T>
constexpr auto find_class_traits() {
  if constexpr (has_fields<T>) return Is<MacroRecord<T>>();
  else if constexpr (std::is_union_v<T>) return Is<Refused<T, Refusal::a_union>>();
  else if constexpr (is_path<T>) return Is<TextTraits<T>>();
  else if constexpr (is_range<T> && has_key<T>) {
    if constexpr (!has_mapped<T>) return Is<SetTraits<T>>();
    else if constexpr (!has_each_once<T>) return Is<Refused<T, Refusal::multimap>>();
    else return Is<FoundMap<T>>();
  } else if constexpr (is_range<T>) {
    if constexpr (std::is_same_v<T, std::string_view>) return Is<Refused<T, Refusal::text_view>>();
    else if constexpr (is_text<T> && std::is_same_v<typename T::value_type, char>) return Is<TextTraits<T>>();
    else if constexpr (is_character<typename T::value_type>) return Is<Refused<T, Refusal::wide_text>>();
    else if constexpr (has_push_back<T> || has_insert_after<T>) return Is<ListTraits<T>>();
    else if constexpr (is_view<T>) return Is<Refused<T, Refusal::view>>();
    else return Is<Refused<T, Refusal::undescribed>>();
  } else if constexpr (is_bits<T>) return Is<BitsTraits<T>>();
  else if constexpr (is_complex<T>) return Is<ComplexTraits<T>>();
  else if constexpr (is_atomic<T>) return Is<Refused<T, Refusal::atomic>>();
  else if constexpr (is_lock<T>) return Is<Refused<T, Refusal::mutex>>();
  else if constexpr (is_weak_pointer<T>) return Is<Refused<T, Refusal::pointer>>();
  else if constexpr (is_any<T>) return Is<Refused<T, Refusal::any_value>>();
  else if constexpr (is_adaptor<T>) return Is<Refused<T, Refusal::adaptor>>();
  else if constexpr (is_function_object<T>) return Is<Refused<T, Refusal::function>>();
  else if constexpr (is_reference_wrapper<T>) return Is<Refused<T, Refusal::reference>>();
  else return Is<Refused<T, Refusal::undescribed>>();
}
template <class T>
constexpr auto find_traits() {
  if constexpr (std::is_enum_v<T>) {
    if constexpr (has_names<T>) return Is<MacroEnumeration<T>>();
    else if constexpr (!HasFixedType<T>::value) return Is<Refused<T, Refusal::plain_enum>>();
    else return Is<CompilerEnumeration<T>>();
  } else if constexpr (is_character<T>) return Is<Refused<T, Refusal::character>>();
  else if constexpr (is_text_view<T>) return Is<Refused<T, Refusal::text_view>>();
  else if constexpr (std::is_function_v<std::remove_pointer_t<T>> || std::is_member_pointer_v<T>) return Is<Refused<T, Refusal::function>>();
  else if constexpr (std::is_pointer_v<T> || std::is_null_pointer_v<T>) return Is<Refused<T, Refusal::pointer>>();
  else if constexpr (std::is_reference_v<T>) return Is<Refused<T, Refusal::reference>>();
  else if constexpr (std::is_class_v<T> || std::is_union_v<T>) return find_class_traits<T>();
  else if constexpr (std::is_void_v<T>) return Is<Refused<T, Refusal::undescribed>>();
  else return Is<Refused<T, Refusal::wide_number>>();  // long double, __int128
}
template <class T>
using FoundTraits = typename decltype(find_traits<T>())::type;

}  // namespace detail
}  // namespace v0
}  // namespace lrt::rdf
