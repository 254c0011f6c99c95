#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include <lrt/model/detail/spec.hpp>
#include <lrt/model/representation.hpp>
#include <lrt/rdf/traits.hpp>

namespace lrt {

/// Handle to a Property of a Thing. Set-up calls have an effect until the thing is added to a server; publish() and changed() work at any
/// time. Copies are handles to the same property.
///
/// @par Threads  Set-up: one at a time. publish: any one thread at a time per property.
template <class T>
class Property {
 public:
  /// Passes the present value to the engine (pushed properties). A bit-identical value is not a change (SPEC 3.8).
  /// @par Time  No lock. No allocation if T is trivially destructible (numbers, structs of numbers): about 40 ns, independent of the number
  ///            of subscribers. One system call if the property is observed and the engine sleeps, see
  ///            subscription::SubscriptionOptions::scan_period and always_scan.
  /// @par Implements  R0.11, R0.12
  void publish(const T& value) noexcept {
    if (slot_) slot_->publish(value);
  }

  /// Notifies the engine that the value has changed (pulled properties). If the property is observed, `read` is called soon.
  /// @par Threads  Any.
  /// @par Time     No lock, no allocation; a system call as in publish().
  void changed() noexcept {
    if (spec_->changes) spec_->changes->changed();
  }

  /// Makes the property writable: PUT calls `write(T)`, which returns void or Result<void>. An error is answered 409. A following GET
  /// shows the written value until the robot publishes again.
  /// @par Threads  `write` runs where dispatch() says.
  /// @par Implements  R0.5
  template <class F>
  Property& on_write(F write) {
    static_assert(std::is_invocable_v<F&, T>, "lrt: on_write expects a callable void(T) or Result<void>(T), where T is the property's type");
    if (!spec_->sealed)
      spec_->write = [write = std::move(write)](const rdf::Value& v) mutable -> Result<void> {
        Result<T> value = rdf::traits<T>::decode(v);
        if (!value) return Unexpected{std::move(value).error()};
        if constexpr (std::is_void_v<std::invoke_result_t<F&, T>>) {
          write(*std::move(value));
          return {};
        } else {
          return write(*std::move(value));
        }
      };
    return *this;
  }

  /// Where `read` and `write` run. Default: as the thing's lambdas.
  Property& dispatch(Dispatch where) { return edit([&](auto& s) { s.dispatch = where; }); }

  /// The unit of the numbers. Values are never converted.
  Property& unit(const Unit& u) { return edit([&](auto& s) { s.facets.unit(u); }); }
  Property& at_least(double v) { return edit([&](auto& s) { s.facets.at_least(v); }); }
  Property& above(double v) { return edit([&](auto& s) { s.facets.above(v); }); }
  Property& at_most(double v) { return edit([&](auto& s) { s.facets.at_most(v); }); }
  Property& below(double v) { return edit([&](auto& s) { s.facets.below(v); }); }
  Property& between(double low, double high) { return edit([&](auto& s) { s.facets.between(low, high); }); }
  Property& facets(const rdf::Facets& f) { return edit([&](auto& s) { s.facets = f; }); }

  /// A domain predicate from the thing to this property, in addition to hybrit:property (R1.9).
  Property& predicate(Iri p) { return edit([&](auto& s) { s.predicates.emplace_back(p.text); }); }
  /// A further rdf:type (R1.4).
  Property& type(Iri t) { return edit([&](auto& s) { s.classes.emplace_back(t.text); }); }
  /// Adds dcterms:title, for people.
  Property& title(std::string text) { return add(vocab::dcterms::title, Object(std::move(text))); }
  /// Adds a triple about the property (R1.12).
  Property& add(Iri predicate, Object object) {
    return edit([&](auto& s) { s.statements.push_back({std::string(predicate.text), std::move(object)}); });
  }
  /// The coordinate system of the numbers, as lrt:frame: an IRI, a name, or Object::resource("baxter/torso").
  Property& frame(Object system) {
    return edit([&](auto& s) { s.frame = std::move(system); });
  }

