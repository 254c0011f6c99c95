// SPDX-License-Identifier: Apache-2.0
#include <lrt/shacl/validator.hpp>

#include "tests/shacl/support.hpp"

// Figures 2a with 2b and 5a with 5b of the paper, corrected as in SPEC 3.2: the domain predicate alone instead of an alternative with
// hybrit:property, the range on the number instead of the unit, and maths:Degree.

namespace {

using Lines = std::vector<std::string>;

const char* const figure_2a = R"(
ros:RevoluteJointShape a sh:NodeShape ;
  sh:targetClass ros:RevoluteJoint ;
  sh:property [ sh:path ros:rotation ; sh:minCount 1 ; sh:maxCount 1 ; sh:class hybrit:Property ; sh:node spatial:AxisAngleShape ] ;
  sh:property [ sh:path ros:jointReferenceFrame ; sh:minCount 1 ; sh:maxCount 1 ; sh:class hybrit:Property ; sh:node maths:CoordinateSystemShape ] ;
  sh:property [ sh:path ros:preceedingLink ; sh:minCount 1 ; sh:maxCount 1 ; sh:class ros:Link ] ;
  sh:property [ sh:path ros:succeedingLink ; sh:minCount 1 ; sh:maxCount 1 ; sh:class ros:Link ] .
spatial:AxisAngleShape a sh:NodeShape ; sh:class spatial:AxisAngle .
maths:CoordinateSystemShape a sh:NodeShape ; sh:class maths:CoordinateSystem .
)";

const char* const figure_2b = R"(
@prefix dcterms: <http://purl.org/dc/terms/> . @prefix xhv: <http://www.w3.org/1999/xhtml/vocab#> .
@base <http://example.org/baxter/> .
<right_s1> a hybrit:RoboticThing , ros:RevoluteJoint ;
  hybrit:blueprint ros:RevoluteJointShape ;
  hybrit:subscriptions <right_s1/subscriptions> ;
  hybrit:action <right_s1/actions/rotate> ;
  hybrit:property <right_s1/friction> , <right_s1/rotation> , <right_s1/jointReferenceFrame> ;
  dcterms:title "right_s1" ;
  ros:friction <right_s1/friction> ;
  ros:jointReferenceFrame <right_s1/jointReferenceFrame> ;
  ros:rotation <right_s1/rotation> ;
  xhv:prev <right_upper_shoulder> ; xhv:next <right_lower_shoulder> ;
  ros:preceedingLink <right_upper_shoulder> ;
  ros:succeedingLink <right_lower_shoulder> .
<right_s1/rotation> a spatial:AxisAngle , spatial:Rotation3D , hybrit:Property .
<right_s1/jointReferenceFrame> a maths:CoordinateSystem , hybrit:Property .
<right_upper_shoulder> a ros:Link .
<right_lower_shoulder> a ros:Link .
)";

const char* const figure_5a = R"(
<http://example.org/baxter/right_s1/actions/rotate#input> a sh:NodeShape ;
  sh:targetClass maths:Scalar ;
  sh:property [ sh:path vom:numericalValue ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:float ; sh:minInclusive 0 ; sh:maxExclusive 360 ] ;
  sh:property [ sh:path vom:unit ; sh:minCount 1 ; sh:maxCount 1 ; sh:hasValue maths:Degree ] .
)";

Lines rotate(const std::string& body) {
  const std::string target = "http://example.org/baxter/right_s1/actions/rotate";
  const auto shapes = shacl_test::compile(figure_5a);
  const auto report = lrt::shacl::validate(shapes, shacl_test::parse(body, target), lrt::rdf::iri(target), lrt::rdf::iri(target + "#input"));
  REQUIRE(report);
  Lines found;
  for (const auto& r : report->results()) {
    const std::string line = shacl_test::line(r);
    found.push_back(line.substr(line.find(' ') + 1));
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

TEST_CASE("the joint of Figure 2b conforms to the Blueprint of Figure 2a", "[shacl][R1.11]") {
  CHECK(shacl_test::lines(figure_2a, figure_2b).empty());
}

TEST_CASE("a joint without the properties that Figure 2a requires does not conform", "[shacl][R1.11]") {
  std::string data = figure_2b;
  const auto without = [&](const std::string& text) {
    std::string changed = data;
    changed.erase(changed.find(text), text.size());  // what follows stays well-formed
    return shacl_test::lines(figure_2a, changed);
  };
  const std::string joint = "http://example.org/baxter/right_s1 ";
  CHECK(without("<right_upper_shoulder> a ros:Link .") == Lines{joint + "ros:preceedingLink http://example.org/baxter/right_upper_shoulder Class"});
  CHECK(without("ros:rotation <right_s1/rotation> ;") == Lines{joint + "ros:rotation - MinCount"});
  CHECK(without("spatial:AxisAngle , ") == Lines{joint + "ros:rotation http://example.org/baxter/right_s1/rotation Node"});
  CHECK(without(", hybrit:Property .\n<right_upper_shoulder> a ros:Link") ==
        Lines{joint + "ros:jointReferenceFrame http://example.org/baxter/right_s1/jointReferenceFrame Class",
              joint + "ros:preceedingLink http://example.org/baxter/right_upper_shoulder Class"});
}

TEST_CASE("Figure 5b conforms to the input shape of Figure 5a, and other inputs are refused for the right reason", "[shacl][R1.11]") {
  CHECK(rotate("<> a maths:Scalar ; vom:numericalValue \"43.6\"^^xsd:float ; vom:unit maths:Degree .").empty());
  CHECK(rotate("<> vom:numericalValue \"0\"^^xsd:float ; vom:unit maths:Degree ; ros:friction 1 .").empty());
  CHECK(rotate("<> vom:numericalValue \"360\"^^xsd:float ; vom:unit maths:Degree .") == Lines{"vom:numericalValue \"360\" MaxExclusive"});
  CHECK(rotate("<> vom:numericalValue \"-1\"^^xsd:float ; vom:unit maths:Degree .") == Lines{"vom:numericalValue \"-1\" MinInclusive"});
  CHECK(rotate("<> vom:numericalValue \"fast\"^^xsd:float ; vom:unit maths:Degree .") ==
        Lines{"vom:numericalValue \"fast\" Datatype", "vom:numericalValue \"fast\" MaxExclusive", "vom:numericalValue \"fast\" MinInclusive"});
  CHECK(rotate("<> vom:numericalValue 43.6 ; vom:unit maths:Degree .") == Lines{"vom:numericalValue \"43.6\" Datatype"});
  CHECK(rotate("<> vom:numericalValue \"1\"^^xsd:float, \"2\"^^xsd:float ; vom:unit maths:Degree .") == Lines{"vom:numericalValue - MaxCount"});
  CHECK(rotate("<> vom:numericalValue \"43.6\"^^xsd:float .") == Lines{"vom:unit - HasValue", "vom:unit - MinCount"});
  CHECK(rotate("<> vom:numericalValue \"43.6\"^^xsd:float ; vom:unit maths:Radian .") == Lines{"vom:unit - HasValue"});
  CHECK(rotate("<> vom:numericalValue \"43.6\"^^xsd:float ; vom:unit maths:Degree, maths:Radian .") == Lines{"vom:unit - MaxCount"});
  CHECK(rotate("") == Lines{"vom:numericalValue - MinCount", "vom:unit - HasValue", "vom:unit - MinCount"});
}
