// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <lrt/base/result.hpp>

namespace lrt::tool {

/// A robot that has a name in the file of the user, with the credentials that it gets.
struct Profile {
  std::string name;
  std::string robot;  ///< its URL
  std::string token_file, user, password_file, ca, certificate, key;
};

/// The profiles of $XDG_CONFIG_HOME/lrt/robots.toml, else of ~/.config/lrt/robots.toml, in TOML:
///
///     robot = "arm"                       # the default: a name of a profile, or a URL
///     [arm]
///     robot = "https://arm.example/"
///     token-file = "arm.token"            # relative to the folder of this file
///     ca = "cell.pem"
///
/// A profile may have robot, token-file, user, password-file, ca, cert and key, as the options of the same names. The file may be written by its owner only;
/// files with secrets may also be read by their owner only.
class Profiles {
 public:
  /// Reads the file. Where there is none, there are no profiles.
  /// @par Errors  invalid_option: it cannot be read, has an unknown key, or others may change it, or read a secret
  static Result<Profiles> read();

  const std::string& file() const noexcept { return file_; }  ///< empty: there is no home
  const std::string& default_robot() const noexcept { return default_robot_; }
  const Profile* find(const std::string& name) const noexcept;
  std::vector<std::string> names() const;

 private:
  std::string file_, default_robot_;
  std::vector<Profile> profiles_;
};

/// Whether only the owner can read the files with secrets that a profile names.
/// @par Errors  invalid_option: another user can, or a file is not there
Result<void> judge_secrets(const Profile& profile);

}  // namespace lrt::tool
