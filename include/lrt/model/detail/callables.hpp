// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/unique_function.hpp>
#include <lrt/model/representation.hpp>
#include <lrt/rdf/value.hpp>

namespace lrt::model {
inline namespace v0 {

class InvocationLink;

/// @{
/// Whether a callable may be null: a std::function, a UniqueFunction, a pointer. A lambda without captures converts to a
/// pointer, and is none.
template <class F>
inline constexpr bool can_be_null = std::is_pointer_v<F> || std::is_member_pointer_v<F>;
template <class Signature>
inline constexpr bool can_be_null<std::function<Signature>> = true;
template <class Signature>
inline constexpr bool can_be_null<UniqueFunction<Signature>> = true;
/// @}

/// The result of reading a property.
struct Reading {
  rdf::Value value;
  std::shared_ptr<const void> whole;  ///< the T itself, for the user's encoders; null: it was not requested
};

template <class T>
void delete_value(const void* value) noexcept {
  delete static_cast<const T*>(value);
}
/// @{
/// Owns a value without its type: its users differ in T, and the control block of std::make_shared would be compiled for each.
LRT_API std::shared_ptr<const void> shared_value(const void* value, void (*destroy)(const void*) noexcept);
template <class T>
std::shared_ptr<const void> shared_value(T&& value) {
  using Value = std::decay_t<T>;
  return shared_value(new Value(std::forward<T>(value)), delete_value<Value>);
}
/// Sets Reading::whole.
LRT_API void keep_whole(Reading& reading, const void* value, void (*destroy)(const void*) noexcept);
/// @}

/// Of a value that describes itself.
/// @throws BadResult  there is none
LRT_API Reading reading_of(Result<rdf::Value> value, bool whole);

/// The user's callables without their types: made by templates, called by the engine. Exceptions of user code pass through.
/// @{
using ReadFunction = UniqueFunction<Reading(bool whole)>;  ///< `whole`: Reading::whole is requested
using WriteFunction = UniqueFunction<Result<void>(const rdf::Value&)>;
using WholeFunction = UniqueFunction<std::shared_ptr<const void>(const rdf::Value&)>;  ///< makes the T of a written value; returns null if it cannot
using EncodeFunction = UniqueFunction<Result<Bytes>(const void*)>;                     ///< of a T
using StartFunction = UniqueFunction<void(const rdf::Value&, const std::shared_ptr<InvocationLink>&)>;  ///< it or a responder finishes the link
using CreateFunction = UniqueFunction<Result<void>(const std::string& id, const rdf::Value&)>;
using RemoveFunction = UniqueFunction<Result<void>(const std::string& id)>;
using LapseFunction = UniqueFunction<void()>;  ///< a written value has lapsed
/// @}

}  // namespace v0
}  // namespace lrt::model
