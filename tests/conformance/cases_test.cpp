#include "tests/conformance/cases.hpp"

#include <functional>
#include <memory>

#include <lrt/server.hpp>
#include <lrt/transport/loopback.hpp>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"
#include "tests/support/socket.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

/// Something that answers requests for one sample robot.
class Target {
 public:
  virtual ~Target() = default;
  virtual Answer ask(const std::string& request) = 0;
  virtual std::string host() const = 0;
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
  std::string host() const override { return "localhost"; }
  void settle() override { bench_.run(); }

 private:
  static engine::Options options(const Clock& clock) {
    engine::Options o;
    o.clock = &clock;
    return o;
  }
  Bench bench_;
};

Options server_options(const Clock& clock) {
  Options o;
  o.port = 0;
  o.io = Io::in_poll;
  o.engine.clock = &clock;
  o.engine.ids = std::make_shared<FixedIds>();
  return o;
}

class LoopbackTarget final : public Target {
 public:
  LoopbackTarget() {
    Options o = server_options(clock);
    o.transport = [this](transport::Options t) {
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
  std::string host() const override { return "localhost:0"; }
  void settle() override {
    for (int i = 0; i < 3; ++i) server_->poll();
  }

 private:
  transport::Loopback* loopback_ = nullptr;
  std::unique_ptr<Server> server_;
};

class SocketTarget final : public Target {
 public:
  SocketTarget() {
    server_ = std::make_unique<Server>(Server::create(server_options(clock)).value());
    server_->add(robot.arm()).value();
    server_->add(robot.tool()).value();
    client_ = std::make_unique<Socket>(server_->port());  // one connection for all of a case
  }
  Answer ask(const std::string& text) override {
    Answer answer = client_->ask(text, [this] { server_->poll(); });
    settle();
    return answer;
  }
  std::string host() const override { return "127.0.0.1:" + std::to_string(server_->port()); }
  void settle() override {
    for (int i = 0; i < 3; ++i) server_->poll();
  }

 private:
  std::unique_ptr<Server> server_;
  std::unique_ptr<Socket> client_;
};

void set(Target& target, const std::string& what) {
  SampleRobot& robot = target.robot;
  const std::string name = what.substr(0, what.find(' ')), value = what.substr(what.find(' ') + 1);
  if (name == "angle") {
    robot.angle_handle->publish(std::stod(value));
  } else if (name == "count") {
    robot.count = std::stoi(value);
  } else if (name == "locked") {
    robot.locked = value != "0";
  } else if (name == "clock") {
    target.clock.advance(std::chrono::milliseconds(std::stol(value)));
  } else if (name == "grip") {
    REQUIRE_FALSE(robot.grips.empty());
    Responder grip = std::move(robot.grips.back());
    robot.grips.pop_back();
    if (value == "progress") grip.progress(0.5), robot.grips.push_back(std::move(grip));
    else if (value == "succeed") std::move(grip).succeed();
    else if (value == "fail") std::move(grip).fail("it slipped");
    else REQUIRE(value == "drop");
  } else {
    FAIL("unknown: set " << what);
  }
  target.settle();
}

class Run {
 public:
  Run(Target& target, const Case& c) : target_(target), case_(c) { words_["{host}"] = target.host(), words_["{base}"] = "http://" + target.host(); }

  void all() {
    for (const Step& step : case_.steps) {
      if (!step.set.empty()) set(target_, step.set);
      else exchange(step);
    }
  }

 private:
  std::string filled(std::string text) const {
    for (const auto& [word, value] : words_)
      for (std::size_t at = 0; (at = text.find(word, at)) != std::string::npos; at += value.size()) text.replace(at, word.size(), value);
    return text;
  }
  void exchange(const Step& step) {
    std::string request = filled(step.request);
    if (request.find("\nHost: ") == std::string::npos) request.insert(std::min(request.find('\n'), request.size()), "\nHost: " + target_.host());
    INFO(request);
    const Answer answer = target_.ask(request);
    INFO(answer.fields.block() << answer.body);
    CHECK(answer.status == step.status);
    for (const auto& [name, pattern] : step.fields) {
      INFO("field " << name << ": " << pattern);
      if (name[0] == '!') {
        CHECK_FALSE(answer.has(name.substr(1)));
      } else if (pattern[0] == '$' && words_.count(pattern) == 0) {
        REQUIRE(answer.has(name));
        words_[pattern] = answer.field(name);
      } else {
        CHECK(fits(filled(pattern), answer.field(name)));
      }
    }
    for (const std::string& text : step.texts) CHECK(answer.says(filled(text)));
    if (step.size >= 0) CHECK(answer.body.size() == static_cast<std::size_t>(step.size));
    const std::string base = words_.at("{base}") + "/";
    if (!step.triples.empty()) CHECK(missing(answer, filled(step.triples), base) == "");
    if (!step.absent.empty()) CHECK(missing(answer, filled(step.absent), base) != "");
  }
  Target& target_;
  const Case& case_;
  std::map<std::string, std::string> words_;
};

template <class T>
void run_cases() {
  static const std::vector<Case> cases = read_cases(LRT_SOURCE_DIR "/tests/conformance/cases.txt");
  REQUIRE(cases.size() >= 80);
  std::set<std::string> ids;
  for (const Case& c : cases) {
    CHECK(ids.insert(c.id).second);
    DYNAMIC_SECTION(c.id << " [" << c.tags << "]") {
      T target;
      Run(target, c).all();
    }
  }
}

}  // namespace

TEST_CASE("the cases hold on the engine", "[conformance][R0.3][R0.4][R0.5][R0.6][R0.7][R0.8][R0.9][R0.10][R0.11][R1.2][R1.8][R1.9][R1.10][R1.11]") {
  run_cases<EngineTarget>();
}

TEST_CASE("the cases hold on loopback", "[conformance][loopback]") { run_cases<LoopbackTarget>(); }

TEST_CASE("the cases hold on a real socket", "[conformance][asio]") { run_cases<SocketTarget>(); }

TEST_CASE("patterns of fields", "[conformance]") {
  CHECK(fits("", ""));
  CHECK(fits("a*c", "abbc"));
  CHECK(fits("*b*", "abc"));
  CHECK(fits("*", ""));
  CHECK_FALSE(fits("a", "ab"));
  CHECK_FALSE(fits("a*c", "ab"));
}
