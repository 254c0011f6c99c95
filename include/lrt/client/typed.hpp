// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/client/latest.hpp>
#include <lrt/client/things.hpp>
#include <lrt/client/watch.hpp>
#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/unit.hpp>

/// Classes that headers of generate() use: properties and actions whose C++ types are known.
namespace lrt::client {
inline namespace v0 {

/// A type with another datatype for its literals: xsd:date for a text, xsd:decimal for a double. For a list, map or
/// optional: the datatype of its values. The object exists until the process ends. For constants of generated headers.
/// @par Threads  Any.
/// @par Time     Locks for a moment, and allocates. Kept once for each pair of type and datatype.
LRT_API const rdf::Type& with_datatype(const rdf::Type& type, Iri datatype);

/// The form in which values of a C++ type are written.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
struct ValueForm {
  /// No type.
  ValueForm() = default;
  /// A type and a unit.
  ValueForm(const rdf::Type& t, const lrt::Unit& u) : type(&t), unit(u) {}
  const rdf::Type* type = nullptr;  ///< structure of the value
  lrt::Unit unit{};                 ///< unit of its numbers
};

/// A Property without a C++ type.
/// @par Threads  Any: immutable. For property() see Property.
class Untyped {
 public:
  /// @param property  nullopt: the Thing does not have it
  explicit Untyped(std::optional<Property> property) : property_(std::move(property)) {}
  /// Whether this Thing has the property. Others of its kind may have it if this one does not.
  bool exists() const noexcept { return property_.has_value(); }
  /// The property.
  /// @par Errors  unknown_path: exists() is false
  Result<Property> property() const {
    if (property_) return *property_;
    return unexpected(Errc::unknown_path, "this Thing does not have this property");
  }

 private:
  std::optional<Property> property_;
};

/// A Property with values of type T.
/// @par Threads  Any. read() blocks as Property::read().
template <class T>
class Readable : public Untyped {
 public:
  /// Made by generated code.
  Readable(std::optional<Property> property, const rdf::Type& type, const lrt::Unit& unit) : Untyped(std::move(property)), form_(type, unit) {}

  /// The present value.
  /// @par Errors  those of Property::read()
  Result<T> read() const {
    const Result<Property> property = this->property();
    if (!property) return Unexpected{property.error()};
    const Result<RepresentationPtr> found = property->get();
    if (!found) return Unexpected{found.error()};
    return decode(**found);
  }
  /// Decodes the value of a representation of this Property.
  /// @par Errors  unknown_path: exists() is false; those of Property::decode()
  Result<T> decode(const Representation& representation) const {
    const Result<Property> property = this->property();
    if (!property) return Unexpected{property.error()};
    const Result<rdf::Value> value = property->decode(representation, *form_.type, form_.unit);
    if (!value) return Unexpected{value.error()};
    return rdf::traits<T>::decode(*value);
  }
  /// Called with each change of a watch and its value. The value is an error if the change is a gap or the end, or if it
  /// is not a T; `change.kind` tells which. Change::at is the time of the value, Change::left_out what is missing.
  using OnValue = std::function<void(const Result<T>& value, const Change& change)>;
  /// Begins to watch it.
  ///
  ///     auto watch = joint.position.watch({}, [](const lrt::Result<double>& value, const lrt::client::Change& change) {
  ///       if (value) plot(change.at, *value);
  ///     });
  ///
  /// @par Errors   unknown_path: exists() is false; those of Property::watch()
  /// @par Threads  The callback: see Options::callbacks.
  /// @par Time     Does not wait for the server.
  Result<Watch> watch(const WatchOptions& options, OnValue on_value) const {
    const Result<Property> property = this->property();
    if (!property) return Unexpected{property.error()};
    return property->watch(options, [property = *property, form = form_, on_value = std::move(on_value)](const Change& change) {
      if (change.kind == Change::Kind::value) return on_value(property.template value_of<T>(change, *form.type, form.unit), change);
      on_value(unexpected(Errc::expected_value, change.kind == Change::Kind::gap ? "a gap has no value" : "the watch has ended"), change);
    });
  }
  /// The newest value for a control loop.
  /// @par Errors  unknown_path: exists() is false; those of Property::latest()
  Result<Latest<T>> latest(const WatchOptions& options = {}) const {
    const Result<Property> property = this->property();
    if (!property) return Unexpected{property.error()};
    return property->template latest<T>(*form_.type, form_.unit, options);
  }
  /// Unit of its numbers; unit::none: none.
  const lrt::Unit& unit() const noexcept { return form_.unit; }

 protected:
  ValueForm form_;  ///< type and unit of the values
};

/// A Property with values of type T that clients may write.
/// @par Threads  Any. write() blocks as Property::write().
template <class T>
class Writable : public Readable<T> {
 public:
  using Readable<T>::Readable;

  /// Writes the value, by PUT.
  /// @param if_match  an entity tag: written only if the representation still has it
  /// @par Errors  those of Property::write()
  Result<void> write(const T& value, const std::string& if_match = {}) const {
    const Result<Property> property = this->property();
    if (!property) return Unexpected{property.error()};
    return property->write(*this->form_.type, rdf::traits<T>::encode(value), WriteOptions{this->form_.unit, if_match});
  }
  /// Changes parts of the value, by PATCH.
  /// @param if_match  as of write()
  /// @par Errors  those of Property::patch()
  Result<void> patch(const Patch& patch, const std::string& if_match = {}) const {
    const Result<Property> property = this->property();
    if (!property) return Unexpected{property.error()};
    return property->patch(patch, WriteOptions{{}, if_match});
  }
};

/// One invocation of an action that produces a T.
/// @par Threads  Any. wait() and cancel() block as those of Invocation.
template <class T>
class TypedInvocation {
 public:
  /// Made by TypedAction.
  TypedInvocation(Invocation invocation, ValueForm form) : invocation_(std::move(invocation)), form_(form) {}

  const Invocation& invocation() const noexcept { return invocation_; }  ///< without the type
  /// Waits until it has ended.
  /// @par Errors  those of Invocation::wait()
  Result<Invocation::State> wait(std::chrono::milliseconds at_most, const std::function<void(const Invocation::State&)>& on_progress = {}) const {
    return invocation_.wait(at_most, on_progress);
  }
  Result<void> cancel() const { return invocation_.cancel(); }  ///< as Invocation::cancel()
  /// The output. @pre it has succeeded
  /// @par Errors  expected_value: there is no such result
  template <class U = T>
  Result<U> result() const {
    const Result<rdf::Value> value = invocation_.result(*form_.type, form_.unit);
    if (!value) return Unexpected{value.error()};
    return rdf::traits<U>::decode(*value);
  }

 private:
  Invocation invocation_;
  ValueForm form_;
};

/// An Action whose input has no C++ type.
/// @par Threads  Any: immutable. For action() see Action.
class UntypedAction {
 public:
  /// @param action  nullopt: the Thing does not have it
  explicit UntypedAction(std::optional<Action> action) : action_(std::move(action)) {}
  /// Whether this Thing has the action and it is available. Others of its kind may have it if this one does not.
  bool exists() const noexcept { return action_.has_value(); }
  /// The action.
  /// @par Errors  unknown_path: exists() is false
  Result<Action> action() const {
    if (action_) return *action_;
    return unexpected(Errc::unknown_path, "this Thing does not have this action");
  }

 private:
  std::optional<Action> action_;
};

/// An Action with input In and output Out; each may be void. It is called like a function: `joint.rotate(43.6F)`.
/// @par Threads  Any. The call blocks as Action::invoke().
template <class In, class Out>
class TypedAction : public UntypedAction {
 public:
  /// Made by generated code.
  TypedAction(std::optional<Action> action, ValueForm input, ValueForm output) : UntypedAction(std::move(action)), input_(input), output_(output) {}

  /// Invokes the action.
  /// @par Errors  those of Action::invoke()
  Result<TypedInvocation<Out>> operator()(const In& input, InvokeOptions options = {}) const {
    const Result<Action> action = this->action();
    if (!action) return Unexpected{action.error()};
    options.unit = input_.unit;
    Result<Invocation> run = action->invoke(*input_.type, rdf::traits<In>::encode(input), options);
    if (!run) return Unexpected{std::move(run).error()};
    return TypedInvocation<Out>(*std::move(run), output_);
  }

 private:
  ValueForm input_, output_;
};
/// An Action without input.
/// @par Threads  Any. The call blocks as Action::invoke().
template <class Out>
class TypedAction<void, Out> : public UntypedAction {
 public:
  /// Made by generated code.
  TypedAction(std::optional<Action> action, const ValueForm&, ValueForm output) : UntypedAction(std::move(action)), output_(output) {}

  /// Invokes the action.
  /// @par Errors  those of Action::invoke()
  Result<TypedInvocation<Out>> operator()(const InvokeOptions& options = {}) const {
    const Result<Action> action = this->action();
    if (!action) return Unexpected{action.error()};
    Result<Invocation> run = action->invoke(options);
    if (!run) return Unexpected{std::move(run).error()};
    return TypedInvocation<Out>(*std::move(run), output_);
  }

 private:
  ValueForm output_;
};

/// Finds the members of a Thing for a generated class, and records which are missing.
/// @par Threads  One thread at a time.
/// @par Time     Sends no request.
class LRT_API Members {
 public:
  /// @param thing    the Thing
  /// @param kind     name of the class, for messages
  /// @param classes  IRIs that the Thing must have as rdf:type
  Members(Thing thing, std::string kind, const std::vector<std::string>& classes);

  const Thing& thing() const noexcept { return thing_; }  ///< the Thing
  /// @{
  /// A member; nullopt: the Thing does not have it.
  /// @param predicate  predicate from the Thing to it; empty: only the name is compared
  /// @param name       its name
  /// @param required   a missing member is an error of fits()
  std::optional<Property> property(std::string_view predicate, std::string_view name, bool required);
  std::optional<Action> action(std::string_view predicate, std::string_view name, bool required);
  /// @}
  /// Whether the Thing fits the class.
  /// @par Errors  expected_value: what is missing
  Result<void> fits() const;

 private:
  void miss(const std::string& what);

  Thing thing_;
  std::string kind_, missing_;
};

/// The Things of a robot that fit a generated class.
/// @par Threads  Any.
/// @par Time     Sends no request.
template <class T>
std::vector<T> all_of(const Robot& robot) {
  std::vector<T> all;
  for (const Thing& thing : robot.things())
    if (Result<T> one = T::of(thing)) all.push_back(*std::move(one));
  return all;
}

}  // namespace v0
}  // namespace lrt::client
