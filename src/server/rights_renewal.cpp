// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <optional>

#include "src/server/service.hpp"
#include "src/server/shared_engine.hpp"

namespace lrt {
namespace {

/// Ends subscriptions whose right has ended, also without a request.
class RightsRenewal final : public Service, public TurnWork {
 public:
  TurnWork* turn_work() noexcept override { return this; }

  explicit RightsRenewal(SharedEngine& server) : server_(server) {}
  void turn(TimePoint now) override {
    const auto due = next_deadline();
    if (due && *due <= now.steady && server_.callers()->have_changed(now)) changed_ = true;
    if (changed_) changed_ = !server_.use_now([this] { server_.engine().renew_rights(); }, now);
  }
  std::optional<std::chrono::steady_clock::time_point> next_deadline() const override {
    const Callers* const callers = server_.callers();
    return callers ? callers->next_look() : std::nullopt;
  }

 private:
  SharedEngine& server_;
  bool changed_ = false;  ///< and the engine does not know yet
};

}  // namespace

std::unique_ptr<Service> make_rights_renewal(SharedEngine& server) {
  const Security& security = server.options().security;
  if (security.token_file.empty() && security.policy_file.empty() && !security.authenticate) return nullptr;
  return std::make_unique<RightsRenewal>(server);
}

}  // namespace lrt
