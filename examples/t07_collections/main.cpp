// SPDX-License-Identifier: Apache-2.0
// A collection: a container. Clients create members by POST and remove them by DELETE. lrt stores and shows the members. It calls a lambda
// before each change, and the lambda may refuse.
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
    r.is(vocab::maths::Vector2D);
    r.field(vocab::maths::x, &Waypoint::x);
    r.field(vocab::maths::y, &Waypoint::y);
  }
};

int main() {
  std::map<std::string, Waypoint> route;
  std::string driving_to;

  lrt::Thing rover{"rover"};
  rover.collection<Waypoint>("waypoints")
      .unit(lrt::unit::metre)
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
    const auto at = [](const std::string& x, const std::string& y) { return "<> maths:x " + x + " ; maths:y " + y + " ; qudt:hasUnit unit:M ."; };
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

// Output:
// OPTIONS /rover/waypoints
// 204 No Content
// Allow: GET, HEAD, OPTIONS, POST
//
// POST /rover/waypoints
//   <> maths:x 1.5 ; maths:y 2 ; qudt:hasUnit unit:M .
// 201 Created
// Location: http://127.0.0.1:8080/rover/waypoints/id-1
//
// POST /rover/waypoints
//   <> maths:x 3 ; maths:y 2 ; qudt:hasUnit unit:M .
// 201 Created
// Location: http://127.0.0.1:8080/rover/waypoints/id-2
//
// POST /rover/waypoints
//   <> maths:x -1 ; maths:y 2 ; qudt:hasUnit unit:M .
// 409 Conflict
// Content-Type: application/problem+json
// {"type":"about:blank","title":"Conflict","status":409,"detail":"the collection \"/rover/waypoints\" did not accept the member: there is a wall at x = 0 m"}
//
// GET /rover/waypoints
// 200 OK
// Content-Type: text/turtle
// <http://127.0.0.1:8080/rover/waypoints> a ldp:BasicContainer, ldp:Container, ldp:RDFSource ;
//     rdfs:seeAlso <http://127.0.0.1:8080/rover> ;
//     ldp:contains <http://127.0.0.1:8080/rover/waypoints/id-1>,
//         <http://127.0.0.1:8080/rover/waypoints/id-2> ;
//     hybrit:binding [
//         a http-core:Request ;
//         http-core:mthd http-methods:POST ;
//         http-core:requestURI <http://127.0.0.1:8080/rover/waypoints> ;
//         http-core:body [
//             a maths:Vector2D ;
//             dcterms:conformsTo <http://127.0.0.1:8080/blueprints/rover-aa17dae8#waypoints>
//         ]
//     ] .
//
// <http://127.0.0.1:8080/rover/waypoints/id-1> a ldp:RDFSource, maths:Vector2D .
//
// <http://127.0.0.1:8080/rover/waypoints/id-2> a ldp:RDFSource, maths:Vector2D .
//
// GET /rover/waypoints/id-2
// 200 OK
// Content-Type: text/turtle
// <http://127.0.0.1:8080/rover/waypoints/id-2> a ldp:RDFSource, maths:Vector2D ;
//     maths:x "3"^^xsd:double ;
//     maths:y "2"^^xsd:double ;
//     qudt:hasUnit unit:M .
//
// DELETE /rover/waypoints/id-1
// 409 Conflict
// Content-Type: application/problem+json
// {"type":"about:blank","title":"Conflict","status":409,"detail":"the member \"/rover/waypoints/id-1\" was not removed: the rover is on its way there"}
//
// DELETE /rover/waypoints/id-2
// 204 No Content
//
// GET /rover/waypoints
// 200 OK
// Content-Type: text/turtle
// <http://127.0.0.1:8080/rover/waypoints> a ldp:BasicContainer, ldp:Container, ldp:RDFSource ;
//     rdfs:seeAlso <http://127.0.0.1:8080/rover> ;
//     ldp:contains <http://127.0.0.1:8080/rover/waypoints/id-1> ;
//     hybrit:binding [
//         a http-core:Request ;
//         http-core:mthd http-methods:POST ;
//         http-core:requestURI <http://127.0.0.1:8080/rover/waypoints> ;
//         http-core:body [
//             a maths:Vector2D ;
//             dcterms:conformsTo <http://127.0.0.1:8080/blueprints/rover-aa17dae8#waypoints>
//         ]
//     ] .
//
// <http://127.0.0.1:8080/rover/waypoints/id-1> a ldp:RDFSource, maths:Vector2D .
