// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/identity.hpp>
#include <lrt/mqtt.hpp>

#include "src/mqtt/topics.hpp"

namespace lrt::mqtt {
inline namespace v0 {

/// How a resource is published.
struct PublishedAs {
  const Publication* how;
  std::chrono::milliseconds minimum_interval;
  std::string_view frame{};  ///< of its values, as engine::Meaning
};

/// What a robot says of itself beside its structure document.
struct RobotFacts {
  std::string base;  ///< as Feed::base()
  const Topics& topics;
  bool takes_commands = false;
  bool describes = true;   ///< Description::publish
  bool discovers = false;  ///< Options::home_assistant
  /// How the resource with this topic is published; nullopt: it is not.
  std::function<std::optional<PublishedAs>(const std::string& topic)> published;
  Identity identity{};  ///< which robot it is
};

/// The descriptions of one Thing.
struct DescribedThing {
  std::string path;
  std::string json;       ///< for programs without RDF
  std::string discovery;  ///< for Home Assistant; empty: it has no Property that can be shown there, or is not wanted
};

/// The descriptions of the Things of one page of the structure document (SPEC 3.24).
struct DescribedPage {
  std::vector<DescribedThing> things;
  std::string next;  ///< target of the next page, "/ns/structure?page=2"; empty: there is none
};

/// @param structure  the structure document in JSON
/// @par Errors       expected_value, or those of the JSON parser: the document is not as SPEC 3.24 says
Result<DescribedPage> describe_things(std::string_view structure, const RobotFacts& robot);

}  // namespace v0
}  // namespace lrt::mqtt
