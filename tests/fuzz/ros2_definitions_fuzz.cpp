// SPDX-License-Identifier: Apache-2.0
// Definitions: a text of a .msg, .srv or .action, or what a node responds to get_type_description. The first byte says which.
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include <lrt/ros2/definitions.hpp>

#include "src/ros2/types/names.hpp"
#include "src/ros2/types/parser.hpp"

namespace {

using namespace lrt::ros2;

void require(bool holds) {
  if (!holds) std::abort();
}

/// What is given back is complete: each message has its definition, and no message is in itself.
void walk(const Message& message, int depth) {
  require(depth < 8);
  require(is_type_name(message.name));
  for (const Field& field : message.fields) {
    require((field.type.kind == Kind::message) == (field.type.message != nullptr));
    require(!field.name.empty());
    if (field.type.message) walk(*field.type.message, depth + 1);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  DefinitionLimits limits;
  limits.max_text_bytes = 16 * 1024;
  limits.max_depth = 6;
  limits.max_members = 200;
  Definitions known(limits);
  switch (data[0] % 5) {
    case 0:
    case 1:
      if (known.add_text("fuzz/msg/Thing", text)) {
        const auto message = known.message("fuzz/msg/Thing");
        if (message) walk(**message, 0);
      }
      break;
    case 2:
      if (known.add_text("fuzz/srv/Thing", text)) (void)known.service("fuzz/srv/Thing");
      break;
    case 3:
      if (known.add_text("fuzz/action/Thing", text)) (void)known.action("fuzz/action/Thing");
      break;
    default: {
      const auto name = known.add_type_description(text, "fuzz/msg/Thing", "", "/node");
      if (!name) break;
      const auto message = known.message(*name);
      if (message) walk(**message, 0);
    }
  }
  const std::size_t half = text.size() / 2;
  (void)fits(text.substr(0, half), text.substr(half));
  const std::string type = ros_type_of(text);
  if (!type.empty()) require(dds_type_of(type) == text);
  return 0;
}
