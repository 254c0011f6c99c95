#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

#include <lrt/engine/engine.hpp>

#include "tests/support/fakes.hpp"
#include "tests/support/message.hpp"

namespace lrt::test {

/// An engine on a test's bench: its clock moves by hand, its ids are known, its jobs run when the test says.
class Bench {
 public:
  explicit Bench(engine::Options options = {}) : engine(with_fakes(std::move(options))) {}

  /// A request that was sent: answered at once, or by a ticket.
  struct Sent {
    std::optional<engine::Ticket> ticket;
    Answer answer;
  };

  Sent send(const std::string& text) {
    RequestText request(text);
    return sent(engine.handle(request.get(), clock.now()));
  }
  Sent sent(engine::Outcome outcome) {
    if (auto* response = std::get_if<http::Response>(&outcome)) return {std::nullopt, Answer(*response)};
    return {std::get<engine::Deferred>(outcome).ticket, {}};
  }

  /// Runs the jobs that there are now, and those they give rise to; how many.
  std::size_t run() {
    std::size_t count = 0;
    while (true) {
      collect();
      auto jobs = engine.take_jobs();
      if (jobs.empty()) return count;
      count += jobs.size();
      for (engine::Job& job : jobs) job.run();
    }
  }
  /// Takes what the engine has to answer by now.
  void collect() {
    while (auto reply = engine.next_reply(clock.now())) replies_.emplace(reply->ticket, Answer(reply->response));
  }

  /// The answer if it has come.
  std::optional<Answer> answer(const Sent& sent) {
    if (!sent.ticket) return sent.answer;
    collect();
    const auto found = replies_.find(*sent.ticket);
    if (found == replies_.end()) return std::nullopt;
    return found->second;
  }

  /// Sends, runs jobs, and returns the answer.
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
  static std::string turtle_request(const std::string& method, const std::string& path, const std::string& body,
                                    const std::string& fields = {}) {
    std::string text = method + " " + path + "\nContent-Type: text/turtle\n" + fields + "\n";
    for (const auto& [prefix, space] : rdf::default_prefixes()) text += "@prefix " + prefix + ": <" + space + "> . ";
    return text + body;
  }

  void add(Thing thing) { engine.add(std::move(thing)).value(); }

  FakeClock clock;
  engine::Engine engine;

 private:
  engine::Options with_fakes(engine::Options options) {
    if (!options.clock) options.clock = &clock;
    if (!options.ids) options.ids = std::make_shared<FixedIds>();
    return options;
  }
  std::map<engine::Ticket, Answer> replies_;
};

/// A Turtle body for a number, with a unit if one is named: number_body("43.6", "maths:Degree").
inline std::string number_body(const std::string& number, const std::string& unit = {}) {
  return "<> a maths:Scalar ; vom:numericalValue " + number + (unit.empty() ? "" : " ; vom:unit " + unit) + " .";
}

}  // namespace lrt::test
