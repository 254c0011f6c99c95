// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/options.hpp>
#include <lrt/ros2.hpp>
#include <lrt/security/audit_file.hpp>

/// The program lrt-ros2.
namespace lrt::ros2_tool {

/// The exit status of the program.
enum Exit : int {
  success = 0,
  failure = 1,  ///< the system or the network refuses, or `--list` finds nobody
  usage = 2,    ///< the command line is wrong, or a file that it names cannot be used
};

/// A connection to an MQTT broker, without a type of lrt::mqtt, which may be absent from the build.
struct Broker {
  std::string address;  ///< "broker.example:1883", "[2001:db8::1]:8883"; empty: none
  std::string prefix;   ///< empty: as lrt::mqtt::Options::prefix
  std::string user, password_file, client_id, public_url;
  bool tls = false;
  std::string ca, certificate, key;
  bool commands = false;
  std::string command_token_file;
};

/// What the environment, the configuration file and the command line say.
struct Settings {
  lrt::Options server;
  ros2::Options bridge;
  Broker broker;
  std::string audit_file;
  bool metrics = false;
  bool sparql = true;
  LogLevel log_level = LogLevel::warning;

  /// @{
  /// What is to be done instead of serving.
  bool list = false, help = false, version = false;
  std::string completion;
  /// @}
};

/// A variable of the environment; nullopt: it is not set, or is empty.
using Environment = std::optional<std::string> (*)(const char* name);

/// Reads all: what the command line says counts more than the file of --config, and that more than the environment. Lists of the command line are added
/// to those of the file.
///
/// | variable | meaning |
/// |---|---|
/// | ROS_DOMAIN_ID | the domain |
/// | ROS_LOCALHOST_ONLY=1, ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST | only 127.0.0.1 |
/// | ROS_STATIC_PEERS | addresses of participants, separated by ';' |
/// | AMENT_PREFIX_PATH | installations of ROS 2 with definitions of types, separated by ':' |
///
/// @par Errors  invalid_option, and those of the files: the sentence says which option or which place of the file
Result<Settings> read_settings(const std::vector<std::string>& arguments, Environment environment);

/// The text of --help.
std::string help_text();
/// A script for a shell that completes the options.
/// @par Errors  invalid_option: neither bash nor zsh
Result<std::string> completion_script(std::string_view shell);
/// Names of all options, "--domain".
std::vector<std::string> option_names();

/// The first line of a file, such as a password.
/// @par Errors  invalid_option: it cannot be read
Result<std::string> first_line(const std::string& file);

}  // namespace lrt::ros2_tool
