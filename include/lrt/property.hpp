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

/// Handle to a Property of a Thing. Say what is to be said of it before the thing is added to a server; publish() for as long as you
/// like. Copies are handles to the same property.
///
/// @par Threads  Set-up: one at a time. publish: any one thread at a time per property.
template <class T>
class Property {
 public:
  /// Hands the present value over (pushed properties). A bit-identical value changes nothing (SPEC 3.8).
  /// @par Time  No lock; for T without a destructor to run (numbers, structs of such) no allocation: some 40 ns, whatever the number of subscribers. A system call only when
  ///            the network side sleeps although somebody observes the property; see subscription::SubscriptionOptions::scan_period and always_scan.
  /// @par Implements  R0.11, R0.12
  void publish(const T& value) noexcept {
    if (slot_) slot_->publish(value);
  }

  /// Says that `read` would give something else now (pulled properties): while somebody observes the property it is read soon.
  /// @par Threads  Any.
  /// @par Time     No lock, no allocation; a system call as with publish().
  void changed() noexcept {
    if (spec_->changes) spec_->changes->changed();
  }

  /// Makes the property writable: PUT calls `write(T)`, which returns void or Result<void>; an error answers 409. A GET that follows
  /// shows the written value until the robot publishes again.
  /// @par Threads  `write` runs where the thing's Dispatch says.
  /// @par Implements  R0.5
  template <class F>
  Property& on_write(F write) {
    static_assert(std::is_invocable_v<F&, T>, "lrt: on_write takes a callable void(T) or Result<void>(T), T being the property's type");
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

  /// The unit of the number; values are never converted.
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
  /// dcterms:title, for people.
  Property& title(std::string text) { return add(vocab::dcterms::title, Object(std::move(text))); }
  /// Any further triple about the property (R1.12).
  Property& add(Iri predicate, Object object) {
    return edit([&](auto& s) { s.statements.push_back({std::string(predicate.text), std::move(object)}); });
  }
  /// The coordinate system in which the numbers are to be read, as lrt:frame: an IRI, a name, or Object::resource("baxter/torso").
  Property& frame(Object system) {
    return edit([&](auto& s) { s.frame = std::move(system); });
  }

  /// Offers the property's values in a further media type. Whoever asks for it gets what `encode` makes of the present value, by GET (with
  /// ranges) and as binary messages; the RDF links to it with its size, and it links back.
  ///
  ///     camera.representation("image/jpeg", [](const Frame& f) { return f.jpeg; });   // Bytes: nothing is copied
  ///
  /// Two values that traits<T>::same() takes for one are one: what changes the bytes must be in the RDF too, if only as a time stamp or a
  /// number. A value that a client wrote is what its RDF says: the other members of T are those of T{}.
  ///
  /// @param media_type  "image/jpeg"; not one that lrt writes itself, but application/octet-stream
  /// @param encode      callable of `const T&`: Bytes, std::string, or a Result of these. Null or an error of Errc::unsupported_syntax:
  ///                    there is no such representation of this value (406); another error: 500.
  /// @param layout      of bytes that are numbers; described if element_type is given
  ///
  /// @par Errors   expected_media_type, duplicate_path (one type twice): by Server::add
  /// @par Threads  `encode` is called like rdf::traits<T>::encode: by the thread that makes representations, on a copy of the value, once
  ///               for each value somebody asks for, be it in RDF, which says the size; in that of the thing's state, too. It may not touch
  ///               the robot. What takes more than a millisecond is encoded better before publish().
  /// @par Implements  R0.17, R1.2; the paper's D5
  template <class F>
  Property& representation(std::string_view media_type, F encode, Layout layout = {}) {
    static_assert(std::is_invocable_v<F&, const T&>, "lrt: representation takes a callable of const T&, T being the property's type");
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
  /// Offers numbers, lists and matrices of numbers as application/octet-stream too: as rdf::Plain::octets, with the layout of the present value
  /// described. Rows of unlike lengths have no octets, other formats do. Both ways where no more than one length is free: octets do not say
  /// how many columns a MatrixXd has, so it is written in other formats. A body may have as many numbers as engine::Options::body_triples
  /// and list_members allow. Of a value with more numbers than engine::Options::value_members, RDF says the layout of its octets, and not
  /// each number.
  /// @par Errors  invalid_option, for other types: by Server::add
  Property& octets() {
    return edit([](auto& s) { s.octets = true; });
  }

  /// How often `read` is called while somebody observes the property (pulled properties); zero: only on changed(). Default:
  /// subscription::SubscriptionOptions::sample_period.
  Property& sample(std::chrono::milliseconds period) {
    return edit([&](auto& s) { s.sample_period = period; });
  }
  /// Keeps up to so many published values between two looks of the network side, so that subscribers with a queue get each of them, not
  /// only the newest (pushed properties). What does not fit counts as dropped.
  Property& keep(std::size_t samples) {
    return edit([&](auto& s) {
      if (s.slot && samples > 0) s.slot->keep(samples);
    });
  }
  /// Counts a repeated value as a change too (pushed properties).
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
