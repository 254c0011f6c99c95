// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <utility>

#include "src/engine/receivers/receiver.hpp"

namespace lrt::engine {

/// A feed of the host (lrt::Feed), which sends its messages to many.
class FeedReceiver final : public Receiver {
 public:
  FeedReceiver(SubscriptionResource& s, SubscriptionRequest& request, const ReceiverParts&) noexcept
      : Receiver(s), protocol_(std::move(request.feed)) {}

  bool chose_media_type() const noexcept override { return false; }
  bool waits_for_value() const noexcept override { return true; }
  bool repeats() const noexcept override { return protocol_->repeats; }
  void made() override { mark_shown(); }
  void close(ClosingChannels& closing, std::uint16_t code, std::string reason) override {
    closing.add_feed(s_.channel, closing_channel(code, std::move(reason)));
  }
  void ended() override { mark_shown(); }
  std::string_view name() const noexcept override { return protocol_->name; }
  void describe(About& about, const std::string& base) const override { about.statements(protocol_->statements, base); }
  void describe_controls(About& about, const std::string& base) const override { about.statements(protocol_->statements, base); }
  FeedReceiver* feed() noexcept override { return this; }

  /// The message that it takes.
  FeedMessage message(const subscription::Item& item) {
    FeedMessage message;
    message.channel = s_.channel;
    message.body = item->body;
    message.queued = s_.queues();
    message.at = item->stamp.at;
    message.number = item->stamp.number;
    message.left_out = s_.left_out;
    message.missed = s_.backlog.dropped() - std::exchange(told_dropped_, s_.backlog.dropped());
    return message;
  }

 private:
  /// The observed resource shows the receiver, and has the same value.
  void mark_shown() {
    if (!protocol_->statements.empty()) s_.observed.mark_changed();
  }

  const std::shared_ptr<const FeedProtocol> protocol_;
  std::uint64_t told_dropped_ = 0;  ///< the dropped changes that its messages have reported
};

}  // namespace lrt::engine
