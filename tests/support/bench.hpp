// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstdlib>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <lrt/engine/engine.hpp>

#include "src/page/page.hpp"
#include "tests/support/fakes.hpp"
#include "tests/support/message.hpp"

namespace lrt::test {

/// An engine on a test's bench: its clock moves by hand, its ids are known, its jobs run when the test says.
class Bench {
 public:
  explicit Bench(engine::EngineOptions options = {}) : engine(with_fakes(std::move(options))) {}

  /// A request that was sent: its response, or its ticket.
  struct Sent {
    std::optional<engine::Ticket> ticket;
    Answer answer;
    std::optional<engine::Channel> channel{};
  };

  Sent send(const std::string& text) {
    RequestText request(text);
    return sent(engine.handle(request.get(), clock.now()));
  }
  Sent sent(engine::Outcome outcome) {
    if (auto* response = std::get_if<http::Response>(&outcome)) return {std::nullopt, Answer(*response)};
    if (auto* upgraded = std::get_if<engine::Upgraded>(&outcome)) return {std::nullopt, Answer(upgraded->response), upgraded->channel};
    if (auto* streamed = std::get_if<engine::Streamed>(&outcome)) return {std::nullopt, Answer(streamed->response), streamed->channel};
    return {std::get<engine::Deferred>(outcome).ticket, {}};
  }

  /// What the engine has handed out by now and was not taken yet; below, one kind of it.
  engine::Outputs& outputs() {
    engine.take_outputs(outputs_);
    return outputs_;
  }
  auto take_jobs() { return std::exchange(outputs().jobs, {}); }
  auto take_body_jobs() { return std::exchange(outputs().body_jobs, {}); }
  auto take_query_jobs() { return std::exchange(outputs().query_jobs, {}); }
  auto take_callbacks() { return std::exchange(outputs().callbacks, {}); }
  auto take_saved() { return std::exchange(outputs().saved, {}); }
  auto take_new_resources() { return std::exchange(outputs().new_resources, {}); }
  auto take_subscription_events() { return std::exchange(outputs().subscription_events, {}); }
  auto take_discarded() { return std::exchange(outputs().discarded, {}); }

  /// Runs the jobs that there are now, and those they give rise to; how many.
  std::size_t run() {
    std::size_t count = 0;
    while (true) {
      collect();
      auto bodies = take_body_jobs();
      for (engine::BodyJob& job : bodies) job.run();
      auto queries = take_query_jobs();
      for (engine::BodyJob& job : queries) job.run();
      auto jobs = take_jobs();
      if (jobs.empty() && bodies.empty() && queries.empty()) return count;
      count += jobs.size() + queries.size();
      for (engine::Job& job : jobs) job.run();
    }
  }
  /// Takes the replies that the engine has by now.
  void collect() {
    while (auto reply = engine.next_reply(clock.now())) {
      if (reply->channel) channels_.emplace(reply->ticket, *reply->channel);
      replies_.emplace(reply->ticket, Answer(reply->response));
    }
  }

  /// The response if it has come.
  std::optional<Answer> answer(const Sent& sent) {
    if (!sent.ticket) return sent.answer;
    collect();
    const auto found = replies_.find(*sent.ticket);
    if (found == replies_.end()) return std::nullopt;
    return found->second;
  }

  /// Sends, runs jobs, and returns the response.
  Answer ask(const std::string& text) {
    const Sent s = send(text);
    run();
    auto a = answer(s);
    if (!a) throw std::runtime_error("no answer to " + text);
    return *std::move(a);
  }
  Answer get(const std::string& path) { return ask("GET " + path); }
  Answer turtle(const std::string& method, const std::string& path, const std::string& body, const std::string& fields = {}) {
    return ask(turtle_request(method, path, body, fields));
  }
  static std::string turtle_request(const std::string& method, const std::string& path, const std::string& body, const std::string& fields = {}) {
    std::string text = method + " " + path + "\nContent-Type: text/turtle\n" + fields + "\n";
    for (const auto& [prefix, space] : rdf::default_prefixes()) text += "@prefix " + prefix + ": <" + space + "> . ";
    return text + body;
  }

  void add(Thing thing) { engine.add(std::move(thing)).value(); }

  /// GET of a path as a WebSocket's opening handshake.
  Sent upgrade(const std::string& path, const std::string& fields = {}) {
    RequestText request("GET " + path + "\nUpgrade: websocket\nConnection: Upgrade\nSec-WebSocket-Version: 13\nSec-WebSocket-Key: " +
                        "dGhlIHNhbXBsZSBub25jZQ==\n" + fields);
    request.get().can_upgrade = true;
    return sent(engine.handle(request.get(), clock.now()));
  }
  /// A WebSocket that opened, after the reads it needs.
  engine::Channel open(const std::string& path, const std::string& fields = {}) { return opened(upgrade(path, fields)); }
  /// GET of a path as an event stream.
  Sent stream(const std::string& path, const std::string& fields = {}, const std::string& accept = "text/event-stream") {
    RequestText request("GET " + path + "\nAccept: " + accept + "\n" + fields);
    request.get().can_stream = true;
    return sent(engine.handle(request.get(), clock.now()));
  }
  /// An event stream that opened, after the reads it needs.
  engine::Channel open_stream(const std::string& path, const std::string& fields = {}) { return opened(stream(path, fields)); }

  /// What all channels have to say by now, as a transport whose clients are quick would get it.
  std::vector<std::pair<engine::Channel, engine::Push>> pushes() {
    std::vector<std::pair<engine::Channel, engine::Push>> all;
    do {
      run();
      while (auto channel = engine.next_ready(clock.now())) {
        while (auto push = engine.next_push(*channel, clock.now())) {
          all.emplace_back(*channel, *push);
          if (push->close != 0) break;
        }
      }
    } while (run() > 0);  // reads of pulled properties that came due
    return all;
  }
  /// The bodies among them, of one channel.
  std::vector<std::string> messages(engine::Channel channel) {
    std::vector<std::string> bodies;
    for (const auto& [c, push] : pushes())
      if (c == channel && push.message) bodies.push_back(*push.message);
    return bodies;
  }
  /// Makes the engine scan for published values.
  void look() { clock.advance(std::chrono::milliseconds(1)); }

  FakeClock clock;
  engine::Engine engine;

 private:
  engine::Channel opened(const Sent& s) {
    if (s.channel) return *s.channel;
    run();
    const Answer a = *answer(s);
    if (!s.ticket || channels_.count(*s.ticket) == 0) throw std::runtime_error("not opened: " + std::to_string(a.status) + " " + a.body);
    return channels_.at(*s.ticket);
  }
  engine::EngineOptions with_fakes(engine::EngineOptions options) {
    if (!options.clock) options.clock = &clock;
    if (!options.ids) options.ids = std::make_shared<FixedIds>();
    if (!options.page) options.page = page::console();
    options.saves_callbacks = true;
    if (std::getenv("LRT_BODY_JOBS") && !options.body_jobs) {  // the same tests with every body judged as on another thread
      options.body_jobs = true;
      options.small_body_bytes = 0;
    }
    return options;
  }
  engine::Outputs outputs_;
  std::map<engine::Ticket, Answer> replies_;
  std::map<engine::Ticket, engine::Channel> channels_;
};

/// A Turtle body for a number, with a unit if one is named: number_body("43.6", "maths:Degree").
inline std::string number_body(const std::string& number, const std::string& unit = {}) {
  return "<> a maths:Scalar ; vom:numericalValue " + number + (unit.empty() ? "" : " ; vom:unit " + unit) + " .";
}

}  // namespace lrt::test
