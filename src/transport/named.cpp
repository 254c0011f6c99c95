// SPDX-License-Identifier: Apache-2.0
#include <lrt/transport/named.hpp>

#include <utility>

#include <lrt/transport/http.hpp>
#if LRT_HAS_LIBWEBSOCKETS
#include <lrt/transport/libwebsockets.hpp>
#endif

namespace lrt::transport {
inline namespace v0 {

std::vector<std::string_view> names() {
  return {
    "http",
#if LRT_HAS_LIBWEBSOCKETS
        "libwebsockets",
#endif
  };
}

std::unique_ptr<Transport> make_named(std::string_view name, TransportOptions options) {
  if (name.empty() || name == "http") return make_http(std::move(options));
#if LRT_HAS_LIBWEBSOCKETS
  if (name == "libwebsockets") return make_libwebsockets(std::move(options));
#endif
  return nullptr;
}

}  // namespace v0
}  // namespace lrt::transport
