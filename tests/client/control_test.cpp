// SPDX-License-Identifier: Apache-2.0
// Client::control() with a server and with holders that are processes of their own: killed, stopped, taken over from.

#include <lrt/client/control.hpp>

#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/client.hpp>
#include <lrt/lrt.hpp>

#include "tests/client/robot_host.hpp"
#include "tests/support/catch.hpp"

namespace {

using namespace lrt;
using namespace lrt::test;
using std::chrono::milliseconds;
using std::chrono::seconds;

bool comes_true(const std::function<bool()>& condition) {
  const auto end = std::chrono::steady_clock::now() + seconds(30);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(milliseconds(2));
  }
  return true;
}

struct Base {
  Base()
      : host([this] {
          Thing thing{"base"};
          thing.control();
          auto drive = thing.property<double>("drive");
          drive.on_write([this](double value) { speed = value; });
          drive.expires(milliseconds(300), [this] { speed = 0, ++lapses; });
          drive.publish(0);
          return one_thing(std::move(thing));
        }()) {}
  std::string url(const std::string& path = "base") const { return host.url() + path; }
  bool is_held() {
    const auto shown = watcher.send({"GET", url("base/control"), {{"Accept", "application/json"}}, {}});
    return shown && shown->body.find("\"held\":true") != std::string::npos;
  }

  std::atomic<double> speed{0};
  std::atomic<int> lapses{0};
  RobotHost host;
  Client watcher = Client::create().value();
};

int put(Client& client, const std::string& url, const std::string& value) {
  const auto response = client.send({"PUT", url, {{"Content-Type", "application/json"}}, value});
  return response ? response->status : 0;
}

/// A holder in a process of its own: it takes control of what it is told, and drives while it has control.
class HolderProcess {
 public:
  HolderProcess() {
    REQUIRE(::pipe(to_) == 0);
    REQUIRE(::pipe(from_) == 0);
    pid_ = ::fork();
    REQUIRE(pid_ >= 0);
    if (pid_ == 0) run();
    ::close(to_[0]);
    ::close(from_[1]);
  }
  ~HolderProcess() {
    send(SIGCONT);
    send(SIGKILL);
    ::waitpid(pid_, nullptr, 0);
    ::close(to_[1]);
    ::close(from_[0]);
  }
  HolderProcess(const HolderProcess&) = delete;
  HolderProcess& operator=(const HolderProcess&) = delete;

  void take(const std::string& thing) { REQUIRE(::write(to_[1], (thing + "\n").data(), thing.size() + 1) == static_cast<ssize_t>(thing.size() + 1)); }
  void send(int signal) const { ::kill(pid_, signal); }
  /// The next letter that it reports: h held, l lost, e error; '-': none within 30 s.
  char report() const {
    pollfd item{from_[0], POLLIN, 0};
    char letter = '-';
    if (::poll(&item, 1, 30'000) == 1 && ::read(from_[0], &letter, 1) != 1) letter = '-';
    return letter;
  }

 private:
  [[noreturn]] void run() {
    const auto say = [this](char letter) {
      if (::write(from_[1], &letter, 1) != 1) ::_exit(1);
    };
    std::string thing;
    for (char c = 0; ::read(to_[0], &c, 1) == 1 && c != '\n';) thing += c;
    Client client = Client::create().value();
    client::ControlOptions options;
    options.life = seconds(1);
    options.name = "holder";
    auto control = client.control(thing, options);
    say(control ? 'h' : 'e');
    while (control && control->is_held()) {
      put(client, thing + "/drive", "0.5");
      std::this_thread::sleep_for(milliseconds(50));
    }
    say('l');
    while (true) ::pause();
  }
  int to_[2]{}, from_[2]{};
  pid_t pid_ = -1;
};

}  // namespace

TEST_CASE("a client takes control, renews it, commands, and gives it back when the lease is destroyed", "[client]") {
  Base base;
  Client client = Client::create().value();
  client::ControlOptions options;
  options.life = seconds(1);
  options.name = "anna";
  {
    auto control = client.control(base.url(), options).value();
    CHECK(control.is_held());
    CHECK(control.id().size() == 32);
    CHECK(control.url() == base.url("base/control"));
    const auto first = control.until();
    CHECK(put(client, base.url("base/drive"), "0.5") == 204);
    CHECK(put(base.watcher, base.url("base/drive"), "0.6") == 409);
    // Longer than its life.
    CHECK(comes_true([&] { return control.until() > first + seconds(1); }));
    CHECK(control.is_held());
    CHECK(put(client, base.url("base/drive"), "0.5") == 204);
    const auto refused = base.watcher.control(base.url(), options);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == Errc::refused);
    CHECK(refused.error().message.find("\"anna\" has control") != std::string::npos);
  }
  CHECK_FALSE(base.is_held());
  CHECK(put(base.watcher, base.url("base/drive"), "0.6") == 204);
  CHECK(put(client, base.url("base/drive"), "0.6") == 204);
}

