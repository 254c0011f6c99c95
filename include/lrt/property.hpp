#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <type_traits>
#include <utility>

#include <lrt/model/detail/spec.hpp>
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
  /// @par Time  No lock; for trivially copyable T no allocation: some 40 ns, whatever the number of subscribers. A system call only when
  ///            the network side sleeps although somebody observes the property; see subscription::Options::push_period and tick.
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
  /// How often `read` is called while somebody observes the property (pulled properties); zero: only on changed(). Default:
  /// subscription::Options::sample_period.
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
