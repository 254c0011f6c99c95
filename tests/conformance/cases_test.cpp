// SPDX-License-Identifier: Apache-2.0
#include "tests/conformance/cases.hpp"

#include <algorithm>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include <lrt/server.hpp>
#include <lrt/transport/loopback.hpp>
#include <lrt/transport/named.hpp>

#include "examples/ex_own_transport/epoll_transport.hpp"

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"
#include "tests/support/skip.hpp"
#include "tests/support/socket.hpp"
#include "tests/support/tls_socket.hpp"

#if LRT_HAS_HTTPLIB
#include "tests/support/httplib_host.hpp"
#endif

using namespace lrt;
using namespace lrt::test;

namespace {

const std::vector<std::string> callback_receivers = {"127.0.0.1"};

/// Something that answers requests for one sample robot.
class Target {
 public:
  virtual ~Target() = default;
  virtual Answer ask(const std::string& request) = 0;
  /// The same for a request whose body is declared and not sent.
  virtual Answer ask_without_body(const std::string& request, std::size_t declared) = 0;
  virtual std::string host() const = 0;
  virtual bool secure() const { return false; }
  /// Of all paths of the robot.
  virtual std::string prefix() const { return ""; }
  /// Runs what the robot's state change has left to be done.
  virtual void settle() = 0;

  SampleRobot robot;
  FakeClock clock;
};

class EngineTarget final : public Target {
 public:
  EngineTarget() : bench_(options(clock)) {
    bench_.add(robot.arm());
    bench_.add(robot.tool());
  }
  Answer ask(const std::string& request) override { return bench_.ask(request); }
  Answer ask_without_body(const std::string& text, std::size_t declared) override {
    RequestText request(text);
    const auto verdict = bench_.engine.judge_header(request.get(), declared, clock.now());
    if (!verdict.response) throw std::runtime_error("the body was admitted by " + text);
    return Answer(*verdict.response);
  }
  std::string host() const override { return "localhost"; }
  void settle() override { bench_.run(); }

 private:
  static engine::EngineOptions options(const Clock& clock) {
    engine::EngineOptions o;
    o.clock = &clock;
    o.callbacks.allow = callback_receivers;
    o.read_origins = {"*"};
    o.allowed_origins = {"https://dashboard.example"};
    return o;
  }
  Bench bench_;
};

Options server_options(const Clock& clock) {
  Options o;
  o.listen.port = 0;
  o.threads.io = Io::in_poll;
  o.clock = &clock;
  o.ids = std::make_shared<FixedIds>();
  o.callbacks.allow = callback_receivers;
  o.security.read_origins = {"*"};
  o.security.allowed_origins = {"https://dashboard.example"};
  return o;
}

class LoopbackTarget final : public Target {
 public:
  LoopbackTarget() {
    Options o = server_options(clock);
    o.listen.transport = [this](transport::TransportOptions t) {
      auto made = std::make_unique<transport::Loopback>(std::move(t));
      loopback_ = made.get();
      return made;
    };
    server_ = std::make_unique<Server>(Server::create(std::move(o)).value());
    server_->add(robot.arm()).value();
    server_->add(robot.tool()).value();
  }
  Answer ask(const std::string& text) override {
    RequestText request(text);
    std::optional<Answer> answer;
    loopback_->submit(request.get(), [&](http::Response response) { answer = Answer(response); });
    for (int i = 0; i < 1000 && !answer; ++i) server_->poll();
    settle();
    if (!answer) throw std::runtime_error("no answer to " + text);
    return *answer;
  }
  /// There is no network that a body could be late on.
  Answer ask_without_body(const std::string& text, std::size_t declared) override { return ask(text + "\n\n" + std::string(declared, ' ')); }
  std::string host() const override { return "localhost:0"; }
  void settle() override {
    for (int i = 0; i < 3; ++i) server_->poll();
  }

 private:
  transport::Loopback* loopback_ = nullptr;
  std::unique_ptr<Server> server_;
};

struct Served {
  std::function<std::unique_ptr<transport::Transport>(transport::TransportOptions)> make;
  bool tls;
};

/// By its name in src/README.md; nullopt if it has not been compiled in.
std::optional<Served> served(const std::string& name) {
  const bool tls = name.find(" over TLS") != std::string::npos;
  const std::string plain = name.substr(0, name.find(" over TLS"));
  const auto names = transport::names();
  if (const auto found = std::find(names.begin(), names.end(), plain); found != names.end())
    return Served{[name = *found](transport::TransportOptions o) { return transport::make_named(name, std::move(o)); }, tls};
  if (name == "a transport of one's own") return Served{make_epoll_transport, false};
  return std::nullopt;
}

/// The certificate that every server over TLS shows here, and a client that trusts it.
struct TlsSide {
  TlsFolder folder;
  Certificate authority = make_certificate({"authority", {}, -3600, 3600, true});
  Certificate own = make_certificate({"robot", "DNS:localhost,IP:127.0.0.1"}, &authority);
  SslContext client = tls_client(authority);
  transport::TlsOptions options;

