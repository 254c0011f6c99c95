// SPDX-License-Identifier: Apache-2.0
// A system call of the server fails once, at each place: each function with each error. Requests get their response, or their connection is closed,
// and the next one is served.

#include <lrt/server.hpp>
#include <lrt/transport/named.hpp>

#include <fcntl.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "tests/attack/failing_calls.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/descriptors.hpp"
#include "tests/support/event_stream.hpp"
#include "tests/support/folder.hpp"
#include "tests/support/message.hpp"
#include "tests/support/socket.hpp"
#include "tests/support/tls.hpp"
#include "tests/support/tls_socket.hpp"
#include "tests/support/watchdog.hpp"
#include "tests/support/websocket.hpp"

using namespace lrt;
using namespace lrt::test;
using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;

namespace {

/// Of one function: a server that polls waits thousands of times for nothing.
constexpr std::size_t max_places = 150;

struct Setting {
  std::string transport;
  Io io;
  const TlsFolder* tls = nullptr;
  SSL_CTX* client = nullptr;
};

/// A receiver of web callbacks, served between the steps of the test.
class Receiver {
 public:
  Receiver() : listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof at;
    if (::bind(listener_, reinterpret_cast<const sockaddr*>(&at), size) != 0 || ::listen(listener_, 64) != 0 ||
        ::getsockname(listener_, reinterpret_cast<sockaddr*>(&at), &size) != 0)
      throw std::runtime_error("no receiver");
    port_ = ntohs(at.sin_port);
  }
  ~Receiver() {
    for (const auto& client : clients_) ::close(client.first);
    ::close(listener_);
  }
  Receiver(const Receiver&) = delete;
  Receiver& operator=(const Receiver&) = delete;

  std::string url() const { return "http://localhost:" + std::to_string(port_) + "/"; }
  bool has(const std::string& text) const {
    return std::any_of(bodies_.begin(), bodies_.end(), [&](const std::string& body) { return body.find(text) != std::string::npos; });
  }
  void step() {
    for (int client = 0; (client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK)) >= 0;) clients_[client];
    for (auto at = clients_.begin(); at != clients_.end();) at = serve(at->first, at->second) ? std::next(at) : clients_.erase(at);
  }

 private:
  bool serve(int client, std::string& received) {
    char buffer[4096];
    const auto got = ::recv(client, buffer, sizeof buffer, 0);
    if (got == 0 || (got < 0 && errno != EAGAIN)) {
      ::close(client);
      return false;
    }
    if (got > 0) received.append(buffer, static_cast<std::size_t>(got));
    const std::size_t end = received.find("\r\n\r\n"), length = received.find("\r\nContent-Length: ");
    if (end == std::string::npos || length == std::string::npos) return true;
    const std::size_t size = std::strtoul(received.c_str() + length + 18, nullptr, 10);
    if (received.size() < end + 4 + size) return true;
    bodies_.push_back(received.substr(end + 4, size));
    received.erase(0, end + 4 + size);
    static constexpr std::string_view done = "HTTP/1.1 204 No Content\r\n\r\n";
    return ::send(client, done.data(), done.size(), MSG_NOSIGNAL) > 0;
  }

  int listener_;
  std::uint16_t port_ = 0;
  std::map<int, std::string> clients_;
  std::vector<std::string> bodies_;
};

/// A robot and its clients. Whatever is not as it must be is thrown.
class Scene {
 public:
  explicit Scene(const Setting& setting) : setting_(setting) {}
  ~Scene() {
    const ServerSide here;
    server_.reset();
  }
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  void play() {
    create();
    get_and_put();
    commands();
    websocket();
    if (!setting_.tls) event_stream();
    callback();
    restart();
    end();
  }

 private:
  [[noreturn]] static void fail(const std::string& what) { throw std::runtime_error(what); }
  static void expect(bool good, const std::string& what) {
    if (!good) fail(what);
  }

  void step() {
    {
      const ServerSide here;
      server_->poll();
    }
    receiver_.step();
  }
  /// Waits until the condition holds.
  void await(const std::string& what, const std::function<bool()>& holds) {
    const auto end = steady_clock::now() + seconds(20);
    while (!holds()) {
      expect(steady_clock::now() < end, "it hangs: " + what);
      step();
    }
  }

