// SPDX-License-Identifier: Apache-2.0
// A program that has an lws_context already serves its robot there: on a port of its own, beside what the context does otherwise.
//
//   ex_lws_host [--port N] &  curl http://127.0.0.1:8080/arm/angle

#include <libwebsockets.h>

#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include <lrt/lrt.hpp>
#include <lrt/transport/libwebsockets.hpp>

namespace {

volatile std::sig_atomic_t ended = 0;
lws_context* context = nullptr;

void on_signal(int) {
  ended = 1;
  lws_cancel_service(context);
}

/// The host's own use of libwebsockets.
int on_host(lws*, lws_callback_reasons, void*, void*, std::size_t) { return 0; }

}  // namespace

int main(int argc, char** argv) {
  const lws_protocols protocols[] = {{"host", &on_host, 0, 0, 0, nullptr, 0}, {nullptr, nullptr, 0, 0, 0, nullptr, 0}};
  lws_context_creation_info info{};
  info.port = CONTEXT_PORT_NO_LISTEN;
  info.protocols = protocols;
  lws_set_log_level(LLL_ERR | LLL_WARN, nullptr);
  context = lws_create_context(&info);
  if (context == nullptr) return 1;
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  {
    double angle = 12.5;
    lrt::Thing arm{"arm"};
    arm.property("angle", [&] { return angle; });

    lrt::Options options;
    if (argc == 3 && std::string_view(argv[1]) == "--port") options.listen.port = static_cast<std::uint16_t>(std::atoi(argv[2]));
    options.threads.io = lrt::Io::in_poll;
    options.listen.transport = [](lrt::transport::TransportOptions o) { return lrt::transport::make_libwebsockets(std::move(o), context); };
    auto server = lrt::Server::create(std::move(options));
    if (!server || !server->add(std::move(arm))) return 1;
    std::printf("listening on %s\n", server->url().c_str());
    std::fflush(stdout);

    // Only the host's loop runs: it serves requests and calls the lambda above.
    while (ended == 0 && lws_service(context, 0) >= 0) {}
  }
  lws_context_destroy(context);
}
