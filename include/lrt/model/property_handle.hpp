// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <string_view>
#include <type_traits>
#include <utility>

#include <lrt/model/representation.hpp>
#include <lrt/model/resource_handle.hpp>
#include <lrt/rdf/traits.hpp>

namespace lrt {
inline namespace v0 {
template <class T>
class PushedProperty;
template <class T>
class PulledProperty;
}  // namespace v0
}  // namespace lrt

namespace lrt::model {
inline namespace v0 {

/// @cond internal
/// The compiled part of a property's handle.
template <class Self>
struct SetupOf;
template <class T>
struct SetupOf<PushedProperty<T>> {
  using type = PushedSetup;
};
template <class T>
struct SetupOf<PulledProperty<T>> {
  using type = PulledSetup;
};
/// @endcond

/// The common part of PushedProperty and PulledProperty: writing, unit and bounds, caching, and representations that
/// the user encodes. Unit, bounds, title, predicates and dispatch are those of ResourceHandle.
///
/// @par Threads  Set-up: one thread at a time, before Server::add().
template <class Self, class T>
class PropertyHandle : public ResourceHandle<Self, typename SetupOf<Self>::type> {
  using Setup = typename SetupOf<Self>::type;
  using Base = ResourceHandle<Self, Setup>;

 public:
  /// Makes the property writable: the server reads and validates the body of a PUT as a T, and calls `write`. A
  /// following GET shows the written value until the robot publishes or returns another one.
  ///
  /// If T is a record or a map, clients may also change parts of the value by PATCH. Then the server takes the present value
  /// (of a pulled property it calls `read`, just before `write` and in the same job; of a pushed one the value that was
  /// published or written last), merges the parts, judges the whole as that of a PUT, and calls `write` with it.
  ///
  /// @param write  callable of T that returns void or Result<void>
  /// @par Errors   of `write`. refused, out_of_range, limit_exceeded: 409 with the message. expected_value: 422.
  ///               Another error, or an exception: 500. A body that is not a T within the bounds is answered with 400,
  ///               415 or 422, and `write` is not called.
  /// @par Threads  `write` runs where dispatch() says.
  /// @par Implements  R0.5
  template <class F>
  Self& on_write(F write) {
    if constexpr (!std::is_invocable_v<F&, T>) {
      static_assert(rdf::detail::always_false<F>,
                    "lrt: on_write expects a callable void(T) or Result<void>(T), where T is the property's type; write [](T value) { ... }");
      return static_cast<Self&>(*this);
    } else if constexpr (!refuses_by_result<std::invoke_result_t<F&, T>>) {
      static_assert(rdf::detail::always_false<F>,
                    "lrt: the callable of on_write returns void or Result<void>; write -> lrt::Result<void> and return lrt::refused(\"reason\")");
      return static_cast<Self&>(*this);
    } else {
      if constexpr (can_be_null<F>)
        if (!write) return this->refuse_null("on_write"), this->self();
      if (this->is_editable("on_write")) {
        this->set_write([write = std::move(write)](const rdf::Value& v) mutable -> Result<void> {
          if constexpr (rdf::detail::is_decoded_in_place<T>) {
            T value{};
            if (Result<void> r = rdf::traits<T>::decode_fields(v, value); !r) return r;
            return result_of([&] { return write(std::move(value)); });
          } else {
            Result<T> value = rdf::traits<T>::decode(v);
            if (!value) return Unexpected{std::move(value).error()};
            return result_of([&] { return write(*std::move(value)); });
          }
        });
        if constexpr (rdf::detail::may_have_parts<T>) this->allow_patches();
      }
      return this->self();
    }
  }

  /// Gives a written value a life: unless a client writes the property again in time, `lapse` is called, once for each
  /// lapse. So a drive command without a driver stops the base:
  ///
  ///     auto drive = base.property<double>("drive", unit::metre_per_second);
  ///     drive.on_write([&](double speed) { wheels.set(speed); });
  ///     drive.expires(std::chrono::milliseconds(200), [&]() noexcept { wheels.set(0); });
  ///
  /// A write renews the life when `on_write` has returned without an error, also with an equal value; the life counts from
  /// the call of `on_write`. A refused write renews nothing. If `on_write` throws, the value may have been set: it has a
  /// life as before, or a new one. What the robot itself publishes or returns renews nothing and ends no life. Clients read
  /// the life as lrt:expiresAfter, in seconds, and write about three times in it.
  ///
  /// Time is that of the server's monotonic clock. If the host's loop is late, `lapse` is called before the next write is
  /// carried out. When the server stops, nobody can renew a value: each life is over at once, and `lapse` is called by
  /// stop() if that runs on the thread that polls, else by run() or the next poll(). If the thing is removed, `lapse` is not called.
  /// A loop that hangs calls nothing: only a watchdog of the hardware stops such a robot (docs/safety.md).
  ///
  /// @param life   1 ms to 1 h
  /// @param lapse  callable without parameters. If it throws, the log says so, and it is not called again for this lapse.
  ///               Publish what it has set: until then clients read the written value.
  /// @par Errors   invalid_option (no on_write(), or the life is out of range): from Server::add()
  /// @par Threads  `lapse` runs where `on_write` runs: in poll() within its budget, on lrt's thread with Dispatch::io_thread.
  ///               Never concurrently with `on_write`, except with Dispatch::executor.
  /// @par Time     poll() takes no lock and allocates nothing for it, and checks the clock while a value has a life.
  /// @par Implements  SPEC 3.22
  template <class F>
  Self& expires(std::chrono::milliseconds life, F lapse) {
    if constexpr (!std::is_invocable_v<F&>) {
      static_assert(rdf::detail::always_false<F>, "lrt: expires expects a callable without parameters; write [] { stop(); }");
      return static_cast<Self&>(*this);
    } else {
      if constexpr (can_be_null<F>)
        if (!lapse) return this->refuse_null("expires"), this->self();
      if (this->is_editable("expires")) this->set_life(life, [lapse = std::move(lapse)]() mutable { (void)lapse(); });
      return this->self();
    }
  }

  /// Sets unit and bounds together. What `f` does not set stays as it is.
  Self& facets(const rdf::Facets& f) {
    if (this->is_editable("facets")) this->facets_of().merge(f);
    return this->self();
  }
  /// States the frame of the numbers: lrt:frame, and for a pose spatial:sourceCoordinateSystem. An IRI, a name, or
  /// Object::resource("baxter/torso"). Numbers are never transformed.
  Self& frame(Object system) {
    if (this->is_editable("frame")) this->set_frame(std::move(system));
    return this->self();
  }

  /// Allows clients and caches to use values of this age without a request to the robot. By default they send a request each time
  /// (`Cache-Control: no-cache`), and an unchanged entity tag saves the body. With an age, any number of readers behind
  /// a cache cause one request to the robot for each `age`; see docs/fleet.md.
  ///
  ///     battery.max_age(std::chrono::seconds(5));   // Cache-Control: max-age=5
  ///
  /// A reader behind a cache may read a value of this age even after its own PUT. Subscriptions get each value as
  /// before. On a server with an authorizer or with rules for reading the response is `private`: a cache that several
  /// clients share does not store it.
  ///
  /// @param age                 in whole seconds, rounded down; less than a second: the default
  /// @param while_revalidating  while a cache asks the robot, it may use the old value for this further time
  ///                            (`stale-while-revalidate`), so that no reader waits. Values are then at most `age` plus
  ///                            this time old
  /// @par Implements  RFC 9111 5.2.2.1, RFC 5861 3
  Self& max_age(std::chrono::milliseconds age, std::chrono::milliseconds while_revalidating = {}) {
    if (this->is_editable("max_age")) this->set_max_age(age, while_revalidating);
    return this->self();
  }

  /// Offers the property's values in a further media type. `encode` makes the bytes of the present value for clients
  /// that request this type by GET (also with ranges) or as binary messages. The RDF links to this representation and
  /// states its size; the representation links back.
  ///
  ///     camera.representation("image/jpeg", [](const Frame& f) { return f.jpeg; });   // Bytes: nothing is copied
  ///
  /// If traits<T>::same() returns true for two values, the encoded bytes are not regenerated. So everything that
  /// changes the bytes must also change the RDF, for example a time stamp or a number. A value written by a client is
  /// decoded from RDF: members of T that are not in the RDF have their values from T{}.
  ///
  /// @param media_type  "image/jpeg". Of the media types that lrt itself writes, only application/octet-stream is
  ///                    allowed, and text/plain with a parameter: "text/plain; version=0.0.4".
  /// @param encode      callable of `const T&` that returns Bytes, std::string, or a Result of these. Null or
  ///                    Errc::unsupported_syntax: this value has no such representation (406). Another error: 500.
  /// @param layout      layout of the numbers in the bytes; described in RDF if element_type is set
  ///
  /// @par Errors   expected_media_type, duplicate_path (a type is offered twice): from Server::add()
  /// @par Threads  `encode` runs like rdf::traits<T>::encode: on the thread that makes representations, on a copy of
  ///               the value, once for each requested value. A request for the RDF of the property or of the thing's
  ///               state also calls it, because the RDF contains the size. It must not access the robot. If encoding
  ///               takes more than 1 ms, encode before publish().
  /// @par Implements  R0.17, R1.2, paper D5
  template <class F>
  Self& representation(std::string_view media_type, F encode, Layout layout = {}) {
    if constexpr (!std::is_invocable_v<F&, const T&>) {
      static_assert(rdf::detail::always_false<F>,
                    "lrt: representation expects a callable of const T&, where T is the property's type; write [](const T& value) { return ...; }");
      return static_cast<Self&>(*this);
    } else if constexpr (!makes_bytes<std::invoke_result_t<F&, const T&>>) {
      static_assert(rdf::detail::always_false<F>, "lrt: the callable of representation returns lrt::Bytes, std::string or a Result of these");
      return static_cast<Self&>(*this);
    } else {
      if constexpr (can_be_null<F>)
        if (!encode) return this->refuse_null("representation"), this->self();
      if (this->is_editable("representation")) {
        this->add_representation(
            media_type, [encode = std::move(encode)](const void* value) mutable { return model::to_bytes(encode(*static_cast<const T*>(value))); },
            std::move(layout),
            [](const rdf::Value& value) -> std::shared_ptr<const void> {
              Result<T> whole = rdf::traits<T>::decode(value);
              return whole ? shared_value(*std::move(whole)) : nullptr;
            });
      }
      return this->self();
    }
  }
  /// Offers numbers, lists and matrices of numbers also as application/octet-stream. The RDF
  /// describes the layout of the present value. A value with rows of different lengths has no such representation.
  ///
  /// PUT accepts octets if at most one length of the type is free: a MatrixXd cannot be written in octets, because they
  /// do not contain the number of columns. Limits::max_body_triples and max_list_members limit the numbers in a body.
  /// If a value has more numbers than Limits::max_value_members, its RDF describes the octets instead of the numbers.
  /// @par Errors  invalid_option, for other types: from Server::add()
  Self& octets() {
    if (this->is_editable("octets")) this->set_octets();
    return this->self();
  }

  /// Serves the property as a file, for example a mesh or a map. A client that accepts every type gets the first
  /// representation() instead of Turtle. The thing's state does not contain the property, so its bytes are made only
  /// for clients that request this resource.
  Self& as_file() {
    if (this->is_editable("as_file")) this->set_file();
    return this->self();
  }

  /// The property counts, or measures, what the program itself does, such as requests. Its changes are no reason to
  /// evaluate a standing query again: such a query would count its own messages. Subscribers of the property receive
  /// them as those of any other.
  Self& as_counter() {
    if (this->is_editable("as_counter")) this->set_counter();
    return this->self();
  }

 protected:
  /// An empty handle.
  PropertyHandle() noexcept = default;
  /// Made by Thing.
  explicit PropertyHandle(Setup&& setup) noexcept : Base(std::move(setup)) {}
};

}  // namespace v0
}  // namespace lrt::model
