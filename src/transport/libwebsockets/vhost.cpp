// SPDX-License-Identifier: Apache-2.0
#include "src/transport/libwebsockets/vhost.hpp"

#include <fcntl.h>
#include <netinet/in.h>
#include <openssl/ssl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <optional>
#include <utility>

#include <lrt/http/date.hpp>

#include "src/base/client_key.hpp"
#include "src/base/resolve.hpp"
#include "src/http/websocket.hpp"
#include "src/transport/libwebsockets/connection.hpp"
#include "src/transport/libwebsockets/tls.hpp"

namespace lrt::libwebsockets {
namespace {

constexpr const char* name = "lrt";
constexpr std::size_t accepts_per_round = 16;
constexpr int deliveries_per_round = 16;

/// Binds a socket for a moment: libwebsockets does not say why it cannot listen.
Result<void> check_address(const std::string& address, std::uint16_t port, bool& is_v6) {
  std::optional<Address> wanted = numeric_address(address);
  if (!wanted) return unexpected(Errc::invalid_option, "address \"" + address + "\": expected a numeric IPv4 or IPv6 address");
  wanted->set_port(port);
  is_v6 = wanted->is_v6();
  const int socket = ::socket(wanted->socket.ss_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
  int error = socket < 0 ? errno : 0;
  if (socket >= 0) {
    const int on = 1;
    ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (::bind(socket, wanted->get(), wanted->size) != 0) error = errno;
    ::close(socket);
  }
  if (error == 0) return {};
  return unexpected(error == EADDRINUSE ? Errc::address_in_use : Errc::io_error,
                    "address " + address + ", port " + std::to_string(port) + ": " + std::strerror(error));
}

Vhost* owner_of(lws* wsi) noexcept {
  lws_vhost* const vhost = wsi != nullptr ? lws_get_vhost(wsi) : nullptr;
  return vhost != nullptr ? static_cast<Vhost*>(lws_vhost_user(vhost)) : nullptr;
}

/// Takes effect at once, also outside of callbacks of the connection.
void allow_reading(lws* wsi, bool allowed) noexcept {
  lws_rx_flow_control(wsi, LWS_RXFLOW_REASON_USER_BOOL | LWS_RXFLOW_REASON_FLAG_PROCESS_NOW |
                               (allowed ? LWS_RXFLOW_REASON_APPLIES_ENABLE : LWS_RXFLOW_REASON_APPLIES_DISABLE));
}

}  // namespace

Vhost::Vhost(const transport::TransportOptions& options, std::shared_ptr<EventWaker> waker)
    : options_(options), clock_(options.clock != nullptr ? *options.clock : system_clock()), waker_(std::move(waker)), bodies_(options.limits) {
  const auto& limits = options_.limits;
  keep_alive_.secs_since_valid_ping = static_cast<std::uint16_t>(to_seconds(limits.ping_interval));
  keep_alive_.secs_since_valid_hangup = static_cast<std::uint16_t>(to_seconds(limits.ping_interval) + to_seconds(limits.pong_timeout));
}

Vhost::~Vhost() {
  for (auto* const connection : std::exchange(connections_, {})) delete connection;
  for (const int descriptor : reserve_) ::close(descriptor);
}

// -------------------------------------------------------------------------------------------------------- beginning and end

Result<void> Vhost::open(const std::shared_ptr<Vhost>& self, lws_context* context, engine::Handler& handler, std::function<void()> on_event) {
  bool is_v6 = false;
  if (auto free = check_address(self->options_.address, self->options_.port, is_v6); !free) return free;
  self->handler_ = &handler;
  self->on_event_ = std::move(on_event);
  self->self_ = self;
  auto listening = self->listen(context, is_v6);
  if (!listening) self->close();
  return listening;
}

Result<void> Vhost::listen(lws_context* context, bool is_v6) {
  static const lws_protocols protocols[] = {{name, &Vhost::on_lws, 0, 4096, 0, nullptr, 0},
                                            {http::stamped_protocol.data(), &Vhost::on_lws, 0, 4096, 0, nullptr, 0},
                                            {nullptr, nullptr, 0, 0, 0, nullptr, 0}};
  const auto& limits = options_.limits;
  lws_context_creation_info info{};
  info.port = options_.port;
  info.iface = options_.address.c_str();
  info.vhost_name = name;
  info.protocols = protocols;
  info.user = this;
  info.finalize = &Vhost::on_freed;
  info.finalize_arg = this;
  info.keepalive_timeout = to_seconds(limits.idle_timeout);
  info.timeout_secs_ah_idle = static_cast<unsigned>(to_seconds(limits.header_timeout));
  info.retry_and_idle_policy = &keep_alive_;
  info.options = LWS_SERVER_OPTION_FAIL_UPON_UNABLE_TO_BIND | (is_v6 ? 0 : LWS_SERVER_OPTION_DISABLE_IPV6);
  if (options_.tls) {
    const auto& tls = *options_.tls;
    info.options |= LWS_SERVER_OPTION_DO_SSL_GLOBAL_INIT;
    if (!tls.client_ca_file.empty()) info.options |= LWS_SERVER_OPTION_REQUIRE_VALID_OPENSSL_CLIENT_CERT;
    if (!tls.require_client_certificate) info.options |= LWS_SERVER_OPTION_PEER_CERT_NOT_REQUIRED;
    info.ssl_cert_filepath = tls.certificate_file.c_str();
    info.ssl_private_key_filepath = tls.key_file.c_str();
    info.alpn = "http/1.1";
  }
  vhost_ = lws_create_vhost(context, &info);
  // Without a socket libwebsockets makes a vhost that does not listen. Where it listens, the address is in use.
  bool ignored = false;
  const auto port = vhost_ != nullptr ? static_cast<std::uint16_t>(lws_get_vhost_listen_port(vhost_)) : std::uint16_t{0};
  if (port == 0 || check_address(options_.address, port, ignored))
    return unexpected(Errc::io_error, "libwebsockets cannot listen on " + options_.address + ", port " + std::to_string(options_.port));
  if (!watch_waker()) return unexpected(Errc::io_error, "libwebsockets did not accept the event descriptor that wakes the transport");
  return {};
}

/// Unlike lws_cancel_service() the waker may outlive the context, and needs no lock for that.
bool Vhost::watch_waker() {
  lws_sock_file_fd_type descriptor;
  descriptor.filefd = ::fcntl(waker_->descriptor(), F_DUPFD_CLOEXEC, 0);  // libwebsockets closes its own
  if (descriptor.filefd >= 0) waker_wsi_ = lws_adopt_descriptor_vhost(vhost_, LWS_ADOPT_RAW_FILE_DESC, descriptor, name, nullptr);
  return waker_wsi_ != nullptr;
}

void Vhost::close() {
  if (handler_ == nullptr) return;
  for (auto* const connection : connections_) connection->end();
  handler_ = nullptr;
  on_event_ = {};
}

/// With libwebsockets 4.1 the user must close all connections, also the listening one. The vhost is freed with the last one.
void Vhost::destroy() {
  if (vhost_ == nullptr) return;
  for (auto* const connection : connections_) connection->kill();
  for (auto* const own : {waker_wsi_, listening_wsi_})
    if (own != nullptr) lws_set_timeout(own, PENDING_TIMEOUT_USER_OK, LWS_TO_KILL_ASYNC);
  lws_vhost_destroy(std::exchange(vhost_, nullptr));
}

void Vhost::on_freed(lws_vhost*, void* self) { static_cast<Vhost*>(self)->forget(); }

std::uint16_t Vhost::port() const noexcept {
  return vhost_ != nullptr && is_open() ? static_cast<std::uint16_t>(lws_get_vhost_listen_port(vhost_)) : std::uint16_t{0};
}

/// Unlike lws_tls_cert_updated() this also reads the authorities of clients, and reports the reason of an error.
void Vhost::reload_tls() {
  if (auto loaded = load_tls(ssl_context_, *options_.tls); !loaded && options_.log) options_.log(LogLevel::error, loaded.error().message);
}

void Vhost::begin_stop() {
  stopping_ = true;
  for (auto* const connection : connections_) connection->begin_stop();
}

bool Vhost::is_busy() const noexcept {
  return std::any_of(connections_.begin(), connections_.end(), [](const Connection* connection) { return connection->is_busy(); });
}

// ------------------------------------------------------------------------------------------------------ from the handler

bool Vhost::deliver() {
  const auto now = clock_.now();
  const bool goes_on = std::exchange(has_more_, false);
  if (!std::exchange(woken_, false) && !goes_on && tickets.empty() && channels.empty()) {
    const auto due = handler_->next_deadline();
    if (!due || *due > now.steady) return false;
  }
  bool gave = false;
  int left = deliveries_per_round;
  for (; left > 0; --left) {
    auto reply = handler_->next_reply(now);
    if (!reply) break;
    const auto found = tickets.find(static_cast<std::uint64_t>(reply->ticket));
    if (found != tickets.end()) {
      Connection& connection = *found->second;
      tickets.erase(found);
      connection.reply(*std::move(reply));
      gave = true;
    } else if (reply->channel) {
      handler_->closed(*reply->channel);
    }
  }
  for (; left > 0; --left) {
    const auto channel = handler_->next_ready(now);
    if (!channel) break;
    const auto found = channels.find(static_cast<std::uint64_t>(*channel));
    if (found == channels.end()) continue;
    found->second->push();
    gave = true;
  }
  has_more_ = left == 0;
  return gave || has_more_;
}

std::string_view Vhost::date(TimePoint now) {
  const auto second = std::chrono::floor<std::chrono::seconds>(now.utc.time_since_epoch());
  if (second != date_second_) {
    date_ = http::to_http_date(now.utc);
    date_second_ = second;
  }
  return date_;
}

unsigned char* Vhost::scratch(std::size_t size) {
  if (scratch_.size() < LWS_PRE + size) scratch_.resize(LWS_PRE + size);
  return scratch_.data() + LWS_PRE;
}

// ----------------------------------------------------------------------------------------------------- from libwebsockets

int Vhost::on_lws(lws* wsi, lws_callback_reasons reason, void* user, void* in, std::size_t size) noexcept {
  // Returns whether to refuse; `size` states whether OpenSSL accepted the certificate.
  if (reason == LWS_CALLBACK_OPENSSL_PERFORM_CLIENT_CERT_VERIFICATION) return size != 0 ? 0 : 1;
  if (reason == LWS_CALLBACK_PROTOCOL_INIT || reason == LWS_CALLBACK_PROTOCOL_DESTROY) return 0;  // the latter comes after on_freed()
  Vhost* const vhost = owner_of(wsi);
  if (vhost == nullptr) return 0;
  if (reason == LWS_CALLBACK_OPENSSL_LOAD_EXTRA_SERVER_VERIFY_CERTS) {
    vhost->ssl_context_ = static_cast<SSL_CTX*>(user);
    return vhost->options_.tls && set_up_tls(vhost->ssl_context_, *vhost->options_.tls) ? 0 : 1;
  }
  if (reason == LWS_CALLBACK_WSI_DESTROY) return vhost->remove(wsi), 0;
  try {
    return vhost->dispatch(wsi, reason, in, size);
  } catch (...) { return -1; }
}

int Vhost::dispatch(lws* wsi, lws_callback_reasons reason, void* in, std::size_t size) {
  ++events_;
  const auto followed = [this](int result) {
    if (on_event_) on_event_();
    return result;
  };
  switch (reason) {
    case LWS_CALLBACK_FILTER_NETWORK_CONNECTION:
      listening_wsi_ = wsi;
      if (is_open()) return filter(static_cast<int>(reinterpret_cast<std::intptr_t>(in)));
      lws_set_timeout(wsi, PENDING_TIMEOUT_USER_OK, LWS_TO_KILL_ASYNC);
      return -1;
    case LWS_CALLBACK_SERVER_NEW_CLIENT_INSTANTIATED: find_or_make(wsi); return 0;
    case LWS_CALLBACK_RAW_RX_FILE:
      if (!is_open()) return -1;
      waker_->clear();
      woken_ = true;
      return followed(0);
    case LWS_CALLBACK_RAW_ADOPT:  // a client that is no HTTP/1.1 client
    case LWS_CALLBACK_RAW_RX: return -1;
    case LWS_CALLBACK_HTTP: return is_open() ? followed(find_or_make(wsi).on_request()) : -1;
    case LWS_CALLBACK_HTTP_CONFIRM_UPGRADE: return is_open() ? followed(find_or_make(wsi).on_upgrade()) : -1;
    case LWS_CALLBACK_HTTP_BODY:
    case LWS_CALLBACK_HTTP_BODY_COMPLETION:
    case LWS_CALLBACK_HTTP_WRITEABLE:
    case LWS_CALLBACK_TIMER:
    case LWS_CALLBACK_ADD_HEADERS:
    case LWS_CALLBACK_ESTABLISHED:
    case LWS_CALLBACK_RECEIVE:
    case LWS_CALLBACK_WS_PEER_INITIATED_CLOSE:
    case LWS_CALLBACK_SERVER_WRITEABLE:
    case LWS_CALLBACK_CLOSED:
    case LWS_CALLBACK_CLOSED_HTTP: break;
    default: return 0;
  }
  Connection* const connection = find(wsi);
  if (connection == nullptr) return 0;
  if (reason == LWS_CALLBACK_CLOSED || reason == LWS_CALLBACK_CLOSED_HTTP) return connection->end(), followed(0);
  if (reason == LWS_CALLBACK_TIMER && connection->is_dying()) return connection->on_timer();
  if (!is_open()) return -1;
  WebSocket* const websocket = connection->websocket();
  const auto* const bytes = static_cast<const char*>(in);
  switch (reason) {
    case LWS_CALLBACK_HTTP_BODY: return connection->on_body({bytes, size});
    case LWS_CALLBACK_HTTP_BODY_COMPLETION: return followed(connection->on_body_end());
    case LWS_CALLBACK_HTTP_WRITEABLE: return followed(connection->on_writable());
    case LWS_CALLBACK_TIMER: return connection->on_timer();
    case LWS_CALLBACK_ADD_HEADERS: return websocket != nullptr ? websocket->add_fields(*static_cast<lws_process_html_args*>(in)) : 0;
    case LWS_CALLBACK_ESTABLISHED: return websocket != nullptr ? followed(websocket->on_open()) : -1;
    case LWS_CALLBACK_RECEIVE: return websocket != nullptr ? followed(websocket->on_received(bytes, size)) : -1;
    case LWS_CALLBACK_WS_PEER_INITIATED_CLOSE: return websocket != nullptr ? followed(websocket->on_client_close({bytes, size})) : -1;
    default: return websocket != nullptr ? followed(websocket->on_writable()) : -1;
  }
}

Connection* Vhost::find(lws* wsi) const noexcept { return static_cast<Connection*>(lws_get_opaque_user_data(wsi)); }

Connection& Vhost::find_or_make(lws* wsi) {
  if (auto* const found = find(wsi)) return *found;
  auto made = std::make_unique<Connection>(*this, wsi);
  connections_.insert(made.get());
  lws_set_opaque_user_data(wsi, made.get());
  auto& connection = *made.release();
  if (std::exchange(next_is_reserved_, false)) {
    connection.serve_only_stops();
    return connection;
  }
  const std::string client = client_key(connection.peer());
  if (!is_this_machine(client)) ++addresses_[client];
  return connection;
}

void Vhost::remove(lws* wsi) noexcept {
  if (wsi == waker_wsi_) waker_wsi_ = nullptr;
  if (wsi == listening_wsi_) listening_wsi_ = nullptr;
  Connection* const connection = find(wsi);
  if (connection == nullptr) return;
  lws_set_opaque_user_data(wsi, nullptr);
  connections_.erase(connection);
  const auto counted = connection->serves_only_stops() ? addresses_.end() : addresses_.find(client_key(connection->peer()));
  if (counted != addresses_.end() && --counted->second == 0) addresses_.erase(counted);
  delete connection;
}

void Vhost::begin_round() {
  if (accepts_left_ == 0 && listening_wsi_ != nullptr) {
    if (connections_.size() >= max_clients()) return;  // those that are about to close come first
    allow_reading(listening_wsi_, true);
  }
  accepts_left_ = std::min(accepts_per_round, max_clients() - connections_.size());
}

/// Returns 0 for a client that may come in. While the listening socket is not to be read, libwebsockets ends its loop of accepts.
int Vhost::filter(int descriptor) {
  const auto& limits = options_.limits;
  if (accepts_left_ && *accepts_left_ > 0 && --*accepts_left_ == 0) allow_reading(listening_wsi_, false);
  if (stopping_) return -1;
  const auto taken = static_cast<std::size_t>(
      std::count_if(connections_.begin(), connections_.end(), [](const Connection* c) { return !c->serves_only_stops() && !c->is_dying(); }));
  char peer[64] = "";
  lws_get_peer_simple_fd(descriptor, peer, sizeof peer);
  const auto counted = addresses_.find(client_key(peer));
  const bool full = scarce_ || (counted != addresses_.end() && counted->second >= limits.max_connections_per_address) ||
                    (taken >= limits.max_connections && !make_room());
  next_is_reserved_ = full && make_reserve();
  return full && !next_is_reserved_ ? -1 : 0;
}

/// Whether one more connection may serve a stop. At the limit, the connection that has waited longest for its request is closed.
bool Vhost::make_reserve() {
  std::size_t reserved = 0;
  Connection* oldest = nullptr;
  for (auto* const connection : connections_) {
    if (!connection->serves_only_stops() || connection->is_dying()) continue;
    ++reserved;
    if (connection->is_incomplete() && (oldest == nullptr || connection->idle_since() < oldest->idle_since())) oldest = connection;
  }
  if (reserved < options_.limits.reserved_connections) return true;
  if (oldest != nullptr) oldest->give_way();
  return oldest != nullptr;
}

bool Vhost::release_descriptor() {
  if (const int free = ::open("/dev/null", O_RDONLY | O_CLOEXEC); free >= 0 || (errno != EMFILE && errno != ENFILE)) {
    if (free >= 0) ::close(free);
    return false;
  }
  pollfd listener{listening_wsi_ != nullptr ? lws_get_socket_fd(listening_wsi_) : -1, POLLIN, 0};
  if (listener.fd >= 0 && ::poll(&listener, 1, 0) <= 0) return false;
  if ((listener.fd >= 0 && make_room()) || reserve_.empty()) return false;  // that of an idle connection is free in the next round
  ::close(reserve_.back());
  reserve_.pop_back();
  scarce_ = true;
  return true;
}

void Vhost::fill_reserve() {
  scarce_ = false;
  const std::size_t wanted = std::max<std::size_t>(1, options_.limits.reserved_connections);
  reserve_.reserve(wanted);
  while (reserve_.size() < wanted) {
    const int descriptor = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) return;
    reserve_.push_back(descriptor);
  }
}

/// Ends the connection that has been idle longest. False: none is.
bool Vhost::make_room() {
  Connection* oldest = nullptr;
  for (auto* const connection : connections_) {
    if (!connection->is_idle() || connection->serves_only_stops() || connection->is_dying()) continue;
    if (oldest == nullptr || connection->idle_since() < oldest->idle_since()) oldest = connection;
  }
  if (oldest != nullptr) oldest->give_way();
  return oldest != nullptr;
}

}  // namespace lrt::libwebsockets