  TlsSide() {
    options.certificate_file = folder.put("server.pem", {&own});
    options.key_file = folder.put_key("server-key.pem", own);
  }
  static TlsSide& get() {
    static TlsSide made;
    return made;
  }
};

class SocketTarget final : public Target {
 public:
  explicit SocketTarget(const Served& served) : tls_(served.tls) {
    Options o = server_options(clock);
    o.listen.transport = served.make;
    if (tls_) o.security.tls = TlsSide::get().options;
    server_ = std::make_unique<Server>(Server::create(std::move(o)).value());
    server_->add(robot.arm()).value();
    server_->add(robot.tool()).value();
  }
  /// One connection for all of a case, as far as the server keeps it.
  Answer ask(const std::string& text) override {
    if (!client_) client_ = std::make_unique<Socket>(server_->port(), tls_ ? std::make_unique<TlsLayer>(TlsSide::get().client.get()) : nullptr);
    Answer answer = client_->ask(text, [this] { server_->poll(); });
    if (answer.field("Connection") == "close") client_.reset();
    settle();
    return answer;
  }
  Answer ask_without_body(const std::string& text, std::size_t declared) override {
    Answer last;
    for (const bool expects : {true, false}) {
      Socket client(server_->port(), tls_ ? std::make_unique<TlsLayer>(TlsSide::get().client.get()) : nullptr);
      client.send_header(text, declared, expects);
      const Answer answer = client.await([this] { server_->poll(); });
      if (!expects && answer.status != last.status) throw std::runtime_error("with Expect: " + std::to_string(last.status));
      last = answer;
    }
    settle();
    return last;
  }
  std::string host() const override { return "127.0.0.1:" + std::to_string(server_->port()); }
  bool secure() const override { return tls_; }
  void settle() override {
    for (int i = 0; i < 3; ++i) server_->poll();
  }

 private:
  bool tls_;
  std::unique_ptr<Server> server_;
  std::unique_ptr<Socket> client_;
};

#if LRT_HAS_HTTPLIB
/// Mounted into a cpp-httplib server, below a prefix.
class HttplibTarget final : public Target {
 public:
  HttplibTarget() {
    Options o = server_options(clock);
    o.listen.transport = transport::no_network;
    server_ = std::make_unique<Server>(Server::create(std::move(o)).value());
    server_->add(robot.arm()).value();
    server_->add(robot.tool()).value();
    host_ = std::make_unique<HttplibHost>([this](httplib::Server& http_server) { mount(http_server, *server_, prefix()); });
  }
  Answer ask(const std::string& text) override {
    if (!client_) client_ = std::make_unique<Socket>(host_->port());
    Answer answer;
    try {
      answer = client_->ask(with_prefix(text), [this] { server_->poll(); });
    } catch (...) {
      client_.reset();  // the host's thread waits for it
      throw;
    }
    if (answer.field("Connection") == "close") client_.reset();
    settle();
    return answer;
  }
  /// Without `Expect: 100-continue`, to which cpp-httplib responds itself.
  Answer ask_without_body(const std::string& text, std::size_t declared) override {
    Socket client(host_->port());
    client.send_header(with_prefix(text), declared, false);
    const Answer answer = client.await([this] { server_->poll(); });
    settle();
    return answer;
  }
  std::string host() const override { return "127.0.0.1:" + std::to_string(host_->port()); }
  std::string prefix() const override { return "/robot"; }
  void settle() override {
    for (int i = 0; i < 3; ++i) server_->poll();
  }

 private:
  std::string with_prefix(std::string request) const {
    std::size_t path = request.find(' ') + 1;
    if (request.compare(path, 7, "http://") == 0) path = request.find('/', path + 7);
    if (request[path] == '/' && request.compare(path, prefix().size(), prefix()) != 0) request.insert(path, prefix());
    return request;
  }

