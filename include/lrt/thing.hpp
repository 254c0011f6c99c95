// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include <lrt/action.hpp>
#include <lrt/base/abi.hpp>
#include <lrt/base/misuse.hpp>
#include <lrt/collection.hpp>
#include <lrt/control.hpp>
#include <lrt/model/detail/callables.hpp>
#include <lrt/model/detail/slot.hpp>
#include <lrt/model/dispatch.hpp>
#include <lrt/property.hpp>

namespace lrt::model {
inline namespace v0 {
struct PropertySpec;
struct ThingSpec;
struct WorldSpec;
}  // namespace v0
}  // namespace lrt::model

namespace lrt::rdf {
inline namespace v0 {
class DynamicType;
}  // namespace v0
}  // namespace lrt::rdf

namespace lrt {
inline namespace v0 {

/// The description of a Linked Robotic Thing: its types, properties, actions and collections. Pass it to Server::add()
/// when it is complete. The thing stores the first error of its calls, and add() returns it.
///
///     lrt::Thing joint{"baxter/right_s1"};
///     joint.property("rotation", [&] { return angle; }, lrt::unit::radian);
///     joint.action("rotate", [&](double target, lrt::Responder done) {
///       angle = target;
///       done.succeed();
///     });
///
/// @par Names    Things, properties, actions and collections may have any name. lrt uses names of its own below a
///               thing: `state`, `blueprint`, `subscriptions`, `all`, `control`, and `actions/` before the name of an action. If
///               the user gives one of these paths to something else, also later and as the path of another Thing,
///               lrt's resource gets `-lrt` after its name ("arm/state-lrt", "arm/actions-lrt/turn") as long as the
///               user's resource exists. The same holds for the Blueprints of kinds below "blueprints". Clients follow
///               links, so they find both. Some paths are reserved: docs/things.md.
/// @par Threads  Set-up only: one thread at a time. Different Things: any. The lambdas run where their Dispatch says.
/// @par Implements  R0.3, R1.1, R1.3
class LRT_API Thing {
 public:
  /// @param path  its path below the server's root: "baxter/right_s1" or "/baxter/right_s1". A Thing at a prefix of the
  ///              path is its parent. Names are percent-encoded.
  /// @par Errors  expected_iri (an empty name, "." or ".."; the message says what to write), duplicate_path: from
  ///              Server::add()
  explicit Thing(std::string_view path);
  Thing(Thing&&) noexcept;
  Thing& operator=(Thing&&) noexcept;
  ~Thing();

  /// Adds an rdf:type. Every thing has the type hybrit:RoboticThing (R1.3, R1.4).
  Thing& type(Iri type);
  /// Sets what people call the thing, in one language: dcterms:title. Each call adds a language. Default: the last segment
  /// of the path, without a language.
  /// @param language  language tag (BCP 47); empty: none is stated
  /// @par Errors      expected_rdf (the language tag), invalid_option (a language twice): from Server::add()
  Thing& title(std::string text, std::string language = {});
  /// Adds a sentence or more about the thing, in one language: dcterms:description. See title().
  Thing& description(std::string text, std::string language = {});
  /// Adds a triple about the thing (R1.12).
  Thing& add(Iri predicate, Object object);
  /// Adds a Turtle document. Its base is the thing's IRI, so `<>` is the thing.
  Thing& add_turtle(std::string text);
  /// Refers to an external Blueprint by its IRI instead of the generated one (R1.11).
  Thing& blueprint(Iri external);
  /// Adds SHACL shapes in Turtle to the thing's own Blueprint, whose IRI is their base. A shape with one of these names
  /// replaces the generated one: `<#rotation>` for values of the property "rotation", `<#actions/rotate/input>` for the
  /// input of the action "rotate" (`<#actions-lrt/rotate/input>` if there is a property "actions/rotate/input"),
  /// `<#waypoints>` for members of the collection "waypoints", `<>` for the thing. If a body does not conform, the
  /// client gets 422 with the report, and no lambda is called.
  /// @par Errors      expected_rdf, expected_value (an ill-formed shape, with its triple): from Server::add()
  /// @par Implements  R1.11, paper 5.1
  Thing& shapes(std::string turtle);
  /// As shapes(), from a file.
  /// @par Errors  io_error: from Server::add()
  Thing& shapes_from_file(const std::string& path);
  /// Sets where the thing's lambdas run.
  Thing& dispatch(Dispatch where);
  /// Calls the thing's lambdas only while an object exists: that whose reference or `this` they captured. During a call
  /// it cannot be destroyed; if the call holds its last std::shared_ptr, the destructor runs on the lambda's thread. Each call of
  /// guard() adds an object. It does not matter whether guard() is called before or after property() and action().
  ///
  ///     thing.property("angle", [this] { return angle_; });
  ///     thing.guard(weak_from_this());       // or a std::shared_ptr
  ///
  /// If the object is gone, the client gets 503 with the reason for what needs a lambda: values that are read, writes, actions,
  /// members. What was published stays readable. Use a Registration as well, so that the Thing goes with the object.
  /// @par Errors   invalid_option (the object is gone already): from Server::add()
  Thing& guard(std::weak_ptr<void> object);
  /// Requires that each command for this thing and for the things below it says until when it is worth carrying out: POST
  /// of an action or of a member of a collection, PUT, PATCH and DELETE. Its sender adds to the stamp in the field
  /// Robot-Time of a response how long the command may take, and sends that in the field Valid-Until. Without it the
  /// response is 428, and says how curl sends it. A command that comes later, or just before its lambda would run is
  /// later, gets 412 and has no effect. A stop and the cancelling of an invocation never need it.
  Thing& requires_expiry();
  /// Sets max_age() for the representations of the thing and of its state (lrt:state), which contains all its values.
  /// See model::PropertyHandle::max_age().
  Thing& max_age(std::chrono::milliseconds age, std::chrono::milliseconds while_revalidating = {});

  /// Lets clients take control of the thing and of all things below it. A lease, the resource `control` below the thing,
  /// is held by one client at a time; while it is held, commands of other clients get 409, which says who has control and
  /// until when: POST of actions, PUT of properties, changes of collections. A stop, the release of a stop and
  /// the cancelling of an invocation need no control, nor do the graphs of a World.
  ///
  /// A client takes control by POST for 10 s (`?life=`, 1 to 60), renews it by PUT and gives it back by DELETE. A client with a
  /// principal has control by its name. Another one gets a secret id (128 bits), and sends it with each command in the
  /// field Control-Id. A client with the right security::Right::control takes over from another one (`Take-Over: ?1`). Nobody else
  /// has control of a thing above or below meanwhile. No lease survives the server.
  /// docs/actions.md has examples.
  /// @par Implements  SPEC 3.23
  Thing& control(ControlOptions options = {});

  /// Exposes a readable value as a pulled Property: GET calls `read` and renders the result with rdf::traits<T>.
  ///
  /// @param path  relative to the thing, without a leading '/': "rotation", "arm/j1".
  /// @param read  callable `T()`, with rdf::traits<T>. It returns numbers in `unit`; they are not converted.
  /// @param unit  unit of the numbers, for example unit::radian
  /// @return      handle, for predicates, types, bounds and on_write
  /// @par Errors      expected_iri, duplicate_path: from Server::add(). If `read` throws, a GET is answered with 500; the state of the thing
  ///                  has the other values, and says why this one is missing.
  /// @par Threads     `read` runs where dispatch() of the property says, never concurrently with itself.
  /// @par Time        Expects `read` to return within one control period.
  /// @par Implements  R0.3, R0.9, R1.9
  template <class Read>
  auto property(std::string_view path, Read read, const Unit& unit = unit::none) {
    if constexpr (!std::is_invocable_v<Read&>) {
      static_assert(rdf::detail::always_false<Read>,
                    "lrt: property expects a callable without parameters that returns the value: property(path, [] { return value; }); a value "
                    "that is published needs its type: property<double>(path, unit)");
      return PulledProperty<bool>();
    } else if constexpr (std::is_void_v<std::invoke_result_t<Read&>>) {
      static_assert(rdf::detail::always_false<Read>, "lrt: the callable of a property returns nothing; return the value");
      return PulledProperty<bool>();
    } else {
      if constexpr (detail::checks) report_moved("property");
      using T = rdf::detail::stored_t<std::invoke_result_t<Read&>>;
      if constexpr (model::can_be_null<Read>)
        if (!read) return PulledProperty<T>(new_pulled(path, rdf::traits<T>::type(), unit, {}));
      return PulledProperty<T>(new_pulled(path, rdf::traits<T>::type(), unit, [read = std::move(read)](bool whole) mutable {
        T value(read());
        model::Reading reading{rdf::traits<T>::encode(value), nullptr};
        if (whole) model::keep_whole(reading, new T(std::move(value)), model::delete_value<T>);
        return reading;
      }));
    }
  }
  /// Exposes a value as a pushed Property: the control loop passes it to publish(), and the server answers GET without
  /// the host's thread. Before the first publish() the property has no value.
  ///
  /// @tparam T    type of the value, with rdf::traits<T>, a default constructor and copies
  /// @param path  relative to the thing, without a leading '/'
  /// @param unit  unit of the numbers, which are not converted
  /// @return      handle, for publish(), predicates, types, bounds and on_write
  /// @par Errors      expected_iri, duplicate_path: from Server::add()
  /// @par Implements  R0.3, R0.9, R1.9
  template <class T>
  PushedProperty<T> property(std::string_view path, const Unit& unit = unit::none) {
    if constexpr (!std::is_default_constructible_v<T> || !std::is_copy_constructible_v<T> || !std::is_copy_assignable_v<T>) {
      static_assert(rdf::detail::always_false<T>,
                    "lrt: values that are published need a default constructor and copies; add them, or let a lambda return the value: "
                    "property(path, [] { return value; })");
      return PushedProperty<T>();
    } else {
      if constexpr (detail::checks) report_moved("property");
      return PushedProperty<T>(new_pushed(path, rdf::traits<T>::type(), unit, model::new_slot<T>()));
    }
  }

  /// As property(path, read), for a type that is made at run time: with `#include <lrt/rdf/dynamic_type.hpp>`.
  ///
  /// @param type  of the value, see rdf::DynamicType
  /// @param read  callable that returns an rdf::Value of the type, or a Result of one. An error is answered with 500.
  /// @par Errors  invalid_option (`type` is none), and those of the other property(): from Server::add()
  template <class Read>
  PulledProperty<rdf::Value> property(std::string_view path, const rdf::DynamicType& type, Read read, const Unit& unit = unit::none) {
    if constexpr (!std::is_invocable_r_v<Result<rdf::Value>, Read&>) {
      static_assert(rdf::detail::always_false<Read>,
                    "lrt: a property of a DynamicType expects a callable that returns an rdf::Value or a Result of one: "
                    "property(path, type, [] { return lrt::rdf::Value(1.5); })");
      return PulledProperty<rdf::Value>();
    } else {
      if constexpr (detail::checks) report_moved("property");
      if constexpr (model::can_be_null<Read>)
        if (!read) return PulledProperty<rdf::Value>(new_pulled(path, kept_type(path, type), unit, {}));
      return PulledProperty<rdf::Value>(new_pulled(path, kept_type(path, type), unit, [read = std::move(read)](bool whole) mutable {
        Result<rdf::Value> value = read();
        return model::reading_of(std::move(value), whole);
      }));
    }
  }
  /// As property<T>(path), for a type that is made at run time: publish() takes an rdf::Value of the type. It allocates,
  /// as for each T that owns memory. For a control loop that must not, use property<double>(path) and the like.
  /// @par Errors  as those of the other property() with a type
  PushedProperty<rdf::Value> property(std::string_view path, const rdf::DynamicType& type, const Unit& unit = unit::none);

  /// Exposes a command as an Action below `actions/`.
  ///
  /// The status of the response to a POST states the outcome of the command. The server waits, at most Limits::host_timeout, for the
  /// result of a synchronous `f` and for the return of an asynchronous one.
  ///
  /// | status                      | meaning |
  /// |-----------------------------|---------|
  /// | 204, or 200 with the output | the invocation has succeeded; an asynchronous one may still run |
  /// | 202                         | not known yet: the client prefers not to wait, the invocation is in the queue, or `f` takes longer |
  /// | 409                         | not available, excluded by the policy, cancelled, or `f` failed with Errc::refused, out_of_range or limit_exceeded |
  /// | 422                         | the input is not valid, or `f` failed with Errc::expected_value |
  /// | 429                         | the queue of the action is full, or the client has too many invocations |
  /// | 500                         | `f` failed with another error or threw, or the Responder was destroyed |
  /// | 503                         | `f` did not begin within the time, and will never begin |
  ///
  /// If there is an invocation, the response has its URI in Location.
  ///
  /// @param path  relative to `actions/`: "rotate"
  /// @param f     `R()`, `R(In)`: synchronous, R is void, a type with traits, or a Result of these; `void(Responder)`,
  ///              `void(In, Responder)`, `void(In, ResponderOf<Out>)`: asynchronous. In may be std::string_view or
  ///              const char* if the action is synchronous: the text is valid during the call.
  /// @return      handle, for unit and bounds, policy, effects and availability
  ///
  /// @par Errors   expected_iri, duplicate_path: from Server::add()
  /// @par Threads  `f` runs where Action::dispatch() says.
  /// @par Implements  R0.5, R0.8, R1.10, paper 5.4
  template <class F>
  Action action(std::string_view path, F f) {
    if constexpr (!model::check_action<F>()) {
      return Action();
    } else {
      if constexpr (detail::checks) report_moved("action");
      using Shape = model::ActionShape<F>;
      const rdf::Type* input = nullptr;
      const rdf::Type* output = nullptr;
      if constexpr (!std::is_void_v<typename Shape::Input>) input = &rdf::traits<typename Shape::Input>::type();
      if constexpr (Shape::asynchronous) {
        using Out = typename model::ResponderTraits<typename Shape::Last>::Output;
        if constexpr (!std::is_void_v<Out>) output = &rdf::traits<Out>::type();
      } else {
        using Out = typename model::Unwrapped<typename Shape::Return>::type;
        if constexpr (!std::is_void_v<Out>) output = &rdf::traits<Out>::type();
      }
      if constexpr (model::can_be_null<F>)
        if (!f) return Action(new_action(path, input, output, Shape::asynchronous, {}));
      return Action(new_action(path, input, output, Shape::asynchronous, model::erase_action(std::move(f))));
    }
  }

  /// As action(path, f), for types that are made at run time.
  ///
  /// @param input,output  types of the input and of the output, see rdf::DynamicType; none: `rdf::DynamicType()`
  /// @param f             as above, with rdf::Value as input and output. It has a parameter of rdf::Value exactly if
  ///                      `input` is a type, and returns one, or has a ResponderOf<rdf::Value>, exactly if `output` is one.
  /// @par Errors  invalid_option (`f` does not fit the types), and those of the other action(): from Server::add()
  template <class F>
  Action action(std::string_view path, const rdf::DynamicType& input, const rdf::DynamicType& output, F f) {
    if constexpr (!model::check_action<F>()) {
      return Action();
    } else {
      using Shape = model::ActionShape<F>;
      using Out = typename model::OutputOf<F>::type;
      constexpr bool takes = !std::is_void_v<typename Shape::Input>, gives = !std::is_void_v<Out>;
      static_assert((!takes || std::is_same_v<typename Shape::Input, rdf::Value>)&&(!gives || std::is_same_v<Out, rdf::Value>),
                    "lrt: an action with types that are made at run time takes and gives rdf::Value");
      if constexpr (detail::checks) report_moved("action");
      if constexpr (model::can_be_null<F>)
        if (!f) return Action(new_action(path, input, output, takes, gives, Shape::asynchronous, {}));
      return Action(new_action(path, input, output, takes, gives, Shape::asynchronous, model::erase_action(std::move(f))));
    }
  }

  /// Exposes a container of values. Clients create and remove its members.
  /// @param path   relative to the thing, without a leading '/'
  /// @return       handle, for on_create, on_remove, unit and bounds
  /// @par Errors   expected_iri, duplicate_path: from Server::add()
  /// @par Implements  R0.5, R0.8, LDP 5.2
  template <class T>
  Collection<T> collection(std::string_view path) {
    if constexpr (detail::checks) report_moved("collection");
    return Collection<T>(new_collection(path, rdf::traits<T>::type()));
  }

  /// As collection<T>(path), for a type that is made at run time.
  /// @par Errors  invalid_option (`type` is none), and those of the other collection(): from Server::add()
  Collection<rdf::Value> collection(std::string_view path, const rdf::DynamicType& type);

  /// The path in percent-encoded form; empty after the thing was moved from.
  const std::string& path() const noexcept;

  /// @cond internal
  /// For libraries: sets the title that the thing has until the user gives one.
  Thing& default_title(std::string text);
  /// For libraries: as property<T>(path), for a T whose values are of a type that is made at run time.
  template <class T>
  PushedProperty<T> pushed(std::string_view path, const rdf::DynamicType& type, const Unit& unit = unit::none) {
    if constexpr (detail::checks) report_moved("property");
    return PushedProperty<T>(new_pushed(path, kept_type(path, type), unit, model::new_slot<T>()));
  }
  /// For the engine and the server: the part that a World has; nullptr: the thing is not a World.
  const model::WorldSpec* world() const noexcept;
  /// For the server: the description. After the thing was moved from: a new one, whose error add() returns.
  model::ThingSpec& described();
  /// For the engine: moves the description out. The thing is empty afterwards.
  std::unique_ptr<model::ThingSpec> release() && noexcept;
  /// @endcond

 private:
  friend class World;
  std::shared_ptr<model::PropertySpec> new_property(std::string_view path, const rdf::Type& type, const Unit& unit);
  model::PulledSetup new_pulled(std::string_view path, const rdf::Type& type, const Unit& unit, model::ReadFunction read);
  model::PushedSetup new_pushed(std::string_view path, const rdf::Type& type, const Unit& unit, std::unique_ptr<model::SlotBase> slot);
  /// @param input,output  nullptr: none
  std::shared_ptr<model::ResourceSpec> new_action(std::string_view path, const rdf::Type* input, const rdf::Type* output, bool asynchronous,
                                                  model::StartFunction start);
  std::shared_ptr<model::ResourceSpec> new_collection(std::string_view path, const rdf::Type& type);
  /// The type, or another one if there is none: then an error is remembered.
  const rdf::Type& kept_type(std::string_view path, const rdf::DynamicType& type);
  std::shared_ptr<model::ResourceSpec> new_action(std::string_view path, const rdf::DynamicType& input, const rdf::DynamicType& output, bool takes,
                                                  bool gives, bool asynchronous, model::StartFunction start);
  void set_path(model::ResourceSpec& spec, std::string_view path, const char* what);
  void remember(Error error);
  /// Reports a call on a thing that was moved from.
  void report_moved(const char* call) const noexcept;

  std::unique_ptr<model::ThingSpec> spec_;
};

}  // namespace v0
}  // namespace lrt
