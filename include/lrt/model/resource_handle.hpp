// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include <lrt/base/abi.hpp>
#include <lrt/base/misuse.hpp>
#include <lrt/base/unique_function.hpp>
#include <lrt/model/detail/callables.hpp>
#include <lrt/model/detail/slot.hpp>
#include <lrt/model/dispatch.hpp>
#include <lrt/model/statement.hpp>
#include <lrt/rdf/type.hpp>

namespace lrt {
inline namespace v0 {
struct FromInput;
}  // namespace v0
}  // namespace lrt

namespace lrt::model {
inline namespace v0 {

/// @cond internal
/// Whether a callable that returns R can refuse by it, or never refuses.
template <class R>
inline constexpr bool refuses_by_result = std::is_void_v<R> || std::is_convertible_v<R, Result<void>>;

/// What a callable of the user returns: void is success.
template <class F>
Result<void> result_of(F f) {
  if constexpr (std::is_void_v<std::invoke_result_t<F&>>) {
    f();
    return {};
  } else {
    return f();
  }
}

struct ResourceSpec;
class ActionSetup;
class ChangeSignal;

/// The part of a handle that is compiled into the library. It points to the description of the resource, whose layout is
/// in src/model/spec.hpp. Functions that change the description expect that is_editable() has returned true.
class LRT_API ResourceSetup {
 public:
  /// False for an empty handle.
  explicit operator bool() const noexcept { return spec_ != nullptr; }

 protected:
  ResourceSetup() noexcept = default;
  explicit ResourceSetup(std::shared_ptr<ResourceSpec> spec) noexcept : spec_(std::move(spec)) {}
  // Compiled once: there is a handle for each type of the user.
  ResourceSetup(const ResourceSetup& other) noexcept;
  ResourceSetup(ResourceSetup&& other) noexcept;
  ResourceSetup& operator=(const ResourceSetup& other) noexcept;
  ResourceSetup& operator=(ResourceSetup&& other) noexcept;
  ~ResourceSetup();

  /// Whether set-up calls have an effect: the handle is not empty, and its thing was not added to a server yet. If not,
  /// this logs the call, and a check of the headers fails.
  bool is_editable(const char* call) const noexcept {
    if (is_open()) return true;
    report_late(call, ::lrt::detail::checks);
    return false;
  }
  /// The call got a null function: Server::add() returns the error.
  void refuse_null(const char* call);
  /// Reports a call on an empty handle.
  void report_empty(const char* call) const noexcept;

  rdf::Facets& facets_of() noexcept;
  void set_dispatch(Dispatch where) noexcept;
  void set_max_body_bytes(std::size_t n) noexcept;
  void set_harmless() noexcept;
  void add_predicate(std::string iri);
  void add_class(std::string iri);
  void add_statement(std::string predicate, Object object);
  void add_text(Iri predicate, std::string text, std::string language);
  /// Its usual path below the root: "/arm/angle", "/arm/actions/turn"; empty for an empty handle.
  std::string location() const;

  std::shared_ptr<ResourceSpec> spec_;

 private:
  friend class ActionSetup;  // reads the properties that an action changes
  bool is_open() const noexcept;
  void report_late(const char* call, bool checks) const noexcept;
};

/// What the library sets in the description of a property.
class LRT_API PropertySetup : public ResourceSetup {
 protected:
  using ResourceSetup::ResourceSetup;
  PropertySetup() noexcept = default;

  void set_write(WriteFunction write);
  /// For values with parts: records, maps, alternatives. @pre set_write()
  void allow_patches() const noexcept;
  void set_life(std::chrono::milliseconds life, LapseFunction lapse);
  void set_frame(Object system);
  void set_max_age(std::chrono::milliseconds age, std::chrono::milliseconds while_revalidating);
  /// @param whole  of a value that a client writes
  void add_representation(std::string_view media_type, EncodeFunction encode, Layout layout, WholeFunction whole);
  void set_octets() noexcept;
  void set_file() noexcept;
  void set_counter() noexcept;
  void set_sample_period(std::chrono::milliseconds period) noexcept;
};

/// A property and what notifies the engine of its changes.
class LRT_API PulledSetup : public PropertySetup {
 public:
  PulledSetup() noexcept;
  PulledSetup(std::shared_ptr<ResourceSpec> spec, std::shared_ptr<ChangeSignal> changes) noexcept;
  PulledSetup(const PulledSetup& other) noexcept;
  PulledSetup(PulledSetup&& other) noexcept;
  PulledSetup& operator=(const PulledSetup& other) noexcept;
  PulledSetup& operator=(PulledSetup&& other) noexcept;
  ~PulledSetup();

 protected:
  std::shared_ptr<ChangeSignal> changes_;
};

/// A property and the slot of its values.
class LRT_API PushedSetup : public PropertySetup {
 public:
  PushedSetup() noexcept;
  PushedSetup(std::shared_ptr<ResourceSpec> spec, std::shared_ptr<SlotBase> slot) noexcept;
  PushedSetup(const PushedSetup& other) noexcept;
  PushedSetup(PushedSetup&& other) noexcept;
  PushedSetup& operator=(const PushedSetup& other) noexcept;
  PushedSetup& operator=(PushedSetup&& other) noexcept;
  ~PushedSetup();

 protected:
  /// Before the slot is used by its writer: false if the handle is empty. With checks that is reported, and so is a second
  /// writer, which gets false, too. After true, end_write() follows.
  bool begin_write(const char* call) const noexcept {
    if constexpr (::lrt::detail::checks) {
      if (slot_ && slot_->begin_write()) return true;
      slot_ ? report_second_writer(call) : report_empty(call);
      return false;
    } else {
      return slot_ != nullptr;
    }
  }
  void end_write() const noexcept {
    if constexpr (::lrt::detail::checks) slot_->end_write();
  }

  void set_keep(std::size_t samples);

  std::shared_ptr<SlotBase> slot_;

 private:
  void report_second_writer(const char* call) const noexcept;
};

/// What the library sets in the description of an action.
class LRT_API ActionSetup : public ResourceSetup {
 protected:
  using ResourceSetup::ResourceSetup;
  ActionSetup() noexcept = default;

  rdf::Facets& output_facets_of() noexcept;
  void set_policy(ActionPolicy policy) noexcept;
  void set_stop() noexcept;
  void set_requires_expiry() noexcept;
  void set_ends_soon() noexcept;
  /// @{
  /// Declares a stop state.
  void set_stop_state(UniqueFunction<bool()> state, const ResourceSetup& release);
  void set_stop_state(const ResourceSetup& property, const ResourceSetup& release);
  /// @}
  void merge_field_facets(std::string_view field, const rdf::Facets& facets);
  /// @param from_input  nullptr: any other value
  void add_effect(const ResourceSetup& property, const FromInput* from_input);
  void add_effect(const ResourceSetup& property, rdf::Value value);
  void add_effect(std::string_view property, const FromInput* from_input);
  void add_effect_turtle(std::string text);
  void add_header(std::string name, std::string value);
  void add_part(const ResourceSetup& part);
  void add_part(std::string_view part);
  /// @param reason  nullptr: the action is available
  void set_unavailable(const char* reason) noexcept;
};

/// What the library sets in the description of a collection.
class LRT_API CollectionSetup : public ResourceSetup {
 protected:
  using ResourceSetup::ResourceSetup;
  CollectionSetup() noexcept = default;

  void set_create(CreateFunction create);
  void set_remove(RemoveFunction remove);
  void set_max_members(std::size_t n) noexcept;
};
/// @endcond

/// The common part of the handles of properties, actions and collections. They describe a resource before its thing is
/// added to a server. Copies are handles to the same resource. In a condition a handle is false if it is empty.
///
/// A set-up call after Server::add() has no effect: it writes one message with the resource and the call to the
/// server's log callback, and fails a check of the headers (base/misuse.hpp). A call on an empty handle fails a check, too.
///
/// @tparam Self   the handle that the calls return
/// @tparam Setup  internal: the part that is compiled into the library
/// @par Errors   Set-up calls do not fail. Server::add() returns the first error of a thing.
/// @par Threads  One thread at a time.
template <class Self, class Setup>
class ResourceHandle : public Setup {
 public:
  /// Sets the unit of the numbers. Values are never converted.
  Self& unit(const Unit& u) {
    if (this->is_editable("unit")) this->facets_of().unit(u);
    return self();
  }
  /// Sets the lower bound of numbers from clients; `v` itself is allowed. A number outside the bounds is answered with
  /// 422. Values that the robot reads or publishes are not checked.
  Self& at_least(double v) {
    if (this->is_editable("at_least")) this->facets_of().at_least(v);
    return self();
  }
  /// Sets the lower bound, see at_least(); `v` itself is not allowed.
  Self& above(double v) {
    if (this->is_editable("above")) this->facets_of().above(v);
    return self();
  }
  /// Sets the upper bound, see at_least(); `v` itself is allowed.
  Self& at_most(double v) {
    if (this->is_editable("at_most")) this->facets_of().at_most(v);
    return self();
  }
  /// Sets the upper bound, see at_least(); `v` itself is not allowed.
  Self& below(double v) {
    if (this->is_editable("below")) this->facets_of().below(v);
    return self();
  }
  /// Sets both bounds, see at_least(); they themselves are allowed.
  Self& between(double low, double high) {
    if (this->is_editable("between")) this->facets_of().between(low, high);
    return self();
  }
  /// Accepts NaN and infinities from clients, and allows them in the published shape. Values that the robot itself
  /// publishes are represented in any case.
  Self& allow_non_finite() {
    if (this->is_editable("allow_non_finite")) this->facets_of().allow_non_finite();
    return self();
  }
  /// Bounds the length of a text, in code points.
  Self& length(std::size_t min, std::size_t max) {
    if (this->is_editable("length")) this->facets_of().length(min, max);
    return self();
  }

  /// Sets where the resource's lambdas run, and an action's on_cancel hook. Default: as the thing's lambdas. With
  /// Dispatch::io_thread a command does not wait for Server::poll: an emergency stop that sets an atomic flag works
  /// while the host is busy.
  Self& dispatch(Dispatch where) {
    if (this->is_editable("dispatch")) this->set_dispatch(where);
    return self();
  }

  /// Limits the body of a PUT or POST, in bytes; more: 413 before the body is received. Default: what a value of the
  /// type needs (engine::Limits::max_scalar_body_bytes). transport::Limits::max_body_bytes also applies.
  Self& max_body_bytes(std::size_t n) {
    if (this->is_editable("max_body_bytes")) this->set_max_body_bytes(n);
    return self();
  }

  /// States that what clients command here moves nothing: it stays available while the Thing, or one above it, is stopped
  /// (Action::stop). Examples: to switch on a lamp, to save a log, to set a name. Without a stop state it has no effect.
  Self& harmless() {
    if (this->is_editable("harmless")) this->set_harmless();
    return self();
  }

  /// Adds a domain predicate from the thing to this resource, in addition to hybrit:property or hybrit:action (R1.9,
  /// R1.10).
  Self& predicate(Iri p) {
    if (this->is_editable("predicate")) this->add_predicate(std::string(p.text));
    return self();
  }
  /// Adds an rdf:type (R1.4).
  Self& type(Iri t) {
    if (this->is_editable("type")) this->add_class(std::string(t.text));
    return self();
  }
  /// Sets what people call the resource, in one language: dcterms:title, and sh:name in the Blueprint of a property. Each
  /// call adds a language; what clients get in JSON depends on Accept-Language.
  ///
  ///     width.title("Width", "en").title("Breite", "de");
  ///
  /// @param language  language tag (BCP 47); empty: none is stated
  /// @par Errors      expected_rdf (the language tag), invalid_option (a language twice): from Server::add()
  /// @par Implements  R1.12
  Self& title(std::string text, std::string language = {}) {
    if (this->is_editable("title")) this->add_text(vocab::dcterms::title, std::move(text), std::move(language));
    return self();
  }
  /// Adds a sentence or more about the resource, in one language: dcterms:description, and sh:description in the Blueprint
  /// of a property. See title().
  Self& description(std::string text, std::string language = {}) {
    if (this->is_editable("description")) this->add_text(vocab::dcterms::description, std::move(text), std::move(language));
    return self();
  }
  /// Adds a triple about the resource (R1.12).
  Self& add(Iri predicate, Object object) {
    if (this->is_editable("add")) this->add_statement(std::string(predicate.text), std::move(object));
    return self();
  }

 protected:
  /// @cond internal
  using Setup::Setup;
  ResourceHandle() noexcept = default;
  explicit ResourceHandle(Setup&& setup) noexcept : Setup(std::move(setup)) {}

  Self& self() noexcept { return static_cast<Self&>(*this); }
  /// @endcond
};

}  // namespace v0
}  // namespace lrt::model
