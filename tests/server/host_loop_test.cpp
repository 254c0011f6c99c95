// SPDX-License-Identifier: Apache-2.0
#include <lrt/transport/asio_loop.hpp>

#include <poll.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/server.hpp>

#include "tests/support/catch.hpp"
#include "tests/support/descriptors.hpp"
#include "tests/support/socket.hpp"
#include "tests/support/websocket.hpp"

#if LRT_HAS_ASIO_LOOP
#include <boost/asio/buffer.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#endif

using namespace lrt;
using namespace lrt::test;
using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

namespace {

std::size_t threads() {
  const std::filesystem::directory_iterator tasks("/proc/self/task");
  return static_cast<std::size_t>(std::distance(begin(tasks), end(tasks)));
}

/// A joint whose every part needs the host.
struct Joint {
  explicit Joint(Server& server) {
    Thing thing{"joint"};
    thing.property("angle", [this] { return ++reads, angle; }).on_write([this](double value) { angle = value; });
    thing.action("home", [this](Responder done) {
      angle = 0;
      done.succeed();
    });
    thing.action("act", [this] {
      if (act) act();
    });
    temperature = thing.property<double>("temperature");
    server.add(std::move(thing)).value();
  }
  double angle = 1.5;
  int reads = 0;
  std::function<void()> act;
  std::optional<PushedProperty<double>> temperature;
};

constexpr const char* new_angle = "\nContent-Type: text/turtle\n\n<> <http://vocab.arvida.de/2015/06/vom/vocab#numericalValue> 2.5e0 .";

}  // namespace

// --------------------------------------------------------------------------------------------- a host that sleeps on the descriptor

