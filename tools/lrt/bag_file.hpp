// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <functional>
#include <string>

#include <lrt/base/result.hpp>

namespace lrt::tool {

/// A file that is read from its beginning to its end; "-" is standard input.
class InputFile {
 public:
  InputFile() = default;
  ~InputFile() {
    if (descriptor_ > STDERR_FILENO) ::close(descriptor_);
  }
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  /// @par Errors  invalid_option
  Result<void> open(const std::string& name) {
    name_ = name == "-" ? "standard input" : name;
    descriptor_ = name == "-" ? STDIN_FILENO : ::open(name.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor_ < 0) return unexpected(Errc::invalid_option, "cannot read \"" + name_ + "\": " + std::strerror(errno));
    return {};
  }
  /// Refers to this.
  std::function<Result<std::size_t>(char*, std::size_t)> source() {
    return [this](char* buffer, std::size_t size) -> Result<std::size_t> {
      while (true) {
        const ssize_t count = ::read(descriptor_, buffer, size);
        if (count >= 0) return static_cast<std::size_t>(count);
        if (errno != EINTR) return unexpected(Errc::invalid_option, "cannot read \"" + name_ + "\": " + std::strerror(errno));
      }
    };
  }

 private:
  std::string name_;
  int descriptor_ = -1;
};

}  // namespace lrt::tool
