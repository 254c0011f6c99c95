// SPDX-License-Identifier: Apache-2.0
// A robot, and a fleet, on a Mosquitto that this program starts on loopback.
//
//   mqtt_bench watchers [--watchers N]... [--properties N] [--rate HZ] [--seconds N]
//       CPU of one robot while N clients of the broker watch all its properties: messages that reached them, latency from publish() to the watcher.
//   mqtt_bench fleet [--robots N] [--properties N] [--rate HZ] [--seconds N] [--kills N] [--signal 9|15] [--qos N]
//       N robots in one process, driven by one thread. The broker is ended and started again. A watcher whose session the broker keeps counts gaps in `seq`.
//   mqtt_bench defaults [--robots N] [--properties N] [--watchers N] [--rate HZ] [--seconds N]
//       N robots with the default publications, whose values change at a higher rate, and N watchers of one of them: messages, CPU, age at the watchers.
//
// Watchers are processes of their own, so that the CPU is the robots' alone.

#include <fcntl.h>
#include <mosquitto.h>
#include <mqtt_protocol.h>
#include <poll.h>
#include <signal.h>
#include <sys/epoll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include <lrt/lrt.hpp>
#include <lrt/mqtt.hpp>
#include <lrt/transport/loopback.hpp>

#include "tests/mqtt/broker.hpp"

namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

struct Settings {
  std::vector<unsigned> watchers;
  unsigned robots = 500, properties = 20, rate_hz = 10, seconds = 30, kills = 2, qos = 1;
  int signal = SIGTERM;
  bool defaults = false;  ///< the default publications
};

