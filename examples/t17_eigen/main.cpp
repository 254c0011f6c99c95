// SPDX-License-Identifier: Apache-2.0
// Values of Eigen's types: include lrt/eigen.hpp. Vectors, rotations and poses are represented in the terms of the paper's Figure 3, other
// vectors and matrices as lists. An invalid rotation is refused.
#include <cstdio>

#include <Eigen/Geometry>

#include <lrt/eigen.hpp>
#include <lrt/lrt.hpp>

#include "examples/lesson.hpp"

int main() {
  using Joints = Eigen::Matrix<double, 6, 1>;
  Joints joints;  // [rad]
  joints << 0, 0.5, -0.5, 0, 0.25, 0;
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d target = Eigen::Vector3d::Zero();  // [m]

  lrt::Thing arm{"arm"};
  auto tool = arm.property<Eigen::Isometry3d>("tool", lrt::unit::metre);
  arm.property("joints", [&] { return joints; });
  arm.property("orientation", [&] { return orientation; }).on_write([&](const Eigen::Quaterniond& wanted) { orientation = wanted; });
  arm.action("reach",
             [&](const Eigen::Vector3d& point) {
               target = point;
               Eigen::Isometry3d pose(orientation);
               pose.translation() = target;
               tool.publish(pose);  // fixed sizes: no lock, no allocation, suitable for a control loop
             })
      .unit(lrt::unit::metre);

  lrt::Server server = lrt::Server::create(lesson::options()).value();
  server.add(std::move(arm)).value();

  lesson::Visitor visitor(server, [](lesson::Client& client) {
    client.get("/arm/joints");
    client.put("/arm/orientation", "<> vom:quantityValue [ maths:x 0 ; maths:y 0 ; maths:z 0.6 ; maths:w 0.9 ] .");
    client.put("/arm/orientation", "<> vom:quantityValue [ maths:x 0 ; maths:y 0 ; maths:z 0.6 ; maths:w 0.8 ] .");
    client.post("/arm/actions/reach", "<> maths:x 0.5 ; maths:y 0 ; maths:z 0.25 ; qudt:hasUnit unit:M .");
    client.get("/arm/tool");
  });
  server.run();
}

// Output:
// GET /arm/joints
// 200 OK
// Content-Type: text/turtle
// <http://127.0.0.1:8080/arm/joints> a hybrit:Property ;
//     rdfs:seeAlso <http://127.0.0.1:8080/arm> ;
//     rdf:value :value-0 ;
//     lrt:elementType xsd:double ;
//     dcterms:modified "<time>"^^xsd:dateTime ;
//     hybrit:subscriptions <http://127.0.0.1:8080/arm/subscriptions> ;
//     hybrit:websocketUrl "ws://127.0.0.1:8080/arm/joints"^^xsd:anyURI .
//
// :value-0 rdf:first "0"^^xsd:double ;
//     rdf:rest :value-1 .
//
// :value-1 rdf:first "0.5"^^xsd:double ;
//     rdf:rest :value-2 .
//
// :value-2 rdf:first "-0.5"^^xsd:double ;
//     rdf:rest :value-3 .
//
// :value-3 rdf:first "0"^^xsd:double ;
//     rdf:rest :value-4 .
//
// :value-4 rdf:first "0.25"^^xsd:double ;
//     rdf:rest :value-5 .
//
// :value-5 rdf:first "0"^^xsd:double ;
//     rdf:rest () .
//
// PUT /arm/orientation
//   <> vom:quantityValue [ maths:x 0 ; maths:y 0 ; maths:z 0.6 ; maths:w 0.9 ] .
// 422 Unprocessable Content
// Content-Type: application/problem+json
// {"type":"about:blank","title":"Unprocessable Content","status":422,"detail":"property \"/arm/orientation\" was not written: expected a quaternion of norm 1 within 1e-09, found a norm of 1.0816653826391966"}
//
// PUT /arm/orientation
//   <> vom:quantityValue [ maths:x 0 ; maths:y 0 ; maths:z 0.6 ; maths:w 0.8 ] .
// 204 No Content
//
// POST /arm/actions/reach
//   <> maths:x 0.5 ; maths:y 0 ; maths:z 0.25 ; qudt:hasUnit unit:M .
// 204 No Content
// Location: http://127.0.0.1:8080/arm/actions/reach/id-1
//
// GET /arm/tool
// 200 OK
// Content-Type: text/turtle
// <http://127.0.0.1:8080/arm/tool> a hybrit:Property, spatial:SpatialRelationship ;
//     rdfs:seeAlso <http://127.0.0.1:8080/arm> ;
//     spatial:translation :translation ;
//     spatial:rotation :rotation ;
//     lrt:matrix :matrix-0 ;
//     dcterms:modified "<time>"^^xsd:dateTime ;
//     hybrit:subscriptions <http://127.0.0.1:8080/arm/subscriptions> ;
//     hybrit:websocketUrl "ws://127.0.0.1:8080/arm/tool"^^xsd:anyURI .
//
// :translation a spatial:Translation3D ;
//     vom:quantityKind vom:Length ;
//     vom:quantityValue :translation.value ;
//     qudt:hasUnit unit:M .
//
// :translation.value a maths:Vector3D ;
//     maths:x "0.5"^^xsd:double ;
//     maths:y "0"^^xsd:double ;
//     maths:z "0.25"^^xsd:double .
//
// :rotation a spatial:Rotation3D ;
//     vom:quantityKind vom:Angle ;
//     vom:quantityValue :rotation.value .
//
// :rotation.value a maths:Quaternion, maths:Vector4D ;
//     maths:x "0"^^xsd:double ;
//     maths:y "0"^^xsd:double ;
//     maths:z "0.6"^^xsd:double ;
//     maths:w "0.8"^^xsd:double .
//
// :matrix.0-0 rdf:first "0.28"^^xsd:double ;
//     rdf:rest :matrix.0-1 .
//
// :matrix.0-1 rdf:first "-0.96"^^xsd:double ;
//     rdf:rest :matrix.0-2 .
//
// :matrix.0-2 rdf:first "0"^^xsd:double ;
//     rdf:rest () .
//
// :matrix.1-0 rdf:first "0.96"^^xsd:double ;
//     rdf:rest :matrix.1-1 .
//
// :matrix.1-1 rdf:first "0.28"^^xsd:double ;
//     rdf:rest :matrix.1-2 .
//
// :matrix.1-2 rdf:first "0"^^xsd:double ;
//     rdf:rest () .
//
// :matrix.2-0 rdf:first "0"^^xsd:double ;
//     rdf:rest :matrix.2-1 .
//
// :matrix.2-1 rdf:first "0"^^xsd:double ;
//     rdf:rest :matrix.2-2 .
//
// :matrix.2-2 rdf:first "1"^^xsd:double ;
//     rdf:rest () .
//
// :matrix-0 rdf:first :matrix.0-0 ;
//     rdf:rest :matrix-1 .
//
// :matrix-1 rdf:first :matrix.1-0 ;
//     rdf:rest :matrix-2 .
//
// :matrix-2 rdf:first :matrix.2-0 ;
//     rdf:rest () .
