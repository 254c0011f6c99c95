#include <lrt/transport/loopback.hpp>

#include <cstdint>
#include <optional>
#include <unordered_map>
#include <utility>
#include <variant>

#include <lrt/http/request_parser.hpp>
#include <lrt/http/problem.hpp>

#include "src/transport/event_waker.hpp"

namespace lrt::transport {
namespace {

using std::chrono::milliseconds;

http::Response problem(int status, std::string detail) {
  http::Response response;
  response.status = status;
  response.fields.add("Content-Type", "application/problem+json");
  response.set_body(http::to_json({status, std::move(detail)}));
  response.close = true;
  return response;
}

}  // namespace

struct Loopback::Impl {
  explicit Impl(TransportOptions given) : options(std::move(given)), clock(options.clock ? *options.clock : system_clock()) {}

  void deliver(TimePoint now, std::chrono::microseconds budget) {
    std::optional<std::chrono::steady_clock::time_point> end;
    for (left = false; handler;) {
      auto reply = handler->next_reply(now);
      if (!reply) break;
      const auto found = open.find(static_cast<std::uint64_t>(reply->ticket));
      if (found != open.end()) {
        const auto done = std::move(found->second);
        open.erase(found);
        if (reply->channel) done(refuse_upgrade(*reply->channel));
        else done(std::move(reply->response));
      } else if (reply->channel) {
        handler->closed(*reply->channel);
      }
      const auto at = std::chrono::steady_clock::now();
      if (!end) end = at + budget;
      if (at >= *end) {
        left = true;
        return;
      }
    }
    // No channel is one of ours, but this is where the handler looks for news, for web callbacks too.
    while (handler && handler->next_ready(now)) {}
  }

  /// No request here can be upgraded; a handler that did not look is told that its channel is over.
  http::Response refuse_upgrade(engine::Channel channel) {
    handler->closed(channel);
    return problem(500, "there are no WebSockets here");
  }

  milliseconds next_due(TimePoint now) const {
    if (left) return milliseconds(0);
    const auto due = handler->next_deadline();
    if (!due) return milliseconds::max();
    return *due <= now.steady ? milliseconds(0) : std::chrono::ceil<milliseconds>(*due - now.steady);
  }

  void give_up() {
    auto* const stopped = std::exchange(handler, nullptr);
    for (auto& [ticket, done] : std::exchange(open, {})) {
      stopped->abandon(engine::Ticket{ticket});
      done(problem(503, "the server stops"));
    }
  }

  const TransportOptions options;
  const Clock& clock;
  engine::Handler* handler = nullptr;
  bool left = false;  ///< the budget ended before the handler's replies
  std::shared_ptr<EventWaker> waker = std::make_shared<EventWaker>();
  std::unordered_map<std::uint64_t, std::function<void(http::Response)>> open;
};

Loopback::Loopback(TransportOptions options) : impl_(std::make_unique<Impl>(std::move(options))) {}

Loopback::~Loopback() {
  if (impl_->handler) impl_->give_up();
}

Result<void> Loopback::start(engine::Handler& handler) {
  if (impl_->handler) return unexpected(Errc::invalid_option, "the transport was started already");
  impl_->handler = &handler;
  return {};
}

milliseconds Loopback::poll(std::chrono::microseconds budget, milliseconds wait) {
  if (!impl_->handler) return milliseconds::max();
  impl_->waker->wait(std::min(wait, impl_->next_due(impl_->clock.now())));
  const auto now = impl_->clock.now();
  impl_->deliver(now, budget);
  return impl_->handler ? impl_->next_due(now) : milliseconds::max();
}

std::shared_ptr<Waker> Loopback::waker() const noexcept { return impl_->waker; }

void Loopback::stop() {
  if (!impl_->handler) return;
  // Bounded by the machine's time, whatever the clock of the options says.
  const auto end = std::chrono::steady_clock::now() + impl_->options.limits.stop_timeout;
  while (impl_->handler && !impl_->open.empty()) {
    const auto now = std::chrono::steady_clock::now();
    if (now >= end) break;
    poll(std::chrono::microseconds(0), std::chrono::ceil<milliseconds>(end - now));
  }
  if (impl_->handler) impl_->give_up();
}

void Loopback::submit(const http::Request& request, std::function<void(http::Response)> done) {
  if (!impl_->handler) return done(problem(503, "the server is not running"));
  http::Framing framing;
  if (auto refusal = http::check_request(request, framing)) return done(problem(refusal->status, std::move(refusal->reason)));
  if (request.body.size() > impl_->options.limits.max_body_bytes) {
    return done(problem(413, "the body has more than " + std::to_string(impl_->options.limits.max_body_bytes) + " bytes"));
  }
  auto outcome = impl_->handler->handle(request, impl_->clock.now());
  if (auto* const deferred = std::get_if<engine::Deferred>(&outcome)) {
    impl_->open.emplace(static_cast<std::uint64_t>(deferred->ticket), std::move(done));
  } else if (auto* const upgraded = std::get_if<engine::Upgraded>(&outcome)) {
    done(impl_->refuse_upgrade(upgraded->channel));
  } else {
    done(std::get<engine::Answered>(std::move(outcome)));
  }
}

}  // namespace lrt::transport
