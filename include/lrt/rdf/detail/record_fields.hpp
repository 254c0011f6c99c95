// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/value.hpp>

/// Base of Record and Enumeration. The macros declare functions with these as parameter, and C++ looks for such a function in the namespaces of
/// the bases, too: so a macro may stand in the global namespace.
struct lrt_described_anywhere {};

namespace lrt::rdf {
inline namespace v0 {

class FieldName;

namespace detail {

/// What rdf::traits do with the objects of one C++ type, by their addresses. All records share the operations of a type, so a
/// further field of a type that occurs already costs a call of add() and nothing else.
struct MemberOperations {
  const Type& (*type)();
  Value (*encode)(const void* member);
  Result<void> (*decode)(const Value& value, void* member);
  bool (*same)(const void* a, const void* b) noexcept;
  bool (*runs_user_code)() noexcept;
};

/// A record that is being described by the calling thread. Then its type() must not be called, because the compiler would wait for
/// the end of that description, or end the process: a record within itself is found by this.
class LRT_API Describing {
 public:
  /// Says which record it is: a function of its own.
  using Key = void (*)();
  explicit Describing(Key key) noexcept;
  ~Describing() { end(); }
  /// It is described.
  void end() noexcept;
  Describing(const Describing&) = delete;
  Describing& operator=(const Describing&) = delete;
  /// nullptr: the record is not being described. Else a type that states the fault, for the field within it.
  static const Type* type_within(Key key) noexcept;

 private:
  const Key key_;
  const Describing* const outer_;
};
/// The type of the members of lists, maps and optionals is that of a record within itself.
LRT_API bool is_within_itself(const Type& type) noexcept;

/// Reads and writes a field that is not at a fixed place of its record: it has a getter, for example.
class LRT_API FieldAccess {
 public:
  virtual ~FieldAccess();
  virtual Value encode(const void* record) const = 0;
  virtual Result<void> decode(const Value& value, void* record) const = 0;
  virtual bool same(const void* a, const void* b) const noexcept = 0;
};

/// What describe() says of one field. It stays where it is as long as its record exists.
struct FieldDraft {
  Facets facets;
  std::shared_ptr<const Value> absent;  ///< FieldType::absent
  bool loses_absent = false;            ///< the C++ type of the field cannot hold the default that was given
};
LRT_API void set_absent(FieldDraft& draft, Value value, bool fits);

/// The fields of a struct, without the struct: all of Record<S> that does not need S.
/// @par Threads  One thread while fields are added, then any.
class LRT_API RecordFields {
 public:
  /// The fields of a struct, which are described at the first call. One function for each struct.
  using Self = const RecordFields& (*)();
  /// @param function  function_of<S>()
  RecordFields(const char* function, Self self);
  RecordFields(const RecordFields&) = delete;
  RecordFields& operator=(const RecordFields&) = delete;
  ~RecordFields();

  void add_class(std::string_view iri);
  void set_name(std::string_view name);
  /// States where the macro stands that describes the struct: so the enclosing classes of its name are known.
  /// @param function   what the compiler calls the macro's function
  /// @param is_friend  of the struct: then its namespace is that of the function
  void set_place(std::string_view function, bool is_friend);
  /// Adds a data member.
  /// @param offset  of the member, in bytes from the beginning of the struct
  FieldDraft& add(FieldName&& name, const MemberOperations& operations, std::ptrdiff_t offset, bool read_only);
  FieldDraft& add(FieldName&& name, const Type& type, bool runs_user_code, bool read_only, std::unique_ptr<FieldAccess> access);
  /// @{
  /// A field that was added. Without such a field the type has a fault.
  FieldDraft& draft(std::string_view name);
  FieldDraft& draft(const MemberOperations& operations, std::ptrdiff_t offset);
  /// @}
  /// To be called when all fields are added.
  void finish();

  /// The type of a struct. If this thread is describing it, a type with that fault.
  static const Type& type_of(Self self);
  bool runs_user_code() const noexcept { return runs_user_code_; }
  Value encode(const void* record) const;
  Result<void> decode(const Value& value, void* record) const;
  bool same(const void* a, const void* b) const noexcept;

 private:
  struct Member {
    const MemberOperations* operations;  // null: access is set
    std::ptrdiff_t offset;
    std::unique_ptr<FieldAccess> access;
  };

  FieldDraft& add(FieldName&& name, const Type& type, bool runs_user_code, bool read_only, Member member);

  Type type_;
  Describing describing_;  // until finish()
  std::string_view function_;
  std::vector<Member> members_;
  std::vector<std::unique_ptr<FieldDraft>> drafts_;
  FieldDraft no_field_;          // of draft()
  bool runs_user_code_ = false;  // a field's traits or its getter do
};

/// The names of an enum, without the enum: all of Enumeration<E> that does not need E.
class LRT_API EnumeratorNames {
 public:
  EnumeratorNames();
  EnumeratorNames(const EnumeratorNames&) = delete;
  EnumeratorNames& operator=(const EnumeratorNames&) = delete;
  ~EnumeratorNames();

  void add(std::uint64_t value, std::string&& name);
  void add_nameless(std::uint64_t value);
  /// Adds the enumerators that the compiler names.
  /// @param function  name_of_values()
  /// @param first     the first of the values
  /// @param powers    each value is twice the one before, else it is the next
  void add_all(std::string_view function, std::uint64_t first, bool powers);
  /// Looks for enumerators without a name, after all were added.
  /// @param function  first_values()
  void find_nameless(std::string_view function);
  /// @{
  /// Of the newest name.
  void add_title(std::string&& text, std::string&& language);
  void add_description(std::string&& text, std::string&& language);
  /// @}
  const Type& type() const noexcept { return type_; }
  Value encode(std::uint64_t value) const;
  /// @return  nullptr: not one of the names
  const std::uint64_t* find(const Value& name) const noexcept;

 private:
  Words& newest_words();
  Type type_;
  std::vector<std::uint64_t> values_, nameless_;
  std::size_t named_by_compiler_ = 0;  // of the first names
};

/// Whether each number of the underlying type is a value of the enum, by its declaration.
template <class E, class = void>
struct HasFixedType : std::false_type {};
template <class E>
struct HasFixedType<E, std::void_t<decltype(E{0})>> : std::true_type {};

/// Its name has the values as the compiler writes them: "Mode::slow, (Mode)1".
template <class E, E... lrt_values>
const char* name_of_values() noexcept {
#ifdef _MSC_VER
  return "";
#else
  return __PRETTY_FUNCTION__;
#endif
}
template <class E, std::size_t... n>
const char* name_of_values(std::index_sequence<n...>) noexcept {
  return name_of_values<E, static_cast<E>(n)...>();
}
/// The values from `low` on.
template <class E, std::int64_t low, std::size_t... n>
const char* name_of_range(std::index_sequence<n...>) noexcept {
  using Number = std::underlying_type_t<E>;
  return name_of_values<E, static_cast<E>(static_cast<Number>(low + static_cast<std::int64_t>(n)))...>();
}
/// The powers of two from 2^low on.
template <class E, std::size_t low, std::size_t... n>
const char* name_of_powers(std::index_sequence<n...>) noexcept {
  using Number = std::underlying_type_t<E>;
  return name_of_values<E, static_cast<E>(static_cast<Number>(std::uint64_t{1} << (low + n)))...>();
}
/// The first values of an enum, as the compiler writes them; empty if it is not known which values the enum has.
template <class E>
const char* first_values() noexcept {
  if constexpr (HasFixedType<E>::value) return name_of_values<E>(std::make_index_sequence<64>());
  else return "";
}

/// Where a data member begins in its struct. By the Itanium C++ ABI (2.3) a pointer to a data member is that offset.
template <class M, class S>
std::ptrdiff_t offset_of(M S::*member) noexcept {
  static_assert(sizeof(member) == sizeof(std::ptrdiff_t), "a pointer to a data member is an offset in the Itanium C++ ABI");
  std::ptrdiff_t offset;
  std::memcpy(&offset, &member, sizeof offset);
  return offset;
}

}  // namespace detail
}  // namespace v0
}  // namespace lrt::rdf
