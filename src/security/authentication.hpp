// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/clock.hpp>
#include <lrt/base/log.hpp>
#include <lrt/security.hpp>

#include "src/security/policy.hpp"

namespace lrt::security {

/// How often the files of tokens and rules are checked for changes.
inline constexpr std::chrono::seconds look_pause{1};

/// The identity of a file's content: it changes when the file is replaced, written to, or removed.
struct FileStamp {
  std::uint64_t inode = 0, bytes = 0;
  std::int64_t modified = 0;  ///< [ns]
  static FileStamp of(const std::string& path) noexcept;
  bool operator==(const FileStamp& other) const noexcept { return inode == other.inode && bytes == other.bytes && modified == other.modified; }
};

/// The content of a file, read again when the file has changed. If it cannot be read, the previous content stays valid, which is logged once.
///
/// @par Threads  any
template <class T>
class ReloadedFile {
 public:
  using Load = std::function<Result<std::shared_ptr<T>>(const std::string& path)>;
  /// @param what  in the log: "the tokens"
  /// @par Errors  those of `load`
  static Result<std::unique_ptr<ReloadedFile>> open(std::string path, std::string what, Load load, LogCallback log) {
    const FileStamp stamp = FileStamp::of(path);  // before it is read, so that a change during reading is detected later
    Result<std::shared_ptr<T>> content = load(path);
    if (!content) return Unexpected{std::move(content).error()};
    std::unique_ptr<ReloadedFile> file(new ReloadedFile(std::move(path), std::move(what), std::move(load), std::move(log)));
    file->stamp_ = stamp;
    file->content_ = *std::move(content);
    return file;
  }

  /// Checks the file at most once a second. Calls the log callback.
  std::shared_ptr<T> content(TimePoint now) {
    std::string trouble;
    std::shared_ptr<T> present;
    {
      const std::lock_guard lock(mutex_);
      if (now.steady >= look_after_) {
        look_after_ = now.steady + look_pause;
        const FileStamp stamp = FileStamp::of(path_);
        if (!(stamp == stamp_)) {
          stamp_ = stamp;
          Result<std::shared_ptr<T>> read = load_(path_);
          if (read) content_ = *std::move(read);
          else trouble = what_ + " of before stay: " + read.error().message;
        }
      }
      present = content_;
    }
    if (!trouble.empty() && log_) log_(LogLevel::error, trouble);
    return present;
  }

 private:
  ReloadedFile(std::string path, std::string what, Load load, LogCallback log)
      : path_(std::move(path)), what_(std::move(what)), load_(std::move(load)), log_(std::move(log)) {}

  const std::string path_, what_;
  const Load load_;
  const LogCallback log_;
  std::mutex mutex_;  ///< guards the rest
  std::chrono::steady_clock::time_point look_after_{};
  FileStamp stamp_;
  std::shared_ptr<T> content_;
};

using TokenFile = ReloadedFile<const Tokens>;
/// @par Errors  those of Tokens::load
Result<std::unique_ptr<TokenFile>> open_tokens(std::string path, LogCallback log);
using PolicyFile = ReloadedFile<Policy>;
/// @param more  rules besides those of the file
/// @par Errors  those of load_rules() and Policy::create()
Result<std::unique_ptr<PolicyFile>> open_policy(std::string path, std::vector<Rule> more, LogCallback log);

/// The credentials in the Authorization field of a request (RFC 9110 11.6.2).
struct Credentials {
  enum class Scheme : std::uint8_t { none, bearer, basic, other };
  Scheme scheme = Scheme::none;
  std::string user;    ///< basic only
  std::string secret;  ///< the token, or the password of basic. Empty: the field is not well-formed
};
Credentials credentials_of(const http::Request& request);

}  // namespace lrt::security
