// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>

#include "src/base/descriptor.hpp"

namespace lrt {

/// The step of working with a file that failed, such as "writing beside", and its errno.
struct FileFailure {
  std::string step;
  int error;
};

/// An error that says what was done to which file.
LRT_INTERNAL_API Unexpected file_error(const FileFailure& failure, const std::string& path);

/// How replace_file() works.
struct ReplaceOptions {
  std::string_view mark{};  ///< what all files of this kind begin with
  mode_t mode = 0600;       ///< of the new file, less the umask
  bool lock = false;        ///< the new file is locked (flock) before it has its name
};

/// A file that has replaced another one, still open; or why it has not.
struct Replaced {
  std::optional<FileFailure> failure;
  Descriptor file;  ///< open for appending
};

/// Replaces a file in one step: a reader finds the old file or the new one, whole, also after a loss of power. The bytes are written to `path.new`,
/// which is renamed when they are on the disk; then the directory is written. A leftover `path.new` is replaced if it is a regular file that is
/// empty or begins with the mark, as far as it goes; anything else there, such as a symbolic link, is an error and stays. If `path` is a symbolic
/// link, the file that it leads to is replaced. If something that is no regular file is at `path`, it stays.
/// @param parts  the content, one after the other
/// @par Threads  Any, but not two for one path.
LRT_INTERNAL_API Replaced replace_file(const std::string& path, std::initializer_list<std::string_view> parts, const ReplaceOptions& options);

/// Whether replace_file() would find `path.new` in its way.
/// @param path  followed()
/// @par Errors  invalid_option: something is there that replace_file() does not remove; io_error
LRT_INTERNAL_API Result<void> check_leftover(const std::string& path, std::string_view mark);

/// The end of a chain of symbolic links, also if nothing is there.
LRT_INTERNAL_API std::string followed(std::string path);

/// The directory of a path; ".": the path has none.
LRT_INTERNAL_API std::string directory_of(const std::string& path);

/// Makes a directory and those above it, for their owner only (0700), unless they exist.
/// @par Errors  io_error
LRT_INTERNAL_API Result<void> make_directory(const std::string& directory);

/// Puts the names of a directory on the disk. Some file systems do not support this, which is no failure.
LRT_INTERNAL_API std::optional<FileFailure> write_directory(const std::string& directory);

/// "a directory", "a device" and so on, of what is no regular file.
LRT_INTERNAL_API const char* kind_of_file(mode_t mode) noexcept;

}  // namespace lrt
