// A collection: a container whose members clients create by POST and remove by DELETE. lrt keeps and shows the members; the lambdas
// hear of each before it counts, and may refuse.
#include <map>
#include <string>

#include <lrt/lrt.hpp>

#include "examples/lesson.hpp"

struct Waypoint {
  double x = 0, y = 0;  // [m]
};

template <>
struct lrt::rdf::traits<Waypoint> : lrt::rdf::Record<Waypoint> {
  static void describe(Record<Waypoint>& r) {
    r.field(vocab::maths::x, &Waypoint::x).unit(unit::metre);
    r.field(vocab::maths::y, &Waypoint::y).unit(unit::metre);
  }
};

int main() {
  std::map<std::string, Waypoint> route;
  std::string driving_to;

  lrt::Thing rover{"rover"};
  rover.collection<Waypoint>("waypoints")
      .on_create([&](const std::string& id, Waypoint point) -> lrt::Result<void> {
        if (point.x < 0) return lrt::unexpected(lrt::Errc::refused, "there is a wall at x = 0 m");
        if (route.empty()) driving_to = id;
        route[id] = point;
        return {};
      })
      .on_remove([&](const std::string& id) -> lrt::Result<void> {
        if (id == driving_to) return lrt::unexpected(lrt::Errc::refused, "the rover is on its way there");
        route.erase(id);
        return {};
      });

  lrt::Server server = lrt::Server::create(lesson::options()).value();
  server.add(std::move(rover)).value();

  lesson::Visitor visitor(server, [](lesson::Client& client) {
    const auto at = [](const std::string& x, const std::string& y) {
      return "<> maths:x [ vom:numericalValue " + x + " ; qudt:unit unit:M ] ; maths:y [ vom:numericalValue " + y + " ; qudt:unit unit:M ] .";
    };
    client.options("/rover/waypoints");
    const std::string first = client.post("/rover/waypoints", at("1.5", "2")).field("Location");
    const std::string second = client.post("/rover/waypoints", at("3", "2")).field("Location");
    client.post("/rover/waypoints", at("-1", "2"));
    client.get("/rover/waypoints");
    client.get(second);
    client.remove(first);
    client.remove(second);
    client.get("/rover/waypoints");
  });
  server.run();
}