  /// Offers the property's values in a further media type. Clients that request it get the bytes that `encode` makes of the present value, by
  /// GET (with ranges) and as binary messages. The RDF links to this representation with its size, and it links back.
  ///
  ///     camera.representation("image/jpeg", [](const Frame& f) { return f.jpeg; });   // Bytes: nothing is copied
  ///
  /// If traits<T>::same() returns true for two values, the encoded bytes are not regenerated. So everything that changes the bytes must also
  /// change the RDF, for example by a time stamp or a number. A value written by a client is decoded from RDF: members of T that are not in
  /// the RDF have their values from T{}.
  ///
  /// @param media_type  "image/jpeg". Of the media types that lrt writes itself only application/octet-stream is allowed.
  /// @param encode      callable of `const T&` that returns Bytes, std::string, or a Result of these. Null or Errc::unsupported_syntax: this
  ///                    value has no such representation (406). Another error: 500.
  /// @param layout      of the numbers in the bytes; described in RDF if element_type is set
  ///
  /// @par Errors   expected_media_type, duplicate_path (a type is offered twice): by Server::add
  /// @par Threads  `encode` runs like rdf::traits<T>::encode: on the thread that makes representations, on a copy of the value, once for each
  ///               requested value. A request for the RDF of the property or of the thing's state also calls it, because the RDF contains the
  ///               size. It must not access the robot. If encoding takes more than 1 ms, encode before publish().
  /// @par Implements  R0.17, R1.2; the paper's D5
  template <class F>
  Property& representation(std::string_view media_type, F encode, Layout layout = {}) {
    static_assert(std::is_invocable_v<F&, const T&>, "lrt: representation expects a callable of const T&, where T is the property's type");
    return edit([&](auto& s) {
      model::RepresentationSpec made{std::string(media_type), {}, std::move(layout), {}};
      made.element_type = std::string(made.layout.element_type.text);
      made.encode = [encode = std::move(encode)](const void* value) mutable { return model::to_bytes(encode(*static_cast<const T*>(value))); };
      s.representations.push_back(std::move(made));
      if (s.slot) s.slot->hold();
      s.whole = [](const rdf::Value& value) -> std::shared_ptr<const void> {
        Result<T> whole = rdf::traits<T>::decode(value);
        return whole ? std::make_shared<const T>(*std::move(whole)) : nullptr;
      };
    });
  }
  /// Offers numbers, lists and matrices of numbers also as application/octet-stream (rdf::Plain::octets). The RDF describes the layout of the
  /// present value. A value with rows of different lengths has no octets.
  ///
  /// PUT accepts octets if at most one length of the type is free: a MatrixXd cannot be written in octets, because they do not contain the
  /// number of columns. engine::EngineOptions::max_body_triples and max_list_members limit the numbers in a body. If a value has more numbers than
  /// engine::EngineOptions::max_value_members, its RDF describes the octets instead of the numbers.
  /// @par Errors  invalid_option, for other types: by Server::add
  Property& octets() {
    return edit([](auto& s) { s.octets = true; });
  }

  /// The period at which `read` is called while the property is observed (pulled properties). Zero: only after changed(). Default:
  /// subscription::SubscriptionOptions::sample_period.
  Property& sample(std::chrono::milliseconds period) {
    return edit([&](auto& s) { s.sample_period = period; });
  }
  /// Keeps up to `samples` published values between two scans of the engine, so that subscribers with a queue get each value instead of only
  /// the newest (pushed properties). A value that does not fit counts as dropped.
  Property& keep(std::size_t samples) {
    return edit([&](auto& s) {
      if (s.slot && samples > 0) s.slot->keep(samples);
    });
  }
  /// Counts a repeated value as a change (pushed properties).
  Property& every_sample() {
    return edit([&](auto& s) {
      if (s.slot) s.slot->set_every_sample();
    });
  }

 private:
  friend class Thing;
  Property(std::shared_ptr<model::PropertySpec> spec, std::shared_ptr<model::Slot<T>> slot)
      : spec_(std::move(spec)), slot_(std::move(slot)) {}
  template <class F>
  Property& edit(F f) {
    if (!spec_->sealed) f(*spec_);
    return *this;
  }
  std::shared_ptr<model::PropertySpec> spec_;
  std::shared_ptr<model::Slot<T>> slot_;
};

}  // namespace lrt
