// SPDX-License-Identifier: Apache-2.0
// Subscriptions with everything busy: for the thread sanitizer, and as a soak for the address sanitizer (LRT_SOAK_SECONDS, default 3).

#include <lrt/server.hpp>

#include <fcntl.h>
#include <poll.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <list>
#include <map>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/sanitizer.hpp"
#include "tests/support/socket.hpp"
#include "tests/support/websocket.hpp"

#if LRT_TEST_SANITIZED
extern "C" std::size_t __sanitizer_get_current_allocated_bytes();  // sanitizer/allocator_interface.h, which g++ 12 on Debian comes without
#define LRT_TEST_HEAP_IS_COUNTED 1
#endif

using namespace lrt;
using namespace lrt::test;
using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;

namespace {

/// A receiver: one thread, responds 204 to all but paths that begin with /hang, remembers the last body of each path.
class SmallReceiver {
 public:
  SmallReceiver() : listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    if (::bind(listener_, reinterpret_cast<sockaddr*>(&address), size) != 0 || ::listen(listener_, 256) != 0 ||
        ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0)
      throw std::runtime_error("no receiver");
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { run(); });
  }
  ~SmallReceiver() {
    ended_ = true;
    thread_.join();
    for (const Peer& p : peers_) ::close(p.descriptor);
    ::close(listener_);
  }
  SmallReceiver(const SmallReceiver&) = delete;
  SmallReceiver& operator=(const SmallReceiver&) = delete;

  std::string url(const std::string& path) const { return "http://127.0.0.1:" + std::to_string(port_) + path; }
  std::string last(const std::string& path) const {
    const std::lock_guard lock(mutex_);
    const auto found = last_.find(path);
    return found == last_.end() ? std::string() : found->second;
  }
  void forget(const std::string& path) {
    const std::lock_guard lock(mutex_);
    last_.erase(path);
  }
  std::size_t count() const noexcept { return count_; }

 private:
  struct Peer {
    int descriptor;
    std::string received;
    bool ended = false;
  };
  void run() {
    while (!ended_) {
      std::vector<pollfd> items{{listener_, POLLIN, 0}};
      for (const Peer& p : peers_) items.push_back({p.descriptor, POLLIN, 0});
      if (::poll(items.data(), items.size(), 10) <= 0) continue;
      std::size_t i = 1;
      for (Peer& p : peers_)
        if (items[i++].revents != 0) serve(p);
      peers_.remove_if([](const Peer& p) { return p.ended && ::close(p.descriptor) == 0; });
      for (int d; items[0].revents != 0 && (d = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK)) >= 0;)
        peers_.push_back({d, {}});
    }
  }
  void serve(Peer& p) {
    char buffer[64 * 1024];
    const auto n = ::recv(p.descriptor, buffer, sizeof buffer, 0);
    if (n == 0 || (n < 0 && errno != EAGAIN)) p.ended = true;
    if (n > 0) p.received.append(buffer, static_cast<std::size_t>(n));
    for (std::size_t end; (end = p.received.find("\r\n\r\n")) != std::string::npos;) {
      const std::size_t at = p.received.find("Content-Length: ");
      const std::size_t length = at < end ? std::strtoul(p.received.c_str() + at + 16, nullptr, 10) : 0;
      if (p.received.size() < end + 4 + length) return;
      const std::size_t space = p.received.find(' ') + 1;
      const std::string path = p.received.substr(space, p.received.find(' ', space) - space);
      {
        const std::lock_guard lock(mutex_);
        last_[path] = p.received.substr(end + 4, length);
      }
      ++count_;
      p.received.erase(0, end + 4 + length);
      constexpr std::string_view answer = "HTTP/1.1 204 No Content\r\n\r\n";
      if (path.compare(0, 5, "/hang") != 0 && ::send(p.descriptor, answer.data(), answer.size(), MSG_NOSIGNAL) < 0) p.ended = true;
    }
  }

  int listener_;
  std::uint16_t port_ = 0;
  std::list<Peer> peers_;
  std::map<std::string, std::string> last_;
  mutable std::mutex mutex_;
  std::atomic<std::size_t> count_{0};
  std::atomic<bool> ended_{false};
  std::thread thread_;
};

/// A WebSocket that responds where a client must, and remembers the last message.
class Watcher {
 public:
  Watcher(std::uint16_t port, std::string path) : client_(port), path_(std::move(path)) { client_.send(WebSocketClient::handshake(path_)); }

