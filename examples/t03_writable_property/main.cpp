// A property that clients may write: on_write. A unit and bounds are checked before the lambda is called; what the robot alone can
// know it refuses itself.
#include <lrt/lrt.hpp>

#include "examples/lesson.hpp"

int main() {
  double speed = 0.2;
  bool emergency_stop = false;

  lrt::Thing arm{"arm"};
  arm.property("speed", [&] { return speed; }, lrt::unit::metre_per_second)
      .between(0, 1.5)
      .on_write([&](double wanted) -> lrt::Result<void> {  // or void, if the robot takes all that the bounds allow
        if (emergency_stop) return lrt::unexpected(lrt::Errc::refused, "the emergency stop is pressed");
        speed = wanted;
        return {};
      });
  arm.property("emergencyStop", [&] { return emergency_stop; });

  lrt::Server server = lrt::Server::create(lesson::options()).value();
  server.add(std::move(arm)).value();

  lesson::Visitor visitor(server, [&](lesson::Client& client) {
    client.put("/arm/speed", "<> vom:numericalValue 0.5 ; qudt:unit unit:M-PER-SEC .");
    client.get("/arm/speed");
    client.put("/arm/speed", "<> vom:numericalValue 2 ; qudt:unit unit:M-PER-SEC .");
    client.put("/arm/speed", "<> vom:numericalValue 0.5 ; qudt:unit unit:DEG .");
    client.put("/arm/speed", "<> vom:numericalValue \"fast\" .");
    client.put("/arm/speed", "<> vom:numericalValue 0.5");
    client.put("/arm/emergencyStop", "<> rdf:value true .");
    client.ask("POST", "/arm/actions/press", {}, {});
    client.post("/arm/speed");
  });
  server.run();
}
