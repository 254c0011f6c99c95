// SPDX-License-Identifier: Apache-2.0
// Robots that work together without knowing each other. A conductor watches them and acts by rules in a Turtle file: "when this property crosses that
// value, invoke an action that changes this property". It is given URLs only; Things are found by type, actions by effect. A robot that joins later
// takes part without a change. The conductor is a robot itself: its members are a collection, and it has one loop for its server and its client.
//
//   ex_conductor RULES [--port N]
//   curl -H 'Content-Type: application/json' -d '{"url": "http://127.0.0.1:8081/"}' http://127.0.0.1:8080/conductor/robots
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include <lrt/client.hpp>
#include <lrt/lrt.hpp>

#include "examples/ex_conductor/rules.hpp"

struct Joined {
  std::string url;
};

template <>
struct lrt::rdf::traits<Joined> : lrt::rdf::Record<Joined> {
  static void describe(Record<Joined>& r) { r.field("url", &Joined::url); }
};

namespace {

volatile std::sig_atomic_t interrupted = 0;

void say(const std::string& line) {
  std::printf("%s\n", line.c_str());
  std::fflush(stdout);
}

class Conductor {
 public:
  explicit Conductor(std::vector<Rule> rules) : rules_(std::move(rules)), client_(lrt::Client::create().value()) {}

  lrt::Client& client() { return client_; }
  int fired() const { return fired_; }

  void join(const std::string& id, const std::string& url) {
    client_.async([this, url] { return client_.open(url); },
                  [this, id, url](lrt::Result<lrt::client::Robot> robot) {
                    if (!robot) return say(url + " cannot join: " + robot.error().message);
                    robots_.insert_or_assign(id, *robot);
                    for (const Rule& rule : rules_) watch(rule, id, *robot);
                    say(url + " has joined with " + std::to_string(robot->things().size()) + " Things");
                  });
  }
  void leave(const std::string& id) {
    robots_.erase(id);
    watches_.erase(id);
  }

 private:
  void watch(const Rule& rule, const std::string& id, const lrt::client::Robot& robot) {
    for (const lrt::client::Thing& thing : robot.things(lrt::Iri(rule.thing))) {
      const auto property = thing.property(lrt::Iri(rule.property));
      if (!property) continue;
      const auto held = std::make_shared<bool>(false);
      auto watch = property->watch({}, [this, &rule, id, held, property = *property](const lrt::client::Change& change) {
        if (change.kind != lrt::client::Change::Kind::value) return;
        const auto value = property.value_of<double>(change, lrt::Unit{lrt::Iri(rule.unit), {}, {}});
        if (!value) return say(property.url() + ": " + value.error().message);
        const bool holds = rule.holds(*value);
        if (holds && !*held) act(rule, id);
        *held = holds;
      });
      if (watch) watches_[id].push_back(*std::move(watch));
      else say(property->url() + " cannot be watched: " + watch.error().message);
    }
  }

  /// The actions are looked up when they are needed, so that the list is current.
  void act(const Rule& rule, const std::string& by) {
    ++fired_;
    say(rule.name.substr(rule.name.find('#') + 1) + ": " + robots_.at(by).url());
    for (const auto& [id, robot] : robots_) {
      if ((id == by) == rule.others) continue;
      client_.async(
          [&rule, robot = robot]() -> lrt::Result<std::string> {
            std::string done;
            for (const lrt::client::Thing& thing : robot.things(lrt::Iri(rule.target))) {
              lrt::client::ActionQuery query;
              query.affects = rule.affects;
              query.thing = thing.url();
              const auto actions = robot.actions(query);
              if (!actions) return lrt::unexpected(actions.error());
              for (const lrt::client::Action& action : *actions) {
                const auto begun = action.invoke(rule.input, {lrt::Unit{lrt::Iri(rule.input_unit), {}, {}}});
                if (!begun) return lrt::unexpected(begun.error());
                done += (done.empty() ? "" : ", ") + action.url();
              }
            }
            return done;
          },
          [](lrt::Result<std::string> done) { say(done ? "invoked " + *done : done.error().message); });
    }
  }

  const std::vector<Rule> rules_;
  lrt::Client client_;
  std::map<std::string, lrt::client::Robot> robots_;  // by the name of the member
  std::map<std::string, std::vector<lrt::client::Watch>> watches_;
  int fired_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 && !(argc == 4 && std::string_view(argv[2]) == "--port")) return std::fputs("usage: ex_conductor RULES [--port N]\n", stderr), 2;
  std::stringstream text;
  text << std::ifstream(argv[1]).rdbuf();
  auto rules = read_rules(text.str());
  if (!rules || rules->empty()) return std::fprintf(stderr, "%s: %s\n", argv[1], rules ? "there is no rule" : rules.error().message.c_str()), 1;
  Conductor conductor(*std::move(rules));

  lrt::Thing thing{"conductor"};
  thing.property("rulesFired", [&] { return conductor.fired(); });
  thing.collection<Joined>("robots")
      .on_create([&](const std::string& id, const Joined& robot) { return conductor.join(id, robot.url), lrt::Result<void>(); })
      .on_remove([&](const std::string& id) { return conductor.leave(id), lrt::Result<void>(); });

  lrt::Options options;
  options.listen.port = static_cast<std::uint16_t>(argc == 4 ? std::atoi(argv[3]) : 8080);
  auto server = lrt::Server::create(options);
  if (!server) return std::fprintf(stderr, "%s\n", server.error().message.c_str()), 1;
  if (auto added = server->add(std::move(thing)); !added) return std::fprintf(stderr, "%s\n", added.error().message.c_str()), 1;
  say("the conductor is at " + server->url());
  for (const int end : {SIGINT, SIGTERM}) std::signal(end, [](int) { interrupted = 1; });
  while (!interrupted) {
    server->poll();
    conductor.client().poll();
    conductor.client().wait(std::chrono::milliseconds(2));
  }
}