  void step() {
    client_.step();
    for (; !client_.frames.empty(); client_.frames.pop_front()) {
      Frame& f = client_.frames.front();
      if (f.opcode == Frame::text) {
        last_ = std::move(f.payload);
        ++count_;
      } else if (f.opcode == Frame::ping) {
        client_.send(Frame{Frame::pong, f.payload});
      } else if (f.opcode == Frame::close) {
        code_ = client_.close_code();
        client_.send_close(1000);
      }
    }
  }
  /// Steps until a condition holds; false: it did not within twenty seconds, or the connection ended.
  bool until(const std::function<bool()>& condition) {
    const auto end = steady_clock::now() + seconds(20);
    for (step(); !condition(); step()) {
      if (over() || steady_clock::now() > end) return false;
      std::this_thread::sleep_for(milliseconds(1));
    }
    return true;
  }
  bool opened() const { return client_.status == 101; }
  int status() const { return client_.status; }
  bool over() const { return client_.ended || code_ != 0; }
  unsigned code() const { return code_; }  ///< of the server's close; 0: none came
  const std::string& last() const { return last_; }
  std::size_t count() const { return count_; }
  const std::string& path() const { return path_; }
  /// Path of the subscription.
  std::string location() const {
    const auto at = client_.head.find("Location: http://localhost");
    if (at == std::string::npos) return {};
    return client_.head.substr(at + 26, client_.head.find("\r\n", at) - at - 26);
  }
  void close() { client_.send_close(1000); }
  void reset() { client_.reset(); }
  void pause(bool on) { client_.paused = on; }

 private:
  WebSocketClient client_;
  std::string path_;
  std::string last_;
  std::size_t count_ = 0;
  unsigned code_ = 0;
};

/// Two things that publish, one that comes and goes, and a place for what goes wrong on any thread.
class Scene {
 public:
  explicit Scene(const Options& o = options()) : server(Server::create(o).value()) {
    Thing a{"a"};
    x_ = a.property<double>("x");
    a.property("pulled", [this] { return pulled_.load(); }).sample(milliseconds(2));
    a.action("go", [](double, Responder done) { done.succeed(); });
    server.add(std::move(a)).value();
    Thing b{"b"};
    y_ = b.property<std::string>("y");  // owns memory
    y_->keep(16);
    server.add(std::move(b)).value();
    x_->publish(0);
    y_->publish("zero");
    server.start();
  }
  static Options options() {
    Options o;
    o.listen.port = 0;
    o.security.allowed_hosts = {"localhost:80"};
    o.callbacks.allow = {"127.0.0.1"};
    o.callbacks.max_threads = 8;
    return o;
  }
  void publish_x(double v) { x_->publish(v), ++pulled_; }
  void publish_y(const std::string& v) { y_->publish(v); }
  Thing temporary() {
    Thing t{"t"};
    auto z = t.property<int>("z");
    z.publish(1);
    return t;
  }
  void failed(const std::string& what) {
    const std::lock_guard lock(mutex_);
    if (failures_.size() < 20) failures_.push_back(what);
  }
  /// Runs on a thread; what it throws is a failure.
  template <class F>
  std::thread run(F f) {
    return std::thread([this, f]() mutable {
      try {
        f();
      } catch (const std::exception& e) { failed(e.what()); }
    });
  }
  std::vector<std::string> failures() const {
    const std::lock_guard lock(mutex_);
    return failures_;
  }

  Server server;

 private:
  std::optional<PushedProperty<double>> x_;
  std::optional<PushedProperty<std::string>> y_;
  std::atomic<int> pulled_{0};
  mutable std::mutex mutex_;
  std::vector<std::string> failures_;
};

constexpr const char* paths[] = {
    "/a/x", "/a/x?queueLength=20", "/b/y", "/b/y?queueLength=5", "/a/state", "/b/state?minimumInterval=0.01", "/a", "/a/actions/go", "/t/z", "/t"};

constexpr std::string_view last_x = "-42.5", last_y = "the very last";

std::string without_query(const std::string& path) { return path.substr(0, path.find('?')); }

/// A client that subscribes and cancels at random, and keeps some.
class Client {
 public:
  Client(Scene& scene, SmallReceiver& receiver, unsigned seed)
      : scene_(scene), receiver_(receiver), rng_(seed), http_(scene.server.port()), name_("/" + std::to_string(seed) + "-") {}

