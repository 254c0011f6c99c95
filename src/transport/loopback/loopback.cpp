// SPDX-License-Identifier: Apache-2.0
#include <lrt/transport/loopback.hpp>

#include <algorithm>
#include <deque>
#include <optional>
#include <unordered_map>
#include <utility>
#include <variant>

#include <lrt/http/problem.hpp>
#include <lrt/http/request_parser.hpp>

#include "src/base/event_waker.hpp"
#include "src/transport/waits.hpp"

namespace lrt::transport {
namespace {

using std::chrono::milliseconds;
using SteadyClock = std::chrono::steady_clock;

/// Messages of one turn of a stream.
constexpr int pushes_per_turn = 8;

http::Response problem(int status, std::string detail) {
  http::Response response;
  http::set_problem(response, {status, std::move(detail)});
  response.close = true;
  return response;
}

}  // namespace

struct LRT_LOCAL Loopback::Impl {
  /// Takes the outcome of a request.
  using Done = std::function<void(engine::Reply)>;
  struct Stream {
    StreamClient client;
    std::optional<engine::Ticket> ticket;    ///< of the response
    std::optional<engine::Channel> channel;  ///< once it streams
    bool taking = false;                     ///< client.message is being called
    bool resumed = false;                    ///< meanwhile
    bool paused = false;
  };

  explicit Impl(TransportOptions given) : options(std::move(given)), clock(options.clock ? *options.clock : system_clock()) {}

  /// Gives a response to its client, with the fields of all responses.
  void give(const Done& done, engine::Reply reply) {
    if (const http::Fields* const more = handler ? handler->common_fields(clock.now()) : nullptr) reply.response.fields.append(*more);
    done(std::move(reply));
  }
  void handle(const http::Request& request, const Done& done, std::optional<engine::Ticket>* ticket);
  void begin(StreamId id, engine::Reply reply);
  void push(StreamId id, TimePoint now);
  void end(StreamId id);
  bool is_over() noexcept {
    const auto at = SteadyClock::now();
    if (!budget_end) budget_end = at + budget;
    return at >= *budget_end;
  }
  void deliver(TimePoint now);
  milliseconds next_due(TimePoint now) const;
  void give_up();

