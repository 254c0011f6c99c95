// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/base/log.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/thread_options.hpp>
#include <lrt/http/message.hpp>
#include <lrt/transport/transport.hpp>

namespace lrt::client {
inline namespace v0 {

/// Options of a CallbackReceiver. Set-up only.
struct CallbackReceiverOptions {
  bool listens = true;                         ///< false: the program passes requests to CallbackReceiver::handle()
  std::string address = "127.0.0.1";           ///< numeric address to listen on
  std::uint16_t port = 0;                      ///< 0: any free one
  std::optional<transport::TlsOptions> tls{};  ///< nullopt: plain HTTP
  /// URL by which servers reach this receiver, "https://console.example/robots"; callbacks are below it. Empty: address
  /// and port. Required without `listens`.
  std::string public_url{};
  std::size_t max_body_bytes = 4 * 1024 * 1024;  ///< of a notification; more: 413
  std::size_t max_callbacks = 1'000;             ///< at a time; more: limit_exceeded
  ThreadOptions threads{};                       ///< of its thread
  LogCallback log{};                             ///< empty: messages are dropped
};

/// A small HTTP server that receives web callbacks (R0.16) for Via::callback. One receiver serves any number of
/// watches, also of several clients.
///
/// Each watch has a callback URL of its own with 128 random bits. Requests to other paths get 404. If a path has the
/// form of a callback and is unknown, the response is 410: its watch was stopped, or it belongs to an earlier process,
/// and the server ends the subscription.
///
/// A GET with hub.mode=subscribe and hub.challenge is confirmed (WebSub 5.3). A POST is a notification. If the watch
/// has given the server a secret, X-Hub-Signature must be the HMAC-SHA256 of the body. A notification with a wrong or
/// missing signature gets 403, is counted and ignored, so a wrong secret is visible at the server. Without a secret,
/// which only a POST to the container of subscriptions transfers, whoever knows the URL can send notifications. Whoever
/// reads the connection can repeat signed notifications; TLS prevents it.
///
/// @par Threads  Any.
/// @par Implements  R0.13, R0.16, WebSub 5.3, 7.1, 8
class LRT_API CallbackReceiver {
 public:
  /// Numbers since its creation.
  struct Counts {
    std::uint64_t notifications = 0;  ///< accepted
    std::uint64_t unsigned_ = 0;      ///< refused: the signature is missing or wrong
    std::uint64_t unknown = 0;        ///< to a path that is not a callback
  };

  /// Makes a receiver and, with `listens`, starts to listen.
  /// @par Errors  address_in_use, invalid_option (also of public_url), io_error
  static Result<std::shared_ptr<CallbackReceiver>> create(CallbackReceiverOptions options = {});
  /// Calls stop().
  virtual ~CallbackReceiver() = default;

  /// The beginning of all callback URLs, with a slash at its end.
  virtual std::string url() const = 0;
  virtual std::uint16_t port() const noexcept = 0;  ///< 0 without `listens`
  virtual Counts counts() const noexcept = 0;       ///< numbers since its creation
  /// Responds to a request that the program's own HTTP server received. Its target has the path of `public_url`.
  /// @par Time  Calls no user code.
  virtual http::Response handle(const http::Request& request) = 0;
  /// Ends the thread and closes the port. Later requests get 410.
  virtual void stop() noexcept = 0;

  /// A notification. The views are valid during the call.
  struct Notification {
    /// @{
    /// The body, Content-Type and ETag.
    std::string_view body, content_type, entity_tag;
    /// @}
    /// @{
    /// Value-Time, Value-Sequence, Values-Left-Out and Value-Series (SPEC 3.6); empty: the server does not send it.
    std::string_view time{}, sequence{}, left_out{}, series{};
    /// @}
  };
  /// Makes a callback URL. Client uses it; a program that subscribes by itself may use it, too.
  /// @param secret  of the subscription; empty: notifications are not signed
  /// @param take    called for each notification, on the thread that handles the request. It must not block
  /// @par Errors    limit_exceeded, closed
  virtual Result<std::string> add(std::string secret, std::function<void(const Notification&)> take) = 0;
  /// Ends a callback: from now on the URL gets 410. Does not wait for a running `take`.
  virtual void remove(const std::string& callback_url) noexcept = 0;

 protected:
  CallbackReceiver() = default;
  CallbackReceiver(const CallbackReceiver&) = delete;
  CallbackReceiver& operator=(const CallbackReceiver&) = delete;
};

}  // namespace v0
}  // namespace lrt::client
