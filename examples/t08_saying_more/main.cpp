// Saying more: types and predicates of your domain, a title, any triple in C++ or in Turtle, and a thing within a thing. Nobody needs
// this to move the robot; it lets others understand what they move.
#include <lrt/lrt.hpp>

#include "examples/lesson.hpp"

int main() {
  using lrt::Iri;
  using lrt::Object;
  double level = 0.75;

  lrt::Thing rover{"rover"};
  rover.type(Iri{"http://www.ontologydesignpatterns.org/ont/dul/DUL.owl#PhysicalAgent"})
      .title("The rover in the lab")
      .add(Iri{"http://schema.org/serialNumber"}, "R-0042")
      .add(lrt::vocab::rdfs::label, Object::tagged("Rover", "en"))
      .add(lrt::vocab::rdfs::label, Object::tagged("Roboter", "de"))
      .add(lrt::vocab::rdfs::seeAlso, Object::resource("rover/battery"))  // a resource of this server, by its path
      .add_turtle("@prefix schema: <http://schema.org/> . <> schema:weight [ schema:value 12.5 ; schema:unitCode \"KGM\" ] .");

  lrt::Thing battery{"rover/battery"};  // a thing below a thing: its path says so
  battery.property("charge", [&] { return level; }, lrt::unit::one)
      .predicate(Iri{"http://example.org/rover#charge"})
      .type(Iri{"http://www.w3.org/ns/sosa/ObservableProperty"})
      .add(lrt::vocab::rdfs::comment, "Measured at rest; drops by a tenth under load.");

  lrt::Server server = lrt::Server::create(lesson::options()).value();
  server.add(std::move(rover)).value();
  server.add(std::move(battery)).value();

  lesson::Visitor visitor(server, [](lesson::Client& client) {
    client.show("Link");
    client.get("/");
    client.get("/rover");
    client.get("/rover/battery");
    client.get("/rover/battery/state");
  });
  server.run();
}
