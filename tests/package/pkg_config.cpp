// SPDX-License-Identifier: Apache-2.0
// A host of all libraries of lrt that are installed. Its argument is a URDF.
#include <lrt/lrt.hpp>
#include <lrt/transport/loopback.hpp>
#ifdef WITH_CLIENT
#include <lrt/check.hpp>
#include <lrt/client/units.hpp>
#include <lrt/codegen.hpp>
#include <lrt/mirror.hpp>
#endif
#ifdef WITH_QUERY
#include <lrt/query.hpp>
#endif
#ifdef WITH_URDF
#include <lrt/urdf.hpp>
#endif
#ifdef WITH_MQTT
#include <lrt/mqtt.hpp>
#endif
#ifdef WITH_PROTOBUF
#include <google/protobuf/timestamp.pb.h>
#include <lrt/protobuf.hpp>
#endif
#ifdef WITH_LIBRDF
#include <lrt/redland.hpp>
#endif
#ifdef WITH_ROS2
#include <lrt/ros2/message_type.hpp>
#endif

int main([[maybe_unused]] int argc, [[maybe_unused]] char** argv) {
  lrt::Options options;
  options.listen.transport = lrt::transport::no_network;
  options.identity.iri = "https://robots.example/r1";
#ifdef WITH_QUERY
  options.query = lrt::query::endpoint();
#endif
  lrt::Server server = lrt::Server::create(options).value();
#ifdef WITH_CLIENT
  if (!lrt::client::convert(1, "m", "mm")) return 1;
  if (lrt::check::run("no URL") || !lrt::codegen::generate({}) || lrt::mirror::Mirror::create({})) return 1;
#endif
#ifdef WITH_URDF
  if (argc != 2) return 2;
  lrt::urdf::load(argv[1]).value().add_to(server).value();
#endif
#ifdef WITH_MQTT
  lrt::mqtt::Options mqtt;
  mqtt.broker.port = 1;
  mqtt.prefix = "robots/r1";
  lrt::mqtt::Bridge::create(server, mqtt).value().poll();
#endif
#ifdef WITH_PROTOBUF
  lrt::Thing clock{"clock"};
  clock.property("time", [] { return google::protobuf::Timestamp(); });
  server.add(std::move(clock)).value();
#endif
#ifdef WITH_LIBRDF
  lrt::World world("world");
  if (lrt::redland::Model::attach(world, "tasks", nullptr)) return 1;
  librdf_free_world(librdf_new_world());
#endif
#ifdef WITH_ROS2
  lrt::ros2::MessageType::of(lrt::ros2::Definitions().message("std_msgs/msg/Header").value()).value();
#endif
}
