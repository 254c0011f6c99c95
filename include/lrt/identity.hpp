// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>

namespace lrt {
inline namespace v0 {

/// Which robot this is, whatever its address and the program that runs on it: Options::identity. It is stated at `/`
/// and `/all` (lrt:identity), in the status on an MQTT broker and in the metrics (lrt_robot_info), so that ten thousand
/// robots can be told apart, and two robots with one identity are noticed.
///
///     options.identity.iri = "https://robots.example/r7";
///
/// Everybody who may read `/` sees it.
/// @par Threads  Distinct objects: any thread.
struct LRT_API Identity {
  /// An absolute IRI that stays for the life of the robot: "https://robots.example/r7", "urn:uuid:...". Nothing has to be
  /// served there. Empty: there is no identity, and the other members are empty, too.
  std::string iri;
  std::string serial_number;     ///< of its maker: "A-1047"
  std::string model;             ///< "Baxter"
  std::string manufacturer;      ///< "Rethink Robotics"
  std::string software_version;  ///< of the robot's program, as people name it: "2.4.1"
  std::string build;             ///< which build of it: a commit or a hash, "66dc05c1"

  /// Reads an identity from a file that provisioning has written: one JSON object with the members `iri`, `serialNumber`,
  /// `model`, `manufacturer`, `softwareVersion` and `build`, each a text. All but `iri` may be absent.
  /// @par Errors  io_error: it cannot be read; invalid_option: it is not such an object, with the member and what was
  ///              found
  static Result<Identity> from_file(const std::string& path);

  /// A short name for topics and labels: the fragment of the IRI, or the last part of its path, "r7". Of
  /// "https://r7.example/" it is the host. Empty without an IRI.
  std::string name() const;
};

}  // namespace v0
}  // namespace lrt