  std::unique_ptr<Server> server_;
  std::unique_ptr<HttplibHost> host_;
  std::unique_ptr<Socket> client_;
};
#endif

/// Carries out a case and collects what was not as expected; one judgement for tests that assert and for counting.
class Run {
 public:
  Run(Target& target, const Case& c) : target_(target), case_(c) {
    words_["{host}"] = target.host(), words_["{base}"] = (target.secure() ? "https://" : "http://") + target.host() + target.prefix();
  }

  /// Empty if the case holds.
  std::string all() {
    try {
      for (const Step& step : case_.steps) {
        if (!step.set.empty()) set(step.set);
        else exchange(step);
      }
    } catch (const std::exception& e) { failures_ += std::string("threw: ") + e.what() + "\n"; }
    return failures_;
  }

 private:
  void set(const std::string& what) {
    SampleRobot& robot = target_.robot;
    const std::string name = what.substr(0, what.find(' ')), value = what.substr(what.find(' ') + 1);
    if (name == "angle") {
      robot.angle_handle->publish(std::stod(value));
    } else if (name == "count") {
      robot.count = std::stoi(value);
    } else if (name == "locked") {
      robot.locked = value != "0";
    } else if (name == "hot") {
      robot.hot = value != "0";
    } else if (name == "clock") {
      target_.clock.advance(std::chrono::milliseconds(std::stol(value)));
    } else if (name == "grip") {
      if (robot.grips.empty()) throw std::runtime_error("there is no open action: set " + what);
      Responder grip = std::move(robot.grips.back());
      robot.grips.pop_back();
      if (value == "progress") grip.progress(0.5), robot.grips.push_back(std::move(grip));
      else if (value == "succeed") grip.succeed();
      else if (value == "fail") grip.fail("it slipped");
      else if (value != "drop") throw std::runtime_error("unknown: set " + what);
    } else {
      throw std::runtime_error("unknown: set " + what);
    }
    target_.settle();
  }
  std::string filled(std::string text) const {
    for (const auto& [word, value] : words_)
      for (std::size_t at = 0; (at = text.find(word, at)) != std::string::npos; at += value.size()) text.replace(at, word.size(), value);
    return text;
  }
  void exchange(const Step& step) {
    std::string request = filled(step.request);
    if (request.find("\nHost: ") == std::string::npos) request.insert(std::min(request.find('\n'), request.size()), "\nHost: " + target_.host());
    const Answer answer = step.declared == 0 ? target_.ask(request) : target_.ask_without_body(request, step.declared);
    const std::size_t before = failures_.size();
    const auto expect = [&](bool holds, const std::string& what) {
      if (!holds) failures_ += "expected " + what + "\n";
    };
    expect(answer.status == step.status, std::to_string(step.status) + ", found " + std::to_string(answer.status));
    for (const auto& [name, pattern] : step.fields) {
      if (name[0] == '!') {
        expect(!answer.has(name.substr(1)), "no field " + name.substr(1));
      } else if (pattern[0] == '$' && words_.count(pattern) == 0) {
        expect(answer.has(name), "a field " + name);
        words_[pattern] = answer.field(name);
      } else {
        expect(fits(filled(pattern), answer.field(name)), name + ": " + filled(pattern));
      }
    }
    for (const std::string& text : step.texts) expect(answer.says(filled(text)), "the text " + filled(text));
    if (step.size >= 0) expect(answer.body.size() == static_cast<std::size_t>(step.size), std::to_string(step.size) + " bytes");
    const std::string base = words_.at("{base}") + "/";
    if (!step.triples.empty()) {
      const std::string lacks = missing(answer, filled(step.triples), base);
      expect(lacks.empty(), "the triples; missing: " + lacks);
    }
    if (!step.absent.empty()) expect(!missing(answer, filled(step.absent), base).empty(), "not all of the triples " + filled(step.absent));
    if (failures_.size() != before) failures_ += "of\n" + request + "\nwhich was answered\n" + answer.fields.block() + answer.body + "\n";
  }
  Target& target_;
  const Case& case_;
  std::string failures_;
  std::map<std::string, std::string> words_;
};

const std::vector<Case>& cases() {
  static const std::vector<Case> read = read_cases(LRT_SOURCE_DIR "/tests/conformance/cases.txt");
  return read;
}

/// The cases that a transport cannot carry, with the reason, from a file of lines `ID reason`.
std::map<std::string, std::string> read_exceptions(const std::string& path) {
  std::ifstream in(path);
  std::map<std::string, std::string> exceptions;
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#') continue;
    const std::size_t space = line.find(' ');
    if (space == std::string::npos || !exceptions.emplace(line.substr(0, space), line.substr(space + 1)).second)
      throw std::runtime_error(path + ": expected a case once, with a reason: " + line);
  }
  return exceptions;
}

