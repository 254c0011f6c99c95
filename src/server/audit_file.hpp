// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/clock.hpp>
#include <lrt/base/log.hpp>
#include <lrt/base/result.hpp>
#include <lrt/security.hpp>
#include <lrt/security/audit_file.hpp>

#include "src/base/mailbox.hpp"

namespace lrt {

/// A file for an audit, as its writer sees it. Only programs that call audit_file() link what derives from this.
class OpenAuditFile : public security::AuditFile {
 public:
  /// What became of the lines that were given.
  struct Appended {
    std::size_t lines = 0;  ///< the first so many are in the file
    bool synced = true;     ///< and where Sync::each_line says so, they are on the disk
    std::string trouble{};  ///< why not; empty: all is well
  };
  virtual bool claim() noexcept = 0;    ///< for one server; false: another one has it
  virtual void release() noexcept = 0;  ///< of claim()
  virtual Appended append(const std::vector<std::string_view>& lines) = 0;
  /// Does what is due: reopening, syncing. The time until it must be called again.
  virtual std::chrono::milliseconds tend() = 0;
  virtual void wake() noexcept = 0;
  virtual void wait(std::chrono::milliseconds time) noexcept = 0;
};

/// Passes lines to the file of the audit on a separate thread. Writers neither lock nor wait. Lines that the file refuses wait; what does not fit into
/// memory is counted, and the file says so.
///
/// @par Threads  write(): one at a time. run(): its own. The others: any
class AuditFileWriter {
 public:
  /// The lines up to a number are saved, or cannot be. Called on the thread of run(), also once a second with 0 while the file cannot be written.
  using Settled = std::function<void(std::uint64_t number, bool saved)>;

  AuditFileWriter(const security::Audit& options, const Clock& clock, LogCallback log, Settled settled);
  ~AuditFileWriter();
  AuditFileWriter(const AuditFileWriter&) = delete;
  AuditFileWriter& operator=(const AuditFileWriter&) = delete;

  /// @par Errors  invalid_option: another server has the file
  Result<void> claim();
  /// Writes the file until stop() has been called and all lines are written, or cannot be.
  void run() noexcept;
  void stop() noexcept;

  /// @return  the number of the line; 0: it was dropped
  std::uint64_t write(std::string line) noexcept;
  /// Counts a line that could not be created.
  void drop() noexcept;
  /// All lines that were dropped.
  std::uint64_t dropped() const noexcept { return all_dropped_.load(std::memory_order_relaxed); }
  std::size_t waiting() const noexcept { return waiting_.load(std::memory_order_relaxed); }
  std::uint64_t errors() const { return file_->counters().errors; }

 private:
  struct Line {
    std::string text;
    std::uint64_t number;
  };
  /// Lines that the file does not have.
  struct Missing {
    std::uint64_t count = 0;
    std::chrono::system_clock::time_point from{}, to{};
  };
  void take(Line line) noexcept;
  void settle(std::uint64_t number, bool saved) noexcept;
  std::chrono::milliseconds write_all() noexcept;
  bool write_pending();
  bool write_lost();
  bool write_missing(std::string_view event, Missing& missing, std::string_view reason);
  void lose_rest() noexcept;
  void say_once(const char* why) noexcept;

  const std::shared_ptr<OpenAuditFile> file_;
  const std::size_t max_lines_, max_bytes_;
  const Clock& clock_;
  const LogCallback log_;
  const Settled settled_;
  Mailbox<Line> lines_;
  std::uint64_t number_ = 0;  ///< of the newest line; of the thread that writes
  std::atomic<std::size_t> waiting_{0}, waiting_bytes_{0};
  std::atomic<std::uint64_t> dropped_{0};                      ///< since the file has said so
  std::atomic<std::int64_t> dropped_from_{0}, dropped_to_{0};  ///< [ns] times of the first and the last of them; 0: none
  std::atomic<std::uint64_t> all_dropped_{0};
  std::atomic<bool> stopping_{false};
  bool claimed_ = false;

  // Used by the thread of run().
  bool fails_ = false;        ///< the file could not be written, and the log says so
  std::deque<Line> pending_;  ///< in order
  Missing lost_, unsynced_;   ///< what the file is to say
  std::string trouble_;       ///< the newest since it has said that; empty: the thread was too slow
};

}  // namespace lrt
