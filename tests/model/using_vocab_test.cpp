// SPDX-License-Identifier: Apache-2.0
// A program that says `using namespace` for both: each name below must mean one thing.
#include <lrt/lrt.hpp>

#include <lrt/engine/engine.hpp>
#include <lrt/shacl/report.hpp>

#include "tests/support/catch.hpp"

using namespace lrt;         // NOLINT: what is tested
using namespace lrt::vocab;  // NOLINT: what is tested

TEST_CASE("the namespaces of vocabularies have no name of lrt", "[model]") {
  lrt::Thing thing{"arm"};
  thing.type(ros::Robot).add(dcterms::title, Object("arm")).add(lrt_::frame, rdf_::nil);
  thing.property<double>("angle", unit::radian).add(qudt::hasUnit, unit_::RAD).facets(rdf::Facets().at_least(0));
  CHECK(rdf_::type.text == "http://www.w3.org/1999/02/22-rdf-syntax-ns#type");
  CHECK(lrt::unit::radian.qudt == unit_::RAD);
  const model::ThingSpec* spec = nullptr;
  const shacl::Report* report = nullptr;
  const engine::EngineOptions* options = nullptr;
  const transport::Limits* limits = nullptr;
  const http::Request* request = nullptr;
  const subscription::SubscriptionOptions* subscriptions = nullptr;
  CHECK((!spec && !report && !options && !limits && !request && !subscriptions));
}
