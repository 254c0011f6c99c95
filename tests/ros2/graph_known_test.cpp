// SPDX-License-Identifier: Apache-2.0
#include "src/ros2/graph/known.hpp"

#include "src/ros2/graph/cdr.hpp"
#include "src/ros2/graph/parameters.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::ros2;

namespace {

Gid gid(std::uint8_t participant, std::uint8_t entity, std::uint8_t kind = 4) {
  Gid made{};
  made.bytes[0] = participant;
  made.bytes[14] = entity;
  made.bytes[15] = kind;
  return made;
}
constexpr std::array<std::uint8_t, 2> eprosima{1, 0x0f}, cyclone{1, 0x10}, other{1, 1};

struct Fixture {
  int changes = 0;
  Known known{GraphLimits{}, [this] { ++changes; }};
  void participant(std::uint8_t id, std::array<std::uint8_t, 2> vendor, const std::string& user_data) {
    known.found(dds::ParticipantData{prefix_of(gid(id, 0)), vendor, user_data});
  }
  void server(std::uint8_t id, const std::string& service, const std::string& user_data = {}, std::uint8_t entity = 1,
              const std::string& type = "a::srv::dds_::B") {
    known.found(dds::EndpointData{gid(id, entity), false, "rq" + service + "Request", type + "_Request_", user_data, {}});
    known.found(dds::EndpointData{gid(id, entity, 3), true, "rr" + service + "Reply", type + "_Response_", user_data, {}});
  }
  IdentityForm form(const std::string& service) { return known.server(service, "a/srv/B").form; }
};

}  // namespace

TEST_CASE("the form of a service is told by its participant and user data, and in doubt unknown", "[ros2][known]") {
  Fixture graph;
  graph.participant(1, cyclone, "enclave=/;");
  graph.participant(2, eprosima, "enclave=/;");
  graph.participant(3, eprosima, "");
  graph.participant(4, other, "enclave=/;");
  graph.participant(5, eprosima, "my_enclave=/;");
  graph.server(1, "/cyclone", "serviceid=1.2.3;");
  graph.server(1, "/plain_cyclone", {}, 5);
  graph.server(2, "/fast");
  graph.server(2, "/fast_with_header", "serviceid=1.2.3;", 5);
  graph.server(3, "/fast_without_ros");
  graph.server(3, "/fast_with_hash", "typehash=RIHS01_" + std::string(64, '0') + ";", 5);
  graph.server(4, "/vendor");
  graph.server(5, "/like_ros");
  graph.server(9, "/of_nobody");
  CHECK(graph.form("/cyclone") == IdentityForm::header);
  CHECK(graph.form("/plain_cyclone") == IdentityForm::header);
  CHECK(graph.form("/fast") == IdentityForm::inline_qos);
  CHECK(graph.form("/fast_with_header") == IdentityForm::header);
  CHECK(graph.form("/fast_without_ros") == IdentityForm::unknown);
  CHECK(graph.form("/fast_with_hash") == IdentityForm::inline_qos);
  CHECK(graph.form("/vendor") == IdentityForm::unknown);
  CHECK(graph.form("/like_ros") == IdentityForm::unknown);
  CHECK(graph.form("/of_nobody") == IdentityForm::unknown);
  graph.server(1, "/fast", {}, 7);
  CHECK(graph.form("/fast") == IdentityForm::unknown);  // two servers that differ
  graph.known.gone(prefix_of(gid(1, 0)));
  CHECK(graph.form("/fast") == IdentityForm::inline_qos);
  graph.known.nodes(prefix_of(gid(3, 0)), ParticipantEntities{16, {}});
  CHECK(graph.form("/fast_without_ros") == IdentityForm::inline_qos);
}

TEST_CASE("a server has a reader and a writer that belong together", "[ros2][known]") {
  Fixture graph;
  graph.participant(1, cyclone, "");
  graph.participant(2, cyclone, "");
  graph.known.found(dds::EndpointData{gid(1, 1), false, "rq/aRequest", "a::srv::dds_::B_Request_", "serviceid=1;", {}});
  CHECK(graph.known.server("/a", "a/srv/B").pairs.empty());
  CHECK(graph.known.server("/a", "a/srv/B").incomplete);
  CHECK_FALSE(graph.known.snapshot(1)->service("/a")->is_ready);
  graph.known.found(dds::EndpointData{gid(2, 2, 3), true, "rr/aReply", "a::srv::dds_::B_Response_", "serviceid=1;", {}});  // of another participant
  graph.known.found(dds::EndpointData{gid(1, 3, 3), true, "rr/aReply", "a::srv::dds_::B_Response_", "serviceid=2;", {}});  // of another service
  CHECK(graph.known.server("/a", "a/srv/B").pairs.empty());
  graph.known.found(dds::EndpointData{gid(1, 4, 3), true, "rr/aReply", "a::srv::dds_::B_Response_", "serviceid=1;", {}});
  CHECK(graph.known.server("/a", "a/srv/B").pairs.size() == 1);
  CHECK(graph.known.snapshot(1)->service("/a")->is_ready);
  CHECK(graph.known.server("/a", "a/srv/C").pairs.empty());
  // Clients are no servers.
  graph.known.found(dds::EndpointData{gid(2, 5, 3), true, "rq/cRequest", "a::srv::dds_::B_Request_", "", {}});
  CHECK(graph.known.snapshot(1)->service("/c") == nullptr);
}

