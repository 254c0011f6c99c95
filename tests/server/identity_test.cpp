// SPDX-License-Identifier: Apache-2.0
#include <lrt/identity.hpp>

#include <string>
#include <utility>

#include <lrt/served.hpp>
#include <lrt/server_thing.hpp>
#include <lrt/transport/loopback.hpp>

#include "tests/support/catch.hpp"
#include "tests/support/message.hpp"

using namespace lrt;
using namespace lrt::test;

TEST_CASE("the metrics say which robot they are of", "[server][identity]") {
  Identity identity;
  CHECK(prometheus_text(identity).empty());
  identity.iri = "urn:lrt:r7";
  identity.model = "a \"b\" \\ c";
  const std::string text = prometheus_text(identity);
  CHECK(text ==
        "# HELP lrt_robot_info Which robot this is; the value is 1.\n# TYPE lrt_robot_info gauge\n"
        "lrt_robot_info{iri=\"urn:lrt:r7\",model=\"a \\\"b\\\" \\\\ c\"} 1\n");

  Options options;
  options.listen.transport = transport::no_network;
  options.identity.iri = "urn:lrt:r7";
  Server server = Server::create(std::move(options)).value();
  CHECK(server.identity().iri == "urn:lrt:r7");
  server.add(server_thing(server)).value();
  RequestText request("GET /server/metrics\nHost: localhost:4711\nAccept: text/plain");
  request.get().local_port = 4711;
  const Answer answer(server.serve(request.get()).response);
  CHECK(answer.says("lrt_robot_info{iri=\"urn:lrt:r7\"} 1"));
  CHECK(answer.says("lrt_requests_total"));
}

TEST_CASE("a public base is the identity of a server that has no other, and a malformed one is refused", "[server][identity]") {
  Options options;
  options.listen.transport = transport::no_network;
  CHECK(Server::create(options).value().identity().iri.empty());
  options.listen.public_base = "https://robots.example/cell7";
  CHECK(Server::create(options).value().identity().iri == "https://robots.example/cell7");
  CHECK(prometheus_text(Server::create(options).value().identity()).find("cell7") != std::string::npos);
  options.identity.iri = "urn:lrt:r7";
  CHECK(Server::create(options).value().identity().iri == "urn:lrt:r7");
  options.identity.iri = "r7";
  const auto refused = Server::create(options);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::invalid_option);
}