  Options options() {
    Options options;
    options.listen.port = 0;
    options.listen.transport = [name = setting_.transport](transport::TransportOptions t) { return transport::make_named(name, std::move(t)); };
    options.threads.io = setting_.io;
    options.threads.body_threads = 1;
    options.limits.small_body_bytes = 16;
    options.limits.stop_timeout = milliseconds(200);
    options.callbacks.allow = {"127.0.0.1", "localhost"};
    options.callbacks.file = folder_ / "state/subscriptions";
    options.callbacks.first_pause = options.callbacks.max_pause = milliseconds(1);
    options.callbacks.response_time = seconds(1);
    options.callbacks.attempts = 100'000;
    options.subscriptions.sample_period = milliseconds(1);
    if (std::getenv("LRT_ATTACK_LOG"))
      options.log = [](LogLevel, std::string_view text) { std::fprintf(stderr, "%.*s\n", static_cast<int>(text.size()), text.data()); };
    if (setting_.tls) {
      options.security.tls.emplace();
      options.security.tls->certificate_file = setting_.tls->path("server.pem");
      options.security.tls->key_file = setting_.tls->path("server.key");
    }
    return options;
  }

  /// A server that is not created reports why, and the next attempt succeeds.
  void create() {
    for (int attempt = 0;; ++attempt) {
      const ServerSide here;
      Result<Server> made = Server::create(options());
      if (made) {
        server_.emplace(*std::move(made));
        break;
      }
      expect(has_failed() && attempt == 0, "no server: " + made.error().message);
      const std::string reason = text_of(current);
      expect(made.error().message.find(reason) != std::string::npos || made.error().message.find("libwebsockets") != std::string::npos,
             "the error does not name what failed: " + made.error().message);
    }
    Thing arm{"arm"};
    angle_ = arm.property<double>("angle").on_write([this](double v) { angle_->publish(v); });
    angle_->publish(1);
    arm.property("name", [this] { return name_; }).on_write([this](std::string v) { name_ = std::move(v); });
    arm.action("home", [] {});
    arm.collection<double>("points").on_create([](double) { return Result<void>(); }).max_members(10);
    const ServerSide here;
    server_->add(std::move(arm)).value();
  }

  std::string host() const { return "\nHost: localhost:" + std::to_string(server_->port()); }

  /// The response on a connection of its own; none if that was closed.
  std::optional<Answer> request(const std::string& text) {
    try {
      Socket client(server_->port(), setting_.client ? std::make_unique<TlsLayer>(setting_.client) : nullptr);
      const std::size_t line = text.find('\n');
      client.send(text.substr(0, line) + host() + (line == std::string::npos ? "" : text.substr(line)));
      std::optional<Answer> answer;
      await(text, [&] { return (answer = client.receive()) || client.ended(); });
      return answer;
    } catch (const std::runtime_error& e) {
      const std::string what = e.what();
      if (what != "connect failed" && what != "send failed") throw;
      return std::nullopt;
    }
  }
  /// The response. The first attempt may fail by the fault: then by a closed connection, a 503 or a 500. The second may not.
  Answer ask(const std::string& text, int status) {
    for (int attempt = 0;; ++attempt) {
      const std::optional<Answer> answer = request(text);
      if (answer && answer->status == status) return *answer;
      const std::string found = answer ? std::to_string(answer->status) + " " + answer->body : "a closed connection";
      const bool may_fail = !answer || answer->status == 503 || answer->status == 500;
      expect(may_fail && has_failed() && attempt == 0, text + ": expected " + std::to_string(status) + ", found " + found);
    }
  }

