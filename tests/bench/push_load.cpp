// SPDX-License-Identifier: Apache-2.0
// WebSocket subscribers for tests/bench: how long after publish() a value arrives, how many are missed, and how fair the server is.
//
//   push_load --port N [--path /arm/joint/angle] [--clients 50] [--seconds 5] [--stalled 0] [--buffer 0] [--pid SERVER] [--tls]
//
// The server publishes a number that grows by 0.001 at each step (pushed_server --publish). Latency is from dcterms:modified, which is
// the time of publish(), to recv() here, by the same clock. With --buffer each socket's receive buffer has so many bytes: when clients are
// slower than the server, what waits there is old. `--stalled` further clients open a socket and never read. With --pid the
// server's CPU per message is printed. The last figures are the messages of the client that got the fewest, and the most.

#include <sys/epoll.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <vector>

#include "tests/bench/cpu.hpp"
#include "tests/bench/stream.hpp"
#include "tests/bench/ws_client.hpp"

namespace {

volatile std::sig_atomic_t ended = 0;

struct Client {
  bench::Stream stream;
  std::string received;
  long first = -1, last = -1, messages = 0;
};

/// The text after a predicate, from its first digit or sign on.
std::string_view number_after(std::string_view text, std::string_view predicate) {
  const auto* const at = static_cast<const char*>(::memmem(text.data(), text.size(), predicate.data(), predicate.size()));
  if (!at) return {};
  text.remove_prefix(static_cast<std::size_t>(at - text.data()) + predicate.size());
  if (!text.empty() && text.front() == '"') text.remove_prefix(1);
  return text;
}

/// Microseconds since 1970 of "2026-11-21T10:38:39.000125Z".
double time_of(std::string_view text) {
  if (text.size() < 27) return 0;
  const auto digits = [&](std::size_t at, std::size_t count) {
    long value = 0;
    for (const char c : text.substr(at, count)) value = 10 * value + (c - '0');
    return value;
  };
  // Days since 1970 in the Gregorian calendar; the year begins in March.
  const long month = digits(5, 2), year = digits(0, 4) - (month <= 2 ? 1 : 0);
  const long days = 365 * year + year / 4 - year / 100 + year / 400 + (153 * (month + (month > 2 ? -3 : 9)) + 2) / 5 + digits(8, 2) - 1 - 719'468;
  const long seconds = ((24 * days + digits(11, 2)) * 60 + digits(14, 2)) * 60 + digits(17, 2);
  return static_cast<double>(seconds) * 1e6 + static_cast<double>(digits(20, 6));
}

/// As bench::open_websocket(), plain or TLS.
void open(Client& client, int port, const std::string& path, int buffer_bytes, bool tls) {
  client.stream.connect(port, tls, buffer_bytes);
  client.stream.finish_handshake();
  client.stream.send(bench::websocket_request(port, path));
  char buffer[4096];
  std::size_t end;
  while ((end = client.received.find("\r\n\r\n")) == std::string::npos) {
    const ssize_t n = client.stream.receive(buffer, sizeof buffer);
    if (n < 0) std::fprintf(stderr, "websocket: no answer\n"), std::exit(1);
    if (n == 0) client.stream.wait();
    client.received.append(buffer, static_cast<std::size_t>(n));
  }
  if (client.received.compare(0, 12, "HTTP/1.1 101") != 0) std::fprintf(stderr, "websocket: %s\n", client.received.c_str()), std::exit(1);
  client.received.erase(0, end + 4);
}

}  // namespace