double now_s() {
  timespec t{};
  ::clock_gettime(CLOCK_MONOTONIC, &t);
  return static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_nsec) * 1e-9;
}
double cpu_s() {
  rusage u{};
  ::getrusage(RUSAGE_SELF, &u);
  return static_cast<double>(u.ru_utime.tv_sec + u.ru_stime.tv_sec) + static_cast<double>(u.ru_utime.tv_usec + u.ru_stime.tv_usec) * 1e-6;
}
std::size_t resident_bytes() {
  std::size_t pages = 0, resident = 0;
  if (std::FILE* const f = std::fopen("/proc/self/statm", "r")) {
    if (std::fscanf(f, "%zu %zu", &pages, &resident) != 2) resident = 0;
    std::fclose(f);
  }
  return resident * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

/// What watchers have seen, as it goes through a pipe.
struct Seen {
  std::uint64_t messages = 0, gaps = 0, repeated = 0, topics = 0, reconnections = 0;
  double median_ms = 0, p99_ms = 0;
};

/// Clients of the broker in a process of their own. They end when their pipe does.
class Watchers {
 public:
  /// @param persistent  the broker keeps their session
  Watchers(std::uint16_t port, unsigned count, int qos, bool persistent, const char* filter = "robots/#") {
    int orders[2], results[2];
    if (::pipe2(orders, O_CLOEXEC) != 0 || ::pipe2(results, O_CLOEXEC) != 0) throw std::runtime_error("pipe");
    child_ = ::fork();
    if (child_ == 0) {
      ::close(orders[1]);
      ::close(results[0]);
      watch(port, count, qos, persistent, filter, orders[0], results[1]);
      ::_exit(0);
    }
    ::close(orders[0]);
    ::close(results[1]);
    orders_ = orders[1];
    results_ = results[0];
    char ready = 0;
    if (::read(results_, &ready, 1) != 1) throw std::runtime_error("the watchers are not there");
  }
  ~Watchers() {
    if (orders_ >= 0) (void)end();
  }
  Watchers(const Watchers&) = delete;
  Watchers& operator=(const Watchers&) = delete;

  /// Counts from now on.
  void begin() const { (void)!::write(orders_, "b", 1); }
  Seen end() {
    ::close(std::exchange(orders_, -1));
    Seen seen;
    (void)!::read(results_, &seen, sizeof seen);
    ::close(results_);
    ::waitpid(child_, nullptr, 0);
    return seen;
  }

 private:
  struct State {
    Seen seen;
    bool counts = false;
    unsigned subscribed = 0;
    int qos = 0;
    const char* filter = nullptr;
    std::vector<float> latencies;
    std::unordered_map<std::string, std::uint64_t> numbers;
    bool checks_numbers = false;
  };
  static void watch(std::uint16_t port, unsigned count, int qos, bool persistent, const char* filter, int orders, int results) {
    ::mosquitto_lib_init();
    State state;
    state.qos = qos;
    state.filter = filter;
    state.checks_numbers = count == 1;
    std::vector<mosquitto*> clients;
    for (unsigned i = 0; i < count; ++i) {
      const std::string id = "watcher" + std::to_string(i);
      mosquitto* const m = ::mosquitto_new(id.c_str(), !persistent, &state);
      ::mosquitto_int_option(m, MOSQ_OPT_PROTOCOL_VERSION, MQTT_PROTOCOL_V5);
      ::mosquitto_int_option(m, MOSQ_OPT_RECEIVE_MAXIMUM, 65'535);
      ::mosquitto_connect_v5_callback_set(m, [](mosquitto* self, void* s, int code, int, const mosquitto_property*) {
        const State& of = *static_cast<State*>(s);
        if (code == 0) ::mosquitto_subscribe(self, nullptr, of.filter, of.qos);
      });
      ::mosquitto_subscribe_v5_callback_set(
          m, [](mosquitto*, void* s, int, int, const int*, const mosquitto_property*) { ++static_cast<State*>(s)->subscribed; });
      ::mosquitto_message_v5_callback_set(m, [](mosquitto*, void* s, const mosquitto_message* message, const mosquitto_property* list) {
        take(*static_cast<State*>(s), *message, list);
      });
      mosquitto_property* session = nullptr;
      if (persistent) ::mosquitto_property_add_int32(&session, MQTT_PROP_SESSION_EXPIRY_INTERVAL, 3'600);
      if (::mosquitto_connect_bind_v5(m, "127.0.0.1", port, 60, nullptr, session) != MOSQ_ERR_SUCCESS)
        std::fprintf(stderr, "a watcher does not connect\n");
      ::mosquitto_property_free_all(&session);
      clients.push_back(m);
    }
    std::vector<pollfd> items(count + 1);
    bool said = false;
    double last_misc = 0;
    while (true) {
      for (unsigned i = 0; i < count; ++i) {
        const int events = POLLIN | (::mosquitto_want_write(clients[i]) ? POLLOUT : 0);
        items[i] = {::mosquitto_socket(clients[i]), static_cast<short>(events), 0};
      }
      items[count] = {orders, POLLIN, 0};
      ::poll(items.data(), items.size(), 100);
      for (unsigned i = 0; i < count; ++i) {
        if ((items[i].revents & POLLOUT) != 0) (void)::mosquitto_loop_write(clients[i], 1);
        if ((items[i].revents & (POLLIN | POLLHUP | POLLERR)) != 0) (void)::mosquitto_loop_read(clients[i], 1);
        if (::mosquitto_socket(clients[i]) < 0 && ::mosquitto_reconnect(clients[i]) == MOSQ_ERR_SUCCESS) ++state.seen.reconnections;
      }
      if (const double t = now_s(); t - last_misc > 1) {
        last_misc = t;
        for (mosquitto* m : clients) (void)::mosquitto_loop_misc(m);
      }
      if (!said && state.subscribed >= count) {
        said = true;
        (void)!::write(results, "r", 1);
      }
      if ((items[count].revents & (POLLIN | POLLHUP)) != 0) {
        char order = 0;
        if (::read(orders, &order, 1) != 1) break;
        state.counts = true;
      }
    }
    state.seen.topics = state.numbers.size();
    std::vector<float>& l = state.latencies;
    if (!l.empty()) {
      std::sort(l.begin(), l.end());
      state.seen.median_ms = static_cast<double>(l[l.size() / 2]) * 1e3;
      state.seen.p99_ms = static_cast<double>(l[l.size() * 99 / 100]) * 1e3;
    }
    (void)!::write(results, &state.seen, sizeof state.seen);
  }
  static void take(State& state, const mosquitto_message& message, const mosquitto_property* list) {
    const std::string_view topic = message.topic;
    if (topic.find("/ns/") != std::string_view::npos || message.payloadlen <= 0 || message.payloadlen > 40) return;
    if (state.checks_numbers) {
      char *name = nullptr, *value = nullptr;
      if (::mosquitto_property_read_string_pair(list, MQTT_PROP_USER_PROPERTY, &name, &value, false)) {
        const std::uint64_t number = std::strtoull(value, nullptr, 10);
        std::uint64_t& last = state.numbers[message.topic];
        if (number <= last) ++state.seen.repeated;
        else state.seen.gaps += last == 0 ? 0 : number - last - 1;
        last = std::max(last, number);
      }
      std::free(name);
      std::free(value);
    }
    if (!state.counts) return;
    ++state.seen.messages;
    const double sent =
        std::strtod(std::string(static_cast<const char*>(message.payload), static_cast<std::size_t>(message.payloadlen)).c_str(), nullptr);
    if (state.latencies.size() < 4'000'000) state.latencies.push_back(static_cast<float>(now_s() - sent));
  }

  pid_t child_ = -1;
  int orders_ = -1, results_ = -1;
};

struct Robot {
  Robot(unsigned number, const Settings& settings, std::uint16_t port) {
    lrt::Options options;
    options.threads.io = lrt::Io::in_poll;
    options.listen.port = 0;
    options.identity.iri = "urn:lrt:r" + std::to_string(number);
    server.emplace(lrt::Server::create(options).value());
    lrt::Thing base{"base"};
    for (unsigned i = 0; i < settings.properties; ++i) values.push_back(base.property<double>("p" + std::to_string(i)));
    server->add(std::move(base)).value();
    lrt::mqtt::Options mqtt;
    mqtt.broker.port = port;
    mqtt.broker.max_pause = milliseconds(1'000);
    mqtt.prefix = "robots/r" + std::to_string(number);
    if (!settings.defaults) {
      mqtt.publications.resize(1);
      mqtt.publications[0].kinds = {lrt::mqtt::Kind::property};
      mqtt.publications[0].qos = static_cast<int>(settings.qos);
      mqtt.publications[0].minimum_interval = milliseconds(0);  // each value, at the rate of the robot
    }
    bridge.emplace(lrt::mqtt::Bridge::create(*server, mqtt).value());
  }
  void publish() {
    const double now = now_s();
    for (auto& value : values) value.publish(now);
  }
  std::optional<lrt::Server> server;
  std::vector<lrt::PushedProperty<double>> values;
  std::optional<lrt::mqtt::Bridge> bridge;
};

/// Drives robots from one thread, by their descriptors.
class Driver {
 public:
  explicit Driver(std::vector<std::unique_ptr<Robot>>& robots) : robots_(robots), set_(::epoll_create1(EPOLL_CLOEXEC)) {
    for (std::size_t i = 0; i < robots.size(); ++i) {
      add(robots[i]->server->descriptor(), 2 * i);
      add(robots[i]->bridge->descriptor(), 2 * i + 1);
      robots[i]->server->poll();
      robots[i]->bridge->poll();
    }
  }
  ~Driver() { ::close(set_); }
  Driver(const Driver&) = delete;
  Driver& operator=(const Driver&) = delete;
  void run_until(double end) {
    for (double left = end - now_s(); left > 0; left = end - now_s()) {
      epoll_event events[256];
      const int count = ::epoll_wait(set_, events, 256, std::max(1, static_cast<int>(std::min(left, 1.0) * 1e3)));
      for (int i = 0; i < count; ++i) {
        Robot& robot = *robots_[events[i].data.u64 / 2];
        if (events[i].data.u64 % 2 == 0) robot.server->poll();
        else robot.bridge->poll();
      }
    }
  }

 private:
  void add(int descriptor, std::size_t number) const {
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.u64 = number;
    ::epoll_ctl(set_, EPOLL_CTL_ADD, descriptor, &event);
  }
  std::vector<std::unique_ptr<Robot>>& robots_;
  const int set_;
};

lrt::mqtt::Counters sum_of(const std::vector<std::unique_ptr<Robot>>& robots) {
  lrt::mqtt::Counters all;
  for (const auto& robot : robots) {
    const lrt::mqtt::Counters c = robot->bridge->counters();
    all.published += c.published;
    all.acknowledged += c.acknowledged;
    all.refused += c.refused;
    all.connections += c.connections;
    all.unacknowledged += c.unacknowledged;
    all.resources += c.resources;
    all.published_bytes += c.published_bytes;
    all.left_out += c.left_out;
    all.lag = std::max(all.lag, c.lag);
  }
  return all;
}

const char* const conf = "allow_anonymous true\npersistence true\nautosave_interval 1800\nmax_queued_messages 0\nmax_inflight_messages 0\n";

int watchers(const Settings& settings) {
  std::printf("one robot, %u properties at %u Hz, QoS %u, %u s\n%10s %10s %12s %12s %10s %10s\n", settings.properties, settings.rate_hz, settings.qos,
              settings.seconds, "watchers", "CPU", "published", "delivered", "median ms", "99% ms");
  for (const unsigned count : settings.watchers) {
    lrt::test::Mosquitto broker("allow_anonymous true\nset_tcp_nodelay true\nmax_queued_messages 100000\n");
    Watchers watching(broker.port(), count, static_cast<int>(settings.qos), false);
    std::vector<std::unique_ptr<Robot>> robots;
    robots.push_back(std::make_unique<Robot>(0, settings, broker.port()));
    Driver driver(robots);
    const double begin = now_s();
    driver.run_until(begin + 1);
    watching.begin();
    const std::uint64_t before = sum_of(robots).published;
    const double cpu = cpu_s();
    double next = now_s();
    const double end = next + settings.seconds;
    while (next < end) {
      robots[0]->publish();
      next += 1.0 / settings.rate_hz;
      driver.run_until(next);
    }
    const double used = (cpu_s() - cpu) / settings.seconds;
    driver.run_until(now_s() + 1);
    const std::uint64_t published = sum_of(robots).published - before;
    const Seen seen = watching.end();
    std::printf("%10u %9.2f%% %12llu %12llu %10.2f %10.2f\n", count, used * 100, static_cast<unsigned long long>(published),
                static_cast<unsigned long long>(seen.messages), seen.median_ms, seen.p99_ms);
    std::fflush(stdout);
  }
  return 0;
}

int fleet(const Settings& settings) {
  lrt::test::Mosquitto broker(conf);
  Watchers watching(broker.port(), 1, static_cast<int>(settings.qos), true);
  const std::size_t empty = resident_bytes();
  std::vector<std::unique_ptr<Robot>> robots;
  for (unsigned i = 0; i < settings.robots; ++i) robots.push_back(std::make_unique<Robot>(i, settings, broker.port()));
  Driver driver(robots);
  driver.run_until(now_s() + 2);
  for (auto& robot : robots) robot->publish();
  driver.run_until(now_s() + 2);
  const std::size_t full = resident_bytes();
  watching.begin();
  const lrt::mqtt::Counters before = sum_of(robots);
  const double cpu = cpu_s(), begin = now_s(), end = begin + settings.seconds;
  double next = begin;
  unsigned kills = 0;
  std::uint64_t changes = 0;
  while (next < end) {
    for (auto& robot : robots) robot->publish();
    changes += std::uint64_t{settings.robots} * settings.properties;
    next = std::max(next + 1.0 / settings.rate_hz, now_s());
    driver.run_until(next);
    if (kills < settings.kills && now_s() > begin + settings.seconds * (kills + 1.0) / (settings.kills + 1.0)) {
      ++kills;
      broker.end(settings.signal);
      driver.run_until(now_s() + 0.5);
      if (!broker.start()) return std::fprintf(stderr, "the broker does not start again\n"), 1;
    }
  }
  const double took = now_s() - begin, used = cpu_s() - cpu;
  // What is on its way arrives.
  for (int i = 0; i < 60 && (i < 3 || sum_of(robots).unacknowledged > 0); ++i) driver.run_until(now_s() + 0.5);
  driver.run_until(now_s() + 3);
  const lrt::mqtt::Counters after = sum_of(robots);
  const Seen seen = watching.end();
  const auto number = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  std::printf("%u robots, %u properties at %u Hz, QoS %u, %.1f s, broker ended %u times by signal %d\n", settings.robots, settings.properties,
              settings.rate_hz, settings.qos, took, kills, settings.signal);
  std::printf("  changes %llu, messages published %llu (%.0f/s), acknowledged %llu, refused %llu, not acknowledged %zu\n", number(changes),
              number(after.published - before.published), static_cast<double>(after.published - before.published) / took,
              number(after.acknowledged - before.acknowledged), number(after.refused), after.unacknowledged);
  std::printf(
      "  the watcher got %llu messages of %llu topics; %llu are missing, %llu came again; connections of robots %llu, of the "
      "watcher %llu\n",
      number(seen.messages), number(seen.topics), number(seen.gaps), number(seen.repeated), number(after.connections),
      number(1 + seen.reconnections));
  std::printf("  latency: median %.1f ms, 99%% %.1f ms; CPU of all robots %.0f%%; memory for each robot %.0f KiB\n", seen.median_ms, seen.p99_ms,
              100 * used / took, static_cast<double>(full - empty) / 1024 / settings.robots);
  return 0;
}

double children_cpu_s() {
  rusage u{};
  ::getrusage(RUSAGE_CHILDREN, &u);
  return static_cast<double>(u.ru_utime.tv_sec + u.ru_stime.tv_sec) + static_cast<double>(u.ru_utime.tv_usec + u.ru_stime.tv_usec) * 1e-6;
}

int defaults(Settings settings) {
  settings.defaults = true;
  lrt::test::Mosquitto broker("allow_anonymous true\nset_tcp_nodelay true\nmax_queued_messages 100000\n");
  Watchers watching(broker.port(), settings.watchers.front(), 0, false, "robots/r0/#");
  std::vector<std::unique_ptr<Robot>> robots;
  for (unsigned i = 0; i < settings.robots; ++i) robots.push_back(std::make_unique<Robot>(i, settings, broker.port()));
  Driver driver(robots);
  driver.run_until(now_s() + 2);
  watching.begin();
  const lrt::mqtt::Counters before = sum_of(robots);
  const double cpu = cpu_s(), begin = now_s(), end = begin + settings.seconds;
  std::uint64_t changes = 0;
  for (double next = begin; next < end;) {
    for (auto& robot : robots) robot->publish();
    changes += std::uint64_t{settings.robots} * settings.properties;
    next = std::max(next + 1.0 / settings.rate_hz, now_s());
    driver.run_until(next);
  }
  const double took = now_s() - begin, used = cpu_s() - cpu;
  const lrt::mqtt::Counters after = sum_of(robots);
  driver.run_until(now_s() + 1);
  const Seen seen = watching.end();
  const double of_watchers = children_cpu_s();
  broker.end(SIGTERM);
  const double of_broker = children_cpu_s() - of_watchers;
  const auto number = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  std::printf("%u robots with the defaults, %u properties that change at %u Hz, %u watchers of one robot, %.1f s\n", settings.robots,
              settings.properties, settings.rate_hz, settings.watchers.front(), took);
  const std::uint64_t published = after.published - before.published;
  std::printf("  changes %llu; published %llu (%.1f/s for each robot), %.0f bytes of payload each; left out %llu; greatest lag %lld ms\n",
              number(changes), number(published), static_cast<double>(published) / took / settings.robots,
              static_cast<double>(after.published_bytes - before.published_bytes) / static_cast<double>(std::max<std::uint64_t>(published, 1)),
              number(after.left_out - before.left_out), static_cast<long long>(after.lag.count()));
  std::printf("  the watchers got %llu messages; age: median %.1f ms, 99%% %.1f ms\n", number(seen.messages), seen.median_ms, seen.p99_ms);
  std::printf("  CPU: robots %.0f%%, broker %.1f s, watchers %.1f s\n", 100 * used / took, of_broker, of_watchers);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Settings settings;
  const std::string_view what = argc > 1 ? argv[1] : "";
  if (what == "watchers") settings.rate_hz = 50, settings.seconds = 10;
  for (int i = 2; i + 1 < argc; i += 2) {
    const std::string_view name = argv[i];
    const auto value = static_cast<unsigned>(std::strtoul(argv[i + 1], nullptr, 10));
    if (name == "--watchers") settings.watchers.push_back(value);
    else if (name == "--robots") settings.robots = value;
    else if (name == "--properties") settings.properties = value;
    else if (name == "--rate") settings.rate_hz = std::max(1U, value);
    else if (name == "--seconds") settings.seconds = std::max(1U, value);
    else if (name == "--kills") settings.kills = value;
    else if (name == "--qos") settings.qos = value;
    else if (name == "--signal") settings.signal = static_cast<int>(value);
    else return std::fprintf(stderr, "mqtt_bench: unknown option %s\n", argv[i]), 2;
  }
  if (settings.watchers.empty()) settings.watchers = what == "defaults" ? std::vector<unsigned>{1'000} : std::vector<unsigned>{1, 100, 1'000};
  rlimit files{};
  if (::getrlimit(RLIMIT_NOFILE, &files) == 0) {
    files.rlim_cur = files.rlim_max;
    ::setrlimit(RLIMIT_NOFILE, &files);
  }
  if (!lrt::test::has_mosquitto()) return 77;
  if (what == "watchers") return watchers(settings);
  if (what == "fleet") return fleet(settings);
  if (what == "defaults") return defaults(settings);
  std::fprintf(stderr, "usage: mqtt_bench watchers|fleet|defaults [OPTION VALUE]...\n");
  return 2;
}
