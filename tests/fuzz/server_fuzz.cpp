// SPDX-License-Identifier: Apache-2.0
// The whole server without a socket: bytes in chunks -> HTTP session -> engine -> a robot -> responses. Whatever comes in, each is a whole HTTP
// response with a definite status, nothing is left waiting, and a refused write has not reached the robot.
//
// Each input is served twice: by a robot that lets all do everything, and by one with rules. There each request gets exactly one decision, only
// `Authorization: w` changes or commands anything, and without it nothing shows that there is an Action.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>
#include <type_traits>

#include <lrt/engine/engine.hpp>
#include <lrt/transport/session.hpp>

#include "src/security/policy.hpp"

namespace {

#define REQUIRE_THAT(condition)     \
  do {                              \
    if (!(condition)) std::abort(); \
  } while (false)

class CountingIds final : public lrt::IdSource {
 public:
  std::string next() override { return "id" + std::to_string(++count_); }

 private:
  int count_ = 0;
};

struct Robot {
  double friction = 0.7;
  double angle = 0;
  int writes = 0, commands = 0;
};

lrt::Thing make_joint(Robot& robot) {
  lrt::Thing joint{"j"};
  joint
      .property(
          "friction", [&robot] { return robot.friction; }, lrt::unit::one)
      .between(0, 1)
      .on_write([&robot](double v) {
        robot.friction = v;
        ++robot.writes;
      });
  joint.property<std::string>("label").on_write([&robot](std::string) { ++robot.writes; });
  joint.property<double>("angle", lrt::unit::radian).publish(0.5);
  joint
      .action("rotate",
              [&robot](float target, lrt::Responder done) {
                ++robot.commands;
                robot.angle = static_cast<double>(target);
                if (target < 100) done.succeed();
                else if (target < 200) throw 1;
              })
      .consumes(lrt::rdf::Facets{}.unit(lrt::unit::degree).at_least(0).below(360))
      .policy(lrt::ActionPolicy::preempt());
  joint.action("add", [](std::array<int, 2> n) { return n[0] + n[1]; });
  joint.collection<std::vector<double>>("points").on_create([](std::vector<double>) {}).on_remove([](const std::string&) {});
  return joint;
}

/// Decides who sends a request, and counts how often it is asked.
struct Guard {
  std::size_t decisions = 0;
  bool admitted_writer = false;

  lrt::engine::Caller decide(const lrt::http::Request& request) {
    using lrt::security::Right, lrt::security::Scope, lrt::security::Who;
    static const auto policy = lrt::security::Policy::create({{"/", Scope::tree, {}, Right::read | Right::subscribe},
                                                              {"/j/actions", Scope::tree, {Who::Kind::role, "writer"}, lrt::security::Rights::all()},
                                                              {"/j", Scope::below, {}, Right::read | Right::subscribe},
                                                              {"/j", Scope::below, {Who::Kind::role, "writer"}, lrt::security::Rights::all()}})
                                   .value();
    ++decisions;
    lrt::engine::Caller caller;
    if (request.find("Authorization") == "w") {
      caller.principal = std::make_shared<const lrt::security::Principal>(lrt::security::Principal{"w", {"writer"}});
      admitted_writer = true;
    } else if (request.find("Authorization")) {
      caller.access = lrt::engine::Access::unauthenticated;
    }
    caller.view = policy->view(caller.principal.get());
    return caller;
  }
};

/// The engine, with a check of the decisions that each call makes.
class GuardedEngine final : public lrt::engine::Handler {
 public:
  GuardedEngine(lrt::engine::Engine& engine, const Guard* guard) : engine_(engine), guard_(guard) {}
  lrt::engine::HeaderVerdict judge_header(const lrt::http::Request& request, std::optional<std::uint64_t> body_bytes, lrt::TimePoint now) override {
    return decided(1, [&] { return engine_.judge_header(request, body_bytes, now); });
  }
  bool is_stop(const lrt::http::Request& request) noexcept override { return engine_.is_stop(request); }
  lrt::engine::Outcome handle(const lrt::http::Request& request, lrt::TimePoint now) override {
    return decided(request.judged ? 0 : 1, [&] { return engine_.handle(request, now); });
  }
  std::optional<lrt::engine::Reply> next_reply(lrt::TimePoint now) override {
    return decided(0, [&] { return engine_.next_reply(now); });
  }
  std::optional<std::chrono::steady_clock::time_point> next_deadline() const override { return engine_.next_deadline(); }
  void abandon(lrt::engine::Ticket ticket) noexcept override { engine_.abandon(ticket); }
  std::optional<lrt::engine::Channel> next_ready(lrt::TimePoint now) override { return engine_.next_ready(now); }
  std::optional<lrt::engine::Push> next_push(lrt::engine::Channel channel, lrt::TimePoint now) override { return engine_.next_push(channel, now); }
  void closed(lrt::engine::Channel channel) noexcept override { engine_.closed(channel); }