int main(int argc, char** argv) {
  int port = 8080, clients = 50, stalled = 0, buffer_bytes = 0, pid = 0;
  double seconds = 5;
  bool tls = false;
  std::string path = "/arm/joint/angle";
  for (int i = 1; i < argc; ++i) {
    const std::string_view name = argv[i];
    if (name == "--tls") {
      tls = true;
      continue;
    }
    if (++i == argc) return std::fprintf(stderr, "%s needs a value\n", argv[i - 1]), 2;
    const char* const value = argv[i];
    if (name == "--port") port = std::atoi(value);
    else if (name == "--path") path = value;
    else if (name == "--clients") clients = std::atoi(value);
    else if (name == "--seconds") seconds = std::atof(value);
    else if (name == "--stalled") stalled = std::atoi(value);
    else if (name == "--buffer") buffer_bytes = std::atoi(value);
    else if (name == "--pid") pid = std::atoi(value);
    else return std::fprintf(stderr, "unknown option %s\n", argv[i - 1]), 2;
  }
  std::signal(SIGTERM, [](int) { ended = 1; });
  std::vector<Client> never_read(static_cast<std::size_t>(stalled));
  for (Client& client : never_read) open(client, port, path, 4096, tls);
  const int epoll = ::epoll_create1(EPOLL_CLOEXEC);
  std::vector<Client> all(static_cast<std::size_t>(clients));
  for (std::size_t i = 0; i < all.size(); ++i) {
    open(all[i], port, path, buffer_bytes, tls);
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.u64 = i;
    ::epoll_ctl(epoll, EPOLL_CTL_ADD, all[i].stream.fd(), &event);
  }

  std::vector<float> latencies;
  latencies.reserve(4'000'000);
  std::string buffer(256 * 1024, '\0');
  using Clock = std::chrono::steady_clock;
  const auto warm = Clock::now() + std::chrono::milliseconds(500);
  const auto end = warm + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  double cpu = 0;
  bool measuring = false;
  long messages = 0;
  while (!ended && Clock::now() < end) {
    if (!measuring && Clock::now() >= warm) {
      measuring = true;
      if (pid) cpu = bench::cpu_microseconds(pid);
    }
    epoll_event events[256];
    const int ready = ::epoll_wait(epoll, events, 256, 10);
    for (int i = 0; i < ready; ++i) {
      Client& client = all[events[i].data.u64];
      do {
        const ssize_t n = client.stream.receive(buffer.data(), buffer.size());
        if (n < 0) return std::fprintf(stderr, "a socket was closed\n"), 1;
        if (n == 0) break;
        const double now =
            static_cast<double>(std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch()).count());
        std::string_view bytes(buffer.data(), static_cast<std::size_t>(n));
        if (!client.received.empty()) {
          client.received.append(bytes);
          bytes = client.received;
        }
        for (std::string_view payload; bench::next_frame(bytes, payload);) {
          if (payload.empty() || !measuring) continue;
          latencies.push_back(static_cast<float>(now - time_of(number_after(payload, "dcterms:modified "))));
          const std::string_view text = number_after(payload, "vom:numericalValue ");
          const long number = text.empty() ? 0 : std::lround(std::strtod(text.data(), nullptr) * 1000);  // a character follows it
          if (client.first < 0) client.first = number;
          client.last = number;
          ++client.messages;
          ++messages;
        }
        if (bytes.empty()) client.received.clear();
        else client.received = std::string(bytes);  // it may be part of itself
      } while (client.stream.pending());
    }
  }
  const double measured = std::chrono::duration<double>(Clock::now() - warm).count();
  const double spent = pid ? bench::cpu_microseconds(pid) - cpu : 0;
  long published = 0;
  const auto fewer = [](const Client& a, const Client& b) { return a.messages < b.messages; };
  const auto [fewest, most] = std::minmax_element(all.begin(), all.end(), fewer);
  for (const Client& c : all)
    if (c.messages > 0) published += c.last - c.first + 1;
  if (latencies.empty()) return std::printf("%d clients: nothing arrived\n", clients), 1;
  std::sort(latencies.begin(), latencies.end());
  const auto at = [&](double part) {
    return static_cast<double>(latencies[static_cast<std::size_t>(part * static_cast<double>(latencies.size() - 1))]) / 1000;
  };
  std::printf("%d clients, %d stalled: %.0f messages/s, latency median %.3f ms, 99 %% %.3f ms, max %.3f ms, missed %ld of %ld", clients, stalled,
              static_cast<double>(messages) / measured, at(0.5), at(0.99), at(1), published - messages, published);
  if (pid) std::printf(", server CPU %.2f us per message", spent / static_cast<double>(messages));
  std::printf(", each client %ld to %ld\n", fewest->messages, most->messages);
}
