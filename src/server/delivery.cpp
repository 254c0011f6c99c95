// SPDX-License-Identifier: Apache-2.0
#include <lrt/delivery/deliverer.hpp>

#include <memory>
#include <string>
#include <utility>

#include "src/server/service.hpp"
#include "src/server/shared_engine.hpp"

namespace lrt {
namespace {

/// Gives the notifications of web callbacks to a deliverer.
class Delivery final : public Service, public delivery::Source {
 public:
  explicit Delivery(SharedEngine& server) : server_(server) {}

  Result<void> start() override {
    Callbacks options = server_.options().callbacks;
    options.threads = server_.options().threads.own;
    auto made =
        options.deliverer ? options.deliverer(*this, options, server_.waking_log()) : delivery::make_deliverer(*this, options, server_.waking_log());
    if (!made) return Unexpected{std::move(made).error()};
    deliverer_ = *std::move(made);
    return {};
  }
  void pass_on(engine::Outputs& outputs) override {
    if (!deliverer_) return;
    for (const subscription::ReadyCallback& due : outputs.callbacks) deliverer_->notify(due.channel, due.receiver);
  }
  void stop() noexcept override {
    if (deliverer_) deliverer_->stop();
  }

  // On the deliverer's threads.
  std::optional<subscription::Notification> next_notification(engine::Channel channel) override {
    auto notification = server_.use([&] { return server_.engine().next_notification(channel, server_.clock().now()); });
    if (!notification) server_.loop().wake_io();  // a timer may have been set
    return notification;
  }
  void delivered(engine::Channel channel, subscription::DeliveryResult result) noexcept override {
    try {
      server_.use([&] { server_.engine().delivered(channel, result, server_.clock().now()); });
      if (result.status / 100 != 2) server_.loop().wake_io();  // there is a new timer
    } catch (const std::exception& e) { server_.log(LogLevel::error, "a delivery result could not be processed", e); }
  }

 private:
  SharedEngine& server_;
  std::unique_ptr<delivery::Deliverer> deliverer_;
};

}  // namespace

std::unique_ptr<Service> make_delivery(SharedEngine& server) {
  if (server.options().callbacks.allow.empty()) return nullptr;
  return std::make_unique<Delivery>(server);
}

}  // namespace lrt
