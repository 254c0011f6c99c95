// SPDX-License-Identifier: Apache-2.0
#pragma once

// A handler of event streams, for the tests of transports.

#include <algorithm>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/engine/handler.hpp>

namespace lrt::test {

/// GET /stream is an event stream, /later one after accept(), /websocket a WebSocket, /forced one whether the transport can or not, /ended one that has ended already;
/// anything else says hello. Calls that a transport must not make are kept in `wrong`.
class StreamHandler : public engine::Handler {
 public:
  engine::Outcome handle(const http::Request& request, TimePoint) override {
    ++requests;
    could_stream = request.can_stream;
    const std::string path(request.target);
    http::Response response;
    if (path == "/websocket" && request.can_upgrade) return engine::Upgraded{new_channel(), response};
    if (path == "/later" && request.can_stream) {
      tickets.push_back(engine::Ticket{++last_});
      return engine::Deferred{tickets.back()};
    }
    const bool streams = path == "/stream" || path == "/ended";
    if (path != "/forced" && !(streams && request.can_stream)) {
      response.set_body("hello");
      return response;
    }
    const auto channel = new_channel();
    if (path == "/ended") push(channel, end());
    return engine::Streamed{channel, header()};
  }
  std::optional<engine::Reply> next_reply(TimePoint) override {
    if (replies.empty()) return std::nullopt;
    auto reply = std::move(replies.front());
    replies.pop_front();
    return reply;
  }
  std::optional<std::chrono::steady_clock::time_point> next_deadline() const override { return std::nullopt; }
  void abandon(engine::Ticket ticket) noexcept override { abandoned.push_back(ticket); }
  std::optional<engine::Channel> next_ready(TimePoint) override {
    if (ready_.empty()) return std::nullopt;
    const auto channel = ready_.front();
    ready_.pop_front();
    if (const auto found = open.find(channel); found != open.end()) found->second.named = false;
    return channel;
  }
  std::optional<engine::Push> next_push(engine::Channel channel, TimePoint) override {
    const auto found = open.find(channel);
    if (found == open.end()) {
      wrong = "next_push of a channel that is closed";
      return std::nullopt;
    }
    auto& stream = found->second;
    if (stream.ending) wrong = "next_push after the end";
    if (stream.endless > 0) {
      auto message = std::make_shared<const std::string>(stream.endless, 'e');
      pushed.push_back(message);
      return engine::Push{std::move(message)};
    }
    if (stream.queue.empty()) return std::nullopt;
    auto push = std::move(stream.queue.front());
    stream.queue.pop_front();
    stream.ending = push.close != 0;
    return push;
  }
  void received(engine::Channel, std::string_view, bool, TimePoint) override { wrong = "received on an event stream"; }
  void closed(engine::Channel channel) noexcept override {
    if (open.erase(channel) == 0) wrong = "closed twice";
  }

  engine::Channel new_channel() {
    const engine::Channel channel{++last_};
    channels.push_back(channel);
    open[channel];
    return channel;
  }
  static http::Response header() {
    http::Response response;
    response.fields.add("Content-Type", "text/event-stream");
    return response;
  }
  static engine::Push end() { return {nullptr, true, 1000, "done"}; }
  void push(engine::Channel channel, engine::Push push) {
    auto& stream = open.at(channel);
    stream.queue.push_back(std::move(push));
    if (!std::exchange(stream.named, true)) ready_.push_back(channel);  // once, as Handler promises
  }
  void push(engine::Channel channel, std::string text) { push(channel, {std::make_shared<const std::string>(std::move(text))}); }
  /// Replies to a deferred request with a stream.
  engine::Channel accept(std::size_t index) {
    const auto channel = new_channel();
    replies.push_back({tickets.at(index), header(), channel});
    return channel;
  }
  std::size_t alive_messages() const {
    return static_cast<std::size_t>(std::count_if(pushed.begin(), pushed.end(), [](const auto& message) { return !message.expired(); }));
  }

  struct Stream {
    std::deque<engine::Push> queue;
    std::size_t endless = 0;  ///< bytes of each of endless messages
    bool named = false;
    bool ending = false;
  };
  std::map<engine::Channel, Stream> open;
  std::vector<engine::Channel> channels;  ///< all that there ever were
  std::vector<engine::Ticket> tickets;
  std::vector<engine::Ticket> abandoned;
  std::deque<engine::Reply> replies;
  std::vector<std::weak_ptr<const std::string>> pushed;
  std::size_t requests = 0;
  bool could_stream = false;
  std::string wrong;

 private:
  std::uint64_t last_ = 0;
  std::deque<engine::Channel> ready_;
};

}  // namespace lrt::test