TEST_CASE("actions are made of their services, and names that ROS cannot have are left out and counted", "[ros2][known]") {
  Fixture graph;
  graph.participant(1, cyclone, "");
  graph.server(1, "/arm/wave/_action/send_goal", {}, 1, "a::action::dds_::Wave_SendGoal");
  graph.server(1, "/arm/wave/_action/get_result", {}, 2, "a::action::dds_::Wave_GetResult");
  REQUIRE(graph.known.snapshot(1)->action("/arm/wave") != nullptr);
  CHECK_FALSE(graph.known.snapshot(1)->action("/arm/wave")->is_ready);
  graph.server(1, "/arm/wave/_action/cancel_goal", {}, 3, "action_msgs::srv::dds_::CancelGoal");
  const auto topic = [&](const std::string& name, std::uint8_t entity) {
    graph.known.found(dds::EndpointData{gid(1, entity, 3), true, name, "std_msgs::msg::dds_::String_", "", {}});
  };
  topic("rt/arm/wave/_action/feedback", 10);
  topic("rt/arm/wave/_action/status", 11);
  topic("rt/arm/joint_states", 12);
  topic("not_of_ros", 13);
  topic("rt/a b", 14);
  topic("rt/" + std::string(260, 'a'), 15);
  topic("rq/aRequest", 16);
  const auto seen = graph.known.snapshot(7);
  CHECK(seen->version == 7);
  CHECK(seen->action("/arm/wave")->is_ready);
  CHECK(seen->action("/arm/wave")->type == "a/action/Wave");
  CHECK(seen->services.empty());
  REQUIRE(seen->topics.size() == 1);
  CHECK(seen->topic("/arm/joint_states") != nullptr);
  CHECK(graph.known.refused_endpoints() == 3);
}

TEST_CASE("the order of endpoints does not depend on time, and nodes cannot claim endpoints of others", "[ros2][known]") {
  Fixture graph;
  graph.participant(1, cyclone, "");
  graph.participant(2, cyclone, "");
  for (const std::uint8_t entity : {std::uint8_t{9}, std::uint8_t{3}, std::uint8_t{7}})
    graph.known.found(dds::EndpointData{gid(1, entity, 3), true, "rt/a", "a::msg::dds_::B_", "", {}});
  graph.known.nodes(prefix_of(gid(1, 0)), ParticipantEntities{16, {{"/one", {}, {gid(1, 3, 3)}}}});
  graph.known.nodes(prefix_of(gid(2, 0)), ParticipantEntities{16, {{"/two", {}, {gid(1, 7, 3)}}}});
  const auto seen = graph.known.snapshot(1);
  const auto& writers = seen->topic("/a")->writers;
  REQUIRE(writers.size() == 3);
  CHECK(writers[0].gid < writers[1].gid);
  CHECK(writers[1].gid < writers[2].gid);
  CHECK(writers[0].node == "/one");
  CHECK(writers[1].node.empty());
  CHECK(seen->nodes.size() == 2);
  CHECK(graph.known.gid_bytes() == 16);
  graph.known.nodes(prefix_of(gid(2, 0)), ParticipantEntities{24, {}});
  CHECK(graph.known.gid_bytes() == 0);
}

TEST_CASE("parameters are written and read, and what breaks their form is an error", "[ros2][known]") {
  const auto round = [](ParameterType type, rdf::Value value) {
    Parameter parameter;
    parameter.name = "p";
    parameter.type = type;
    parameter.value = value;
    const auto request = set_request(parameter);
    REQUIRE(request);
    // The same members follow in an event: {Time, node, Parameter[], ...}. With a node of three letters they have the same alignment.
    CdrWriter event;
    event.u32(0).u32(0).text("/no").bytes(std::string_view(*request).substr(4, 0));
    std::string payload = event.payload() + std::string(request->substr(4));
    while (payload.size() % 4 != 0) payload += '\0';
    payload += std::string(8, '\0');
    const auto change = read_event(payload);
    REQUIRE(change);
    REQUIRE(change->parameters.size() == 1);
    CHECK(change->parameters[0].name == "p");
    CHECK(change->parameters[0].type == type);
    CHECK(rdf::same(change->parameters[0].value, value));
  };
  using List = rdf::Value::Sequence;
  round(ParameterType::not_set, rdf::Value());
  round(ParameterType::boolean, rdf::Value(true));
  round(ParameterType::integer, rdf::Value(std::int64_t{-5}));
  round(ParameterType::real, rdf::Value(0.25));
  round(ParameterType::text, rdf::Value(std::string("fast")));
  round(ParameterType::bytes, rdf::Value(std::string("AQI=")));
  round(ParameterType::booleans, rdf::Value(List{rdf::Value(true), rdf::Value(false)}));
  round(ParameterType::integers, rdf::Value(List{rdf::Value(std::int64_t{1}), rdf::Value(std::int64_t{2})}));
  round(ParameterType::reals, rdf::Value(List{rdf::Value(1.5)}));
  round(ParameterType::texts, rdf::Value(List{rdf::Value(std::string("a")), rdf::Value(std::string("bc"))}));
  Parameter wrong;
  wrong.name = "p";
  wrong.type = ParameterType::integer;
  for (rdf::Value value : {rdf::Value(1.5), rdf::Value(true), rdf::Value(std::string("1")), rdf::Value()}) {
    wrong.value = std::move(value);
    CHECK(set_request(wrong).error().code == Errc::expected_value);
  }
  wrong.type = ParameterType::bytes;
  wrong.value = rdf::Value(std::string("A==="));
  CHECK(set_request(wrong).error().code == Errc::expected_value);
  std::vector<Parameter> parameters(3);
  for (std::size_t size = 0; size < 200; ++size) {
    const std::string payload = std::string("\0\1\0\0", 4) + std::string(size, '\xff');
    CHECK_FALSE(read_values(payload, parameters));
    CHECK_FALSE(read_descriptors(payload, parameters));
    CHECK_FALSE(read_list_response(payload, 10));
    CHECK_FALSE(read_event(payload));
  }
}