template <class Make>
void run_cases(Make make, const std::map<std::string, std::string>& exceptions = {}) {
  REQUIRE(cases().size() >= 80);
  std::set<std::string> ids;
  for (const Case& c : cases()) {
    CHECK(ids.insert(c.id).second);
    if (exceptions.count(c.id) != 0) continue;
    DYNAMIC_SECTION(c.id << " [" << c.tags << "]") {
      const auto target = make();
      CHECK(Run(*target, c).all() == "");
    }
  }
}

/// Makes targets of a row of the table in src/README.md; empty if it has not been compiled in.
std::function<std::unique_ptr<Target>()> targets(const std::string& row) {
#if LRT_HAS_HTTPLIB
  if (row == "cpp-httplib") return [] { return std::make_unique<HttplibTarget>(); };
#endif
  if (const auto transport = served(row)) return [transport] { return std::make_unique<SocketTarget>(*transport); };
  return {};
}

/// How many cases hold.
std::size_t count_cases(const std::function<std::unique_ptr<Target>()>& make) {
  std::size_t passed = 0;
  for (const Case& c : cases()) {
    const auto target = make();
    passed += Run(*target, c).all().empty() ? 1 : 0;
  }
  return passed;
}

void run_served_cases(const std::string& row, const std::map<std::string, std::string>& exceptions = {}) {
  if (const auto make = targets(row)) run_cases(make, exceptions);
  else print_skip("not compiled in: " + row);
}

/// Whether each exception is needed.
void check_exceptions(const std::string& row, std::map<std::string, std::string> exceptions) {
  const auto make = targets(row);
  if (!make) {
    print_skip("not compiled in: " + row);
    return;
  }
  for (const Case& c : cases()) {
    if (exceptions.erase(c.id) == 0) continue;
    const auto target = make();
    INFO(c.id);
    CHECK(Run(*target, c).all() != "");
  }
  CHECK(exceptions.empty());
}

/// Rows of the Markdown table between these two lines, without its head; cells without white space around them.
std::vector<std::vector<std::string>> table(const std::string& path, const std::string& begin, const std::string& end) {
  std::ifstream in(path);
  std::vector<std::vector<std::string>> rows;
  std::string line;
  while (std::getline(in, line) && line != begin) {}
  while (std::getline(in, line) && line != end) {
    if (line.empty() || line[0] != '|') continue;
    rows.emplace_back();
    for (std::size_t at = 1; at < line.size();) {
      const std::size_t bar = std::min(line.find('|', at), line.size());
      const std::size_t first = std::min(line.find_first_not_of(' ', at), bar);
      const std::size_t last = line.find_last_not_of(' ', bar - 1) + 1;
      rows.back().push_back(line.substr(first, std::max(last, first) - first));
      at = bar + 1;
    }
  }
  if (line != end || rows.size() < 3) throw std::runtime_error(path + ": expected a table between " + begin + " and " + end);
  rows.erase(rows.begin(), rows.begin() + 2);
  return rows;
}

}  // namespace

TEST_CASE("the cases hold on the engine",
          "[conformance][R0.3][R0.4][R0.5][R0.6][R0.7][R0.8][R0.9][R0.10][R0.11][R0.12][R0.13]"
          "[R0.17][R1.1][R1.2][R1.3][R1.4][R1.5][R1.7][R1.8][R1.9][R1.10][R1.11]") {
  run_cases([] { return std::make_unique<EngineTarget>(); });
}

TEST_CASE("the cases hold on loopback", "[conformance][loopback]") {
  run_cases([] { return std::make_unique<LoopbackTarget>(); });
}

TEST_CASE("the cases hold on http", "[conformance][http]") { run_served_cases("http"); }
TEST_CASE("the cases hold on http over TLS", "[conformance][http][tls][R0.2]") { run_served_cases("http over TLS"); }
TEST_CASE("the cases hold on a transport of one's own", "[conformance][own]") { run_served_cases("a transport of one's own"); }

TEST_CASE("the cases hold on libwebsockets", "[conformance][libwebsockets]") { run_served_cases("libwebsockets"); }
TEST_CASE("the cases hold on libwebsockets over TLS", "[conformance][libwebsockets][tls][R0.2]") { run_served_cases("libwebsockets over TLS"); }

