// SPDX-License-Identifier: Apache-2.0
// A host of lrt::protobuf: a message that protoc has made, and one by its descriptor.
#include <google/protobuf/timestamp.pb.h>
#include <google/protobuf/type.pb.h>
#include <lrt/lrt.hpp>
#include <lrt/protobuf.hpp>

int main() {
  lrt::Options options;
  options.listen.port = 0;
  lrt::Server server = lrt::Server::create(options).value();
  lrt::Thing robot{"robot"};
  robot.property("time", [] { return google::protobuf::Timestamp(); });
  google::protobuf::EnumValue message;
  lrt::protobuf::Options choice;
  choice.field = [](const google::protobuf::FieldDescriptor&, lrt::protobuf::Field& says) { says.as_json = true; };
  const auto type = lrt::protobuf::MessageType::of(*message.GetDescriptor(), choice).value();
  robot.property("value", type.type(), [&] { return type.encode(message); });
  server.add(std::move(robot)).value();
}
