// SPDX-License-Identifier: Apache-2.0
// A program whose data are messages of Protocol Buffers (arm.proto). What protoc has made is a type of lrt without further code; messages that only
// their descriptors describe are served by glue() below, the same lines for any message.
//
//   ex_protobuf_host --port 8080 &  curl -H 'Accept: application/json' http://127.0.0.1:8080/arm/status
//   curl -d '{"motion":{"moveL":{"x":1,"y":2,"z":3}}}' -H 'Content-Type: application/json' http://127.0.0.1:8080/arm/actions/move
//   curl -d '{"motion":{}}' -H 'Content-Type: application/json' http://127.0.0.1:8080/arm/actions/move

#include <google/protobuf/descriptor.h>
#include <google/protobuf/dynamic_message.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <string_view>
#include <thread>

#include <lrt/lrt.hpp>
#include <lrt/protobuf.hpp>

#include "arm.pb.h"

namespace {

volatile std::sig_atomic_t ended = 0;
void on_signal(int) { ended = 1; }

/// What a .proto file does not say.
lrt::protobuf::Options options() {
  lrt::protobuf::Options o;
  o.field = [](const google::protobuf::FieldDescriptor& field, lrt::protobuf::Field& says) {
    if (field.full_name() == "acme.Joint.position") says.facets.unit(lrt::unit::radian);
    if (field.full_name() == "acme.Joint.velocity") says.facets.unit(lrt::unit::radian_per_second);
    if (field.full_name() == "acme.Limits.max_velocity") says.facets.unit(lrt::unit::radian_per_second).between(0, 3);
  };
  o.oneof_is_required = [](const google::protobuf::OneofDescriptor& oneof) { return oneof.full_name() == "acme.Command.motion"; };
  return o;
}

/// A writable Property of any message: `message` holds its value.
void glue(lrt::Thing& thing, std::string_view path, const std::shared_ptr<google::protobuf::Message>& message) {
  const auto type = lrt::protobuf::MessageType::of(*message->GetDescriptor(), options()).value();
  thing.property(path, type.type(), [=] { return type.encode(*message); }).on_write([=](const lrt::rdf::Value& v) {
    return type.decode(v, *message);
  });
}

}  // namespace

template <>
struct lrt::protobuf::OptionsOf<acme::Status> {
  static Options options() { return ::options(); }
};
template <>
struct lrt::protobuf::OptionsOf<acme::Command> {
  static Options options() { return ::options(); }
};

int main(int argc, char** argv) {
  const int port = argc > 2 && std::string_view(argv[1]) == "--port" ? std::atoi(argv[2]) : 8080;
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);

  acme::Status status;
  for (const char* name : {"shoulder", "elbow"}) {
    status.add_joints()->set_name(name);
    (*status.mutable_temperatures())[name] = 31.5;
  }

  lrt::Thing arm{"arm"};
  // Messages that protoc has made: values as all others.
  auto published = arm.property<acme::Status>("status");
  arm.action("move", [&](const acme::Command& command) {
    status.set_mode(acme::MOVING);
    if (!command.has_move_j()) return;
    for (int i = 0; i < std::min(status.joints_size(), command.move_j().positions_size()); ++i)
      status.mutable_joints(i)->set_position(command.move_j().positions(i));
  });
  // A message that the program knows by its descriptor only, as from a file that protoc has written (--descriptor_set_out).
  google::protobuf::DynamicMessageFactory factory;
  const google::protobuf::Descriptor* const limits = google::protobuf::DescriptorPool::generated_pool()->FindMessageTypeByName("acme.Limits");
  glue(arm, "limits", std::shared_ptr<google::protobuf::Message>(factory.GetPrototype(limits)->New()));

  lrt::Options server_options;
  server_options.listen.port = static_cast<std::uint16_t>(port);
  auto server = lrt::Server::create(std::move(server_options));
  if (!server) return std::fprintf(stderr, "%s\n", server.error().message.c_str()), 1;
  if (auto added = server->add(std::move(arm)); !added) return std::fprintf(stderr, "%s\n", added.error().message.c_str()), 1;
  std::printf("listening on http://127.0.0.1:%d/\n", static_cast<int>(server->port()));
  std::fflush(stdout);

  // The program's own loop: lambdas run in poll(), on this thread.
  while (ended == 0) {
    const auto now = std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::system_clock::now().time_since_epoch()).count();
    status.mutable_at()->set_seconds(now / 1000);
    published.publish(status);  // copies the message
    server->poll();
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}