  void act() {
    const std::string path = paths[rng_() % std::size(paths)];
    switch (rng_() % 8) {
      case 0:
      case 1:
      case 2: return open(path);
      case 3: return call_back(path);
      case 4:
      case 5: return leave();
      case 6: return stop_call_back();
      default: {
        const int status =
            http_.ask("POST /a/actions/go\nContent-Type: text/turtle\n\n<> <http://www.w3.org/1999/02/22-rdf-syntax-ns#value> 1.0e0 .").status;
        if (status >= 500 && status != 503) scene_.failed("go: " + std::to_string(status));
      }
    }
    for (auto& w : kept_) w->step();
  }
  /// After calm: every observer has the newest representation. At first no client sends a request: a GET would make the
  /// server scan, and hide a wake-up that was lost.
  void settle() {
    wait_for("has not the last value", [this] { return who_waits(); });
    wait_for("has not what GET answers", [this] { return who_is_late(); });
  }
  std::size_t alive() const { return alive_; }
  std::vector<std::unique_ptr<Watcher>>& kept() { return kept_; }

 private:
  void open(const std::string& path) {
    auto w = std::make_unique<Watcher>(scene_.server.port(), path);
    const bool told = w->until([&] { return w->count() > 0 || (w->status() != 0 && w->status() != 101); });
    const bool comes_and_goes = path[1] == 't';
    if (w->status() == 404 && comes_and_goes) return;
    if (!told) {
      if (!(comes_and_goes && w->code() == 1001))
        scene_.failed("opening " + path + ": " + std::to_string(w->status()) + " closed " + std::to_string(w->code()));
      return;
    }
    if (kept_.size() < 8) kept_.push_back(std::move(w));
    else end(*w);
  }
  void end(Watcher& w) {
    switch (rng_() % 4) {
      case 0: return w.reset();
      case 1: return;  // without a word, by the destructor
      case 2: {
        w.close();
        if (!w.until([&] { return w.over(); }) && !w.over()) scene_.failed("no answer to a close of " + w.path());
        return;
      }
      default: {
        const int status = http_.ask("DELETE " + w.location()).status;
        if (status != 204 && status != 404) scene_.failed("DELETE: " + std::to_string(status));
        if (!w.until([&] { return w.over(); }) && !w.over()) scene_.failed("DELETE did not close " + w.path());
        if (status == 204 && w.code() != 1000) scene_.failed("DELETE closed with " + std::to_string(w.code()));
      }
    }
  }
  void leave() {
    if (kept_.empty()) return;
    const auto at = kept_.begin() + static_cast<std::ptrdiff_t>(rng_() % kept_.size());
    if (!(*at)->over()) end(**at);
    kept_.erase(at);
  }
  void call_back(const std::string& path) {
    if (callbacks_.size() > 6) return;
    const std::string target = name_ + std::to_string(++made_);
    const Answer a = http_.ask("GET " + path + "\nUpgrade: callback\nCallback: " + receiver_.url(target));
    if (a.status == 201) callbacks_.push_back({target, without_query(path), a.field("Location").substr(std::string("http://localhost").size())});
    else if (!(a.status == 404 && path[1] == 't') && a.status != 503) scene_.failed("callback: " + std::to_string(a.status) + a.body);
  }
  void stop_call_back() {
    if (callbacks_.empty()) return;
    const auto at = callbacks_.begin() + static_cast<std::ptrdiff_t>(rng_() % callbacks_.size());
    const int status = http_.ask("DELETE " + at->location).status;
    if (status != 204 && status != 404) scene_.failed("DELETE of a callback: " + std::to_string(status));
    receiver_.forget(at->target);
    callbacks_.erase(at);
  }
  void wait_for(const std::string& what, const std::function<std::string()>& who) {
    const auto end = steady_clock::now() + seconds(20);
    for (std::string found; !(found = who()).empty(); std::this_thread::sleep_for(milliseconds(2)))
      if (steady_clock::now() > end) return scene_.failed(what + ": " + found);
  }
  std::string who_waits() {
    const auto complete = [](const std::string& path, const std::string& last) {
      if (path.compare(0, 4, "/a/x") == 0 || path.compare(0, 8, "/a/state") == 0) return last.find(last_x) != std::string::npos;
      return path.compare(0, 3, "/b/") != 0 || last.find(last_y) != std::string::npos;
    };
    for (auto& w : kept_) {
      w->step();
      if (!w->over() && !complete(w->path(), w->last())) return w->path();
    }
    for (const Callback& c : callbacks_)
      if (!complete(c.path, receiver_.last(c.target))) return "callback of " + c.path;
    return {};
  }
  std::string who_is_late() {
    alive_ = 0;
    for (auto& w : kept_) {
      w->step();
      if (w->over()) {
        if (w->path()[1] != 't' || w->code() != 1001) return w->path() + " was closed with " + std::to_string(w->code());
        continue;
      }
      if (w->last() != http_.ask("GET " + without_query(w->path())).body) return w->path();
      ++alive_;
    }
    for (const Callback& c : callbacks_) {
      if (http_.ask("GET " + c.location).status == 404 && c.path[1] == 't') continue;
      if (receiver_.last(c.target) != http_.ask("GET " + c.path).body) return "callback of " + c.path;
      ++alive_;
    }
    return {};
  }
  struct Callback {
    std::string target, path, location;
  };
  Scene& scene_;
  SmallReceiver& receiver_;
  std::mt19937 rng_;
  Socket http_;
  std::string name_;
  int made_ = 0;
  std::vector<std::unique_ptr<Watcher>> kept_;
  std::vector<Callback> callbacks_;
  std::size_t alive_ = 0;
};

