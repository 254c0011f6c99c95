// SPDX-License-Identifier: Apache-2.0
// Testing your robot's things without a port, threads or waiting: with the transport Loopback, a clock that the test sets, and ids that the
// test chooses. Everything runs in poll(), so every run has the same result.
#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>

#include <lrt/lrt.hpp>
#include <lrt/transport/loopback.hpp>

lrt::Thing make_joint(double& angle) {  // the thing under test
  lrt::Thing joint{"joint"};
  joint.property(
      "rotation", [&] { return angle; }, lrt::unit::radian);
  joint.action("rotate", [&](double target) { angle = target; });
  return joint;
}

class HandClock final : public lrt::Clock {
 public:
  lrt::TimePoint now() const noexcept override { return now_; }
  void advance(std::chrono::milliseconds by) {
    now_.steady += by;
    now_.utc += by;
  }

 private:
  lrt::TimePoint now_{{}, std::chrono::system_clock::time_point(std::chrono::hours(24 * 365 * 50))};
};

class Numbers final : public lrt::IdSource {
 public:
  std::string next() override { return std::to_string(++last_); }

 private:
  int last_ = 0;
};

void show(const lrt::http::Response& r) {
  std::printf("%d %.*s\n%.*s\n", r.status, int(r.fields.find("Location").value_or("").size()), r.fields.find("Location").value_or("").data(),
              int(r.content().size()), r.content().data());
}

int main() {
  HandClock clock;
  lrt::transport::Loopback* loopback = nullptr;  // owned by the server

  lrt::Options options;
  options.threads.io = lrt::Io::in_poll;
  options.clock = &clock;
  options.ids = std::make_shared<Numbers>();
  options.listen.public_base = "http://robot.example";
  options.listen.transport = [&](lrt::transport::TransportOptions o) {
    auto made = std::make_unique<lrt::transport::Loopback>(std::move(o));
    loopback = made.get();
    return made;
  };
  lrt::Server server = lrt::Server::create(options).value();

  double angle = 0.5;
  server.add(make_joint(angle)).value();

  const auto ask = [&](std::string_view method, std::string_view target, std::string_view turtle = {}) {
    lrt::http::Request request;
    request.method = method;
    request.target = target;
    request.fields = {{"Host", "robot.example"}};
    if (!turtle.empty()) request.fields.push_back({"Content-Type", "text/turtle"});
    request.body = turtle;
    loopback->submit(request, show);
  };

  ask("POST", "/joint/actions/rotate", "<> <http://vocab.arvida.de/2015/06/vom/vocab#numericalValue> 1.25 .");
  server.poll();  // runs the lambda and sends the response
  if (angle != 1.25) return 1;

  ask("GET", "/joint/rotation");
  clock.advance(options.limits.host_timeout);  // the host hangs ...
  server.poll();                               // ... and the waiting request gets 503
}

// Output:
// 204 http://robot.example/joint/actions/rotate/1
//
// 503
// {"type":"about:blank","title":"Service Unavailable","status":503,"detail":"the robot's program did not process the request in time; the request was cancelled, try again later"}
