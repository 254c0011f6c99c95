// SPDX-License-Identifier: Apache-2.0
// A target for external WebSocket probes: lrt's transport with a handler of its own, no engine.
//
//   ws_echo [--port 8080] [--bind 127.0.0.1] [--transport http|libwebsockets] [--tls DIR]
//
// With --tls it speaks wss with DIR/server.pem and DIR/server-key.pem (see examples/make-certificate.sh).
//
// Any path becomes a WebSocket that echoes every message, text as text and binary as binary. Messages to 64 MiB, as many as there are.

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <limits>
#include <string>
#include <unordered_map>

#include <lrt/engine/handler.hpp>
#include <lrt/http/problem.hpp>
#include <lrt/transport/named.hpp>

#include "src/http/websocket.hpp"

namespace {

using namespace lrt;

std::atomic<bool> ended{false};
Waker* waker = nullptr;

void on_signal(int) {
  ended = true;
  if (waker) waker->wake();  // one write to an eventfd: allowed here
}

class Echo final : public engine::Handler {
 public:
  engine::Outcome handle(const http::Request& request, TimePoint) override {
    if (!request.can_upgrade || !http::requests_upgrade(request, "websocket")) return refused(426, "there are only WebSockets here");
    if (auto refusal = http::check_websocket(request)) return refused(refusal->status, std::move(refusal->reason));
    const engine::Channel channel{++last_channel_};
    open_.try_emplace(channel);
    return engine::Upgraded{channel, {}};
  }
  std::optional<engine::Reply> next_reply(TimePoint) override { return std::nullopt; }
  std::optional<std::chrono::steady_clock::time_point> next_deadline() const override { return std::nullopt; }
  void abandon(engine::Ticket) noexcept override {}

  std::optional<engine::Push> next_push(engine::Channel channel, TimePoint) override {
    auto& client = open_.at(channel);
    if (client.queue.empty()) return std::nullopt;
    auto push = std::move(client.queue.front());
    client.queue.pop_front();
    client.bytes -= push.message ? push.message->size() : 0;
    return push;
  }
  void received(engine::Channel channel, std::string_view message, bool text, TimePoint) override {
    auto& client = open_.at(channel);
    client.bytes += message.size();
    client.queue.push_back({std::make_shared<const std::string>(message), text});
    if (client.bytes <= most_bytes) return;
    client = {};
    client.queue.push_back({nullptr, true, 1008, "read what you sent"});
  }
  void closed(engine::Channel channel) noexcept override { open_.erase(channel); }

 private:
  /// Waiting for one client; beyond that it sends and does not read.
  static constexpr std::size_t most_bytes = 256 * 1024 * 1024;
  struct Client {
    std::deque<engine::Push> queue;
    std::size_t bytes = 0;
  };

  static http::Response refused(int status, std::string detail) {
    http::Response response;
    response.status = status;
    if (status == 426) {
      response.fields.add("Upgrade", "websocket");
      response.fields.add("Sec-WebSocket-Version", "13");
    }
    response.fields.add("Content-Type", "application/problem+json");
    response.set_body(http::to_json({status, std::move(detail)}));
    return response;
  }

  std::uint64_t last_channel_ = 0;
  std::unordered_map<engine::Channel, Client> open_;
};

}  // namespace

int main(int argc, char** argv) {
  transport::TransportOptions options;
  const char* transport = "";
  options.limits.max_websocket_message_bytes = 64 * 1024 * 1024;
  options.limits.max_websocket_messages = std::numeric_limits<std::size_t>::max();
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::strcmp(argv[i], "--port") == 0) options.port = static_cast<std::uint16_t>(std::atoi(argv[i + 1]));
    else if (std::strcmp(argv[i], "--bind") == 0) options.address = argv[i + 1];
    else if (std::strcmp(argv[i], "--transport") == 0) transport = argv[i + 1];
    else if (std::strcmp(argv[i], "--tls") == 0)
      options.tls = transport::TlsOptions{argv[i + 1] + std::string("/server.pem"), argv[i + 1] + std::string("/server-key.pem"), {}, false};
    else return std::fprintf(stderr, "usage: ws_echo [--port N] [--bind ADDRESS] [--transport http|libwebsockets] [--tls DIR]\n"), 2;
  }
  Echo echo;
  const auto server = transport::make_named(transport, options);
  if (!server) return std::fprintf(stderr, "ws_echo: there is no transport \"%s\" in this build\n", transport), 2;
  const auto shared_waker = server->waker();
  waker = shared_waker.get();
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  if (auto started = server->start(echo); !started) return std::fprintf(stderr, "%s\n", started.error().message.c_str()), 1;
  const bool v6 = options.address.find(':') != std::string::npos;
  std::printf("listening on ws%s://%s%s%s:%u/\n", options.tls ? "s" : "", v6 ? "[" : "", options.address.c_str(), v6 ? "]" : "",
              unsigned{server->port()});
  std::fflush(stdout);
  while (!ended) server->poll(std::chrono::milliseconds(1), std::chrono::hours(1));
  std::signal(SIGINT, SIG_IGN);  // a second one finds no waker
  std::signal(SIGTERM, SIG_IGN);
  server->stop();
}