constexpr std::size_t client_count = 5;

/// Publishes on two threads and lets a thing come and go on a third, until it is destroyed or a bound is met.
class Busy {
 public:
  explicit Busy(Scene& scene) : scene_(scene) {
    threads_.push_back(scene.run([&] {
      for (int i = 0; i < 20'000'000 && !ended_; ++i) scene.publish_x(i);
    }));
    threads_.push_back(scene.run([&] {
      for (int i = 0; i < 20'000'000 && !ended_; ++i) scene.publish_y("value number " + std::to_string(i));
    }));
    threads_.push_back(scene.run([&] {
      for (int i = 0; i < 100'000 && !ended_; ++i) {
        if (!scene.server.add(scene.temporary())) return;  // stopped
        std::this_thread::sleep_for(milliseconds(2));
        if (!scene.server.remove("t")) return;
        std::this_thread::sleep_for(milliseconds(1));
      }
    }));
  }
  ~Busy() { end(); }
  Busy(const Busy&) = delete;
  Busy& operator=(const Busy&) = delete;
  void end() {
    ended_ = true;
    for (std::thread& t : threads_) t.join();
    threads_.clear();
  }

 private:
  Scene& scene_;
  std::atomic<bool> ended_{false};
  std::vector<std::thread> threads_;
};

std::size_t resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  std::size_t all = 0, resident = 0;
  statm >> all >> resident;
  return resident * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}
/// What must not grow. A sanitizer keeps freed memory resident, so that what is in use is counted there.
std::size_t bytes_in_use() {
#ifdef LRT_TEST_HEAP_IS_COUNTED
  return __sanitizer_get_current_allocated_bytes();
#else
  return resident_bytes();
#endif
}

}  // namespace

TEST_CASE("subscribers that come and go while values are published at full speed end up with the newest", "[server][control loop][R0.12][R0.13]") {
  SmallReceiver receiver;
  Scene scene;
  std::vector<std::unique_ptr<Client>> clients;
  for (unsigned i = 0; i < client_count; ++i) clients.push_back(std::make_unique<Client>(scene, receiver, 100 + i));
  {
    Busy busy(scene);
    std::vector<std::thread> threads;
    for (auto& c : clients)
      threads.push_back(scene.run([&client = *c] {
        const auto end = steady_clock::now() + seconds(20);
        for (int i = 0; i < 150 && steady_clock::now() < end; ++i) client.act();
      }));
    for (std::thread& t : threads) t.join();
  }
  scene.publish_x(-42.5);  // last_x
  scene.publish_y(std::string(last_y));
  std::size_t alive = 0;
  for (auto& c : clients) {
    c->settle();
    alive += c->alive();
  }
  for (const std::string& f : scene.failures()) FAIL_CHECK(f);
  CHECK(alive > 10);
  CHECK(receiver.count() > 20);
}

