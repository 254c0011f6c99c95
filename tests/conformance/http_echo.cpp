// SPDX-License-Identifier: Apache-2.0
// A target for external HTTP probes: lrt's transport with a handler of its own, no engine.
//
//   http_echo [--port 8080] [--bind 127.0.0.1] [--transport http|libwebsockets] [--tls DIR]
//
// With --tls it speaks https with DIR/server.pem and DIR/server-key.pem (see examples/make-certificate.sh).
//
// GET / answers a constant text, POST and PUT / echo their body, /echo answers the request's head as it was understood.

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include <lrt/engine/handler.hpp>
#include <lrt/http/problem.hpp>
#include <lrt/transport/named.hpp>

#include "src/http/target.hpp"

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
  Echo() {
    std::string text;
    while (text.size() < 600) text += "The quick brown fox jumps over the lazy dog.\r\n";
    text.resize(600);
    home_.fields.add("Content-Type", "text/plain; charset=utf-8");
    home_.fields.add("Allow", "GET, HEAD, POST, PUT, OPTIONS");
    home_.set_body(std::move(text));
  }

  engine::Outcome handle(const http::Request& request, TimePoint) override {
    const auto target = http::split_target(request.target);
    if (!target) return problem(400, "the target has none of the allowed forms");
    if (request.method == "OPTIONS") return empty(204);
    if (target->path == "/") {
      if (request.method == "GET" || request.method == "HEAD") return home_;
      if (request.method == "POST" || request.method == "PUT") {
        http::Response response;
        response.fields.add("Content-Type", request.find("Content-Type").value_or("application/octet-stream"));
        response.set_body(std::string(request.body));
        return response;
      }
      return empty(405);
    }
    if (target->path == "/echo") {
      std::string text;
      text.append(request.method).append(" ").append(request.target).append("\n");
      for (const auto& field : request.fields) text.append(field.name).append(": ").append(field.value).append("\n");
      http::Response response;
      response.fields.add("Content-Type", "text/plain; charset=utf-8");
      response.set_body(std::move(text));
      return response;
    }
    return problem(404, "there are / and /echo");
  }
  std::optional<engine::Reply> next_reply(TimePoint) override { return std::nullopt; }
  std::optional<std::chrono::steady_clock::time_point> next_deadline() const override { return std::nullopt; }
  void abandon(engine::Ticket) noexcept override {}

 private:
  static http::Response empty(int status) {
    http::Response response;
    response.status = status;
    response.fields.add("Allow", "GET, HEAD, POST, PUT, OPTIONS");
    return response;
  }
  static http::Response problem(int status, std::string detail) {
    http::Response response;
    response.status = status;
    response.fields.add("Content-Type", "application/problem+json");
    response.set_body(http::to_json({status, std::move(detail)}));
    return response;
  }

  http::Response home_;
};

}  // namespace

int main(int argc, char** argv) {
  transport::TransportOptions options;
  const char* transport = "";
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::strcmp(argv[i], "--port") == 0) options.port = static_cast<std::uint16_t>(std::atoi(argv[i + 1]));
    else if (std::strcmp(argv[i], "--bind") == 0) options.address = argv[i + 1];
    else if (std::strcmp(argv[i], "--transport") == 0) transport = argv[i + 1];
    else if (std::strcmp(argv[i], "--tls") == 0)
      options.tls = transport::TlsOptions{argv[i + 1] + std::string("/server.pem"), argv[i + 1] + std::string("/server-key.pem"), {}, false};
    else return std::fprintf(stderr, "usage: http_echo [--port N] [--bind ADDRESS] [--transport http|libwebsockets] [--tls DIR]\n"), 2;
  }
  Echo echo;
  const auto server = transport::make_named(transport, options);
  if (!server) return std::fprintf(stderr, "http_echo: there is no transport \"%s\" in this build\n", transport), 2;
  const auto shared_waker = server->waker();
  waker = shared_waker.get();
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  if (auto started = server->start(echo); !started) return std::fprintf(stderr, "%s\n", started.error().message.c_str()), 1;
  const bool v6 = options.address.find(':') != std::string::npos;
  std::printf("listening on http%s://%s%s%s:%u/\n", options.tls ? "s" : "", v6 ? "[" : "", options.address.c_str(), v6 ? "]" : "",
              unsigned{server->port()});
  std::fflush(stdout);
  while (!ended) server->poll(std::chrono::milliseconds(1), std::chrono::hours(1));
  std::signal(SIGINT, SIG_IGN);  // a second one finds no waker
  std::signal(SIGTERM, SIG_IGN);
  server->stop();
}
