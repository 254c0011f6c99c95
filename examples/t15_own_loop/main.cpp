// SPDX-License-Identifier: Apache-2.0
// One thread that waits in its own poll() for its devices and for the server. lrt has no thread and uses no CPU time without requests.
#include <poll.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <lrt/lrt.hpp>

#include "examples/lesson.hpp"

int main() {
  // The device: anything with a descriptor. Here a timer of 5 ms, elsewhere a CAN bus or an encoder.
  const int device = ::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK);
  const itimerspec period{{0, 5'000'000}, {0, 5'000'000}};
  ::timerfd_settime(device, 0, &period, nullptr);

  lrt::Thing wheel{"cart/wheel"};
  auto speed = wheel.property<double>("speed", lrt::unit::radian_per_second);
  speed.publish(0);
  double wanted = 0;
  wheel.action("spin", [&](double to) { wanted = to; });  // called by server.poll(), on this thread

  lrt::Options options = lesson::options();
  options.threads.io = lrt::Io::in_poll;  // no thread of lrt
  lrt::Server server = lrt::Server::create(options).value();
  server.add(std::move(wheel)).value();

  lesson::Visitor visitor(server, [](lesson::Client& client) {
    client.only({"numericalValue"});
    client.post("/cart/wheel/actions/spin", "<> vom:numericalValue 3 .");
    client.get_until("/cart/wheel/speed", "\"3\"");
  });
  double now = 0;
  pollfd sources[] = {{device, POLLIN, 0}, {server.descriptor(), POLLIN, 0}};
  while (visitor.is_here()) {
    ::poll(sources, 2, -1);  // no time-out: expired times also make the descriptor readable
    if (sources[0].revents != 0) {
      std::uint64_t ticks = 0;
      if (::read(device, &ticks, sizeof ticks) > 0) speed.publish(now += (wanted - now) / 2 > 0.01 ? (wanted - now) / 2 : wanted - now);
    }
    if (sources[1].revents != 0) server.poll();
  }
  ::close(device);
}

// Output:
// POST /cart/wheel/actions/spin
//   <> vom:numericalValue 3 .
// 204 No Content
// Location: http://127.0.0.1:8080/cart/wheel/actions/spin/id-1
//
// GET /cart/wheel/speed
// 200 OK
// Content-Type: text/turtle
//     vom:numericalValue "3"^^xsd:double ;