TEST_CASE("stop() with everything busy ends all sockets with 1001, and soon", "[server][R0.12][R0.13]") {
  SmallReceiver receiver;
  Options options = Scene::options();
  options.callbacks.response_time = std::chrono::minutes(1);  // longer than patience: stop() does not wait for it
  options.callbacks.max_threads = 80;                         // a quarter at one receiver: more than hang
  Scene scene(options);
  std::vector<std::unique_ptr<Watcher>> watchers;
  for (int i = 0; i < 40; ++i) watchers.push_back(std::make_unique<Watcher>(scene.server.port(), paths[static_cast<std::size_t>(i) % 8]));
  for (auto& w : watchers) REQUIRE(w->until([&] { return w->count() > 0; }));
  watchers[0]->pause(true);  // does not read, and gets its close all the same when it reads again
  Socket http(scene.server.port());
  for (int i = 0; i < 30; ++i)
    REQUIRE(http.ask("GET /a/x\nUpgrade: callback\nCallback: " + receiver.url((i % 2 ? "/hang" : "/r") + std::to_string(i))).status == 201);
  {
    Busy busy(scene);
    const auto busy_until = steady_clock::now() + seconds(10);
    const std::size_t some = receiver.count() + 50;
    while ((receiver.count() < some || watchers[5]->count() < 20) && steady_clock::now() < busy_until)
      for (auto& w : watchers) w->step();
    std::atomic<bool> stopped{false};
    std::thread stopping([&] {
      scene.server.stop();
      stopped = true;
    });
    const auto end = steady_clock::now() + seconds(20);
    while (!stopped && steady_clock::now() < end)
      for (std::size_t i = 1; i < watchers.size(); ++i) watchers[i]->step();
    CHECK(stopped);
    stopping.join();
  }  // publishing went on: the handles are inert
  watchers[0]->pause(false);
  std::size_t told = 0;
  for (auto& w : watchers) {
    CHECK(w->until([&] { return w->over(); }));
    told += w->code() == 1001;
  }
  CHECK(told >= watchers.size() - 1);  // the one that did not read may have been cut off
  for (const std::string& f : scene.failures()) FAIL_CHECK(f);
}

TEST_CASE("subscribing for long costs no memory", "[server][soak]") {
  const char* wish = std::getenv("LRT_SOAK_SECONDS");
  const auto length = milliseconds(wish ? 1000 * std::strtol(wish, nullptr, 10) : 3000);
  SmallReceiver receiver;
  Scene scene;
  std::size_t rounds = 0;
  const auto soak = [&](steady_clock::time_point end) {
    std::vector<std::unique_ptr<Client>> clients;
    for (unsigned i = 0; i < client_count; ++i)
      clients.push_back(std::make_unique<Client>(scene, receiver, static_cast<unsigned>(1000 * ++rounds + i)));
    Busy busy(scene);
    std::vector<std::thread> threads;
    for (auto& c : clients)
      threads.push_back(scene.run([&, &client = *c] {
        for (int i = 0; i < 200 && steady_clock::now() < end; ++i) client.act();
      }));
    for (std::thread& t : threads) t.join();
  };
  /// Nobody observes any more, so that what is left is what is kept.
  const auto clear = [&] {
    Socket http(scene.server.port());
    const auto end = steady_clock::now() + seconds(20);
    for (const char* thing : {"/a", "/b"}) {
      while (steady_clock::now() < end) {
        const auto members = http.ask(std::string("GET ") + thing + "/subscriptions").linked("related");
        if (members.empty()) break;
        for (const std::string& m : members) (void)http.ask("DELETE " + m.substr(std::string("http://localhost").size()));
      }
    }
  };
  const auto start = steady_clock::now();
  const auto warm = start + std::max<milliseconds>(length / 3, seconds(1));
  while (steady_clock::now() < warm) soak(warm);
  clear();
  const std::size_t before = bytes_in_use(), resident_before = resident_bytes();
  const auto end = warm + length;
  while (steady_clock::now() < end) soak(end);
  clear();
  const std::size_t after = bytes_in_use(), resident_after = resident_bytes();
  const auto mb = [](std::size_t bytes) { return static_cast<double>(bytes) / (1024 * 1024); };
  std::printf("soak of %.0f s: resident %.1f MB at begin, %.1f MB at end; in use %.1f MB, %.1f MB; %zu notifications posted\n",
              std::chrono::duration<double>(steady_clock::now() - start).count(), mb(resident_before), mb(resident_after), mb(before), mb(after),
              receiver.count());
  CHECK(mb(after) - mb(before) < 16);
  for (const std::string& f : scene.failures()) FAIL_CHECK(f);
}
