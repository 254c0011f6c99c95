// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/clock.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/unique_function.hpp>
#include <lrt/model/representation.hpp>
#include <lrt/rdf/value.hpp>

#include "src/base/thin_vector.hpp"
#include "src/engine/host_calls.hpp"
#include "src/engine/registry.hpp"
#include "src/engine/variants.hpp"

namespace lrt::engine {
inline namespace v0 {

class PropertyResource;

/// The user-written encoders of a property that have to run on its value.
struct Encodings {
  bool all = false;
  std::optional<std::size_t> one{};

  /// The encodings that a variant needs. RDF needs all, because it states the size of each.
  static Encodings of(Variant variant) noexcept;
  bool contains(std::size_t encoder) const noexcept { return all || one == encoder; }
};

/// What an encoder made of one value.
struct Encoding {
  bool made = false;
  Result<Bytes> bytes{Bytes()};
};

/// A value that is about to be stored in a property.
struct Sample {
  rdf::Value value;
  std::shared_ptr<const void> whole;
  std::chrono::system_clock::time_point since{};
  ThinVector<Encoding> encodings;
  std::uint64_t number = 0;  ///< of its slot; 0: it is not from a slot
};

/// A refresh of one property. At most one runs. Requests that arrive during it wait for the next one, because their value must not
/// be older than the request.
struct PropertyRefresh {
  using Done = UniqueFunction<void(const Result<void>&, TimePoint)>;
  struct Waiter {
    Encodings encodings;
    Done done;
  };
  bool running = false;
  std::shared_ptr<CancelToken> token;
  std::vector<Waiter> waiters, next_waiters;
  std::string failure;                            ///< why there is no present value, for clients; empty: there is one
  Errc failure_code = Errc::failed;               ///< of `failure`
  std::uint64_t failure_changes = 0;              ///< how often `failure` has changed while the value was the same
  std::chrono::steady_clock::time_point begin{};  ///< of the running refresh
  bool late = false;                              ///< the running refresh was given up: it is not waited for
  UniqueFunction<void(TimePoint)> next_turn;      ///< PropertyValues::take_turn() waits for the end of the present refresh
};

/// Brings the values of properties up to date: from the slots of pushed properties, from the read lambdas of pulled ones, and through
/// the user's encoders. User code runs as host calls: lambdas where the Thing's Dispatch says, traits and encoders on the I/O thread.
/// A value and the encodings that observers want change together.
class PropertyValues {
 public:
  using Done = PropertyRefresh::Done;

  PropertyValues(HostCalls& calls, Registry& registry, const EngineOptions& options, const Clock& clock)
      : calls_(calls), registry_(registry), options_(options), clock_(clock) {}

  /// Stores the values that need no user code. Returns whether a representation can be made.
  /// @param current   a refresh has just ended: its values are new enough
  /// @param audience  whom the representation is for: what it does not see is neither read nor waited for, here and in the next functions
  bool ready(Resource& resource, Variant variant, bool current, const Audience& audience = {});
  /// Brings all properties of a resource up to date and then calls `done`, once, on the engine's thread.
  void refresh(Resource& resource, Encodings encodings, Done done, const Audience& audience = {});
  void refresh(PropertyResource& property, Encodings encodings, Done done);
  using Instant = std::chrono::steady_clock::time_point;
  /// The time limit of a request for values of several properties has passed. If a lambda runs, those that have not returned count as failing until they
  /// do, and later requests do not wait for them.
  /// @return false: no lambda runs, because the host does not, or no property has a present value; nothing has changed
  bool give_up(Resource& resource, const Audience& audience = {});
  /// An observed property may have a new value: refreshes it, unless a refresh is running.
  /// @param until  as for take_published()
  /// @return  when the time was over, kept values were left: call it again soon
  bool refresh_observed(PropertyResource& property, Instant until);
  /// Takes published values if that needs no user code. After the time limit, older kept values are dropped.
  /// @param may_leave  after at least one, those that are not old are left instead
  void take_published(PropertyResource& property, Instant until, bool may_leave = false);
  void take_published(PropertyResource& property);
  /// Until when values for queues may be taken over, if that begins now (SubscriptionOptions::max_catch_up_time).
  Instant catch_up_end() const;
  /// Adds or removes an observer with a queue. While there is one, published values are kept between two scans.
  void keep(PropertyResource& property, bool queued);
  /// The same for all properties of a resource.
  void keep(Resource& resource, bool queued);
  /// Gives the property a value, of the robot or written by a client, and notifies its observers.
  void set(PropertyResource& property, Sample sample);
  /// Gives it a published value, if that is a change (SPEC 3.8).
  void set_published(PropertyResource& property, Sample sample);
  /// Calls `begin` when no refresh of a pulled property runs, at once or after the present one, and lets none run until end_turn(): a
  /// lambda `read` never runs concurrently with itself. One turn at a time for each property.
  void take_turn(PropertyResource& property, UniqueFunction<void(TimePoint)> begin, TimePoint now);
  void end_turn(PropertyResource& property, TimePoint now) { end(property, {}, now); }
  /// The property is removed: all waiters get Errc::closed.
  void cancel(PropertyResource& property, TimePoint now);

 private:
  static PropertyRefresh& refresh_of(PropertyResource& property);
  static void set_value_bytes(PropertyResource& property);
  bool needs_user_code(const PropertyResource& property) const;
  static bool has_encodings(const PropertyResource& property, Encodings wanted);
  static std::vector<std::size_t> wanted_encoders(const PropertyResource& property);
  void start(PropertyResource& property);
  void read(PropertyResource& property);
  void take(PropertyResource& property, std::vector<std::size_t> encoders);
  void encode(PropertyResource& property, std::optional<Sample> sample, std::vector<std::size_t> encoders);
  void was_read(PropertyResource& property, Result<model::Reading> reading, TimePoint now);
  void were_taken(PropertyResource& property, Result<std::vector<Sample>> samples, TimePoint now);
  void were_encoded(PropertyResource& property, std::optional<Sample> sample, Result<ThinVector<Encoding>> encodings, TimePoint now);
  void end(PropertyResource& property, const Result<void>& result, TimePoint now);
  static void fail(PropertyResource& property, std::string_view why, Errc code = Errc::failed);
  static void recover(PropertyResource& property);
  template <class Step>
  void ends_if_thrown(PropertyResource& property, Step step);

  HostCalls& calls_;
  Registry& registry_;
  const EngineOptions& options_;
  const Clock& clock_;
};

}  // namespace v0
}  // namespace lrt::engine
