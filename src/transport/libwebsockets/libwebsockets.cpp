// SPDX-License-Identifier: Apache-2.0
#include <lrt/transport/libwebsockets.hpp>

#include <libwebsockets.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <optional>
#include <thread>
#include <utility>

#include "src/base/third_party_call.hpp"
#include "src/transport/libwebsockets/log.hpp"
#include "src/transport/libwebsockets/tls.hpp"
#include "src/transport/libwebsockets/vhost.hpp"
#include "src/transport/waits.hpp"

namespace lrt::transport {
inline namespace v0 {
namespace {

using libwebsockets::to_seconds;
using libwebsockets::Vhost;
using std::chrono::milliseconds;
using SteadyClock = std::chrono::steady_clock;

constexpr milliseconds max_wait = std::chrono::hours(1);
/// libwebsockets checks the times of its connections this often.
constexpr milliseconds timer_period{1000};
constexpr int max_empty_rounds = 16;
/// Time between two clients that are accepted with descriptors of the reserve.
constexpr milliseconds relief_period{100};
/// Descriptors that a context uses besides those of clients.
constexpr unsigned other_descriptors = 16;

/// A timer of an lws_context.
struct Timer {
  lws_sorted_usec_list_t scheduled{};  // first: libwebsockets gives its address to the callback
  std::function<void()> expired;

  void set(lws_context* context, std::chrono::microseconds time) {
    lws_sul_schedule(context, 0, &scheduled, &Timer::on_expired, std::max<lws_usec_t>(time.count(), 1));
  }
  void cancel() { lws_sul_cancel(&scheduled); }
  static void on_expired(lws_sorted_usec_list_t* scheduled) { reinterpret_cast<Timer*>(scheduled)->expired(); }
};

Result<void> check_tls(const std::optional<TlsOptions>& tls) {
  if (!tls) return {};
  if (tls->certificate_file.empty()) return unexpected(Errc::invalid_option, "tls.certificate_file: no file is named");
  if (tls->key_file.empty()) return unexpected(Errc::invalid_option, "tls.key_file: no file is named");
  if (tls->require_client_certificate && tls->client_ca_file.empty())
    return unexpected(Errc::invalid_option, "tls.require_client_certificate needs tls.client_ca_file");
  return libwebsockets::check_tls_files(*tls);
}

/// The common part of both transports: a vhost, and a waker that outlives it.
class VhostTransport : public Transport {
 public:
  explicit VhostTransport(TransportOptions options) : options_(std::move(options)), vhost_(std::make_shared<Vhost>(options_, waker_)) {}

  std::shared_ptr<Waker> waker() const noexcept override { return waker_; }
  std::uint16_t port() const noexcept override { return vhost_->port(); }
  std::optional<std::size_t> connections() const noexcept override { return connections_.load(std::memory_order_relaxed); }
  Result<void> reload_tls() override {
    if (!options_.tls) return unexpected(Errc::invalid_option, "the port serves plain HTTP: there are no TLS files to reload");
    if (auto checked = check_tls(options_.tls); !checked) return checked;
    reload_ = true;
    waker_->wake();
    return {};
  }

 protected:
  bool is_open() const noexcept { return vhost_->is_open(); }
  TimePoint now() const noexcept { return vhost_->now(); }
  std::optional<SteadyClock::time_point> next_deadline() const { return vhost_->handler().next_deadline(); }
  /// For the next start(): libwebsockets may still use the previous one.
  void renew() { vhost_ = std::make_shared<Vhost>(options_, waker_); }
  void count_connections() noexcept { connections_.store(vhost_->connection_count(), std::memory_order_relaxed); }
  /// Called at the beginning of a turn, so that the next client gets a new certificate.
  void reload_if_requested() {
    if (reload_.exchange(false)) vhost_->reload_tls();
  }

  const TransportOptions options_;
  const std::shared_ptr<EventWaker> waker_ = std::make_shared<EventWaker>();
  std::shared_ptr<Vhost> vhost_;

 private:
  std::atomic<bool> reload_{false};
  std::atomic<std::size_t> connections_{0};  ///< at the end of the last turn
};

/// A transport with its own context, which exists from start() to stop().
class OwnContext final : public VhostTransport {
 public:
  using VhostTransport::VhostTransport;
  ~OwnContext() override {
    vhost_->close();
    destroy_context();
  }

  Result<void> start(engine::Handler& handler) override;
  milliseconds poll(std::chrono::microseconds budget, milliseconds wait) override;
  void stop() override;
  Capabilities capabilities() const noexcept override { return {true, true, true, false, false}; }

 private:
  void serve(milliseconds wait);
  void pause_after_nothing(std::size_t events);
  void relieve();
  void destroy_context();

  std::optional<libwebsockets::Log> log_;
  lws_context* context_ = nullptr;
  Timer wait_;
  SteadyClock::time_point next_relief_{};
  int empty_rounds_ = 0;  ///< waits in a row that ended without an event
};

Result<void> OwnContext::start(engine::Handler& handler) {
  if (is_open()) return unexpected(Errc::invalid_option, "the transport is already started");
  if (auto checked = check_tls(options_.tls); !checked) return checked;
  log_.emplace(options_.log);
  const auto& limits = options_.limits;
  lws_context_creation_info info{};
  info.port = CONTEXT_PORT_NO_LISTEN;
  info.options = LWS_SERVER_OPTION_EXPLICIT_VHOSTS | LWS_SERVER_OPTION_SKIP_SERVER_CANONICAL_NAME | LWS_SERVER_OPTION_VALIDATE_UTF8 |
                 (options_.tls ? LWS_SERVER_OPTION_DO_SSL_GLOBAL_INIT : 0);
  info.fd_limit_per_thread = static_cast<unsigned>(vhost_->max_clients()) + other_descriptors;
  info.max_http_header_data2 = static_cast<unsigned>(std::min<std::size_t>(limits.max_header_bytes, 65535));
  info.max_http_header_pool2 = info.fd_limit_per_thread;  // a connection without a header table would wait until another one ends
  info.timeout_secs = static_cast<unsigned>(to_seconds(limits.header_timeout));
  info.pt_serv_buf_size = 16 * 1024;
  context_ = lws_create_context(&info);
  Result<void> opened = unexpected(Errc::io_error, "libwebsockets has no context");
  if (context_ != nullptr) {
    wait_.expired = [this] { waker_->wake(); };  // it may expire between the check of the timers and the wait
    opened = Vhost::open(vhost_, context_, handler, {});
  }
  if (!opened) destroy_context();
  else if (options_.tls) ThirdPartyCall::wake_at_exit(waker_);
  return opened;
}

/// One round of events. With a time that is not negative, libwebsockets waits for the next of them.
void OwnContext::serve(milliseconds wait) {
  vhost_->begin_round();
  if (wait <= milliseconds(0)) {
    lws_service(context_, -1);
    return;
  }
  wait_.set(context_, wait);
  lws_service(context_, 0);
  wait_.cancel();
}

milliseconds OwnContext::poll(std::chrono::microseconds budget, milliseconds wait) {
  if (!is_open()) return milliseconds::max();
  std::optional<ThirdPartyCall> call;  // of OpenSSL, by libwebsockets
  if (options_.tls && !call.emplace()) {
    waker_->wait(wait);
    return max_wait;
  }
  reload_if_requested();
  const auto end = SteadyClock::now() + budget;
  wait = std::min(wait, max_wait);
  if (const auto due = next_deadline()) wait = std::min(wait, until(*due, now().steady));
  if (vhost_->has_more()) wait = milliseconds(0);
  for (auto events = vhost_->events();; events = vhost_->events()) {
    serve(wait);
    if (vhost_->events() == events) relieve();
    if (wait > milliseconds(0)) pause_after_nothing(events);
    wait = milliseconds(0);
    if ((!vhost_->deliver() && vhost_->events() == events) || SteadyClock::now() >= end) break;  // the delivered output is written in the next round
  }
  count_connections();
  auto rest = vhost_->has_connections() ? timer_period : max_wait;
  rest = milliseconds(lws_service_adjust_timeout(context_, static_cast<int>(rest.count()), 0));
  if (const auto due = next_deadline()) rest = std::min(rest, until(*due, now().steady));
  return vhost_->has_more() ? milliseconds(0) : rest;
}

/// A client that sends without reading its response makes libwebsockets return from every wait. This limits the CPU time of that.
void OwnContext::pause_after_nothing(std::size_t events) {
  if (vhost_->events() != events) empty_rounds_ = 0;
  else if (++empty_rounds_ > max_empty_rounds) std::this_thread::sleep_for(milliseconds(1));
}

/// libwebsockets does not report that it has no descriptor for a new client. A round without an event may have that reason.
void OwnContext::relieve() {
  const auto now = SteadyClock::now();
  if (now < next_relief_) return;
  next_relief_ = now + relief_period;
  if (vhost_->release_descriptor()) serve(milliseconds(0));
  vhost_->fill_reserve();
}

void OwnContext::stop() {
  if (!is_open() || (options_.tls && !ThirdPartyCall())) return;
  vhost_->begin_stop();
  // Limited by the system's clock, not by the clock of the options.
  const auto end = SteadyClock::now() + options_.limits.stop_timeout;
  for (auto time = SteadyClock::now(); vhost_->is_busy() && time < end; time = SteadyClock::now()) poll(milliseconds(10), until(end, time));
  vhost_->close();
  destroy_context();
}

void OwnContext::destroy_context() {
  if (context_ != nullptr) lws_context_destroy(std::exchange(context_, nullptr));
  vhost_->forget();
  log_.reset();
  renew();
}

/// A vhost of the host's context, whose lws_service() takes the turns.
class HostContext final : public VhostTransport {
 public:
  HostContext(TransportOptions options, lws_context* context) : VhostTransport(std::move(options)), context_(context) {
    turn_.expired = [this] { options_.turn(); };
  }
  ~HostContext() override { close(); }

  Result<void> start(engine::Handler& handler) override;
  milliseconds poll(std::chrono::microseconds budget, milliseconds wait) override;
  void stop() override { close(); }
  Capabilities capabilities() const noexcept override { return {true, true, true, true, false}; }

 private:
  void request_turn() { turn_.set(context_, std::chrono::microseconds(0)); }
  void close();

  lws_context* const context_;
  Timer turn_;
};

Result<void> HostContext::start(engine::Handler& handler) {
  if (is_open()) return unexpected(Errc::invalid_option, "the transport is already started");
  if (context_ == nullptr) return unexpected(Errc::invalid_option, "the transport needs an lws_context");
  if (!options_.turn) return unexpected(Errc::invalid_option, "the transport runs on the host's event loop: set TransportOptions::turn");
  if (auto checked = check_tls(options_.tls); !checked) return checked;
  auto opened = Vhost::open(vhost_, context_, handler, [this] { request_turn(); });
  if (opened) request_turn();
  else close();
  return opened;
}

/// The host calls lws_service(): this delivers the pending output and sets the time of the next turn.
milliseconds HostContext::poll(std::chrono::microseconds, milliseconds) {
  if (!is_open()) return milliseconds::max();
  reload_if_requested();
  vhost_->deliver();
  count_connections();
  if (vhost_->has_more()) {
    request_turn();
    return milliseconds(0);
  }
  const auto due = next_deadline();
  if (!due) {
    turn_.cancel();
    return milliseconds::max();
  }
  const auto time = std::chrono::ceil<std::chrono::microseconds>(std::max(*due - now().steady, SteadyClock::duration::zero()));
  turn_.set(context_, time);
  return std::chrono::ceil<milliseconds>(time);
}

void HostContext::close() {
  turn_.cancel();
  vhost_->close();
  vhost_->destroy();
  renew();
}

}  // namespace

std::unique_ptr<Transport> make_libwebsockets(TransportOptions options) { return std::make_unique<OwnContext>(std::move(options)); }

std::unique_ptr<Transport> make_libwebsockets(TransportOptions options, lws_context* context) {
  return std::make_unique<HostContext>(std::move(options), context);
}

}  // namespace v0
}  // namespace lrt::transport
