// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <libwebsockets.h>

#include <functional>
#include <memory>
#include <utility>

#include <lrt/base/result.hpp>

namespace lrt::libwebsockets {

/// One descriptor that an lws_context waits for: that of lrt's HTTP server, which is readable whenever the server has work. It is the only descriptor
/// of a vhost that does not listen and has no TLS, so libwebsockets reads no byte of a client.
///
/// libwebsockets frees the vhost in steps, which may come after end(): the object keeps itself until then.
///
/// @par Threads  The one of lws_service().
class DescriptorWatch {
 public:
  /// @param descriptor   stays the caller's: libwebsockets gets a copy, because it closes what it has
  /// @param on_readable  called by lws_service() in each of its rounds in which the descriptor is readable
  /// @par Errors  io_error
  static Result<std::shared_ptr<DescriptorWatch>> begin(lws_context* context, int descriptor, std::function<void()> on_readable);
  DescriptorWatch(const DescriptorWatch&) = delete;
  DescriptorWatch& operator=(const DescriptorWatch&) = delete;

  /// Nothing is called from here on. Of the context there remains what it frees in its next round, or when it is destroyed.
  void end() noexcept;
  /// After end(): the context was destroyed.
  void forget() noexcept { self_.reset(); }

 private:
  explicit DescriptorWatch(std::function<void()> on_readable) : on_readable_(std::move(on_readable)) {}
  static int on_lws(lws* wsi, lws_callback_reasons reason, void* user, void* in, std::size_t size) noexcept;
  static void on_freed(lws_vhost* vhost, void* self) noexcept;
  bool open(lws_context* context, int descriptor);
  int on_ready() noexcept;

  std::function<void()> on_readable_;
  lws_vhost* vhost_ = nullptr;
  lws* wsi_ = nullptr;
  bool ended_ = false;
  std::shared_ptr<DescriptorWatch> self_;  ///< while libwebsockets has a pointer to this
};

}  // namespace lrt::libwebsockets
