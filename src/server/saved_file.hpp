#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include <lrt/base/log.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/thread_options.hpp>

namespace lrt {

/// Keeps the newest text for one path on disk, whole: a reader of the file finds this text or the one before it, also after a power cut.
///
/// A text is written beside the file, to `path.new`, and renamed when all of it is on the disk. The file is readable by its owner only
/// (0600), whatever it was before. If `path` is a symbolic link, the file it leads to is replaced and the link stays. What could not
/// be written is tried again every ten seconds. One writer per path.
///
/// @par Threads  save: any. Writing happens on a thread of its own that comes with the first save().
class SavedFile {
 public:
  SavedFile(std::string path, LogCallback log, ThreadOptions threads = {});
  /// Writes what waits. If the disk does not respond for five seconds, the thread is detached.
  ~SavedFile();
  SavedFile(const SavedFile&) = delete;
  SavedFile& operator=(const SavedFile&) = delete;

  /// Returns at once. A text that still waits is forgotten for the newer one. Trouble goes to the log, once for each kind until a text
  /// was written again.
  void save(std::string text) noexcept;

  /// nullopt: there is no such file.
  /// @par Errors  limit_exceeded: more than `max_bytes`; io_error: no file, or not readable
  static Result<std::optional<std::string>> load(const std::string& path, std::size_t max_bytes);
  /// Renames a damaged file to `path.damaged-1`, or the next number that is free, and returns that.
  /// @par Errors  io_error
  static Result<std::string> set_aside(const std::string& path);

 private:
  class Writer;
  std::shared_ptr<Writer> writer_;
};

}  // namespace lrt
