// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include <lrt/control.hpp>

#include "src/engine/control.hpp"

namespace lrt::engine {
inline namespace v0 {

/// "/arm/control": who has control of a Thing and what is below it, and until when (SPEC 3.23). POST takes it, PUT renews it, DELETE gives it back.
///
/// At most one client has control of a Thing, and nobody else has control of one above or below it.
class ControlResource final : public ControlBase {
 public:
  ControlResource(const std::string& its_path, ThingNode* its_thing, ControlOptions options)
      : ControlBase(its_path, its_thing, its_path.size()), options_(options) {}

  const ResourceKind& kind() const noexcept override {
    static constexpr Observable observable{vocab::lrt_::control};
    static constexpr ResourceKind kind{"control", Trait::plain_bodies, &observable, security::Right::invoke};
    return kind;
  }
  Methods methods() const noexcept override { return {true, true, true}; }
  Input input(const EngineOptions&) const override { return {nullptr, true, 0}; }
  Outcome post(Context& context, Parts& parts) override;
  Outcome put(Context& context, Parts& parts) override;
  Outcome remove(Context& context, Parts& parts) override;

  void describe(const Description& d) const override;
  void describe_types(About& about, const Description& d) const override;
  const Variants& variants() const override { return value_variants(); }
  std::optional<PlainValue> plain_value(const Audience& audience) const override;
  std::uint64_t state(std::uint64_t) const noexcept override { return revision; }
  std::string up() const override;
  void summarize(Overview& o) const override;

  Holder holder(const Context& context) const override;
  bool is_required() const noexcept override { return options_.required; }
  std::string holder_text(const Context& context) const override;
  void expire(TimePoint now, DeadlineQueue<ResourceId>& leases) override;

 private:
  using Instant = std::chrono::steady_clock::time_point;
  struct Lease {
    std::string principal;  ///< who has it; empty: who sends `id`
    std::string id;         ///< of a client without a principal
    std::string name;       ///< that the client gave itself, or that of the principal; empty: none
    std::chrono::milliseconds life{};
    Instant until{};
    Utc until_utc{};
    bool is_held = false;  ///< false: it was the last one

    bool is_of(const Context& context) const;
  };
  struct Wanted;

  bool is_held(TimePoint now) const noexcept { return lease_.is_held && lease_.until > now.steady; }
  void renew(std::chrono::milliseconds life, Context& context, Parts& parts);
  void end(Parts& parts);
  http::Response held_response(const Context& context, bool with_id) const;

  const ControlOptions options_;
  Lease lease_;
};

}  // namespace v0
}  // namespace lrt::engine
