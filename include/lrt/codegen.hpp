// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/client/description.hpp>

namespace lrt::codegen {
inline namespace v0 {

/// Options and limits of generate().
struct GenerateOptions {
  std::string name_space = "robot";          ///< "robot" or "acme::robot"; no part may be "lrt" or "std"
  std::size_t max_name = 64;                 ///< characters of an identifier; longer names are cut
  std::size_t max_comment = 200;             ///< bytes of one text of the robot in a comment; longer ones are cut
  std::size_t max_text = 4'096;              ///< bytes of one IRI or name in a string literal; members with longer ones are left out
  std::size_t max_array = 64;                ///< members of a std::array; longer lists of a fixed length are std::vector
  std::size_t max_bytes = 16 * 1024 * 1024;  ///< of the header; beyond: Errc::limit_exceeded
  std::size_t max_warnings = 1'000;          ///< further ones are left out
};

/// The result of generate().
struct Generated {
  std::string header;                 ///< the text of the header
  std::vector<std::string> warnings;  ///< those of the description, and what C++ cannot express; the latter are also comments in the header
};

/// Writes a C++17 header for a robot: a struct or enum with rdf::traits for each type of its Blueprints, and a class
/// for each kind of Thing with typed properties and actions. The header includes only lrt/client.hpp.
///
/// From a description without Things the types of its shapes are generated.
///
/// Things of one kind share a Blueprint and have equal types of values. If their bounds of numbers differ, the class
/// has none.
///
/// The same description gives the same bytes. Things, properties and actions are in the order of their names; fields
/// are in the order of the shapes. Texts of the robot cannot end their comments and string literals. The last lines
/// list what the header was generated from, with a digest, for check().
///
/// @par Errors   invalid_option: the namespace; limit_exceeded: max_bytes
/// @par Threads  Any.
/// @par Time     Allocates. Performs no I/O.
LRT_API Result<Generated> generate(const client::Description& robot, const GenerateOptions& options = {});

/// Compares a generated header with the present description of a robot. Returns one sentence for each difference, with
/// the kind of Thing, the property or action, and the field. Empty: the header is up to date. Host and port of the
/// robot are ignored.
/// @par Errors   expected_value: the text was not made by generate(), or its list has been changed
/// @par Threads  Any.
/// @par Time     Allocates. Performs no I/O.
LRT_API Result<std::vector<std::string>> check(std::string_view header, const client::Description& robot, const GenerateOptions& options = {});

}  // namespace v0
}  // namespace lrt::codegen
