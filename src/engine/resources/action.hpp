// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/result.hpp>

#include "src/engine/audience_numbers.hpp"
#include "src/engine/client_counts.hpp"
#include "src/engine/command_rules.hpp"
#include "src/engine/deadline_queue.hpp"
#include "src/engine/invocation_control.hpp"
#include "src/engine/resource.hpp"
#include "src/model/spec.hpp"

namespace lrt::engine {
inline namespace v0 {

class ActionResource;

enum class Status : std::uint8_t { pending, running, succeeded, failed, cancelled };

/// The input of an action without input: a record without fields. RDF is covered by no constraint, and so ignored.
const rdf::Type& no_input() noexcept;

/// A request that waits for its invocation.
struct WaitingRequest {
  Ticket ticket;
  bool until_end;  ///< false: until the start lambda has returned
};

/// One invocation of an Action: status, progress, times, input and result (SPEC 3.1).
class InvocationResource final : public ValueResource {
 public:
  InvocationResource(std::string path, ActionResource& its_action);

  Methods methods() const noexcept override;
  /// DELETE cancels an invocation that has not finished, and removes one that has.
  Outcome remove(Context& context, Parts& parts) override;

  void describe(const Description& d) const override;
  void describe_types(About& about, const Description& d) const override;
  const ResourceKind& kind() const noexcept override {
    static constexpr Observable observable{{}, Observable::Order::urgent, true};
    static constexpr ResourceKind kind{"invocation", Trait::cancelled_by_delete, &observable, security::Right::invoke};
    return kind;
  }
  const Variants& variants() const override { return value_variants(); }
  std::optional<PlainValue> plain_value(const Audience& audience) const override;
  bool fits_rdf(std::size_t max_values) const override;
  std::uint64_t state(std::uint64_t) const noexcept override { return revision; }
  std::string up() const override;
  void refresh() override;
  void set_observed(bool observed, ChangeScanner& scanner) override;

  bool finished() const noexcept { return status >= Status::succeeded; }

  ActionResource& action;
  std::shared_ptr<InvocationControl> control;
  rdf::Value input;
  Status status = Status::pending;
  double progress = 0;
  Result<rdf::Value> result{rdf::Value()};
  Utc created{}, started{}, ended{};
  std::shared_ptr<CancelToken> token;  ///< of the call that starts it, once there is one
  SharedCheck check;                   ///< of the call that starts it; null: nothing is judged then
  DeadlineQueue<ResourceId>::Place start_deadline;
  std::chrono::steady_clock::time_point host_deadline{};  ///< by which the host must have started it, once there is a call
  std::vector<WaitingRequest> waiting;
  bool is_concluding = false;  ///< its lambda has succeeded, and the host is asked whether the robot is still stopped
  ClientCounts::Share share;   ///< of its client, until it has ended
};

/// An Action: its input, output, binding and invocations (R1.10, paper 5.4).
class ActionResource final : public Resource {
 public:
  ActionResource(std::string path, ThingNode* thing, std::shared_ptr<model::ActionSpec> s);
  ~ActionResource() override;

  Methods methods() const noexcept override;
  /// POST invokes.
  Outcome post(Context& context, Parts& parts) override;
  Input input(const EngineOptions& options) const override;
  std::string input_shape() const override { return shape_name("input"); }
  std::string output_shape() const { return shape_name("output"); }

  void describe(const Description& d) const override;
  void describe_types(About& about, const Description& d) const override;
  const ResourceKind& kind() const noexcept override {
    static constexpr Observable observable{vocab::hybrit::Action, Observable::Order::urgent};
    static constexpr ResourceKind usual{"action", Trait::plain_bodies | Trait::commands, &observable, security::Right::invoke};
    static constexpr ResourceKind stop{"action", Trait::plain_bodies | Trait::stop, &observable, security::Right::invoke};
    static constexpr ResourceKind expiring{"action", Trait::plain_bodies | Trait::commands | Trait::requires_expiry, &observable,
                                           security::Right::invoke};
    // Who may release need not have control: it moves nothing.
    static constexpr ResourceKind release{"action", Trait::plain_bodies | Trait::requires_expiry, &observable, security::Right::release};
    return spec->stop ? stop : spec->releases ? release : spec->requires_expiry ? expiring : usual;
  }
  const model::ResourceSpec* command() const noexcept override { return spec.get(); }
  void summarize(Overview& o) const override;
  void overview(Overview& o) const override;
  std::uint64_t state(std::uint64_t structure) const noexcept override { return structure + revision; }
  void link_related(http::LinkWriter& links, const std::string& base) const override;
  void set_observed(bool observed, ChangeScanner& scanner) override;
  void path_changed() override;
  using Resource::change_number;
  std::uint64_t change_number(const Audience& audience) const override { return numbers_.of(audience); }
  /// The list of its invocations has changed by one at a path.
  void mark_invocation_changed(const std::string& at);

  /// Stores the availability that the robot has set.
  /// @return  it has changed
  bool take_availability();

  const std::shared_ptr<model::ActionSpec> spec;
  const rdf::Type invocation_type;                             ///< of its invocations as records
  std::list<std::unique_ptr<InvocationResource>> invocations;  ///< oldest first
  std::deque<InvocationResource*> queue;                       ///< pending ones that wait for their turn
  std::size_t active = 0;                                      ///< handed to the host and not ended
  std::string unavailable;                                     ///< why it is not available; empty: it is
  rdf::Graph effects;                                          ///< of the user's Turtle, with IRIs below placeholder_base

 private:
  void count_change(SeenBy seen) override { numbers_.count(seen); }
  std::string shape_name(std::string_view what) const;
  void describe_binding(const Description& d, rdf::TermId node) const;
  void describe_parts(About& about, const Description& d) const;
  void describe_input_value(const Description& d, rdf::TermId effect_shape, std::size_t& parts, const model::EffectSpec& effect) const;
  void summarize_effects(Overview& o) const;
  void describe_effects(About& about, const Description& d) const;

  AudienceNumbers numbers_;
};

}  // namespace v0
}  // namespace lrt::engine