 private:
  template <class F>
  std::invoke_result_t<F&> decided(std::size_t times, F f) {
    const std::size_t before = guard_ ? guard_->decisions : 0;
    auto result = f();
    if (guard_) REQUIRE_THAT(guard_->decisions == before + times);
    return result;
  }

  lrt::engine::Engine& engine_;
  const Guard* guard_;
};

void serve(std::string_view bytes, std::size_t chunk, bool with_rules) {
  const std::string_view all = bytes;
  Robot robot;
  Guard guard;
  lrt::TimePoint now;
  lrt::engine::EngineOptions options;
  options.ids = std::make_shared<CountingIds>();
  if (with_rules) options.authorize = [&guard](const lrt::http::Request& request) { return guard.decide(request); };
  lrt::engine::Engine engine(options);
  GuardedEngine handler(engine, with_rules ? &guard : nullptr);
  engine.listens_on("127.0.0.1", 8080);
  REQUIRE_THAT(engine.add(make_joint(robot)));

  lrt::transport::Limits limits;
  limits.max_header_bytes = 2048;
  limits.max_line_bytes = 1024;
  limits.max_body_bytes = 4096;
  lrt::transport::SessionContext context(limits);
  context.handler = &handler;
  context.websockets = true;
  lrt::transport::Session session(context, "127.0.0.1");
  using Phase = lrt::transport::Session::Phase;

  std::string written;
  const auto settle = [&] {
    // As the server does: jobs run, answers go back, bytes go out, until nothing moves.
    for (int round = 0; round < 1000; ++round) {
      bool moved = false;
      lrt::engine::Outputs outputs;
      engine.take_outputs(outputs);
      for (lrt::engine::Job& job : outputs.jobs) job.run(), moved = true;
      while (auto reply = engine.next_reply(now)) {
        moved = true;
        if (session.ticket() == reply->ticket) session.reply(*std::move(reply), now);
        else if (reply->channel) engine.closed(*reply->channel);
      }
      for (auto out = session.output(); !out.empty(); out = session.output()) {
        written.append(out.first).append(out.second);
        session.sent(out.first.size() + out.second.size(), now);
        moved = true;
      }
      if (!moved) return;
      if (round == 500) now.steady += std::chrono::hours(48);  // what waits by the client's wish (Prefer: wait)
    }
  };
  while (!bytes.empty() && session.phase() != Phase::closed && session.phase() != Phase::lingering && session.phase() != Phase::upgraded) {
    session.receive(bytes.substr(0, chunk), now);
    bytes.remove_prefix(std::min(bytes.size(), chunk));
    settle();
    if (session.phase() == Phase::waiting) {
      now.steady += std::chrono::hours(48);
      settle();
    }
    REQUIRE_THAT(session.phase() != Phase::waiting);
  }
  bool success = session.phase() == Phase::upgraded;  // the frames are not the session's business
  if (success) engine.closed(session.take_upgrade().channel);

  std::string_view rest = written;
  while (!rest.empty()) {
    const auto end = rest.find("\r\n\r\n");
    REQUIRE_THAT(end != std::string_view::npos && rest.substr(0, 9) == "HTTP/1.1 ");
    const std::string head(rest.substr(0, end + 4));
    const int status = std::atoi(head.c_str() + 9);
    REQUIRE_THAT(status >= 100 && status <= 505);
    success |= status >= 200 && status < 300;
    rest.remove_prefix(end + 4);
    const auto length = head.find("\r\nContent-Length: ");
    const std::size_t body = length == std::string::npos ? 0 : static_cast<std::size_t>(std::atol(head.c_str() + length + 18));
    if (rest.size() >= body && (rest.substr(body).empty() || rest.substr(body, 5) == "HTTP/")) rest.remove_prefix(body);
    else REQUIRE_THAT(rest.empty() || rest.substr(0, 5) == "HTTP/");  // an answer to HEAD
  }
  REQUIRE_THAT(success || (robot.writes == 0));
  if (with_rules && !guard.admitted_writer) {
    REQUIRE_THAT(robot.writes == 0 && robot.commands == 0);
    REQUIRE_THAT(all.find("rotate") != std::string_view::npos || written.find("rotate") == std::string::npos);
  }
  REQUIRE_THAT(robot.friction >= 0 && robot.friction <= 1);
  REQUIRE_THAT(robot.angle >= 0 && robot.angle < 360);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 1) return 0;
  const std::size_t chunk = data[0] < 128 ? size : data[0] - 127u;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  serve(bytes, chunk, false);
  serve(bytes, chunk, true);
  return 0;
}
