// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <libwebsockets.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include <lrt/engine/handler.hpp>
#include <lrt/transport/transport.hpp>

#include "src/base/event_waker.hpp"
#include "src/transport/body_buffer.hpp"

namespace lrt::libwebsockets {

class Connection;

/// Whole seconds, rounded up, as libwebsockets counts times; at least one.
inline int to_seconds(std::chrono::milliseconds time) noexcept {
  using std::chrono::seconds;
  return static_cast<int>(std::max(std::chrono::ceil<seconds>(time), seconds(1)).count());
}

/// One vhost of an lws_context with its connections: the callbacks of libwebsockets, and the tickets and channels of the handler.
///
/// libwebsockets destroys a vhost in steps, so that callbacks arrive after close(): the vhost keeps its Vhost until then, without a handler.
///
/// @par Threads  The one of lws_service().
class Vhost {
 public:
  Vhost(const transport::TransportOptions& options, std::shared_ptr<EventWaker> waker);
  ~Vhost();
  Vhost(const Vhost&) = delete;
  Vhost& operator=(const Vhost&) = delete;

  /// Listens, as a vhost of `context`. `self` is kept until libwebsockets frees the vhost.
  /// @param on_event  called after each event after which the handler may have output; may be empty
  static Result<void> open(const std::shared_ptr<Vhost>& self, lws_context* context, engine::Handler& handler, std::function<void()> on_event);
  /// No handler from here on; open tickets are abandoned, channels closed.
  void close();
  /// After close(): libwebsockets ends the connections as it comes to it.
  void destroy();
  /// After close(): the caller has destroyed the context, and the vhost with it.
  void forget() { self_.reset(); }

  /// Delivers the handler's output to the connections, a few at a time. True if something was delivered.
  bool deliver();
  /// deliver() stopped before all output was delivered.
  bool has_more() const noexcept { return has_more_; }
  /// No new connections; every response is the last one of its connection, WebSockets begin to close.
  void begin_stop();
  /// Responses or closing handshakes are in progress.
  bool is_busy() const noexcept;
  /// Loads the certificate and its key again.
  void reload_tls();

  /// If descriptors have run out and clients wait: closes one of the reserve, with which libwebsockets can accept a client in the next round.
  /// It may send a stop. Then fill_reserve() must be called.
  bool release_descriptor();
  void fill_reserve();

  /// Limits what the next call of lws_service() accepts: without that libwebsockets accepts all who wait.
  void begin_round();
  /// Clients at most, also those that are about to close: of the reserved ones as many again.
  std::size_t max_clients() const noexcept { return options_.limits.max_connections + 2 * options_.limits.reserved_connections; }

  bool is_open() const noexcept { return handler_ != nullptr; }
  std::uint16_t port() const noexcept;
  bool has_connections() const noexcept { return !connections_.empty(); }
  std::size_t connection_count() const noexcept { return connections_.size(); }
  /// Events so far.
  std::size_t events() const noexcept { return events_; }

  // Used by connections.
  engine::Handler& handler() noexcept { return *handler_; }
  const transport::TransportOptions& options() const noexcept { return options_; }
  TimePoint now() const noexcept { return clock_.now(); }
  bool is_stopping() const noexcept { return stopping_; }
  std::string_view date(TimePoint now);
  /// engine::Handler::common_fields()
  const http::Fields* common_fields(TimePoint now) { return handler_ ? handler_->common_fields(now) : nullptr; }
  /// The memory budget for the bodies that the connections receive.
  transport::BodyBudget& bodies() noexcept { return bodies_; }
  /// A buffer for `size` bytes, with what libwebsockets needs before them.
  unsigned char* scratch(std::size_t size);
  std::unordered_map<std::uint64_t, Connection*> tickets;   ///< connections by the deferred response that they wait for
  std::unordered_map<std::uint64_t, Connection*> channels;  ///< connections by the channel that they carry

 private:
  static int on_lws(lws* wsi, lws_callback_reasons reason, void* user, void* in, std::size_t size) noexcept;
  static void on_freed(lws_vhost* vhost, void* self);

  Result<void> listen(lws_context* context, bool is_v6);
  bool watch_waker();
  int dispatch(lws* wsi, lws_callback_reasons reason, void* in, std::size_t size);
  Connection* find(lws* wsi) const noexcept;
  Connection& find_or_make(lws* wsi);
  int filter(int descriptor);
  bool make_room();
  bool make_reserve();
  void remove(lws* wsi) noexcept;

  transport::TransportOptions options_;
  const Clock& clock_;
  engine::Handler* handler_ = nullptr;
  std::function<void()> on_event_;
  std::shared_ptr<EventWaker> waker_;
  lws_vhost* vhost_ = nullptr;
  ssl_ctx_st* ssl_context_ = nullptr;  ///< of the vhost
  lws* waker_wsi_ = nullptr;
  lws* listening_wsi_ = nullptr;  ///< known from the first client on
  lws_retry_bo_t keep_alive_{};
  std::shared_ptr<Vhost> self_;  ///< while libwebsockets has a pointer to this
  std::unordered_set<Connection*> connections_;
  std::map<std::string, std::size_t> addresses_;  ///< connections from each, but for this machine's; clients choose IPv6 addresses
  std::vector<unsigned char> scratch_;
  transport::BodyBudget bodies_;
  std::chrono::seconds date_second_{-1};
  std::string date_;
  bool next_is_reserved_ = false;            ///< what filter() has decided of the client that is being accepted
  std::vector<int> reserve_;                 ///< descriptors for clients that come when there are no others
  bool scarce_ = false;                      ///< the next client gets one of the reserve
  std::optional<std::size_t> accepts_left_;  ///< in this round; none on a host's context, whose rounds are not known
  std::size_t events_ = 0;
  bool woken_ = false;
  bool has_more_ = false;
  bool stopping_ = false;
};

}  // namespace lrt::libwebsockets
