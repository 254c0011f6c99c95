// SPDX-License-Identifier: Apache-2.0
#include "tools/lrt/profiles.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <fstream>

#include <CLI/CLI.hpp>

#include "tools/lrt/suggest.hpp"

namespace lrt::tool {
namespace {

std::string file_of_user() {
  // A relative path in the variable is not valid (XDG Base Directory Specification).
  if (const char* const folder = std::getenv("XDG_CONFIG_HOME"); folder && *folder == '/') return std::string(folder) + "/lrt/robots.toml";
  if (const char* const home = std::getenv("HOME"); home && *home == '/') return std::string(home) + "/.config/lrt/robots.toml";
  return {};
}

std::string octal(mode_t mode) {
  char text[16];
  std::snprintf(text, sizeof text, "%04o", static_cast<unsigned>(mode & 07777));
  return text;
}

/// @param refused  bits that the mode must not have
/// @return  false: there is no such file
Result<bool> judge(const std::string& name, mode_t refused, const char* what) {
  struct stat found {};
  if (::stat(name.c_str(), &found) != 0) {
    if (errno == ENOENT || errno == ENOTDIR) return false;
    return unexpected(Errc::invalid_option, "cannot read \"" + name + "\": " + std::strerror(errno));
  }
  if (!S_ISREG(found.st_mode)) return unexpected(Errc::invalid_option, "\"" + name + "\" is not a file");
  if (found.st_uid != ::geteuid() && found.st_uid != 0)
    return unexpected(Errc::invalid_option, "\"" + name + "\" belongs to another user, and is not used");
  if ((found.st_mode & refused) != 0)
    return unexpected(Errc::invalid_option, std::string("others can ") + what + " \"" + name + "\" (mode " + octal(found.st_mode) +
                                                "), and it is not used; run: chmod " + (refused == 077 ? "600 " : "go-w ") + name);
  return true;
}

struct Key {
  const char* name;
  std::string Profile::*member;
  bool is_file;
};
constexpr Key keys[] = {{"robot", &Profile::robot, false}, {"token-file", &Profile::token_file, true},
                        {"user", &Profile::user, false},   {"password-file", &Profile::password_file, true},
                        {"ca", &Profile::ca, true},        {"cert", &Profile::certificate, true},
                        {"key", &Profile::key, true}};

}  // namespace

const Profile* Profiles::find(const std::string& name) const noexcept {
  const auto found = std::find_if(profiles_.begin(), profiles_.end(), [&](const Profile& one) { return one.name == name; });
  return found == profiles_.end() ? nullptr : &*found;
}

std::vector<std::string> Profiles::names() const {
  std::vector<std::string> all;
  for (const Profile& one : profiles_) all.push_back(one.name);
  return all;
}

Result<Profiles> Profiles::read() {
  Profiles result;
  result.file_ = file_of_user();
  if (result.file_.empty()) return result;
  constexpr mode_t writable_by_others = 022;
  const Result<bool> exists = judge(result.file_, writable_by_others, "write");
  if (!exists) return unexpected(exists.error());
  if (!*exists) return result;
  std::ifstream file(result.file_);
  if (!file) return unexpected(Errc::invalid_option, "cannot read \"" + result.file_ + "\": " + std::strerror(errno));
  const std::string folder = result.file_.substr(0, result.file_.rfind('/') + 1);
  const auto wrong = [&](const std::string& sentence) { return unexpected(Errc::invalid_option, "\"" + result.file_ + "\": " + sentence); };
  std::vector<CLI::ConfigItem> items;
  try {
    items = CLI::ConfigTOML().from_config(file);
  } catch (const std::exception& error) { return wrong(error.what()); }
  for (const CLI::ConfigItem& item : items) {
    if (item.name == "++" || item.name == "--") continue;  // a section begins, ends
    const std::string value = item.inputs.empty() ? std::string() : item.inputs.front();
    if (item.inputs.size() != 1 || value.empty()) return wrong("\"" + item.fullname() + "\": expected one text");
    if (item.parents.empty() && item.name == "robot") {
      result.default_robot_ = value;
      continue;
    }
    if (item.parents.empty()) return wrong("\"" + item.name + "\" stands in no profile; write [NAME] before it");
    std::string name = item.parents.front();
    for (std::size_t i = 1; i < item.parents.size(); ++i) name += "." + item.parents[i];
    auto profile = std::find_if(result.profiles_.begin(), result.profiles_.end(), [&](const Profile& one) { return one.name == name; });
    if (profile == result.profiles_.end()) {
      Profile made;
      made.name = std::move(name);
      profile = result.profiles_.insert(profile, std::move(made));
    }
    const auto key = std::find_if(std::begin(keys), std::end(keys), [&](const Key& one) { return item.name == one.name; });
    if (key == std::end(keys)) {
      std::vector<std::string> known;
      for (const Key& one : keys) known.emplace_back(one.name);
      return wrong("[" + profile->name + "] has the unknown key \"" + item.name + "\"" + did_you_mean(item.name, known));
    }
    std::string Profile::*const member = key->member;
    (*profile).*member = value;
    if (key->is_file && value.front() != '/') {
      const char* const home = std::getenv("HOME");
      (*profile).*member = value.substr(0, 2) == "~/" && home ? home + value.substr(1) : folder + value;
    }
  }
  for (const Profile& one : result.profiles_)
    if (one.robot.substr(0, 7) != "http://" && one.robot.substr(0, 8) != "https://")
      return wrong("[" + one.name + "] needs robot = \"URL\", which begins with http:// or https://");
  return result;
}

Result<void> judge_secrets(const Profile& profile) {
  constexpr mode_t of_others = 077;
  for (const std::string* const name : {&profile.token_file, &profile.password_file, &profile.key}) {
    if (name->empty()) continue;
    const Result<bool> exists = judge(*name, of_others, "read");
    if (!exists) return unexpected(exists.error());
    if (!*exists) return unexpected(Errc::invalid_option, "[" + profile.name + "]: there is no file \"" + *name + "\"");
  }
  return {};
}

}  // namespace lrt::tool
