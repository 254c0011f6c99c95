// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <variant>

#include <lrt/rdf/value.hpp>

#include "src/engine/body_task.hpp"
#include "src/model/spec.hpp"

namespace lrt::engine {
inline namespace v0 {

/// The body of a PATCH of a Property, read and not applied yet (SPEC 3.25).
///
/// @par Threads  Any.
class ValuePatch {
 public:
  virtual ~ValuePatch() = default;
  /// The value that the Property is to have, judged whole as the body of a PUT.
  /// @param current  its value now; null: none
  virtual JudgedBody apply(const rdf::Value& current) const = 0;
};

/// What the engine has of the extension of a Property that clients patch: a program in which they cannot is linked without it.
class PatchExtension : public model::PatchExtension {
 public:
  /// @pre  Property::patches is not null
  static const PatchExtension& of(const model::PropertySpec& property) { return static_cast<const PatchExtension&>(*property.patches); }

  /// Reads a body, on any thread.
  /// @param task  its format is Plain::json for a merge patch; neither format nor syntax: an update in SPARQL
  virtual std::variant<std::shared_ptr<const ValuePatch>, BodyFault> read(BodyTask task) const = 0;

 protected:
  ~PatchExtension() = default;
};

}  // namespace v0
}  // namespace lrt::engine
