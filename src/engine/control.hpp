// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/control.hpp>
#include <lrt/http/message.hpp>

#include "src/engine/deadline_queue.hpp"
#include "src/engine/resource.hpp"

namespace lrt::engine {

class Responses;

inline namespace v0 {

class Context;

inline constexpr std::string_view control_id_field = "Control-Id";
inline constexpr std::string_view take_over_field = "Take-Over";

/// Counts the clients that have had control of a Thing, in order. Read by other threads.
using ControlNumber = std::atomic<std::uint64_t>;

/// Control of a Thing and what is below it (Thing::control()), as the rules for commands see it. Only programs that declare it link what derives from this.
class ControlBase : public ValueResource {
 public:
  using ValueResource::ValueResource;

  enum class Holder : std::uint8_t { nobody, sender, another };
  /// Who has control now.
  /// @param context  a request: whether its sender has it
  virtual Holder holder(const Context& context) const = 0;
  virtual bool is_required() const noexcept = 0;
  /// Who has it and until when, as the end of a sentence: "anna has control of it until ...".
  virtual std::string holder_text(const Context& context) const = 0;
  /// A lease is over at this time, or was renewed since.
  virtual void expire(TimePoint now, DeadlineQueue<ResourceId>& leases) = 0;

  std::shared_ptr<ControlNumber> number = std::make_shared<ControlNumber>(0);
  DeadlineQueue<ResourceId>::Place lease_end;  ///< in Parts::leases
};

/// What is judged once more just before the host's lambda: nobody else has taken control since the command came.
class ControlCheck {
 public:
  /// Of a command whose resource is below none with control: always passes.
  explicit ControlCheck(const Context& context);
  bool passes() const noexcept;
  bool is_needed() const noexcept { return !all_.empty(); }

 private:
  struct One {
    std::shared_ptr<const ControlNumber> number;
    std::uint64_t seen;
  };
  std::vector<One> all_;
};

/// The response to a command whose sender lacks control: 409 if another client has it, 428 if one has to have it. nullopt: the sender may command.
/// A command needs control of each Thing above its resource, and of its Thing, that somebody has.
std::optional<http::Response> refused_by_control(const Context& context, const Responses& responses);

/// The response to a client without control where another one has it.
/// @param control  that one's
http::Response controlled_by_another(const Context& context, const Responses& responses, const ControlBase& control);
/// The response to a client without control where nobody has it.
http::Response control_required(const Context& context, const Responses& responses, const ControlBase& control, int status);

}  // namespace v0
}  // namespace lrt::engine
