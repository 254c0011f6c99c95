// Actions that take a while: keep the Responder, say how far it is, and answer when it is done. A client watches the invocation, waits
// for it, or cancels it with DELETE. What a second command meets is a policy.
#include <chrono>
#include <optional>
#include <thread>

#include <lrt/lrt.hpp>

#include "examples/lesson.hpp"

int main() {
  int position = 0, target = 0;  // [mm]
  std::optional<lrt::Responder> move;

  lrt::Thing axis{"axis"};
  axis.action("moveTo", [&](int to, lrt::Responder done) {
        target = to;
        done.on_cancel([&] { target = position; });  // also when a later command takes over: it is called before that one begins
        move = std::move(done);
      })
      .consumes(lrt::rdf::Facets{}.unit(lrt::unit::millimetre).between(0, 1'000'000))
      .policy(lrt::ActionPolicy::preempt());  // others: queue(n), reject(), parallel(n)

  lrt::Server server = lrt::Server::create(lesson::options()).value();
  server.add(std::move(axis)).value();

  lesson::Visitor visitor(server, [](lesson::Client& client) {
    const std::string far = "<> vom:numericalValue 1000000 ; qudt:unit unit:MilliM .";
    const std::string near = "<> vom:numericalValue 0 ; qudt:unit unit:MilliM .";
    const std::string first = client.post("/axis/actions/moveTo", far).field("Location");                  // goes on after the answer
    const std::string second = client.post("/axis/actions/moveTo", far, "Prefer: respond-async\r\n").field("Location");
    client.get(first);  // preempted
    client.get_until(second, "lrt:running");
    client.remove(second);
    client.get(second);
    client.post("/axis/actions/moveTo", near, "Prefer: wait=5, return=representation\r\n");
  });

  while (visitor.is_here()) {
    server.poll();
    if (position != target) position += position < target ? 1 : -1;
    if (move && move->cancelled()) move.reset();
    if (move && position == target) {
      std::move(*move).succeed();
      move.reset();
    } else if (move) {
      move->progress(0.25);  // a robot says what it knows
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}
