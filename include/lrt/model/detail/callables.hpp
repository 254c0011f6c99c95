// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include <lrt/base/result.hpp>
#include <lrt/base/unique_function.hpp>
#include <lrt/model/representation.hpp>
#include <lrt/rdf/value.hpp>

namespace lrt::model {
inline namespace v0 {

class InvocationLink;

/// The result of reading a property.
struct Reading {
  rdf::Value value;
  std::shared_ptr<const void> whole;  ///< the T itself, for the user's encoders; null: it was not requested
};

/// The user's callables without their types: made by templates, called by the engine. Exceptions of user code pass through.
/// @{
using ReadFunction = UniqueFunction<Reading(bool whole)>;  ///< `whole`: Reading::whole is requested
using WriteFunction = UniqueFunction<Result<void>(const rdf::Value&)>;
using WholeFunction = UniqueFunction<std::shared_ptr<const void>(const rdf::Value&)>;  ///< makes the T of a written value; returns null if it cannot
using EncodeFunction = UniqueFunction<Result<Bytes>(const void*)>;                     ///< of a T
using StartFunction = UniqueFunction<void(const rdf::Value&, const std::shared_ptr<InvocationLink>&)>;  ///< it or a responder finishes the link
using CreateFunction = UniqueFunction<Result<void>(const std::string& id, const rdf::Value&)>;
using RemoveFunction = UniqueFunction<Result<void>(const std::string& id)>;
/// @}

}  // namespace v0
}  // namespace lrt::model
