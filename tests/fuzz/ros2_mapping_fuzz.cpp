// SPDX-License-Identifier: Apache-2.0
// A mapping in TOML and in Turtle, and the options of a file: nothing crashes, and each error has a sentence.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include <lrt/ros2.hpp>

#include "src/ros2/bridge/mapping_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  for (const char* format : {"application/toml", "text/turtle"}) {
    lrt::ros2::Mapping mapping;
    const lrt::Result<void> added = mapping.add(text, format);
    if (!added && added.error().message.empty()) std::abort();
  }
  const lrt::Result<lrt::ros2::Options> options = lrt::ros2::options_from_toml(text, "file");
  if (!options && options.error().message.empty()) std::abort();
  return 0;
}
