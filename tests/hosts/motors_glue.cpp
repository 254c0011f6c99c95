// SPDX-License-Identifier: Apache-2.0
#include <lrt/lrt.hpp>

#include "tests/hosts/glue.hpp"
#include "tests/hosts/motors.hpp"

namespace motors {

LRT_RECORD(Sample, position, velocity, current)

inline void lrt_describe(lrt::rdf::Record<Sample>& r) {
  r.facets("position").unit(lrt::unit::radian);
  r.facets("velocity").unit(lrt::unit::radian_per_second);
  r.facets("current").unit(lrt::unit::ampere);
}

}  // namespace motors

void serve_motor(lrt::Server& server, const std::shared_ptr<motors::Motor>& motor) {
  lrt::Thing thing{"motors/" + motor->name()};
  thing.guard(motor);  // it may be unplugged
  auto sample = thing.property<motors::Sample>("sample");
  thing.property(
      "temperature", [&m = *motor] { return m.temperature(); }, lrt::unit::degree_celsius);
  thing.action("aim", [&m = *motor](double velocity) { m.aim(velocity); }).unit(lrt::unit::radian_per_second).between(-10, 10);
  motor->listen([sample](const motors::Sample& now) mutable { sample.publish(now); });
  server.add(std::move(thing)).value();
  motor->run();
}
