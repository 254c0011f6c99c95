// WebSocket subscribers for tests/bench: how long after publish() a value arrives, and how many are missed.
//
//   push_load --port N [--path /arm/joint/angle] [--clients 50] [--seconds 5] [--stalled 0] [--buffer 0] [--pid SERVER]
//
// The server publishes a number that grows by 0.001 at each step (pushed_server --publish). Latency is from dcterms:modified, which is
// the time of publish(), to recv() here, by the same clock. With --buffer each socket's receive buffer has so many bytes: when clients are
// slower than the server, what waits there is old. `--stalled` further clients open a socket and never read. With --pid the
// server's CPU per message is printed, read from /proc.

#include <sys/epoll.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <vector>

#include "tests/bench/cpu.hpp"
#include "tests/bench/ws_client.hpp"

namespace {

struct Client {
  int fd = -1;
  std::string received;
  long first = -1, last = -1, messages = 0;
};

std::string_view quoted_after(std::string_view text, std::string_view word) {
  const std::size_t at = text.find(word);
  if (at == std::string_view::npos) return {};
  const std::size_t from = text.find_first_of("\"0123456789-", at + word.size()) + (text[text.find_first_of("\"0123456789-", at + word.size())] == '"');
  return text.substr(from, text.find_first_of("\"^ ;\n", from) - from);
}

/// Microseconds since 1970 of "2026-11-21T10:38:39.000125Z".
double time_of(std::string_view text) {
  std::tm tm{};
  const std::string zone(text);
  if (!::strptime(zone.c_str(), "%Y-%m-%dT%H:%M:%S", &tm)) return 0;
  return static_cast<double>(::timegm(&tm)) * 1e6 + std::atof(zone.c_str() + 19) * 1e6;
}

}  // namespace

int main(int argc, char** argv) {
  int port = 8080, clients = 50, stalled = 0, buffer_bytes = 0, pid = 0;
  double seconds = 5;
  std::string path = "/arm/joint/angle";
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string_view name = argv[i];
    const char* const value = argv[i + 1];
    if (name == "--port") port = std::atoi(value);
    else if (name == "--path") path = value;
    else if (name == "--clients") clients = std::atoi(value);
    else if (name == "--seconds") seconds = std::atof(value);
    else if (name == "--stalled") stalled = std::atoi(value);
    else if (name == "--buffer") buffer_bytes = std::atoi(value);
    else if (name == "--pid") pid = std::atoi(value);
    else return std::fprintf(stderr, "unknown option %s\n", argv[i]), 2;
  }
  std::vector<int> never_read;
  for (int i = 0; i < stalled; ++i) {
    std::string ignored;
    never_read.push_back(bench::open_websocket(port, path, ignored, 4096));
  }
  const int epoll = ::epoll_create1(EPOLL_CLOEXEC);
  std::vector<Client> all(static_cast<std::size_t>(clients));
  for (std::size_t i = 0; i < all.size(); ++i) {
    all[i].fd = bench::open_websocket(port, path, all[i].received, buffer_bytes);
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.u64 = i;
    ::epoll_ctl(epoll, EPOLL_CTL_ADD, all[i].fd, &event);
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
  while (Clock::now() < end) {
    if (!measuring && Clock::now() >= warm) {
      measuring = true;
      if (pid) cpu = bench::cpu_microseconds(pid);
    }
    epoll_event events[256];
    const int ready = ::epoll_wait(epoll, events, 256, 10);
    for (int i = 0; i < ready; ++i) {
      Client& client = all[events[i].data.u64];
      const ssize_t n = ::recv(client.fd, buffer.data(), buffer.size(), 0);
      if (n <= 0) {
        if (n < 0 && errno == EAGAIN) continue;
        return std::fprintf(stderr, "a socket was closed\n"), 1;
      }
      const double now =
          static_cast<double>(std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch()).count());
      std::string_view bytes(buffer.data(), static_cast<std::size_t>(n));
      if (!client.received.empty()) {
        client.received.append(bytes);
        bytes = client.received;
      }
      for (std::string_view payload; bench::next_frame(bytes, payload);) {
        if (payload.empty() || !measuring) continue;
        latencies.push_back(static_cast<float>(now - time_of(quoted_after(payload, "dcterms:modified "))));
        const long number = std::lround(std::atof(std::string(quoted_after(payload, "vom:numericalValue ")).c_str()) * 1000);
        if (client.first < 0) client.first = number;
        client.last = number;
        ++client.messages;
        ++messages;
      }
      const std::string rest(bytes);
      client.received = rest;
    }
  }
  const double spent = pid ? bench::cpu_microseconds(pid) - cpu : 0;
  long published = 0;
  for (const Client& c : all)
    if (c.messages > 0) published += c.last - c.first + 1;
  if (latencies.empty()) return std::printf("%d clients: nothing arrived\n", clients), 1;
  std::sort(latencies.begin(), latencies.end());
  const auto at = [&](double part) { return static_cast<double>(latencies[static_cast<std::size_t>(part * static_cast<double>(latencies.size() - 1))]) / 1000; };
  std::printf("%d clients, %d stalled: %.0f messages/s, latency median %.3f ms, 99 %% %.3f ms, max %.3f ms, missed %ld of %ld", clients, stalled,
              static_cast<double>(messages) / seconds, at(0.5), at(0.99), at(1), published - messages, published);
  if (pid) std::printf(", server CPU %.2f us per message", spent / static_cast<double>(messages));
  std::printf("\n");
}
