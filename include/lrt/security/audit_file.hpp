// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>

namespace lrt::security {
inline namespace v0 {

/// How an AuditFile is written.
struct AuditFileOptions {
  /// When lines are on the disk, so that a loss of power does not lose them. A line that was written is not lost when the process is killed.
  enum class Sync : std::uint8_t {
    each_line,  ///< before a further line is written; lines that came together are put there together
    interval,   ///< at the latest `sync_interval` after they were written
    never,      ///< when the system decides
  };
  Sync sync = Sync::interval;                     ///< when lines are on the disk
  std::chrono::milliseconds sync_interval{1000};  ///< of Sync::interval; 10 ms to 1 h
  /// A file that would become larger is renamed to `path.1`, that to `path.2` and so on, and a new file begins; 0, or
  /// 64 KiB to 1 TiB; 0: no limit. Other programs may rename the file, too: see AuditFile::reopen().
  std::uint64_t max_bytes = 0;
  std::size_t kept_files = 8;  ///< of those renamed by `max_bytes`, 1 to 1,000; the oldest is removed
  /// A response with a status of 2xx to a request that changes or commands something is sent when its line is in the
  /// file, and with Sync::each_line on the disk. If that takes longer than Limits::host_timeout, the response is 503,
  /// which says that the request was carried out. The response to a stop (Action::stop()) does not wait, nor does a
  /// subscription that a GET makes. false: responses do not wait, and what waits in memory is lost if the process is
  /// killed.
  bool respond_when_saved = false;
};

/// Numbers of an AuditFile.
struct AuditFileCounters {
  std::uint64_t written = 0;   ///< lines that were written
  std::uint64_t errors = 0;    ///< steps that failed: opening, writing, syncing, renaming
  std::string newest_error{};  ///< what failed last, and why; empty: nothing has failed
};

/// A file to which a server appends its audit (security::Audit::file). audit_file() makes it.
///
/// - Each line is appended whole, at the end of the file. What a crash or a full disk left of a line is ended, so that the
///   next line begins clean: it becomes the text of a line with the event "torn".
/// - If the disk refuses a line, the line waits, and is tried again once a second. While it waits, further lines wait
///   in memory, up to Audit::max_waiting_bytes. Lines beyond that are lost, and as soon as the file can be written a line with
///   the event "lost" says how many, from when to when, and why.
/// - Before it writes, it looks whether the path still names its file. If the file was renamed or removed, or its
///   directory was, it makes a new file, and the directories for it.
/// - Several processes may append to one file: lines do not mix, and one of them renames a file that is full.
/// - The file belongs to its owner only (0600), whatever it was before; a directory that is made for it, too (0700).
///
/// @par Threads  Any.
class LRT_API AuditFile {
 public:
  virtual ~AuditFile() = default;
  /// Closes the file and opens it again by its path, also if nothing is logged meanwhile. For a program that renames
  /// the file, such as logrotate: after it the old file is not written any more.
  /// @par Threads  Any, and from the handler of a signal (SIGHUP).
  virtual void reopen() noexcept = 0;
  /// What was written, and what failed.
  virtual AuditFileCounters counters() const = 0;

  /// @{
  /// For the server, which defines them.
  class Output;
  struct Place;
  /// @}

 private:
  /// What writes the lines of one server.
  virtual std::unique_ptr<Output> make_output(const Place& place) = 0;
};

/// Opens a file for an audit, or makes it:
///
///     options.security.audit.file = lrt::security::audit_file("/var/log/robot/audit.jsonl").value();
///
/// @param path  of a file that has lines of JSON or nothing, and belongs to the user of the process or to root; or of no file.
///              A symbolic link as its last part is refused, because renaming would rename the link
/// @par Errors   invalid_option: an option is out of range, or something else is at that path; io_error
/// @par Threads  Any.
/// @par Time     Opens the file.
LRT_API Result<std::shared_ptr<AuditFile>> audit_file(std::string path, AuditFileOptions options = {});

}  // namespace v0
}  // namespace lrt::security
