// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <lrt/base/log.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/thread_options.hpp>

namespace lrt {

/// Writes the newest text for one path to disk, atomically: a reader finds this text or the previous one, also after a power failure.
///
/// A text is written to `path.new` and renamed when it is completely on the disk; then the directory is written. Several
/// texts that arrive during a write cost one write. The file begins with a comment, by which lrt recognizes its own files and detects
/// damage. It is readable by its owner only (0600), whatever it was before. If `path` is a symbolic link, the file it leads to is replaced and
/// the link is kept. A failed write is repeated every ten seconds. One writer per path: prepare() locks out other processes,
/// and a second use in this one.
///
/// @par Threads  save: any. Writing happens on a thread of its own that comes with the first save().
class SavedFile {
 public:
  /// A text is on the disk, or writing it failed; so are those with smaller revisions. Called on the writing thread. After a failure it may
  /// be called again with the same revision.
  using Written = std::function<void(std::uint64_t revision, bool written)>;
  class Claim;

  /// @param claim  of that path; it is renewed before each write, and ends with the last one. Without it nothing locks others out
  SavedFile(std::string path, Written written, LogCallback log, ThreadOptions threads, Claim claim);
  SavedFile(std::string path, Written written, LogCallback log, ThreadOptions threads = {});
  /// Writes the pending text. If the disk does not respond for five seconds, the thread is detached.
  ~SavedFile();
  SavedFile(const SavedFile&) = delete;
  SavedFile& operator=(const SavedFile&) = delete;

  /// Returns at once. A newer text replaces a waiting one. Errors are logged, once for each kind until a text
  /// was written again.
  /// @param revision  larger than that of the text before
  void save(std::string text, std::uint64_t revision) noexcept;
  /// The same for a text that takes long to create: the writing thread creates it, and only for the newest state.
  /// @param make  may be called again if writing has failed, or if it threw. The error of a BadResult is logged
  using Make = std::function<std::string()>;
  void save(Make make, std::uint64_t revision) noexcept;

  /// The right to write a path, by whatever name: one at a time. It ends with the object, or with the process and the children that it has forked and
  /// that have not called exec().
  class Claim {
   public:
    Claim() = default;
    /// @param path        of the lock
    /// @param descriptor  of it; less than 0: there was no space for it on the disk
    explicit Claim(std::string path, int descriptor) noexcept : path_(std::move(path)), descriptor_(descriptor) {}
    Claim(Claim&& other) noexcept : path_(std::exchange(other.path_, {})), descriptor_(std::exchange(other.descriptor_, -1)) {}
    Claim& operator=(Claim&& other) noexcept {
      path_.swap(other.path_);
      std::swap(descriptor_, other.descriptor_);
      return *this;
    }
    ~Claim();

    /// Claims the path again if the lock was removed, as by somebody who has deleted the directory and made it again: then others could claim it,
    /// too. Makes the directory again. Call it before writing.
    /// @return  whether it had been removed: another process may have had the path meanwhile
    /// @par Errors   io_error: also, another process has claimed the path meanwhile; invalid_option: this process has
    /// @par Threads  One at a time.
    Result<bool> renew();

   private:
    std::string path_;
    int descriptor_ = -1;
  };
  /// Checks that a file of lrt is at that path, or nothing, that it can be written, and that nothing else writes it. Makes the directory for it (0700).
  /// @param other_mark  what `path.new` may begin with besides; empty: nothing
  /// @par Errors  invalid_option: something else is there, or this process writes the file already; io_error: also, another process writes the file
  static Result<Claim> prepare(const std::string& path, std::string_view other_mark = {});

  enum class State : std::uint8_t {
    whole,     ///< as lrt wrote it
    damaged,   ///< lrt wrote it, and it was changed or truncated later
    unmarked,  ///< it does not begin as lrt's files do, or it is empty
  };
  struct Content {
    std::string text;  ///< without the first line of lrt
    State state;
  };
  /// nullopt: there is no such file.
  /// @par Errors  invalid_option: no file; limit_exceeded: more than `max_bytes`; io_error: not readable
  static Result<std::optional<Content>> load(const std::string& path, std::size_t max_bytes);
  /// Keeps a damaged file as `path.damaged-1`, or the next number that is free, and returns that. The file itself stays where file systems
  /// have hard links.
  /// @par Errors  io_error
  static Result<std::string> keep_copy(const std::string& path);

 private:
  class Writer;
  std::shared_ptr<Writer> writer_;
};

}  // namespace lrt