  void get_and_put() {
    expect(ask("GET /arm/angle\nAccept: application/json", 200).body == "1", "another value");
    ask("PUT /arm/angle\nContent-Type: application/json\n\n2", 204);
    expect(ask("GET /arm/angle\nAccept: application/json", 200).body == "2", "another value after PUT");
    const std::string name(40'000, 'n');  // judged by a job
    ask("PUT /arm/name\nContent-Type: application/json\n\n\"" + name + "\"", 204);
    expect(ask("GET /arm/name\nAccept: application/json", 200).body == "\"" + name + "\"", "another text after PUT");
  }
  void commands() {
    ask("POST /arm/actions/home\nPrefer: respond-async", 202);
    const std::string member = ask("POST /arm/points\nContent-Type: application/json\n\n3.5", 201).field("Location");
    expect(ask("GET " + member.substr(member.find("/arm/")) + "\nAccept: application/json", 200).body == "3.5", "another member");
  }

  /// Sets the angle to a new value.
  std::string move() {
    const std::string value = std::to_string(++moved_) + ".03125";
    ask("PUT /arm/angle\nContent-Type: application/json\n\n" + value, 204);
    return value;
  }

  void websocket() {
    if (setting_.tls) return;  // the client of the tests has none
    for (int attempt = 0;; ++attempt) {
      WebSocketClient client(server_->port());
      std::string handshake = WebSocketClient::handshake("/arm/angle", "Accept: application/json\r\n");
      handshake.insert(handshake.find("localhost") + 9, ":" + std::to_string(server_->port()));
      client.send(handshake);
      await("a handshake", [&] { return client.step(), client.status != 0 || client.ended; });
      expect(client.status == 101 || client.status == 0 || client.status == 503, "handshake: " + std::to_string(client.status));
      const std::string value = move();
      await("a message", [&] {
        client.step();
        return client.ended || std::any_of(client.frames.begin(), client.frames.end(), [&](const Frame& f) { return f.payload == value; });
      });
      if (!client.ended && client.status == 101) break;
      expect(has_failed() && attempt == 0, "the WebSocket was closed");
    }
  }

  void event_stream() {
    for (int attempt = 0;; ++attempt) {
      StreamClient client(server_->port(), "/arm/angle");
      await("an event stream", [&] { return client.step(), client.status != 0 || client.ended; });
      expect(client.status == 200 || client.status == 0 || client.status == 503, "event stream: " + std::to_string(client.status));
      const std::string value = move();
      bool found = false;
      await("an event", [&] {
        client.step();
        for (const Event& event : client.take()) found = found || event.data.find(value) != std::string::npos;
        return client.ended || found;
      });
      if (found) break;
      expect(has_failed() && attempt == 0, "the event stream was closed");
    }
  }

  std::string saved() const {
    std::ifstream file(folder_ / "state/subscriptions", std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  std::string subscribe() {
    const std::string location = ask("POST /arm/subscriptions\nContent-Type: text/turtle\n\n<> "
                                     "<https://hybr-it-projekt.de/ns/hybr-it#onResource> <../arm/angle> ; "
                                     "<https://hybr-it-projekt.de/ns/hybr-it#callbackURL> \"" +
                                         receiver_.url() + "\"^^<http://www.w3.org/2001/XMLSchema#anyURI> .",
                                     201)
                                     .field("Location");
    const std::string path = location.substr(location.find("/arm/"));
    expect(saved().find(path.substr(path.rfind('/') + 1)) != std::string::npos, "an acknowledged callback is not in the file");
    return path;
  }
  void callback() {
    const std::string cancelled = subscribe();
    const std::string value = move();
    await("a notification", [&] { return receiver_.has(value); });
    // The first attempt may have succeeded, and its response was lost.
    const std::optional<Answer> answer = request("DELETE " + cancelled);
    if (!answer || answer->status != 204) {
      expect(has_failed(), "DELETE: " + (answer ? std::to_string(answer->status) : "closed"));
      const std::optional<Answer> again = request("DELETE " + cancelled);
      expect(again && (again->status == 204 || again->status == 404), "DELETE fails again");
    }
    expect(saved().find(cancelled.substr(cancelled.rfind('/') + 1)) == std::string::npos, "a cancelled callback is in the file");
    kept_ = subscribe();
  }
  /// What was acknowledged is there after a restart.
  void restart() {
    end();
    create();
    ask("GET " + kept_, 200);
    const std::string value = move();
    await("a notification after the restart", [&] { return receiver_.has(value); });
  }
  void end() {
    const ServerSide here;
    server_.reset();
  }

  const Setting& setting_;
  const Folder folder_;
  Receiver receiver_;
  std::optional<Server> server_;
  std::optional<PushedProperty<double>> angle_;
  std::string name_ = "arm";
  std::string kept_;
  int moved_ = 10;

 public:
  static Fault current;
};
Fault Scene::current;

/// Plays the scene once. What was wrong; empty: nothing.
std::string play(const Setting& setting, const std::string& fault = "no fault") {
  const auto before = descriptors(false);
  std::string wrong;
  try {
    const Watchdog dog("a scene on " + setting.transport + " with " + fault, seconds(120));
    Scene scene(setting);
    scene.play();
  } catch (const std::exception& e) { wrong = e.what(); }
  // A thread that resolves a name ends after its server.
  const auto end = steady_clock::now() + seconds(20);
  const auto is_clean = [&] { return descriptors(false).size() <= before.size(); };
  while (!is_clean() && steady_clock::now() < end) std::this_thread::yield();
  if (!is_clean())
    for (const auto& [number, what] : descriptors(false))
      if (before.count(number) == 0) wrong += " Descriptor left: " + what;
  return wrong;
}

Fault fault(const std::string& name) {
  for (const Fault& one : all_faults())
    if (name_of(one) == name) return one;
  throw std::invalid_argument("no fault " + name);
}

/// Each fault at each place.
/// @param step  of the places, so many are passed over
/// @param only  the beginning of the names of the faults
void play_all(const Setting& setting, std::size_t step, const std::string& only = {}) {
  fail_no_call();
  REQUIRE(play(setting) == "");  // what is made once is there
  fail_no_call();
  REQUIRE(play(setting) == "");
  std::map<std::size_t, std::size_t> places;
  for (const Fault& fault : all_faults()) places[fault.function] = std::min(calls_of(fault.function), max_places);
  std::size_t played = 0, failed = 0, place = 0;
  for (const Fault& fault : all_faults())
    for (std::size_t n = 1; n <= places[fault.function]; ++n) {
      if (name_of(fault).compare(0, only.size(), only) != 0 || place++ % step != 0) continue;
      fail_call(fault, n);
      Scene::current = fault;
      const std::string wrong = play(setting, name_of(fault) + ", call " + std::to_string(n));
      ++played;
      failed += has_failed();
      fail_no_call();
      INFO(name_of(fault) << " at call " << n);
      CHECK(wrong == "");
    }
  std::size_t all = 0;
  for (const auto& [function, count] : places) all += count;
  std::printf("%s, %s%s: %zu calls, %zu faults, %zu took effect\n", setting.transport.c_str(), setting.io == Io::in_poll ? "in poll" : "own thread",
              setting.tls ? ", TLS" : "", all, played, failed);
  CHECK(failed > 0);
}

}  // namespace

TEST_CASE("a WebSocket for which there is no descriptor is refused, and the server ends", "[attack][calls]") {
  for (const Io io : {Io::own_thread, Io::in_poll}) play_all({"http", io}, 1, "epoll_create1");
}

TEST_CASE("without an event descriptor there is no server, and the error says why", "[attack][calls]") {
  for (const Io io : {Io::own_thread, Io::in_poll}) {
    play_all({"http", io}, 1, "eventfd");
    fail_call(fault("eventfd, Too many open files"), 1, 1000);
    const ServerSide here;
    Options options;
    options.listen.port = 0;
    options.threads.io = io;
    const Result<Server> made = Server::create(options);
    fail_no_call();
    REQUIRE_FALSE(made);
    CHECK(made.error().message.find("event descriptor") != std::string::npos);
  }
}

TEST_CASE("a web callback is delivered although its thread could not be started at first", "[attack][calls]") {
  for (const Io io : {Io::own_thread, Io::in_poll}) play_all({"http", io}, 1, "pthread_create");
}

TEST_CASE("a subscription that did not wait for the file is saved at the end without a thread", "[attack][calls]") {
  const Folder folder;
  Options options;
  options.listen.port = 0;
  options.callbacks.allow = {"127.0.0.1"};
  options.callbacks.file = folder / "state";
  options.callbacks.respond_when_saved = false;
  fail_no_call();
  std::string id;
  {
    const ServerSide here;
    Server server = Server::create(options).value();
    Thing arm{"arm"};
    arm.property<double>("angle");
    server.add(std::move(arm)).value();
    fail_call(fault("pthread_create, Resource temporarily unavailable"), 1, 1000);
    Socket client(server.port());
    const Answer made = client.ask("POST /arm/subscriptions\nContent-Type: text/turtle\nHost: localhost:" + std::to_string(server.port()) +
                                       "\n\n<> <https://hybr-it-projekt.de/ns/hybr-it#onResource> <../arm/angle> ; "
                                       "<https://hybr-it-projekt.de/ns/hybr-it#callbackURL> "
                                       "\"http://127.0.0.1:9/\"^^<http://www.w3.org/2001/XMLSchema#anyURI> .",
                                   [&] { server.poll(); });
    CHECK(made.status == 201);
    id = made.field("Location").substr(made.field("Location").rfind('/') + 1);
  }
  CHECK(has_failed());
  fail_no_call();
  std::ifstream file(folder / "state", std::ios::binary);
  CHECK(std::string(std::istreambuf_iterator<char>(file), {}).find(id) != std::string::npos);
}

TEST_CASE("libwebsockets without a socket to listen on is an error that says why", "[attack][calls]") {
  for (const std::string_view name : transport::names())
    if (name != "http") play_all({std::string(name), Io::own_thread}, 1, "socket, Too many open files");
}

TEST_CASE("without descriptors a server neither spins nor hangs, and goes on when there are some", "[attack][calls]") {
  const std::string transport(GENERATE("http", "libwebsockets"));
  const Io io = GENERATE(Io::own_thread, Io::in_poll);
  CAPTURE(transport, io == Io::in_poll);
  const auto named = transport::names();
  if (std::find(named.begin(), named.end(), transport) == named.end()) return;
  fail_no_call();
  std::optional<Server> server;
  {
    const ServerSide here;
    Options options;
    options.listen.port = 0;
    options.listen.transport = [&](transport::TransportOptions t) { return transport::make_named(transport, std::move(t)); };
    options.threads.io = io;
    options.limits.reserved_connections = 4;
    server.emplace(Server::create(options).value());
  }
  const auto step = [&] {
    const ServerSide here;
    server->poll();
  };
  const std::string request = "GET /\nHost: localhost:" + std::to_string(server->port());
  Socket idle(server->port());  // its connection keeps its descriptor
  CHECK(idle.ask(request, step).status == 200);

  constexpr std::size_t clients = 12;
  std::vector<int> sockets;
  for (std::size_t i = 0; i < clients; ++i) sockets.push_back(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  rlimit before{};
  ::getrlimit(RLIMIT_NOFILE, &before);
  rlimit low = before;
  low.rlim_cur = static_cast<rlim_t>(sockets.back()) + 8;
  REQUIRE(::setrlimit(RLIMIT_NOFILE, &low) == 0);
  std::vector<int> used;
  for (int descriptor = 0; (descriptor = ::open("/dev/null", O_RDONLY | O_CLOEXEC)) >= 0;) used.push_back(descriptor);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(server->port());
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  std::size_t connected = 0;
  const std::string text = "GET / HTTP/1.1\r\nHost: localhost:" + std::to_string(server->port()) + "\r\n\r\n";
  for (const int socket : sockets) {
    connected += ::connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
    ::send(socket, text.data(), text.size(), MSG_NOSIGNAL);
  }
  const std::size_t accepts = calls_of("accept"), polls = calls_of("poll") + calls_of("epoll_wait");
  // A server that spins makes some 100,000 of each in this time.
  for (const auto end = steady_clock::now() + milliseconds(300); steady_clock::now() < end;) {
    if (io == Io::in_poll) step();
    std::this_thread::sleep_for(milliseconds(1));
  }
  const std::size_t more_accepts = calls_of("accept") - accepts, more_polls = calls_of("poll") + calls_of("epoll_wait") - polls;
  // A client is served with a descriptor of the reserve.
  std::vector<pollfd> items;
  for (const int socket : sockets) items.push_back({socket, POLLIN, 0});
  for (const auto end = steady_clock::now() + seconds(10); ::poll(items.data(), items.size(), 0) == 0 && steady_clock::now() < end;) step();
  const bool is_answered = ::poll(items.data(), items.size(), 0) > 0;
  for (const int descriptor : used) ::close(descriptor);
  REQUIRE(::setrlimit(RLIMIT_NOFILE, &before) == 0);
  CHECK(connected == clients);
  CHECK(is_answered);
  CHECK(more_accepts < 2000);
  CHECK(more_polls < 5000);

  // Each client gets a response or the end of its connection.
  std::size_t served = 0;
  const auto end = steady_clock::now() + seconds(20);
  for (const int socket : sockets) {
    char byte = 0;
    ssize_t got = -1;
    while ((got = ::recv(socket, &byte, 1, MSG_DONTWAIT)) < 0 && errno == EAGAIN && steady_clock::now() < end) step();
    served += got >= 0 || errno == ECONNRESET;
    ::close(socket);
  }
  CHECK(served == clients);
  CHECK(Socket(server->port()).ask(request, step).status == 200);
  const ServerSide here;
  server.reset();
}

/// Of the places, so many are passed over. LRT_ATTACK_STRIDE=1 tries each.
static std::size_t stride() {
  const char* const text = std::getenv("LRT_ATTACK_STRIDE");
  return std::max<std::size_t>(1, text ? std::strtoul(text, nullptr, 10) : 97);
}

TEST_CASE("a system call fails once at any place of a server's life", "[attack][calls]") {
  for (const std::string_view name : transport::names())
    for (const Io io : {Io::own_thread, Io::in_poll}) play_all({std::string(name), io}, stride());
}

TEST_CASE("a system call fails once at any place of a server's life with TLS", "[attack][calls][tls]") {
  const Certificate authority = make_certificate({"authority", "", -3600, 3600, true});
  const Certificate own = make_certificate({"robot", "DNS:localhost,IP:127.0.0.1"}, &authority);
  const TlsFolder files;
  files.put("server.pem", {&own});
  files.put_key("server.key", own);
  const SslContext client = tls_client(authority);
  for (const std::string_view name : transport::names()) play_all({std::string(name), Io::own_thread, &files, client.get()}, stride());
}