TEST_CASE("the cases hold mounted in cpp-httplib", "[conformance][httplib]") {
  run_served_cases("cpp-httplib", read_exceptions(LRT_SOURCE_DIR "/tests/conformance/cpp_httplib.txt"));
}
TEST_CASE("the cases that cpp-httplib cannot carry differ in fact", "[conformance][httplib]") {
  check_exceptions("cpp-httplib", read_exceptions(LRT_SOURCE_DIR "/tests/conformance/cpp_httplib.txt"));
}

TEST_CASE("a stop is published on every transport, and served when all connections are taken where those are limited",
          "[conformance][http][libwebsockets][own][tls][R0.6]") {
  const std::string row = GENERATE(as<std::string>(), "http", "http over TLS", "libwebsockets", "libwebsockets over TLS", "a transport of one's own");
  CAPTURE(row);
  const auto transport = served(row);
  if (!transport) {
    print_skip("not compiled in: " + row);
    return;
  }
  FakeClock clock;
  Options options = server_options(clock);
  options.listen.transport = transport->make;
  if (transport->tls) options.security.tls = TlsSide::get().options;
  options.limits.max_connections = 3;
  options.limits.reserved_connections = 2;
  options.limits.max_waiting_requests = 0;
  Server server = Server::create(std::move(options)).value();
  int stops = 0;
  Thing thing{"arm"};
  thing.property<double>("angle").publish(10);
  thing.action("go", [] {});
  thing.action("stop", [&stops] { ++stops; }).stop();
  server.add(std::move(thing)).value();
  const auto connection = [&] {
    return std::make_unique<Socket>(server.port(), transport->tls ? std::make_unique<TlsLayer>(TlsSide::get().client.get()) : nullptr);
  };
  const auto ask = [&](const std::string& request) { return connection()->ask(request, [&] { server.poll(); }); };
  const std::string base = (transport->tls ? "https://127.0.0.1:" : "http://127.0.0.1:") + std::to_string(server.port());
  const std::string host = "\nHost: 127.0.0.1:" + std::to_string(server.port());
  for (const char* path : {"/", "/arm"}) {
    const Answer answer = ask("GET " + std::string(path) + host);
    CHECK(missing(answer, "<" + base + path + "> lrt:stop <" + base + "/arm/actions/stop> .", base + "/") == "");
  }
  CHECK(missing(ask("GET /arm/actions/stop" + host), "<" + base + "/arm/actions/stop> a hybrit:Action, lrt:StopAction .", base + "/") == "");
  CHECK(ask("POST /arm/actions/stop" + host).status == 204);
  CHECK(stops == 1);
  if (row == "a transport of one's own") return;  // the example reserves no connection

  // Event streams take the connections, and clients that do not finish their requests the reserved ones.
  std::vector<std::unique_ptr<Socket>> others;
  for (int i = 0; i < 12; ++i) {
    others.push_back(connection());
    if (i < 3) others.back()->ask("GET /arm/angle" + host + "\nAccept: text/event-stream", [&] { server.poll(); });
    else others.back()->write("POST /arm/actions/stop HTTP/1.1\r\nHo");
    for (int turn = 0; turn < 10; ++turn) server.poll();
  }
  CHECK(ask("POST /arm/actions/go" + host).status == 503);
  for (int i = 0; i < 5; ++i) CHECK(ask("POST /arm/actions/stop" + host).status == 204);
  CHECK(stops == 6);
}

TEST_CASE("the table of transports in src/README.md is true", "[conformance][http][libwebsockets][own]") {
  const auto rows = table(LRT_SOURCE_DIR "/src/README.md", "<!-- conformance -->", "<!-- /conformance -->");
  std::set<std::string> names;
  for (const auto& row : rows) {
    REQUIRE(row.size() == 3);
    INFO(row[0] << ": " << row[1] << " of " << row[2]);
    CHECK(names.insert(row[0]).second);
    CHECK(row[2] == std::to_string(cases().size()));
    if (const auto make = targets(row[0])) CHECK(row[1] == std::to_string(count_cases(make)));
    else print_skip("not compiled in, so its row is not checked: " + row[0]);
  }
  CHECK(names ==
        std::set<std::string>{"http", "http over TLS", "libwebsockets", "libwebsockets over TLS", "a transport of one's own", "cpp-httplib"});
}

TEST_CASE("patterns of fields", "[conformance]") {
  CHECK(fits("", ""));
  CHECK(fits("a*c", "abbc"));
  CHECK(fits("*b*", "abc"));
  CHECK(fits("*", ""));
  CHECK_FALSE(fits("a", "ab"));
  CHECK_FALSE(fits("a*c", "ab"));
}
