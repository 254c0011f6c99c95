// SPDX-License-Identifier: Apache-2.0
// A robot on Boost.Asio gives its io_context to the server: it does not call poll(), and lambdas run among its own handlers.
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <functional>

#include <lrt/lrt.hpp>
#include <lrt/transport/asio_loop.hpp>

#include "examples/lesson.hpp"

int main() {
  boost::asio::io_context io;

  lrt::Thing battery{"cart/battery"};
  auto charge = battery.property<double>("charge");
  charge.publish(1);
  double load = 0;
  battery.action("connect", [&](double consumers) { load = consumers; });

  lrt::Options options = lesson::options();
  options.threads.io = lrt::Io::in_poll;
  options.listen.transport = [&io](lrt::transport::TransportOptions o) { return lrt::transport::make_http(std::move(o), io); };
  lrt::Server server = lrt::Server::create(options).value();
  server.add(std::move(battery)).value();

  lesson::Visitor visitor(server, [](lesson::Client& client) {
    client.only({"numericalValue"});
    client.get("/cart/battery/charge");
    client.post("/cart/battery/actions/connect", "<> vom:numericalValue 0.25 .");
    client.get_until("/cart/battery/charge", "\"0\"");
  });
  boost::asio::steady_timer tick(io);  // the host's own work
  double left = 1;
  std::function<void()> work = [&] {
    charge.publish(left = left > load ? left - load : 0);
    if (!visitor.is_here()) return;
    tick.expires_after(std::chrono::milliseconds(5));
    tick.async_wait([&](const boost::system::error_code&) { work(); });
  };
  work();
  io.run();  // until the host's work and the server have ended
}

// Output:
// GET /cart/battery/charge
// 200 OK
// Content-Type: text/turtle
//     vom:numericalValue "1"^^xsd:double ;
//
// POST /cart/battery/actions/connect
//   <> vom:numericalValue 0.25 .
// 204 No Content
// Location: http://127.0.0.1:8080/cart/battery/actions/connect/id-1
//
// GET /cart/battery/charge
// 200 OK
// Content-Type: text/turtle
//     vom:numericalValue "0"^^xsd:double ;