TEST_CASE("who loses control by a take-over is told, once, and why", "[client]") {
  Base base;
  client::Options in_background;
  in_background.callbacks = client::Callbacks::in_background;
  Client client = Client::create(in_background).value();
  client::ControlOptions options;
  options.life = seconds(1);
  std::atomic<int> told{0};
  std::string why;
  auto control = client.control(base.url(), options, [&](const Error& error) { why = error.message, ++told; }).value();
  options.take_over = true;
  options.name = "bert";
  auto other = base.watcher.control(base.url(), options).value();
  CHECK(comes_true([&] { return told > 0; }));
  CHECK(why.find("\"bert\" has control") != std::string::npos);
  CHECK_FALSE(control.is_held());
  CHECK(control.why_lost().code == Errc::refused);
  CHECK(put(client, base.url("base/drive"), "0.5") == 409);
  control.give_back();
  CHECK(other.is_held());
  CHECK(base.is_held());
  CHECK(told == 1);
}

TEST_CASE("who cannot reach the robot knows in time that control is lost", "[client]") {
  std::optional<Base> base(std::in_place);
  Client client = Client::create().value();
  client::ControlOptions options;
  options.life = seconds(1);
  int told = 0;
  auto control = client.control(base->url(), options, [&](const Error& error) { told += error.code == Errc::timed_out ? 1 : 0; }).value();
  base.reset();
  CHECK(comes_true([&] { return !control.is_held(); }));
  CHECK(comes_true([&] { return client.poll(), told == 1; }));
}

TEST_CASE("what has no control, and odd options, are errors", "[client]") {
  Thing plain{"plain"};
  plain.property("x", [] { return 1; });
  RobotHost host(one_thing(std::move(plain)));
  Client client = Client::create().value();
  CHECK(client.control(host.url() + "plain").error().code == Errc::unknown_path);
  CHECK(client.control(host.url() + "nothing").error().code == Errc::unknown_path);
  client::ControlOptions options;
  for (const int ms : {0, 999, 60'001}) {
    options.life = milliseconds(ms);
    CHECK(client.control(host.url() + "plain", options).error().code == Errc::invalid_option);
  }
  CHECK_FALSE(client::Control().is_held());
}

TEST_CASE("a holder that is killed loses control and its drive command within their lives", "[client]") {
  HolderProcess holder;  // before there are threads
  Base base;
  holder.take(base.url());
  REQUIRE(holder.report() == 'h');
  REQUIRE(comes_true([&] { return base.speed == 0.5; }));
  CHECK(base.is_held());
  CHECK(put(base.watcher, base.url("base/drive"), "0.7") == 409);
  holder.send(SIGKILL);
  CHECK(comes_true([&] { return base.speed == 0; }));
  CHECK(base.lapses >= 1);
  CHECK(comes_true([&] { return !base.is_held(); }));
  CHECK(put(base.watcher, base.url("base/drive"), "0.7") == 204);
}

TEST_CASE("a holder that was stopped knows that it has lost control, and cannot command any more", "[client]") {
  HolderProcess holder;
  Base base;
  holder.take(base.url());
  REQUIRE(holder.report() == 'h');
  REQUIRE(comes_true([&] { return base.speed == 0.5; }));
  holder.send(SIGSTOP);
  CHECK(comes_true([&] { return base.speed == 0; }));
  CHECK(comes_true([&] { return !base.is_held(); }));
  client::ControlOptions options;
  options.name = "bert";
  auto control = base.watcher.control(base.url(), options).value();
  CHECK(put(base.watcher, base.url("base/drive"), "0") == 204);
  holder.send(SIGCONT);
  CHECK(holder.report() == 'l');
  CHECK(base.speed == 0);
  CHECK(control.is_held());
}

TEST_CASE("no lease survives a restart of the server, and its holder is told", "[client]") {
  const auto make = [](std::uint16_t port) {
    Options options;
    options.listen.port = port;
    options.threads.dispatch = Dispatch::io_thread;
    Server server = Server::create(std::move(options)).value();
    Thing thing{"base"};
    thing.control();
    thing.property("drive", [] { return 0.0; }).on_write([](double) {});
    server.add(std::move(thing)).value();
    return server;
  };
  std::optional<Server> server(make(0));
  const std::uint16_t port = server->port();
  const std::string url = server->url() + "base";
  Client client = Client::create().value(), other = Client::create().value();
  client::ControlOptions options;
  options.life = milliseconds(1'500);
  int told = 0;
  auto control = client.control(url, options, [&](const Error&) { ++told; }).value();
  CHECK(put(other, url + "/drive", "1") == 409);
  server.reset();
  server.emplace(make(port));
  CHECK(put(other, url + "/drive", "1") == 412);  // it was for the run before; the response has the time of this one
  CHECK(put(other, url + "/drive", "1") == 204);
  CHECK(comes_true([&] { return !control.is_held(); }));
  CHECK(comes_true([&] { return client.poll(), told > 0; }));
  CHECK(told == 1);
  CHECK(other.control(url, options).has_value());
}