  const TransportOptions options;
  const Clock& clock;
  engine::Handler* handler = nullptr;
  std::chrono::microseconds budget{0};
  std::optional<SteadyClock::time_point> budget_end;  ///< from the first step on
  bool left = false;                                  ///< the budget ended before the handler's replies and messages
  std::shared_ptr<EventWaker> waker = std::make_shared<EventWaker>();
  std::unordered_map<std::uint64_t, Done> tickets;
  std::unordered_map<std::uint64_t, Stream> streams;
  std::unordered_map<std::uint64_t, StreamId> channels;
  std::deque<StreamId> turns;  ///< that may have more, after the others
  std::uint64_t last_stream = 0;
};

/// @param ticket  set if the reply is deferred; nullptr: not needed
void Loopback::Impl::handle(const http::Request& request, const Done& done, std::optional<engine::Ticket>* ticket) {
  if (!handler) return done({{}, problem(503, "the server is not running")});
  http::Framing framing;
  if (auto refusal = http::check_request(request, framing)) return done({{}, problem(refusal->status, std::move(refusal->reason))});
  if (request.body.size() > options.limits.max_body_bytes) {
    return done({{}, problem(413, "the body has more than " + std::to_string(options.limits.max_body_bytes) + " bytes")});
  }
  auto outcome = handler->handle(request, clock.now());
  if (auto* const deferred = std::get_if<engine::Deferred>(&outcome)) {
    if (ticket) *ticket = deferred->ticket;
    tickets.emplace(static_cast<std::uint64_t>(deferred->ticket), done);
  } else if (auto* const upgraded = std::get_if<engine::Upgraded>(&outcome)) {
    give(done, {{}, std::move(upgraded->response), upgraded->channel});
  } else if (auto* const streamed = std::get_if<engine::Streamed>(&outcome)) {
    give(done, {{}, std::move(streamed->response), streamed->channel});
  } else {
    give(done, {{}, std::get<http::Response>(std::move(outcome))});
  }
}

void Loopback::Impl::begin(StreamId id, engine::Reply reply) {
  const auto found = streams.find(static_cast<std::uint64_t>(id));
  if (found == streams.end()) {
    if (reply.channel) handler->closed(*reply.channel);
    return;
  }
  Stream& stream = found->second;
  stream.ticket.reset();
  if (reply.channel && reply.response.status == 101) {
    handler->closed(*reply.channel);
    reply = {{}, problem(500, "the loopback transport does not support WebSockets")};
  }
  if (!reply.channel) {
    const auto respond = std::move(stream.client.response);
    streams.erase(found);
    return respond(std::move(reply.response), false);
  }
  stream.channel = reply.channel;
  channels.emplace(static_cast<std::uint64_t>(*reply.channel), id);
  const auto respond = stream.client.response;
  respond(std::move(reply.response), true);
  push(id, clock.now());
}

/// Pushes messages while the client accepts them, for at most one turn.
void Loopback::Impl::push(StreamId id, TimePoint now) {
  for (int turn = 0; turn < pushes_per_turn; ++turn) {
    const auto found = streams.find(static_cast<std::uint64_t>(id));  // each time: the client may have cancelled
    if (found == streams.end() || !found->second.channel || found->second.paused || found->second.taking) return;
    auto push = handler->next_push(*found->second.channel, now);
    if (!push) return;
    if (push->close != 0) return end(id);
    if (!push->message) continue;
    found->second.taking = true;
    const auto take = found->second.client.message;
    const bool more = take(std::move(push->message));
    const auto again = streams.find(static_cast<std::uint64_t>(id));
    if (again == streams.end()) return;
    again->second.taking = false;
    again->second.paused = !std::exchange(again->second.resumed, false) && !more;
  }
  turns.push_back(id);
}

void Loopback::Impl::end(StreamId id) {
  const auto found = streams.find(static_cast<std::uint64_t>(id));
  const auto stream = std::move(found->second);
  streams.erase(found);
  channels.erase(static_cast<std::uint64_t>(*stream.channel));
  handler->closed(*stream.channel);
  stream.client.end();
}

void Loopback::Impl::deliver(TimePoint now) {
  budget_end.reset();
  for (left = false; handler;) {
    auto reply = handler->next_reply(now);
    if (!reply) break;
    const auto found = tickets.find(static_cast<std::uint64_t>(reply->ticket));
    if (found != tickets.end()) {
      const auto done = std::move(found->second);
      tickets.erase(found);
      give(done, *std::move(reply));
    } else if (reply->channel) {
      handler->closed(*reply->channel);
    }
    if (is_over()) {
      left = true;
      return;
    }
  }
  // Also without streams: the handler scans for changes here, for web callbacks too.
  while (handler && !left) {
    const auto channel = handler->next_ready(now);
    if (!channel) break;
    const auto found = channels.find(static_cast<std::uint64_t>(*channel));
    if (found == channels.end()) continue;
    push(found->second, now);
    left = is_over();
  }
  for (auto count = turns.size(); count > 0 && !left; --count) {
    const StreamId id = turns.front();
    turns.pop_front();
    push(id, now);
    left = is_over();
  }
}

milliseconds Loopback::Impl::next_due(TimePoint now) const {
  if (left || !turns.empty()) return milliseconds(0);
  const auto due = handler->next_deadline();
  if (!due) return milliseconds::max();
  return until(*due, now.steady);
}

/// Ends all that is open.
void Loopback::Impl::give_up() {
  auto* const stopped = std::exchange(handler, nullptr);
  turns.clear();
  for (const auto& [channel, id] : std::exchange(channels, {})) {
    const auto found = streams.find(static_cast<std::uint64_t>(id));
    const auto finish = std::move(found->second.client.end);
    streams.erase(found);
    stopped->closed(engine::Channel{channel});
    finish();
  }
  for (auto& [ticket, done] : std::exchange(tickets, {})) {
    stopped->abandon(engine::Ticket{ticket});
    done({{}, problem(503, "the server is stopping")});
  }
}

Loopback::Loopback(TransportOptions options) : impl_(std::make_unique<Impl>(std::move(options))) {}

Loopback::~Loopback() {
  if (impl_->handler) impl_->give_up();
}

Result<void> Loopback::start(engine::Handler& handler) {
  if (impl_->handler) return unexpected(Errc::invalid_option, "the transport is already started");
  impl_->handler = &handler;
  return {};
}

milliseconds Loopback::poll(std::chrono::microseconds budget, milliseconds wait) {
  if (!impl_->handler) return milliseconds::max();
  impl_->waker->wait(std::min(wait, impl_->next_due(impl_->clock.now())));
  const auto now = impl_->clock.now();
  impl_->budget = budget;
  impl_->deliver(now);
  return impl_->handler ? impl_->next_due(now) : milliseconds::max();
}

std::shared_ptr<Waker> Loopback::waker() const noexcept { return impl_->waker; }

void Loopback::stop() {
  if (!impl_->handler) return;
  // Bounded by the machine's time, whatever the clock of the options says.
  const auto end = SteadyClock::now() + impl_->options.limits.stop_timeout;
  while (impl_->handler && !impl_->tickets.empty()) {
    const auto now = SteadyClock::now();
    if (now >= end) break;
    poll(std::chrono::microseconds(0), std::chrono::ceil<milliseconds>(end - now));
  }
  if (impl_->handler) impl_->give_up();
}

void Loopback::submit(const http::Request& request, std::function<void(http::Response)> done) {
  impl_->handle(
      request,
      [this, done = std::move(done)](engine::Reply reply) {
        if (!reply.channel) return done(std::move(reply.response));
        impl_->handler->closed(*reply.channel);
        done(problem(500, "the loopback transport does not support WebSockets and event streams"));
      },
      nullptr);
}

Loopback::StreamId Loopback::submit(const http::Request& request, StreamClient client) {
  const StreamId id{++impl_->last_stream};
  impl_->streams.emplace(impl_->last_stream, Impl::Stream{std::move(client), std::nullopt, std::nullopt});
  http::Request streamable = request;
  streamable.can_stream = true;
  std::optional<engine::Ticket> ticket;
  impl_->handle(
      streamable, [this, id](engine::Reply reply) { impl_->begin(id, std::move(reply)); }, &ticket);
  const auto found = impl_->streams.find(static_cast<std::uint64_t>(id));
  if (found != impl_->streams.end()) found->second.ticket = ticket;
  return id;
}

void Loopback::resume(StreamId stream) {
  const auto found = impl_->streams.find(static_cast<std::uint64_t>(stream));
  if (found == impl_->streams.end()) return;
  if (found->second.taking) found->second.resumed = true;
  if (std::exchange(found->second.paused, false)) impl_->push(stream, impl_->clock.now());
}

void Loopback::cancel(StreamId stream) {
  const auto found = impl_->streams.find(static_cast<std::uint64_t>(stream));
  if (found == impl_->streams.end()) return;
  const auto cancelled = std::move(found->second);
  impl_->streams.erase(found);
  if (cancelled.ticket) {
    impl_->tickets.erase(static_cast<std::uint64_t>(*cancelled.ticket));
    impl_->handler->abandon(*cancelled.ticket);
  }
  if (cancelled.channel) {
    impl_->channels.erase(static_cast<std::uint64_t>(*cancelled.channel));
    impl_->handler->closed(*cancelled.channel);
  }
}

}  // namespace lrt::transport
