// SPDX-License-Identifier: Apache-2.0
#include <lrt/transport/libwebsockets.hpp>

#include <libwebsockets.h>
#include <signal.h>  // sigaction

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include <lrt/transport/http.hpp>

#include "src/transport/libwebsockets/descriptor_watch.hpp"
#include "src/transport/libwebsockets/log.hpp"
#include "src/transport/waits.hpp"

namespace lrt::transport {
inline namespace v0 {
namespace {

using libwebsockets::DescriptorWatch;
using std::chrono::milliseconds;

constexpr milliseconds longest_wait = std::chrono::hours(1);
/// libwebsockets rounds the time until a timer down to milliseconds.
constexpr std::chrono::microseconds rounding{999};
/// Descriptors of a context that has no clients.
constexpr unsigned descriptors_of_context = 16;

/// The HTTP transport, whose descriptor an lws_context waits for.
class WatchedHttp : public Transport {
 public:
  explicit WatchedHttp(TransportOptions options) : http_(make_http(std::move(options))) {}

  int descriptor() noexcept override { return http_->descriptor(); }
  std::shared_ptr<Waker> waker() const noexcept override { return http_->waker(); }
  Capabilities capabilities() const noexcept override { return http_->capabilities(); }
  Result<void> reload_tls() override { return http_->reload_tls(); }
  std::uint16_t port() const noexcept override { return http_->port(); }
  std::optional<std::size_t> connections() const noexcept override { return http_->connections(); }

 protected:
  Result<void> begin_watch(lws_context* context, std::function<void()> on_readable) {
    auto begun = DescriptorWatch::begin(context, http_->descriptor(), std::move(on_readable));
    if (!begun) return Unexpected{std::move(begun).error()};
    watch_ = *std::move(begun);
    return {};
  }
  void end_watch() noexcept {
    if (watch_) watch_->end();
  }

  const std::unique_ptr<Transport> http_;
  std::shared_ptr<DescriptorWatch> watch_;
};

/// On the context of a host, whose lws_service() takes the turns.
class HostContext final : public WatchedHttp {
 public:
  HostContext(TransportOptions options, lws_context* context)
      : WatchedHttp(options), context_(context), turn_(std::move(options.turn)), log_(std::move(options.log)) {}
  ~HostContext() override { end_watch(); }

  Result<void> start(engine::Handler& handler) override;
  milliseconds poll(std::chrono::microseconds budget, milliseconds wait) override { return http_->poll(budget, wait); }
  void stop() override {
    end_watch();
    http_->stop();
  }
  Capabilities capabilities() const noexcept override {
    auto capabilities = http_->capabilities();
    capabilities.on_host_loop = true;
    return capabilities;
  }

 private:
  void take_turn() noexcept;

  lws_context* const context_;
  const std::function<void()> turn_;
  const LogCallback log_;
};

Result<void> HostContext::start(engine::Handler& handler) {
  if (context_ == nullptr) return unexpected(Errc::invalid_option, "the transport needs an lws_context");
  if (!turn_) return unexpected(Errc::invalid_option, "the transport runs on the host's event loop: set TransportOptions::turn");
  if (auto started = http_->start(handler); !started) return started;
  auto begun = begin_watch(context_, [this] { take_turn(); });
  if (!begun) http_->stop();
  return begun;
}

void HostContext::take_turn() noexcept {
  try {
    turn_();
  } catch (...) {
    try {
      if (log_) log_(LogLevel::error, "a turn on the host's lws_context threw");
    } catch (...) {}
  }
}

/// With a context of its own, from start() to stop().
class OwnContext final : public WatchedHttp {
 public:
  explicit OwnContext(TransportOptions options)
      : WatchedHttp(options), log_callback_(std::move(options.log)), clock_(options.clock != nullptr ? *options.clock : system_clock()) {}
  ~OwnContext() override { destroy_context(); }

  Result<void> start(engine::Handler& handler) override;
  milliseconds poll(std::chrono::microseconds budget, milliseconds wait) override;
  void stop() override {
    destroy_context();
    http_->stop();
  }

 private:
  /// Ends a wait of lws_service().
  struct Timer {
    lws_sorted_usec_list_t scheduled{};  // first: libwebsockets gives its address to the callback
    Waker* waker = nullptr;
    static void on_expired(lws_sorted_usec_list_t* scheduled) { reinterpret_cast<Timer*>(scheduled)->waker->wake(); }
  };
  Result<void> open();
  void destroy_context() noexcept;
  void wait_at_most(milliseconds time);

  const LogCallback log_callback_;
  const Clock& clock_;
  engine::Handler* handler_ = nullptr;
  std::optional<std::chrono::steady_clock::time_point> due_;  ///< when poll() has work by what the last poll() knew
  std::optional<libwebsockets::Log> log_;
  lws_context* context_ = nullptr;
  Timer timer_;
};

Result<void> OwnContext::start(engine::Handler& handler) {
  if (auto started = http_->start(handler); !started) return started;
  handler_ = &handler;
  due_.reset();
  auto opened = open();
  if (!opened) stop();
  return opened;
}

Result<void> OwnContext::open() {
  log_.emplace(log_callback_);
  lws_context_creation_info info{};
  info.port = CONTEXT_PORT_NO_LISTEN;
  info.options = LWS_SERVER_OPTION_EXPLICIT_VHOSTS | LWS_SERVER_OPTION_SKIP_SERVER_CANONICAL_NAME;
  info.fd_limit_per_thread = descriptors_of_context;
  struct sigaction before {};
  ::sigaction(SIGPIPE, nullptr, &before);
  context_ = lws_create_context(&info);  // makes the process ignore SIGPIPE, which lrt does not need
  ::sigaction(SIGPIPE, &before, nullptr);
  if (context_ == nullptr) return unexpected(Errc::io_error, "libwebsockets has no context");
  return begin_watch(context_, [] {});  // poll() serves
}

milliseconds OwnContext::poll(std::chrono::microseconds budget, milliseconds wait) {
  if (context_ == nullptr) return milliseconds::max();
  const auto now = clock_.now().steady;
  if (due_) wait = std::min(wait, until(*due_, now));
  if (const auto deadline = handler_->next_deadline()) wait = std::min(wait, until(*deadline, now));
  if (wait > milliseconds(0)) wait_at_most(std::min(wait, longest_wait));
  else lws_service(context_, -1);
  const milliseconds rest = http_->poll(budget, milliseconds(0));
  due_.reset();
  if (rest < longest_wait) due_ = clock_.now().steady + rest;
  return rest;
}

/// Until the descriptor is readable: there is work, or a time is over.
void OwnContext::wait_at_most(milliseconds time) {
  const auto waker = http_->waker();
  timer_.waker = waker.get();  // it may expire between the check of the timers and the wait: the descriptor ends that, too
  lws_sul_schedule(context_, 0, &timer_.scheduled, &Timer::on_expired, (time + rounding).count());
  lws_service(context_, 0);
  lws_sul_cancel(&timer_.scheduled);
}

void OwnContext::destroy_context() noexcept {
  end_watch();
  if (context_ != nullptr) lws_context_destroy(std::exchange(context_, nullptr));
  if (watch_) watch_->forget();
  watch_.reset();
  log_.reset();
}

}  // namespace

std::unique_ptr<Transport> make_libwebsockets(TransportOptions options) { return std::make_unique<OwnContext>(std::move(options)); }

std::unique_ptr<Transport> make_libwebsockets(TransportOptions options, lws_context* context) {
  return std::make_unique<HostContext>(std::move(options), context);
}

}  // namespace v0
}  // namespace lrt::transport
