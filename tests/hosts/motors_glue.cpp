// SPDX-License-Identifier: Apache-2.0
#include <stdexcept>

#include <lrt/lrt.hpp>

#include "tests/hosts/glue.hpp"
#include "tests/hosts/motors.hpp"

template <>
struct lrt::rdf::traits<motors::Sample> : lrt::rdf::Record<motors::Sample> {
  static void describe(Record& r) {
    r.field("position", &motors::Sample::position).unit(unit::radian);
    r.field("velocity", &motors::Sample::velocity).unit(unit::radian_per_second);
    r.field("current", &motors::Sample::current).unit(unit::ampere);
  }
};

void serve_motor(lrt::Server& server, const std::shared_ptr<motors::Motor>& motor) {
  // The lambdas may run while the motor is unplugged: they must not keep it, and must not use it when it is gone.
  const auto present = [weak = std::weak_ptr<motors::Motor>(motor)] {
    if (auto here = weak.lock()) return here;
    throw std::runtime_error("it is unplugged");
  };
  lrt::Thing thing{"motors/" + motor->name()};
  auto sample = thing.property<motors::Sample>("sample");
  thing.property(
      "temperature", [present] { return present()->temperature(); }, lrt::unit::degree_celsius);
  thing.action("aim", [present](double velocity) { present()->aim(velocity); }).unit(lrt::unit::radian_per_second).between(-10, 10);
  motor->listen([sample](const motors::Sample& now) mutable { sample.publish(now); });
  server.add(std::move(thing)).value();
  motor->run();
}
