// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <utility>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/identity.hpp>

namespace lrt::engine {
inline namespace v0 {

struct Description;

/// The most bytes that a member of an identity has.
constexpr std::size_t max_identity_bytes = 1'000;

/// Whether an identity is none, or has an absolute IRI and texts without control characters.
/// @par Errors  invalid_option, with the member
Result<void> check(const Identity& identity);

/// Calls a function with the name that JSON has for each member that is not empty, and the text.
template <class F>
void for_each_member(const Identity& identity, F f) {
  const std::pair<std::string_view, const std::string*> all[] = {
      {"iri", &identity.iri},
      {"serialNumber", &identity.serial_number},
      {"model", &identity.model},
      {"manufacturer", &identity.manufacturer},
      {"softwareVersion", &identity.software_version},
      {"build", &identity.build},
  };
  for (const auto& [name, text] : all)
    if (!text->empty()) f(name, *text);
}

/// An identity as Identity::from_file() reads it: {"iri":"https://robots.example/r7","model":"Baxter"}
LRT_INTERNAL_API std::string json_of(const Identity& identity);

/// Links a document of the server to the robot's identity, and states its members; nothing if there is none.
void describe_identity(const std::string& document, const Description& d);

}  // namespace v0
}  // namespace lrt::engine
