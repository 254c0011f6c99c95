// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>

#include <lrt/base/iri.hpp>
#include <lrt/security.hpp>

namespace lrt::engine {

/// How clients observe the resources of a kind.
struct Observable {
  enum class Order : std::uint8_t {
    last,    ///< only the last change matters
    each,    ///< each change matters, and subscriptions have a queue by default
    urgent,  ///< the same, and changes are sent before those of others: commands before telemetry
  };

  Iri saved_type{};  ///< in the file of saved subscriptions; empty: the resource does not exist after a restart
  Order order = Order::last;
  bool has_final_state = false;  ///< observers get its last representation even after its removal

  constexpr bool is_urgent() const noexcept { return order == Order::urgent; }
  constexpr bool wants_queues() const noexcept { return order != Order::last; }
};

enum class Trait : std::uint16_t {
  none = 0,
  placeholder = 1,            ///< for a resource that a request may create: it has no representation yet
  about_caller = 2,           ///< it is about the caller instead of the robot: it needs a principal and no right
  no_rdf_source = 4,          ///< it is no ldp:RDFSource
  fixed_links = 8,            ///< its links depend only on the structure, not on its state
  plain_bodies = 16,          ///< bodies may be plain values, not only RDF
  by_principal = 32,          ///< its representation depends on the principal, not only on the rights
  stop = 64,                  ///< POST stops the robot (Action::stop()), and its body is ignored
  term_list = 128,            ///< its page has its terms: PageSource::terms()
  query = 256,                ///< POST is a query: it changes nothing
  cancelled_by_delete = 512,  ///< DELETE ends what it stands for, and is never too late
  requires_expiry = 1024,     ///< POST must say until when it is valid
  commands = 2048,            ///< unsafe methods command the robot: who has control of its Thing may send them (Thing::control())
};

constexpr Trait operator|(Trait a, Trait b) noexcept { return static_cast<Trait>(static_cast<unsigned>(a) | static_cast<unsigned>(b)); }

/// What all resources of a kind have in common. A constant of their class.
struct ResourceKind {
  std::string_view name;  ///< in overviews, one word
  Trait traits = Trait::none;
  const Observable* observable = nullptr;                    ///< nullptr: clients cannot observe it
  security::Right right_to_change = security::Right::write;  ///< that unsafe methods need

  constexpr bool is(Trait trait) const noexcept { return (static_cast<unsigned>(traits) & static_cast<unsigned>(trait)) != 0; }
};

}  // namespace lrt::engine