namespace {

/// Sleeps until something is to be done, and nothing else makes it go on.
void sleep_on(Server& server) {
  pollfd item{server.descriptor(), POLLIN, 0};
  REQUIRE(item.fd >= 0);
  REQUIRE(::poll(&item, 1, 60'000) == 1);
  REQUIRE((item.revents & POLLIN) != 0);
  server.poll();
}

}  // namespace

TEST_CASE("a host that sleeps on the descriptor runs lambdas when they are due", "[server]") {
  const Io io = GENERATE(Io::in_poll, Io::own_thread);
  Options options;
  options.listen.port = 0;
  options.threads.io = io;
  Server server = Server::create(std::move(options)).value();
  Joint joint(server);
  std::vector<int> statuses;
  std::string body;
  std::atomic<bool> done{false};
  std::thread client([&] {
    const std::string host = "\nHost: 127.0.0.1:" + std::to_string(server.port());
    try {
      Socket socket(server.port());
      for (int i = 0; i < 20; ++i) statuses.push_back(socket.ask("GET /joint/angle" + host).status);
      statuses.push_back(socket.ask("PUT /joint/angle" + host + new_angle).status);
      statuses.push_back(socket.ask("POST /joint/actions/act" + host).status);
      body = socket.ask("GET /joint/angle" + host).body;
    } catch (const std::exception& e) { body = e.what(); }
    done = true;
    server.wake();
  });
  int acted = 0;
  joint.act = [&] { ++acted; };
  while (!done) sleep_on(server);
  client.join();
  REQUIRE(statuses.size() == 22);
  for (std::size_t i = 0; i < 20; ++i) CHECK(statuses[i] == 200);
  CHECK(statuses[20] == 204);
  CHECK(statuses[21] == 204);
  CHECK(acted == 1);
  CHECK(joint.angle == 2.5);
  CHECK(body.find("2.5") != std::string::npos);
}

TEST_CASE("the descriptor shows what one poll has left of the lambdas", "[server]") {
  const Io io = GENERATE(Io::in_poll, Io::own_thread);
  Options options;
  options.listen.port = 0;
  options.threads.io = io;
  Server server = Server::create(std::move(options)).value();
  Joint joint(server);
  int acted = 0;
  joint.act = [&] { ++acted; };
  const std::string host = "\nHost: 127.0.0.1:" + std::to_string(server.port());
  std::vector<std::unique_ptr<Socket>> clients;
  for (int i = 0; i < 10; ++i) {
    clients.push_back(std::make_unique<Socket>(server.port()));
    clients.back()->send("POST /joint/actions/act" + host);
  }
  while (acted < 10) {
    pollfd item{server.descriptor(), POLLIN, 0};
    REQUIRE(::poll(&item, 1, 60'000) == 1);
    server.poll(microseconds(0));  // one lambda at most
  }
  for (auto& client : clients) CHECK(client->await([&] { server.poll(); }).status == 204);
}

// ------------------------------------------------------------------------------------------------------------ a host's io_context

#if LRT_HAS_ASIO_LOOP

namespace {

namespace asio = boost::asio;
using boost::system::error_code;

Options on(asio::io_context& io) {
  Options options;
  options.listen.port = 0;
  options.threads.io = Io::in_poll;
  options.listen.transport = [&io](transport::TransportOptions given) { return transport::make_http(std::move(given), io); };
  return options;
}

/// A client on the same io_context: sends what it is given and collects what comes.
class Visitor {
 public:
  Visitor(asio::io_context& io, std::uint16_t port) : socket_(io) {
    socket_.connect({asio::ip::address_v4::loopback(), port});
    read();
  }
  void say(std::string bytes) {
    out_ = std::move(bytes);
    asio::async_write(socket_, asio::buffer(out_), [](const error_code&, std::size_t) {});
  }
  /// Calls `then` with the response to an HTTP request.
  void ask(const std::string& line, std::string more, std::function<void(int status, std::string body)> then) {
    then_ = std::move(then);
    const auto at = more.find("\r\n\r\n");
    const std::string body = at == std::string::npos ? "" : more.substr(at + 4);
    more = more.substr(0, at);
    say(line + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(socket_.remote_endpoint().port()) +
        "\r\nContent-Length: " + std::to_string(body.size()) + "\r\n" + more + (more.empty() ? "" : "\r\n") + "\r\n" + body);
  }
  void close() { socket_.close(); }

  std::string in;
  std::function<void()> on_bytes;
  bool ended = false;

 private:
  void read() {
    socket_.async_read_some(asio::buffer(buffer_), [this](const error_code& error, std::size_t size) {
      if (error == asio::error::operation_aborted) return;
      ended = !!error;
      in.append(buffer_, size);
      if (then_) answer();
      if (on_bytes) on_bytes();
      if (!ended && socket_.is_open()) read();
    });
  }
  void answer() {
    const auto end = in.find("\r\n\r\n");
    if (end == std::string::npos) return;
    const auto length = in.find("Content-Length: ");
    const auto size = end + 4 + (length < end ? std::strtoul(in.c_str() + length + 16, nullptr, 10) : 0);
    if (in.size() < size) return;
    const int status = std::atoi(in.c_str() + 9);
    auto body = in.substr(end + 4, size - end - 4);
    in.erase(0, size);
    std::exchange(then_, {})(status, std::move(body));
  }

  asio::ip::tcp::socket socket_;
  std::string out_;
  char buffer_[4096];
  std::function<void(int, std::string)> then_;
};

/// Has the same response for every request.
struct Handler final : engine::Handler {
  engine::Outcome handle(const http::Request&, TimePoint) override {
    ++requests;
    return http::Response{};
  }
  std::optional<engine::Reply> next_reply(TimePoint) override { return std::nullopt; }
  std::optional<std::chrono::steady_clock::time_point> next_deadline() const override { return std::nullopt; }
  void abandon(engine::Ticket) noexcept override {}
  std::optional<engine::Channel> next_ready(TimePoint) override { return std::nullopt; }
  std::optional<engine::Push> next_push(engine::Channel, TimePoint) override { return std::nullopt; }
  void closed(engine::Channel) noexcept override {}
  int requests = 0;
};

/// Runs until there is nothing left to wait for; false: that did not come within a minute.
bool run_out(asio::io_context& io) {
  io.run_for(seconds(60));
  return io.stopped();
}

}  // namespace

TEST_CASE("a server on a host's io_context needs Io::in_poll", "[server]") {
  asio::io_context io;
  Options options = on(io);
  options.threads.io = Io::own_thread;
  const Result<Server> server = Server::create(std::move(options));
  REQUIRE_FALSE(server);
  CHECK(server.error().code == Errc::invalid_option);
  CHECK(run_out(io));
}

TEST_CASE("the thread that runs the io_context serves, calls lambdas and its own handlers, without a thread of lrt", "[server][R0.12]") {
  asio::io_context io;
  const auto threads_before = threads();
  Server server = Server::create(on(io)).value();
  Joint joint(server);
  joint.temperature->publish(20);
  int acted = 0;
  joint.act = [&] { ++acted; };

  int ticks = 0;
  bool over = false;
  asio::steady_timer timer(io);
  std::function<void()> tick = [&] {
    timer.expires_after(milliseconds(1));
    timer.async_wait([&](const error_code& error) {
      if (error || over) return;  // cancel() does not reach a handler that waits for its turn
      ++ticks;
      tick();
    });
  };
  tick();

  Visitor visitor(io, server.port()), watcher(io, server.port());
  std::vector<int> statuses;
  std::string pulled;
  std::vector<Frame> frames;
  FrameReader reader;
  std::string head;
  std::size_t threads_within = 0;
  const auto end = [&] {
    threads_within = threads();
    visitor.close();
    watcher.close();
    over = true;
    timer.cancel();
    server.stop();
  };
  watcher.on_bytes = [&] {
    if (head.empty()) {
      const auto found = watcher.in.find("\r\n\r\n");
      if (found == std::string::npos) return;
      head = watcher.in.substr(0, found + 4);
      watcher.in.erase(0, found + 4);
      joint.temperature->publish(21.25);
    }
    std::string_view rest = watcher.in;
    bool seen = false;
    for (Frame frame; reader.next(rest, frame);) {
      seen = seen || frame.payload.find("21.25") != std::string::npos;
      frames.push_back(frame);
    }
    watcher.in.erase(0, watcher.in.size() - rest.size());
    if (seen) end();
  };
  const auto watch = [&] {
    watcher.say("GET /joint/temperature HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(server.port()) +
                "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: " +
                std::string(WebSocketClient::key) + "\r\n\r\n");
  };
  const std::string body = std::string("Content-Type: text/turtle\r\n\r\n") + std::string(new_angle).substr(std::string(new_angle).find("\n\n") + 2);
  visitor.ask("GET /joint/angle", "", [&](int status, std::string text) {
    statuses.push_back(status);
    pulled = std::move(text);
    visitor.ask("PUT /joint/angle", body, [&](int put, const std::string&) {
      statuses.push_back(put);
      visitor.ask("POST /joint/actions/act", "", [&](int post, const std::string&) {
        statuses.push_back(post);
        visitor.ask("GET /joint", "", [&](int get, const std::string&) {
          statuses.push_back(get);
          watch();
        });
      });
    });
  });
  REQUIRE(run_out(io));
  CHECK(statuses == std::vector<int>{200, 204, 204, 200});
  CHECK(pulled.find("1.5") != std::string::npos);
  CHECK(joint.angle == 2.5);
  CHECK(acted == 1);
  CHECK(head.rfind("HTTP/1.1 101 ", 0) == 0);
  CHECK(head.find("Sec-WebSocket-Accept: " + accept_of(WebSocketClient::key)) != std::string::npos);
  CHECK(frames.size() >= 1);
  CHECK(threads_within <= threads_before);  // one of an earlier test may not have quite gone
}

TEST_CASE("the host's timers are served while clients keep the server busy", "[server]") {
  asio::io_context io;
  Server server = Server::create(on(io)).value();
  Joint joint(server);
  std::vector<std::unique_ptr<Visitor>> visitors;
  int answers = 0, ticks = 0;
  asio::steady_timer timer(io);
  std::function<void()> tick = [&] {
    timer.expires_after(microseconds(0));
    timer.async_wait([&](const error_code&) {
      if (++ticks < 100) return tick();
      for (auto& visitor : visitors) visitor->close();
      server.stop();
    });
  };
  std::function<void(Visitor&)> again = [&](Visitor& visitor) {
    visitor.ask("GET /joint/angle", "", [&](int status, const std::string&) {
      CHECK(status == 200);
      if (++answers == 1) tick();
      again(visitor);  // never stops by itself
    });
  };
  for (int i = 0; i < 8; ++i) again(*visitors.emplace_back(std::make_unique<Visitor>(io, server.port())));
  REQUIRE(run_out(io));
  CHECK(ticks == 100);
  CHECK(answers > 8);
}

TEST_CASE("what one turn leaves over is done in the next, though nothing new arrives", "[server]") {
  asio::io_context io;
  std::unique_ptr<transport::Transport> transport;
  Handler handler;
  int turns = 0, thrown = 0, logged = 0;
  transport::TransportOptions options;
  options.port = 0;
  options.log = [&](LogLevel level, std::string_view) { logged += level == LogLevel::error; };
  options.turn = [&] {
    ++turns;
    transport->poll(microseconds(0), milliseconds(0));  // one step
    if (turns == 3) {
      ++thrown;
      throw 7;
    }
  };
  transport = transport::make_http(options, io);
  CHECK(transport->capabilities().on_host_loop);
  CHECK(transport->capabilities().websocket);
  CHECK(transport->descriptor() == -1);
  REQUIRE(transport->start(handler));
  CHECK(transport->descriptor() >= 0);
  CHECK(transport->reload_tls().error().code == Errc::invalid_option);
  std::vector<std::unique_ptr<Socket>> clients;
  for (int i = 0; i < 20; ++i) {
    clients.push_back(std::make_unique<Socket>(transport->port()));
    clients.back()->send("GET /");
  }
  const auto until = std::chrono::steady_clock::now() + seconds(60);
  while (handler.requests < 20 && std::chrono::steady_clock::now() < until) io.run_one_for(seconds(1));
  CHECK(handler.requests == 20);
  CHECK(turns > 20);
  CHECK(thrown == 1);
  CHECK(logged == 1);
  for (auto& client : clients) CHECK(client->await().status == 200);
  clients.clear();
  transport->stop();
  CHECK(transport->descriptor() == -1);
  CHECK(run_out(io));

  // and once more on the same io_context
  REQUIRE(transport->start(handler));
  Socket client(transport->port());
  client.send("GET /");
  io.restart();
  while (handler.requests < 21 && std::chrono::steady_clock::now() < until) io.run_one_for(seconds(1));
  CHECK(client.await().status == 200);
  transport.reset();
  CHECK(run_out(io));
}

TEST_CASE("a transport on a host's io_context says that it needs a turn", "[server]") {
  asio::io_context io;
  const auto transport = transport::make_http(transport::TransportOptions{}, io);
  Handler handler;
  const auto started = transport->start(handler);
  REQUIRE_FALSE(started);
  CHECK(started.error().code == Errc::invalid_option);
}

TEST_CASE("stop ends the host's run, from wherever it is called", "[server]") {
  asio::io_context io;
  Server server = Server::create(on(io)).value();
  Joint joint(server);
  SECTION("before anything has happened") {
    server.stop();
    CHECK(run_out(io));
  }
  SECTION("from a handler of the host's") {
    asio::post(io, [&] { asio::post(io, [&] { server.stop(); }); });
    CHECK(run_out(io));
  }
  SECTION("from a lambda") {
    joint.act = [&] { server.stop(); };
    Visitor visitor(io, server.port());
    int status = 0;
    visitor.ask("POST /joint/actions/act", "", [&](int s, const std::string&) { status = s; });
    CHECK(run_out(io));
    CHECK(status != 0);  // 204 or 503: there was a response
    CHECK(visitor.ended);
  }
  SECTION("from a lambda that is run where the request is read") {
    Options options = on(io);
    options.threads.dispatch = Dispatch::io_thread;
    Server other = Server::create(std::move(options)).value();
    Joint second(other);
    second.act = [&] {
      other.stop();
      server.stop();
    };
    Visitor visitor(io, other.port());
    visitor.ask("POST /joint/actions/act", "", [&](int, const std::string&) {});
    CHECK(run_out(io));
    CHECK(visitor.ended);
  }
  SECTION("from another thread, while nothing happens") {
    std::thread stopper([&] { server.stop(); });
    CHECK(run_out(io));
    stopper.join();
  }
  SECTION("from another thread, in the middle of things") {
    Visitor visitor(io, server.port());
    std::atomic<int> answers{0};
    std::function<void()> again = [&] {
      visitor.ask("GET /joint/angle", "", [&](int, const std::string&) {
        ++answers;
        again();
      });
    };
    again();
    std::thread stopper([&] {
      while (answers < 3) std::this_thread::yield();
      server.stop();
    });
    CHECK(run_out(io));
    stopper.join();
    CHECK(visitor.ended);
  }
  SECTION("by the destructor") {
    auto other = std::make_unique<Server>(Server::create(on(io)).value());
    asio::post(io, [&] {
      other.reset();
      server.stop();
    });
    CHECK(run_out(io));
  }
  CHECK(run_out(io));
}

TEST_CASE("every descriptor of a server on a host's io_context is close-on-exec", "[server]") {
  boost::asio::io_context io;
  const auto before = descriptors(true);
  Server server = Server::create(on(io)).value();
  CHECK(descriptors(true) == before);
}

TEST_CASE("the io_context does not run out of work while a server lives on it", "[server]") {
  asio::io_context io;
  Server server = Server::create(on(io)).value();
  for (int i = 0; i < 100; ++i) {
    io.poll();
    REQUIRE_FALSE(io.stopped());
  }
  server.stop();
  CHECK(run_out(io));
}

TEST_CASE("a turn that is queued already when the transport goes does nothing", "[server]") {
  const bool destroyed = GENERATE(false, true);
  asio::io_context io;
  Handler handler;
  std::unique_ptr<transport::Transport> transport;
  int turns = 0;
  transport::TransportOptions options;
  options.port = 0;
  options.turn = [&] {
    ++turns;
    transport->poll(microseconds(100), milliseconds(0));
  };
  transport = transport::make_http(options, io);
  REQUIRE(transport->start(handler));
  for (int last = -1; last != turns;) last = turns, io.poll();
  const int before = turns;
  const Socket client(transport->port());  // the descriptor is readable
  // asio polls its descriptors, which queues the turn behind this; what that finds is:
  asio::post(io, [&] {
    transport->stop();
    if (destroyed) transport.reset();
  });
  CHECK(run_out(io));
  CHECK(turns == before);
}

TEST_CASE("several threads may run the io_context, and one lambda runs at a time", "[server]") {
  asio::io_context io;
  std::atomic<int> inside{0}, most{0};
  Server server = Server::create(on(io)).value();
  Joint joint(server);
  joint.act = [&] {
    const int now = ++inside;
    if (now > most) most = now;
    std::this_thread::yield();
    --inside;
  };
  std::vector<std::thread> runners;
  for (int i = 0; i < 4; ++i) runners.emplace_back([&] { io.run(); });
  std::vector<std::thread> clients;
  std::atomic<int> good{0};
  const std::string request = "POST /joint/actions/act\nHost: 127.0.0.1:" + std::to_string(server.port());
  for (int i = 0; i < 4; ++i)
    clients.emplace_back([&] {
      Socket socket(server.port());
      for (int n = 0; n < 25; ++n) good += socket.ask(request).status == 204;
    });
  for (auto& client : clients) client.join();
  server.stop();
  for (auto& runner : runners) runner.join();
  CHECK(good == 100);
  CHECK(most == 1);
}

#endif
