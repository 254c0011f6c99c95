// SPDX-License-Identifier: Apache-2.0
#include "examples/baxter/surroundings.hpp"

#include <cmath>
#include <string>
#include <utility>

namespace baxter {

namespace {

/// Nodes have names, because a graph is also part of the union of all graphs.
constexpr const char* things = R"(
  @prefix schema: <http://schema.org/> . @prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> . @prefix unit: <http://qudt.org/vocab/unit/> .
  @prefix qudt: <http://qudt.org/schema/qudt/> . @prefix vom: <http://vocab.arvida.de/2015/06/vom/vocab#> .
  </baxter> schema:additionalProperty <#payload> .
  <#payload> a schema:PropertyValue ; schema:name "payload" ; schema:value 2.2 ; schema:unitCode "KGM" .
  <#table> a schema:Product ; rdfs:label "table" .
  <#box1> a schema:Product ; rdfs:label "red box" ; schema:weight <#box1.weight> .
  <#box1.weight> vom:numericalValue 0.4 ; qudt:hasUnit unit:KiloGM .
  <#box2> a schema:Product ; rdfs:label "blue box" ; schema:weight <#box2.weight> .
  <#box2.weight> vom:numericalValue 3.5 ; qudt:hasUnit unit:KiloGM .)";

constexpr const char* first_tasks = R"(
  @prefix schema: <http://schema.org/> . @prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
  <#1> a schema:MoveAction, <blueprint#task> ; rdfs:label "put the red box to the left" ; schema:object <objects#box1> ;
    schema:actionStatus schema:PotentialActionStatus .)";

/// A task has an object and a status. The shape is a class of its own, so that it does not judge the actions of other robots.
constexpr const char* task_shape = R"(
  @prefix schema: <http://schema.org/> . @prefix sh: <http://www.w3.org/ns/shacl#> .
  @prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
  <#task> a sh:NodeShape, rdfs:Class ; rdfs:label "task" ;
    sh:property [ sh:path schema:object ; sh:minCount 1 ; sh:nodeKind sh:IRI ] ;
    sh:property [ sh:path schema:actionStatus ; sh:minCount 1 ; sh:maxCount 1 ;
                  sh:in ( schema:PotentialActionStatus schema:ActiveActionStatus schema:CompletedActionStatus schema:FailedActionStatus ) ] .)";

}  // namespace

lrt::Result<void> Surroundings::add_to(lrt::Server& server) {
  lrt::World world("world");
  world.title("What Baxter sees and has to do", "en");
  lrt::GraphOptions objects;
  objects.title = {"Objects seen", "en"};
  objects.description = {"The things on the table, with their masses and poses.", "en"};
  objects.turtle = things;
  objects_ = world.graph("objects", std::move(objects));
  lrt::GraphOptions tasks;
  tasks.title = {"Tasks", "en"};
  tasks.description = {"What the robot has to do; clients add tasks.", "en"};
  tasks.turtle = first_tasks;
  tasks.shapes = task_shape;
  tasks.clients_may_write = true;
  tasks.max_triples = 10'000;
  tasks_ = world.graph("tasks", std::move(tasks));
  lrt::PublishedOptions seen(lrt::unit::metre);
  seen.frame = lrt::Object::resource("baxter");
  for (std::size_t i = 0; i < box_count; ++i)
    poses_[i] = objects_.published<Eigen::Isometry3d>("box" + std::to_string(i + 1), lrt::vocab::spatial::spatialRelationship, seen);
  publish(0, false);
  return server.add(std::move(world));
}

void Surroundings::publish(double seconds, bool demo) noexcept {
  const double pushed = demo ? 0.1 * std::sin(seconds) : 0;
  const double y[box_count] = {-0.2 + pushed, -0.5};
  for (std::size_t i = 0; i < box_count; ++i) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = Eigen::Vector3d(0.7, y[i], 0.05);
    poses_[i].publish(pose);
  }
}

}  // namespace baxter
