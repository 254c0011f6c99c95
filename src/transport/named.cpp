#include <lrt/transport/named.hpp>

#include <utility>

#include <lrt/transport/asio.hpp>
#include <lrt/transport/classic.hpp>
#include <lrt/transport/libwebsockets.hpp>

namespace lrt::transport {

std::vector<std::string_view> names() {
  return {
#if LRT_HAS_ASIO
      "asio",
#endif
#if LRT_HAS_CLASSIC
      "classic",
#endif
#if LRT_HAS_LIBWEBSOCKETS
      "libwebsockets",
#endif
  };
}

std::unique_ptr<Transport> make_named(std::string_view name, Options options) {
  if (name.empty() && !names().empty()) name = names().front();
#if LRT_HAS_ASIO
  if (name == "asio") return make_asio(std::move(options));
#endif
#if LRT_HAS_CLASSIC
  if (name == "classic") return make_classic(std::move(options));
#endif
#if LRT_HAS_LIBWEBSOCKETS
  if (name == "libwebsockets") return make_libwebsockets(std::move(options));
#endif
  (void)options;
  return nullptr;
}

}  // namespace lrt::transport
