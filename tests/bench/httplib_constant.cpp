// The yardstick for the transport classic: cpp-httplib's server answering every request with the same bytes.
//
//   httplib_constant [--port 0] [--size 600 (of the body) | --total BYTES (with the head)] [--threads 272] [--tls DIR]
//
// It gives each connection a thread of its pool for as long as the connection lasts, so the pool must be as large as there are connections
// at once: --threads, default 256 and some; 0: the library's own, for comparison, with which further connections wait. TCP_NODELAY,
// connections that live as long as the client likes. DIR has server.pem and server-key.pem. Ends on SIGINT or SIGTERM.

#include <httplib.h>
#include <pthread.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <string_view>
#include <thread>

int main(int argc, char** argv) {
  int port = 0;
  std::size_t size = 600, total = 0, threads = 272;
  std::string tls;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string_view name = argv[i];
    if (name == "--port") port = std::atoi(argv[i + 1]);
    else if (name == "--size") size = static_cast<std::size_t>(std::atol(argv[i + 1]));
    else if (name == "--total") total = static_cast<std::size_t>(std::atol(argv[i + 1]));
    else if (name == "--threads") threads = static_cast<std::size_t>(std::atol(argv[i + 1]));
    else if (name == "--tls") tls = argv[i + 1];
    else return std::fprintf(stderr, "usage: httplib_constant [--port N] [--size BYTES | --total BYTES] [--threads N] [--tls DIR]\n"), 2;
  }
  constexpr std::size_t requests_per_connection = 100'000'000;
  constexpr int keep_alive_seconds = 60;
  if (total > 0) {
    const auto head = [](std::size_t body) {
      return ("HTTP/1.1 200 OK\r\nContent-Length: " + std::to_string(body) + "\r\nContent-Type: text/plain\r\nKeep-Alive: timeout=" +
              std::to_string(keep_alive_seconds) + ", max=" + std::to_string(requests_per_connection) + "\r\n\r\n")
          .size();
    };
    size = total - head(total);
    size = total - head(size);
  }
  const std::string body(size, 'x');

  // A thread of its own waits for the signals: what ends the server may lock. Blocked before the library starts threads.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  ::pthread_sigmask(SIG_BLOCK, &signals, nullptr);

  std::unique_ptr<httplib::Server> server;
  if (tls.empty()) server = std::make_unique<httplib::Server>();
  else server = std::make_unique<httplib::SSLServer>((tls + "/server.pem").c_str(), (tls + "/server-key.pem").c_str());
  if (!server->is_valid()) return std::fprintf(stderr, "the server cannot be set up\n"), 1;
  server->set_tcp_nodelay(true);
  server->set_keep_alive_max_count(requests_per_connection);
  server->set_keep_alive_timeout(keep_alive_seconds);
  server->set_read_timeout(keep_alive_seconds);
  server->set_write_timeout(keep_alive_seconds);
  if (threads > 0) server->new_task_queue = [threads] { return new httplib::ThreadPool(threads); };
  server->Get(".*", [&body](const httplib::Request&, httplib::Response& response) { response.set_content(body, "text/plain"); });
  if (port == 0) port = server->bind_to_any_port("127.0.0.1");
  else if (!server->bind_to_port("127.0.0.1", port)) port = -1;
  if (port < 0) return std::fprintf(stderr, "cannot listen\n"), 1;
  std::printf("listening on http%s://127.0.0.1:%d/\n", tls.empty() ? "" : "s", port);
  std::fflush(stdout);

  std::thread waiter([&] {
    int signal = 0;
    ::sigwait(&signals, &signal);
    std::_Exit(0);  // its threads end only when their clients do
  });
  server->listen_after_bind();
  waiter.join();
}
