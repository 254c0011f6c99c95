// SPDX-License-Identifier: Apache-2.0
#include "src/client/websockets.hpp"

#include <libwebsockets.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <map>
#include <mutex>
#include <string_view>
#include <utility>
#include <variant>

#include <lrt/version.hpp>

#include "src/base/ascii.hpp"
#include "src/base/mailbox.hpp"
#include "src/base/third_party_call.hpp"
#include "src/base/thread.hpp"
#include "src/base/utf8.hpp"
#include "src/transport/libwebsockets/log.hpp"

namespace lrt::client {
inline namespace v0 {
namespace {

using std::chrono::milliseconds;
using SteadyClock = std::chrono::steady_clock;
using Instant = SteadyClock::time_point;

constexpr const char* protocol_name = "lrt-client";
constexpr milliseconds close_time{2'000};
constexpr unsigned max_connections = 4'096;  // with those that are being closed
constexpr unsigned other_descriptors = 16;   // of a context
/// libwebsockets 4.1 writes the request line with at most 2048 bytes and Host with at most 128, and cuts what is longer.
constexpr std::size_t max_target_bytes = 2'000, max_authority_bytes = 110;

/// A timer of an lws_context.
struct Timer {
  lws_sorted_usec_list_t scheduled{};  // first: libwebsockets gives its address to the callback
  void* owner = nullptr;
};

/// Replaces some messages of libwebsockets by clearer ones.
Error connect_error(std::string_view said, const std::string& where) {
  if (said == "Unable to connect") return {Errc::io_error, where + ": no connection"};
  if (said == "HS: Accept hash wrong" || said == "HS: ACCEPT missing")
    return {Errc::expected_http, where + ": Sec-WebSocket-Accept is not that of the request"};
  if (said.substr(0, 3) == "HS:")
    return {Errc::expected_http, where + ": the opening response is not valid: " + std::string(said.substr(said.find_first_not_of(' ', 3)))};
  return {Errc::closed, where + ": " + (said.empty() ? "the connection was closed" : std::string(said))};
}

/// Callbacks of received frames. If one of them returns that the connection is to be closed, the parser of libwebsockets 4.1 does not reset the
/// fill level of its buffer (client-parser-ws.c, rx_ubuf_head), goes on with what the server sends until the close is acknowledged, and writes it
/// beyond the end of the buffer. So they always return 0, and the connection is closed when it is writable.
constexpr bool must_go_on(lws_callback_reasons reason) noexcept {
  return reason == LWS_CALLBACK_CLIENT_RECEIVE || reason == LWS_CALLBACK_CLIENT_RECEIVE_PONG || reason == LWS_CALLBACK_WS_PEER_INITIATED_CLOSE;
}

}  // namespace

struct WebSockets::Impl : std::enable_shared_from_this<Impl> {
  /// One connection. Used by the own thread only.
  struct Connection : Timer {
    enum class Phase : unsigned char { connecting, handshake, open, closing };

    std::uint64_t id = 0;
    WebSocketRequest request;
    std::shared_ptr<WebSocketEvents> events;
    lws* wsi = nullptr;
    Phase phase = Phase::connecting;
    bool is_connected = false;  ///< TCP is
    bool wants_ping = false;
    bool has_pinged = false;  ///< since the last frame
    std::size_t address = 0;  ///< the present one
    Instant limit{};          ///< of the phase, unless it is `open`
    Instant last_frame{};
    std::uint16_t own_code = 0;  ///< of the close that is to be sent
    std::string message;
    bool is_text = true;
    std::string location;
    std::optional<WebSocketEnd> end;

    std::string where() const { return "WebSocket to \"" + request.url.authority + "\""; }
    void note_frame() {
      last_frame = SteadyClock::now();
      has_pinged = false;
    }
    /// The first reason is reported.
    void fail(Error error) {
      if (!end) end = WebSocketEnd{0, {}, 0, {}, std::move(error)};
    }
  };
  struct Open {
    std::uint64_t id;
    WebSocketRequest request;
    std::shared_ptr<WebSocketEvents> events;
  };
  struct Close {
    std::uint64_t id;
  };
  struct ExitWaker final : Waker {
    explicit ExitWaker(std::weak_ptr<Impl> owner) : impl(std::move(owner)) {}
    void wake() noexcept override {
      if (const auto owner = impl.lock()) owner->wake();
    }
    const std::weak_ptr<Impl> impl;
  };

  explicit Impl(const Options& given) : options(given) {}

  // Any thread.
  bool start();
  void put(std::variant<Open, Close> command);
  void wake() noexcept;

  // The own thread.
  void run();
  bool create_context();
  void serve();
  void open(Open command);
  void connect(Connection& connection);
  void close(Connection& connection, std::uint16_t code);
  void begin_close(Connection& connection, std::uint16_t code);
  void kill(Connection& connection);
  void set_timer(Connection& connection, milliseconds time);
  void expire(Connection& connection);
  void finish_ended();
  void finish(Connection& connection);
  bool enable_tls();
  int dispatch(lws* wsi, Connection& connection, lws_callback_reasons reason, void* in, std::size_t size);
  int add_fields(Connection& connection, unsigned char** to, std::size_t room) const;
  void receive(Connection& connection, const char* bytes, std::size_t size);
  int write(Connection& connection);

  static int on_lws(lws* wsi, lws_callback_reasons reason, void* user, void* in, std::size_t size) noexcept;
  static void on_timer(lws_sorted_usec_list_t* scheduled) noexcept;

  const Options options;
  Mailbox<std::variant<Open, Close>> commands;
  std::atomic<std::uint64_t> next_id{1};
  std::atomic<bool> stopping{false};

  std::mutex mutex;  // never held during calls of other functions of lrt
  Thread thread;
  bool is_started = false;
  lws_context* wakeable = nullptr;  ///< the context, while it may be woken
  std::shared_ptr<Waker> exit_waker;

  lws_context* context = nullptr;
  lws_vhost* vhost = nullptr;
  bool has_tls = false;
  std::map<std::uint64_t, std::unique_ptr<Connection>> connections;
  std::vector<std::uint64_t> ended;  ///< connections whose wsi is gone
};

// ------------------------------------------------------------------------------------------------------------ any thread

bool WebSockets::Impl::start() {
  const std::lock_guard lock(mutex);
  if (is_started) return true;
  if (stopping) return false;
  Result<Thread> started = start_thread("lrt-client", options.threads, [self = shared_from_this()] { self->run(); });
  if (!started) return false;
  thread = *std::move(started);
  return is_started = true;
}

void WebSockets::Impl::put(std::variant<Open, Close> command) {
  commands.put(std::move(command));
  wake();
}

void WebSockets::Impl::wake() noexcept {
  const std::lock_guard lock(mutex);
  if (wakeable != nullptr) lws_cancel_service(wakeable);
}

WebSockets::WebSockets(const Options& options) : impl_(std::make_shared<Impl>(options)) {}

WebSockets::~WebSockets() { stop(); }

std::uint64_t WebSockets::open(WebSocketRequest request, std::shared_ptr<WebSocketEvents> events) {
  if (!impl_->start()) return 0;
  const std::uint64_t id = impl_->next_id++;
  impl_->put(Impl::Open{id, std::move(request), std::move(events)});
  return id;
}

void WebSockets::close(std::uint64_t connection) { impl_->put(Impl::Close{connection}); }

void WebSockets::stop() noexcept {
  impl_->stopping = true;
  impl_->wake();
  Thread thread;
  {
    const std::lock_guard lock(impl_->mutex);
    std::swap(thread, impl_->thread);
  }
  if (thread.is_current()) thread.detach();  // it has the Impl until it ends
}

// -------------------------------------------------------------------------------------------------------- the own thread

void WebSockets::Impl::run() {
  std::optional<libwebsockets::Log> log;
  bool process_ends = false;
  {
    const ThirdPartyCall call;  // libwebsockets initialises OpenSSL
    process_ends = !call;
    if (call) {
      log.emplace(options.log);
      if (create_context()) {
        const std::lock_guard lock(mutex);
        wakeable = context;
      }
    }
  }
  if (context != nullptr) serve();
  {
    const std::lock_guard lock(mutex);
    wakeable = nullptr;
  }
  if (const ThirdPartyCall call; call && !process_ends && context != nullptr) {
    for (auto& [id, connection] : connections) lws_sul_cancel(&connection->scheduled);
    lws_context_destroy(context);
  }
  stopping = true;
  commands.take_all([this](std::variant<Open, Close> command) noexcept {  // too late
    if (auto* request = std::get_if<Open>(&command)) {
      try {
        request->events->ended({0,
                                {},
                                0,
                                {},
                                Error{context != nullptr ? Errc::cancelled : Errc::io_error,
                                      "there is no WebSocket: the client stops, or libwebsockets has no context"}});
      } catch (...) {}
    }
  });
  for (auto& [id, connection] : connections) {
    connection->fail({Errc::cancelled, connection->where() + ": the client stops"});
    connection->events->ended(*connection->end);
  }
  connections.clear();
}

bool WebSockets::Impl::create_context() {
  static const lws_protocols protocols[] = {{protocol_name, &Impl::on_lws, 0, 4096, 0, nullptr, 0}, {nullptr, nullptr, 0, 0, 0, nullptr, 0}};
  const Limits& limits = options.limits;
  const auto seconds = [](milliseconds time) {
    return static_cast<unsigned>(std::max<std::int64_t>(1, std::chrono::ceil<std::chrono::seconds>(time).count()));
  };
  lws_context_creation_info info{};
  info.port = CONTEXT_PORT_NO_LISTEN;
  info.options = LWS_SERVER_OPTION_EXPLICIT_VHOSTS | LWS_SERVER_OPTION_SKIP_SERVER_CANONICAL_NAME | LWS_SERVER_OPTION_DO_SSL_GLOBAL_INIT;
  info.fd_limit_per_thread = max_connections + other_descriptors;
  info.max_http_header_data2 = static_cast<unsigned>(std::min<std::size_t>(limits.max_header_bytes, 65535));
  info.max_http_header_pool2 = max_connections;  // tables exist while a handshake needs them
  info.pt_serv_buf_size = 16 * 1024;
  info.timeout_secs = 1 + seconds(limits.connect_time + limits.response_time);  // timers of ours are earlier
  context = lws_create_context(&info);
  if (context == nullptr) return false;
  lws_context_creation_info own{};
  own.port = CONTEXT_PORT_NO_LISTEN;
  own.vhost_name = protocol_name;
  own.protocols = protocols;
  own.connect_timeout_secs = 1 + seconds(limits.connect_time);
  // Otherwise libwebsockets would use the environment's proxy. Port 0: no proxy.
  own.http_proxy_address = "none:0";
  own.alpn = "http/1.1";
  own.options = options.ca_file.empty() ? 0 : LWS_SERVER_OPTION_DISABLE_OS_CA_CERTS;
  vhost = lws_create_vhost(context, &own);
  if (vhost == nullptr) {
    lws_context_destroy(std::exchange(context, nullptr));
    return false;
  }
  exit_waker = std::make_shared<ExitWaker>(weak_from_this());
  [[maybe_unused]] static const bool closes = ThirdPartyCall::close_at_exit();
  ThirdPartyCall::wake_at_exit(exit_waker);
  return true;
}

/// With the first TLS connection: the certificate authorities of the system take time and memory.
bool WebSockets::Impl::enable_tls() {
  if (has_tls) return true;
  lws_context_creation_info info{};
  info.options = LWS_SERVER_OPTION_DO_SSL_GLOBAL_INIT;
  info.ssl_client_options_set = SSL_OP_NO_SSLv3 | SSL_OP_NO_TLSv1 | SSL_OP_NO_TLSv1_1;
  const auto file = [](const std::string& name) { return name.empty() ? nullptr : name.c_str(); };
  info.client_ssl_ca_filepath = file(options.ca_file);
  info.client_ssl_cert_filepath = file(options.identity.certificate_file);
  info.client_ssl_private_key_filepath = file(options.identity.key_file);
  has_tls = lws_init_vhost_client_ssl(&info, vhost) == 0;
  return has_tls;
}

void WebSockets::Impl::serve() {
  std::optional<Instant> stop_until;
  while (true) {
    const ThirdPartyCall call;  // of OpenSSL
    if (!call) return;
    commands.take_all([this](std::variant<Open, Close> command) noexcept {
      try {
        if (auto* request = std::get_if<Open>(&command)) {
          open(std::move(*request));
        } else if (const auto found = connections.find(std::get<Close>(command).id); found != connections.end()) {
          close(*found->second, 1000);
        }
      } catch (...) {  // out of memory
        if (auto* request = std::get_if<Open>(&command); request && request->events) request->events->ended({});
      }
    });
    finish_ended();
    if (stopping) {
      if (!stop_until) {
        stop_until = SteadyClock::now() + close_time;
        for (auto& [id, connection] : connections) close(*connection, 1001);
        finish_ended();
      }
      if (connections.empty() || SteadyClock::now() >= *stop_until) return;
    }
    lws_service(context, 0);
    finish_ended();
  }
}

void WebSockets::Impl::open(Open command) {
  auto made = std::make_unique<Connection>();
  Connection& c = *made;
  c.owner = this;
  c.id = command.id;
  c.request = std::move(command.request);
  c.events = std::move(command.events);
  connections.emplace(c.id, std::move(made));
  const http::Url& url = c.request.url;
  if (stopping) c.fail({Errc::cancelled, c.where() + ": the client stops"});
  else if (connections.size() > max_connections)
    c.fail({Errc::limit_exceeded, c.where() + ": more than " + std::to_string(max_connections) + " connections"});
  else if (url.target.size() > max_target_bytes)
    c.fail({Errc::limit_exceeded, c.where() + ": path and query are longer than " + std::to_string(max_target_bytes) + " bytes"});
  else if (url.authority.size() > max_authority_bytes)
    c.fail({Errc::limit_exceeded, c.where() + ": the host is longer than " + std::to_string(max_authority_bytes) + " bytes"});
  else if (url.secure && url.host.front() == '[')
    c.fail({Errc::unsupported_syntax, c.where() + ": libwebsockets cannot check the certificate of an IPv6 address; use a host name"});
  else if (url.secure && !enable_tls()) c.fail({Errc::invalid_option, c.where() + ": TLS: the files of the certificates cannot be used"});
  else if (c.request.addresses.empty()) c.fail({Errc::io_error, c.where() + ": no address"});
  if (c.end) {
    ended.push_back(c.id);
    return;
  }
  connect(c);
}

void WebSockets::Impl::connect(Connection& c) {
  const std::string address = c.request.addresses[c.address].text;
  lws_client_connect_info info{};
  info.context = context;
  info.vhost = vhost;
  info.address = address.c_str();  // numeric: libwebsockets resolves names on this thread
  info.port = c.request.url.port;
  info.path = c.request.url.target.c_str();
  info.host = c.request.url.authority.c_str();  // also SNI, and what the certificate must be valid for
  info.ssl_connection = LCCSCF_HTTP_NO_FOLLOW_REDIRECT | (c.request.url.secure ? LCCSCF_USE_SSL : 0);
  info.ietf_version_or_minus_one = -1;
  info.local_protocol_name = protocol_name;
  info.alpn = "http/1.1";
  info.opaque_user_data = &c;
  info.userdata = &c;
  info.pwsi = &c.wsi;
  c.phase = Connection::Phase::connecting;
  c.is_connected = false;
  // Each address gets an equal part of the time.
  const auto time = options.limits.connect_time / static_cast<int>(c.request.addresses.size());
  c.limit = SteadyClock::now() + time;
  set_timer(c, time);
  if (lws_client_connect_via_info(&info) == nullptr) {
    c.wsi = nullptr;
    if (std::find(ended.begin(), ended.end(), c.id) == ended.end()) ended.push_back(c.id);
  }
}

void WebSockets::Impl::set_timer(Connection& c, milliseconds time) {
  const auto microseconds = std::chrono::duration_cast<std::chrono::microseconds>(time).count();
  lws_sul_schedule(context, 0, &c.scheduled, &Impl::on_timer, std::max<lws_usec_t>(microseconds, 1));
}

void WebSockets::Impl::on_timer(lws_sorted_usec_list_t* scheduled) noexcept {
  auto& c = static_cast<Connection&>(*reinterpret_cast<Timer*>(scheduled));
  try {
    static_cast<Impl*>(c.owner)->expire(c);
  } catch (...) { static_cast<Impl*>(c.owner)->kill(c); }
}

void WebSockets::Impl::expire(Connection& c) {
  const Instant now = SteadyClock::now();
  if (c.phase != Connection::Phase::open) {
    if (now < c.limit) return set_timer(c, std::chrono::ceil<milliseconds>(c.limit - now));
    c.fail({Errc::timed_out,
            c.where() + (c.phase == Connection::Phase::connecting ? ": timed out while connecting" : ": no complete opening response in time")});
    return kill(c);
  }
  const SteadyClock::duration idle = now - c.last_frame, half = c.request.idle_time / 2;
  if (idle >= c.request.idle_time) {
    c.fail({Errc::timed_out, c.where() + ": nothing was received for " + std::to_string(c.request.idle_time.count()) + " ms"});
    return kill(c);
  }
  if (idle < half) return set_timer(c, std::chrono::ceil<milliseconds>(half - idle));
  if (!std::exchange(c.has_pinged, true)) {
    c.wants_ping = true;
    lws_callback_on_writable(c.wsi);
  }
  set_timer(c, std::chrono::ceil<milliseconds>(c.request.idle_time - idle));
}

void WebSockets::Impl::close(Connection& c, std::uint16_t code) {
  if (c.wsi == nullptr || c.phase == Connection::Phase::closing) return;
  c.fail({Errc::cancelled, c.where() + ": closed by this program"});
  const bool was_open = c.phase == Connection::Phase::open;
  c.phase = Connection::Phase::closing;
  if (!was_open) return kill(c);
  begin_close(c, code);
}

/// Sends a close frame when the connection is writable.
void WebSockets::Impl::begin_close(Connection& c, std::uint16_t code) {
  c.phase = Connection::Phase::closing;
  c.own_code = code;
  c.message = std::string();
  c.limit = SteadyClock::now() + close_time;
  set_timer(c, close_time);
  lws_callback_on_writable(c.wsi);
}

/// Ends it without a close frame. libwebsockets frees it in its next turn.
void WebSockets::Impl::kill(Connection& c) {
  if (c.wsi != nullptr) lws_set_timeout(c.wsi, PENDING_TIMEOUT_USER_OK, LWS_TO_KILL_ASYNC);
}

/// Outside of libwebsockets' callbacks.
void WebSockets::Impl::finish_ended() {
  while (!ended.empty()) {
    const std::vector<std::uint64_t> now = std::exchange(ended, {});
    for (const std::uint64_t id : now)
      if (const auto found = connections.find(id); found != connections.end()) finish(*found->second);
  }
}

void WebSockets::Impl::finish(Connection& c) {
  lws_sul_cancel(&c.scheduled);
  const bool may_retry = !c.is_connected && !stopping && (!c.end || c.end->error.code == Errc::io_error || c.end->error.code == Errc::timed_out);
  if (may_retry && c.address + 1 < c.request.addresses.size()) {
    ++c.address;
    c.end.reset();
    return connect(c);
  }
  c.fail(connect_error({}, c.where()));
  const std::shared_ptr<WebSocketEvents> events = c.events;
  const WebSocketEnd end = *std::move(c.end);
  connections.erase(c.id);
  events->ended(end);
}

// ------------------------------------------------------------------------------------------------ from libwebsockets

int WebSockets::Impl::on_lws(lws* wsi, lws_callback_reasons reason, void*, void* in, std::size_t size) noexcept {
  switch (reason) {
    case LWS_CALLBACK_WSI_CREATE:
    case LWS_CALLBACK_WSI_DESTROY:
    case LWS_CALLBACK_CLIENT_CONNECTION_ERROR:
    case LWS_CALLBACK_CLIENT_APPEND_HANDSHAKE_HEADER:
    case LWS_CALLBACK_ESTABLISHED_CLIENT_HTTP:
    case LWS_CALLBACK_CLIENT_FILTER_PRE_ESTABLISH:
    case LWS_CALLBACK_CLIENT_ESTABLISHED:
    case LWS_CALLBACK_CLIENT_RECEIVE:
    case LWS_CALLBACK_CLIENT_RECEIVE_PONG:
    case LWS_CALLBACK_CLIENT_WRITEABLE:
    case LWS_CALLBACK_WS_PEER_INITIATED_CLOSE: break;
    default: return 0;  // some callbacks have an invalid wsi
  }
  auto* const connection = static_cast<Connection*>(lws_get_opaque_user_data(wsi));
  if (connection == nullptr) return 0;
  auto& self = *static_cast<Impl*>(connection->owner);
  try {
    return self.dispatch(wsi, *connection, reason, in, size);
  } catch (...) {  // out of memory
    self.kill(*connection);
    return must_go_on(reason) ? 0 : -1;
  }
}

int WebSockets::Impl::dispatch(lws* wsi, Connection& c, lws_callback_reasons reason, void* in, std::size_t size) {
  const auto number = [&](lws_token_indexes field) -> std::optional<std::chrono::seconds> {
    std::array<char, 16> text{};
    const int length = lws_hdr_copy(wsi, text.data(), text.size(), field);
    unsigned value = 0;
    if (length <= 0 || std::from_chars(text.data(), text.data() + length, value).ptr != text.data() + length) return std::nullopt;
    return std::chrono::seconds(value);
  };
  switch (reason) {
    case LWS_CALLBACK_WSI_CREATE:
      c.wsi = wsi;
      c.is_connected = true;
      return 0;
    case LWS_CALLBACK_WSI_DESTROY:
      c.wsi = nullptr;
      ended.push_back(c.id);
      lws_cancel_service(context);  // a timer may have ended it just before libwebsockets waits
      return 0;
    case LWS_CALLBACK_CLIENT_CONNECTION_ERROR:
      c.fail(connect_error(
          in != nullptr ? std::string_view(static_cast<const char*>(in), ::strnlen(static_cast<const char*>(in), size)) : std::string_view(),
          c.where()));
      return 0;
    case LWS_CALLBACK_CLIENT_APPEND_HANDSHAKE_HEADER:
      c.phase = Connection::Phase::handshake;  // TLS is complete
      c.limit = SteadyClock::now() + options.limits.response_time;
      set_timer(c, options.limits.response_time);
      return add_fields(c, static_cast<unsigned char**>(in), size);
    case LWS_CALLBACK_ESTABLISHED_CLIENT_HTTP: {  // the header section of any response
      const int status = static_cast<int>(lws_http_client_http_response(wsi));
      if (status == 101 || c.end) return 0;
      c.end = WebSocketEnd{status,
                           number(WSI_TOKEN_HTTP_RETRY_AFTER),
                           0,
                           {},
                           Error{Errc::refused, c.where() + ": the server responded with " + std::to_string(status)}};
      return 0;
    }
    case LWS_CALLBACK_CLIENT_FILTER_PRE_ESTABLISH:
      if (const int length = lws_hdr_total_length(wsi, WSI_TOKEN_HTTP_LOCATION); length > 0 && length <= 8 * 1024) {
        c.location.resize(static_cast<std::size_t>(length) + 1);
        c.location.resize(static_cast<std::size_t>(std::max(0, lws_hdr_copy(wsi, c.location.data(), length + 1, WSI_TOKEN_HTTP_LOCATION))));
      }
      return 0;
    case LWS_CALLBACK_CLIENT_ESTABLISHED:
      c.wsi = wsi;
      if (c.phase == Connection::Phase::closing) return -1;
      c.phase = Connection::Phase::open;
      c.last_frame = SteadyClock::now();
      set_timer(c, c.request.idle_time / 2);
      c.events->opened(std::exchange(c.location, {}));
      return 0;
    case LWS_CALLBACK_CLIENT_RECEIVE: receive(c, static_cast<const char*>(in), size); return 0;
    case LWS_CALLBACK_CLIENT_RECEIVE_PONG: c.note_frame(); return 0;
    case LWS_CALLBACK_CLIENT_WRITEABLE: return write(c);
    case LWS_CALLBACK_WS_PEER_INITIATED_CLOSE: {
      // libwebsockets 4.1 has replaced 1012 and 1013 (IANA's registry) by 1002.
      const auto* const payload = static_cast<const unsigned char*>(in);
      const std::uint16_t code = size >= 2 ? static_cast<std::uint16_t>(payload[0] << 8 | payload[1]) : std::uint16_t{1005};
      std::string reason_text = size > 2 ? std::string(reinterpret_cast<const char*>(payload) + 2, size - 2) : std::string();
      if (utf8::find_invalid(reason_text)) reason_text.clear();
      for (char& byte : reason_text)
        if (static_cast<unsigned char>(byte) < 0x20) byte = ' ';
      if (!c.end) {
        c.end = WebSocketEnd{
            0,
            {},
            code,
            reason_text,
            Error{Errc::closed, c.where() + ": the server closed it with " + std::to_string(code) + (reason_text.empty() ? "" : ": " + reason_text)}};
      }
      return 0;
    }
    default: return 0;
  }
}

int WebSockets::Impl::add_fields(Connection& c, unsigned char** to, std::size_t room) const {
  std::string block;
  bool has_agent = false;
  for (const auto& [name, value] : c.request.fields) {
    if (name.find_first_of("\r\n: ") != std::string::npos || value.find_first_of("\r\n") != std::string::npos) {
      c.fail({Errc::expected_http, c.where() + ": the header field \"" + name + "\" is not valid"});
      return -1;
    }
    has_agent |= lrt::detail::iequals_ascii(name, "User-Agent");
    block.append(name).append(": ").append(value).append("\r\n");
  }
  if (!has_agent) block += "User-Agent: lrt/" LRT_VERSION "\r\n";
  if (block.size() > room) {
    c.fail({Errc::limit_exceeded, c.where() + ": the header fields are too long"});
    return -1;
  }
  *to = std::copy(block.begin(), block.end(), *to);
  return 0;
}

void WebSockets::Impl::receive(Connection& c, const char* bytes, std::size_t size) {
  c.note_frame();
  if (c.phase != Connection::Phase::open) return;
  if (lws_is_first_fragment(c.wsi) == 1) {
    c.is_text = lws_frame_is_binary(c.wsi) == 0;
    c.message.clear();
  }
  const std::size_t limit = options.limits.max_message_bytes, rest = lws_remaining_packet_payload(c.wsi);
  if (c.message.size() > limit || rest > limit || size + rest > limit - c.message.size()) {
    c.fail({Errc::limit_exceeded, c.where() + ": a message is longer than " + std::to_string(limit) + " bytes"});
    return begin_close(c, 1009);
  }
  if (size > 0) c.message.append(bytes, size);
  if (lws_is_final_fragment(c.wsi) == 0 || rest != 0) return;
  if (c.is_text && utf8::find_invalid(c.message)) {
    c.fail({Errc::expected_http, c.where() + ": a text message is not UTF-8"});
    return begin_close(c, 1007);
  }
  c.events->received(std::exchange(c.message, {}));
}

int WebSockets::Impl::write(Connection& c) {
  if (c.phase == Connection::Phase::closing) {  // libwebsockets sends the code when this returns
    lws_close_reason(c.wsi, static_cast<lws_close_status>(c.own_code), nullptr, 0);
    return -1;
  }
  if (!std::exchange(c.wants_ping, false)) return 0;
  std::array<unsigned char, LWS_PRE + 1> frame{};
  return lws_write(c.wsi, frame.data() + LWS_PRE, 0, LWS_WRITE_PING) < 0 ? -1 : 0;
}

}  // namespace v0
}  // namespace lrt::client
