// SPDX-License-Identifier: Apache-2.0
#include <lrt/urdf.hpp>

#include <cmath>
#include <cstdint>
#include <string>

#include <lrt/engine/engine.hpp>

#include "tests/fuzz/round_trip.hpp"

// A description -> a model, or one error with words -> a robot whose Things are all added or refused with words, and whose links are
// somewhere.

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(bytes), size);
  lrt::urdf::ParseOptions options;
  options.arguments["p"] = "q";
  options.max_elements = 200;
  options.max_bytes = 20'000;
  lrt::Result<lrt::urdf::Model> model = lrt::urdf::parse(text, options);
  if (!model) {
    if (model.error().message.empty()) lrt::fuzz::broken("an error without a word", text);
    return 0;
  }
  lrt::urdf::Robot robot(*std::move(model));
  const std::vector<double> positions(robot.model().variables.size(), 0.5);
  robot.publish(positions, positions, positions);
  for (std::size_t l = 0; l < robot.model().links.size(); ++l) static_cast<void>(robot.pose(l));
  lrt::engine::Engine engine;
  if (const auto added = robot.add_to(engine); !added && added.error().message.empty()) lrt::fuzz::broken("an error without a word", text);
  return 0;
}
