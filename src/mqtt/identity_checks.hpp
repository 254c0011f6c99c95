// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include <lrt/identity.hpp>
#include <lrt/mqtt.hpp>

namespace lrt::mqtt {
inline namespace v0 {

// Whether a robot is the only one of its name, and is called at its broker what it is. docs/fleet.md has the sentences; a test compares them.

/// The refusal of a robot that has neither an identity nor a public base.
std::string without_identity();

/// The topics of a robot without Options::prefix: "robots/r7".
std::string default_prefix(const Identity& identity);

/// The same for each start of a robot, whatever its prefix, so that the broker ends an old connection of the robot, with its Last Will, when a new one
/// begins. Letters, digits and '-', because brokers may refuse others and long ids.
std::string client_id_of(const Identity& identity);

/// What a message of PREFIX/ns/status says; empty members if it says nothing of them.
struct StatusText {
  std::string session, iri, base;
  bool online = false;
  std::string since{};  ///< when that connection began
};
StatusText read_status(std::string_view payload);

/// Another robot has published where this one does.
/// @param other  its status
std::string another_robot(const Identity& identity, const std::string& prefix, const StatusText& other);
/// The broker has ended the connection because another client has its client id.
std::string taken_over(const Identity& identity, const std::string& client_id);

/// Of the status that the broker has kept, before this robot has published its own: whether it was of another robot, or of this one with other IRIs.
/// Empty: neither.
std::string earlier_status(const Identity& identity, const std::string& prefix, const std::string& base, const StatusText& earlier);

/// What the robot's own certificate has to do with a connection that could not be made: it has expired, or will be valid later; or what can be the matter
/// with that of the broker. Begins with "; ". Empty: nothing is known.
std::string why_not_connected(const Broker& broker, const std::string& reason, std::chrono::system_clock::time_point now);

/// What is to be said of the robot's own certificate on a good connection: that it expires within two weeks, or names another robot. Empty: nothing.
std::string certificate_warning(const Broker& broker, const Identity& identity, const std::string& prefix, std::chrono::system_clock::time_point now);

}  // namespace v0
}  // namespace lrt::mqtt
