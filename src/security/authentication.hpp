#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

#include <lrt/base/clock.hpp>
#include <lrt/base/log.hpp>
#include <lrt/security.hpp>

namespace lrt::security {

/// The tokens of a file, read again when the file has changed. One that cannot be read keeps the tokens of before, and the log says so once.
///
/// @par Threads  any
class TokenFile {
 public:
  /// @par Errors  those of Tokens::load
  static Result<std::unique_ptr<TokenFile>> open(std::string path, LogCallback log);

  /// Looks at the file at most once a second. Calls the log callback.
  std::shared_ptr<const Tokens> tokens(TimePoint now);

 private:
  /// What changes with the file: replaced, written to, or gone.
  struct Stamp {
    std::uint64_t inode = 0, bytes = 0;
    std::int64_t modified = 0;  ///< [ns]
    bool operator==(const Stamp& other) const noexcept { return inode == other.inode && bytes == other.bytes && modified == other.modified; }
  };
  static Stamp stamp_of(const std::string& path) noexcept;

  TokenFile(std::string path, LogCallback log) : path_(std::move(path)), log_(std::move(log)) {}

  const std::string path_;
  const LogCallback log_;
  std::mutex mutex_;  ///< guards the rest
  std::chrono::steady_clock::time_point look_after_{};
  Stamp stamp_;
  std::shared_ptr<const Tokens> tokens_;
};

/// What the Authorization field of a request has (RFC 9110 11.6.2).
struct Credentials {
  enum class Scheme : std::uint8_t { none, bearer, basic, other };
  Scheme scheme = Scheme::none;
  std::string user;    ///< basic only
  std::string secret;  ///< the token, or the password of basic. Empty: the field is not well-formed
};
Credentials credentials_of(const http::Request& request);

}  // namespace lrt::security
