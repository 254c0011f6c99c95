// SPDX-License-Identifier: Apache-2.0
#include "src/transport/libwebsockets/descriptor_watch.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

namespace lrt::libwebsockets {
namespace {

constexpr const char* name = "lrt";

}  // namespace

Result<std::shared_ptr<DescriptorWatch>> DescriptorWatch::begin(lws_context* context, int descriptor, std::function<void()> on_readable) {
  std::shared_ptr<DescriptorWatch> watch(new DescriptorWatch(std::move(on_readable)));
  watch->self_ = watch;
  const int copy = ::fcntl(descriptor, F_DUPFD_CLOEXEC, 0);
  if (copy < 0) {
    watch->forget();
    return unexpected(Errc::io_error, std::string("no descriptor for libwebsockets: ") + std::strerror(errno));
  }
  if (watch->open(context, copy)) return watch;
  watch->end();
  return unexpected(Errc::io_error, "libwebsockets did not accept the descriptor of the transport");
}

/// Takes the descriptor, also if it fails.
bool DescriptorWatch::open(lws_context* context, int descriptor) {
  static const lws_protocols protocols[] = {{name, &DescriptorWatch::on_lws, 0, 0, 0, nullptr, 0}, {nullptr, nullptr, 0, 0, 0, nullptr, 0}};
  lws_context_creation_info info{};
  info.port = CONTEXT_PORT_NO_LISTEN;
  info.vhost_name = name;
  info.protocols = protocols;
  info.user = this;
  info.finalize = &DescriptorWatch::on_freed;
  info.finalize_arg = this;
  vhost_ = lws_create_vhost(context, &info);
  if (vhost_ == nullptr) {
    ::close(descriptor);
    forget();
    return false;
  }
  lws_sock_file_fd_type given;
  given.filefd = descriptor;
  wsi_ = lws_adopt_descriptor_vhost(vhost_, LWS_ADOPT_RAW_FILE_DESC, given, name, nullptr);  // it closes what it does not adopt
  return wsi_ != nullptr;
}

/// With libwebsockets 4.1 the user must close all that a vhost has. The vhost is freed with the last.
void DescriptorWatch::end() noexcept {
  if (std::exchange(ended_, true)) return;
  if (wsi_ != nullptr) lws_set_timeout(wsi_, PENDING_TIMEOUT_USER_OK, LWS_TO_KILL_ASYNC);
  if (vhost_ != nullptr) lws_vhost_destroy(std::exchange(vhost_, nullptr));  // may free this
}

void DescriptorWatch::on_freed(lws_vhost*, void* self) noexcept {
  auto& watch = *static_cast<DescriptorWatch*>(self);
  watch.vhost_ = nullptr;
  watch.wsi_ = nullptr;
  watch.forget();
}

int DescriptorWatch::on_lws(lws* wsi, lws_callback_reasons reason, void*, void*, std::size_t) noexcept {
  if (reason != LWS_CALLBACK_RAW_RX_FILE && reason != LWS_CALLBACK_WSI_DESTROY) return 0;  // others may come after on_freed()
  lws_vhost* const vhost = wsi != nullptr ? lws_get_vhost(wsi) : nullptr;
  auto* const watch = vhost != nullptr ? static_cast<DescriptorWatch*>(lws_vhost_user(vhost)) : nullptr;
  if (watch == nullptr) return 0;
  if (reason == LWS_CALLBACK_RAW_RX_FILE) return watch->on_ready();
  if (watch->wsi_ == wsi) watch->wsi_ = nullptr;
  return 0;
}

/// Returns -1 to have the descriptor closed.
int DescriptorWatch::on_ready() noexcept {
  if (ended_) return -1;
  const auto keep = self_;  // the call may end it
  keep->on_readable_();
  return keep->ended_ ? -1 : 0;
}

}  // namespace lrt::libwebsockets
