// SPDX-License-Identifier: Apache-2.0
// Payloads of CDR: the first byte chooses a type, the rest is the payload. What is decoded is of the type, comes back when it is encoded in either
// byte order, and is found by its places.
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/ros2/definitions.hpp>
#include <lrt/ros2/message_type.hpp>

namespace {

using namespace lrt::ros2;

void require(bool holds) {
  if (!holds) std::abort();
}

struct Subject {
  MessageType type;
  std::vector<MessageType::Place> places;
};

void add_places(const MessageType& type, const Message& message, const std::string& path, std::vector<MessageType::Place>& to) {
  for (const Field& field : message.fields) {
    to.push_back(type.place(path + field.name).value());
    if (field.type.message && field.type.arity == Arity::single) add_places(type, *field.type.message, path + field.name + ".", to);
  }
}

std::vector<Subject> make() {
  Definitions known;
  known.add_text("fuzz/msg/Empty", "").value();
  known.add_text("fuzz/msg/Small", "bool a\nstring b\nwstring c\n").value();
  known
      .add_text(
          "fuzz/msg/All",
          "int8 MODE_A=1\nint8 MODE_B=2\nbool a true\nint8 b\nuint16[3] c\nstring<=4 d \"x\"\nwstring<=3[<=2] e\nfloat32[] f\nfloat64 g\nEmpty[] h\n"
          "Small[2] i\nSmall[<=2] j\nbuiltin_interfaces/Time[] k\nbuiltin_interfaces/Duration l\nbyte[4] m\nchar[] n\nuint64 o\nint64[] p\n"
          "string[] q\nbool[] r\nint8 mode\nstd_msgs/Header s\n")
      .value();
  MessageOptions options, plain;
  options.field = [](const Message& in, const Field& field, std::string_view, FieldOptions& says) {
    says.enumerators = MessageOptions::of_constants(in, field);
    says.left_out = field.name == "g" || field.name == "stamp" || field.name == "i";
  };
  options.name = [](const Message& m, std::string_view) { return "named." + m.name.substr(m.name.rfind('/') + 1); };
  plain.times = false;
  plain.replace_invalid_text = false;
  CodecLimits limits;
  limits.max_bytes = 64 * 1024;
  limits.max_values = 10'000;
  std::vector<Subject> made;
  for (const char* name : {"fuzz/msg/All", "sensor_msgs/msg/JointState", "sensor_msgs/msg/PointCloud2", "tf2_msgs/msg/TFMessage",
                           "diagnostic_msgs/msg/DiagnosticArray", "rmw_dds_common/msg/ParticipantEntitiesInfo", "rcl_interfaces/msg/ParameterEvent",
                           "type_description_interfaces/srv/GetTypeDescription_Response", "visualization_msgs/msg/Marker"})
    for (const MessageOptions* o : {&plain, &options}) {
      Subject subject{MessageType::of(known.message(name).value(), *o, limits).value(), {}};
      add_places(subject.type, subject.type.message(), "", subject.places);
      made.push_back(std::move(subject));
    }
  return made;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<Subject> subjects = make();
  if (size == 0) return 0;
  const Subject& subject = subjects[data[0] % subjects.size()];
  const std::string_view payload(reinterpret_cast<const char*>(data) + 1, size - 1);
  const lrt::Result<lrt::rdf::Value> value = subject.type.decode(payload);
  for (const MessageType::Place& place : subject.places) {
    const auto found = subject.type.find(payload, place);
    if (found)
      require(found->bytes.empty() ||
              (found->bytes.data() >= payload.data() && found->bytes.data() + found->bytes.size() <= payload.data() + payload.size()));
    (void)subject.type.number(payload, place);
    (void)subject.type.text(payload, place);
    (void)subject.type.time(payload, place);
  }
  if (!value) return 0;
  require(subject.type.type().check(*value).has_value());
  for (const bool little : {true, false}) {
    const lrt::Result<std::string> again = subject.type.encode(*value, little);
    if (!again) {  // "other" cannot be sent; U+FFFD for a byte that is no text makes it longer than its bound
      require(again.error().code == lrt::Errc::expected_value || again.error().code == lrt::Errc::out_of_range ||
              again.error().code == lrt::Errc::limit_exceeded);
      continue;
    }
    const lrt::Result<lrt::rdf::Value> back = subject.type.decode(*again);
    require(back.has_value() && same(*back, *value));
  }
  return 0;
}
