// SPDX-License-Identifier: Apache-2.0
#include "src/server/audit_file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <limits>
#include <map>
#include <mutex>
#include <new>
#include <optional>
#include <utility>

#include <lrt/http/problem.hpp>

#include "src/base/event_waker.hpp"
#include "src/base/quote.hpp"
#include "src/base/replace_file.hpp"
#include "src/server/audit_output.hpp"
#include "src/server/shared_engine.hpp"

namespace lrt {
namespace {

using Steady = std::chrono::steady_clock;

/// A part of a line that is longer than this was not written by lrt.
constexpr std::size_t max_torn_bytes = 64 * 1024;
/// Bytes of one call of write().
constexpr std::size_t max_write_bytes = 64 * 1024;
/// Another process that has the lock longer than this has probably stopped.
constexpr std::chrono::milliseconds audit_lock_patience{1'000};
/// A file is opened again if another process renames it meanwhile, and so on.
constexpr int max_openings = 8;

/// The lock of an open file, against other processes that append and rename.
class FileLock {
 public:
  explicit FileLock(int descriptor) noexcept : descriptor_(descriptor) {
    for (const auto end = Steady::now() + audit_lock_patience; ::flock(descriptor_, LOCK_EX | LOCK_NB) != 0;) {
      if (errno == EINTR) continue;
      if (errno != EWOULDBLOCK || Steady::now() >= end) return;  // some file systems have no locks
      ::usleep(500);
    }
    held_ = true;
  }
  ~FileLock() { unlock(); }
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;
  bool held() const noexcept { return held_; }
  void unlock() noexcept {
    if (std::exchange(held_, false)) ::flock(descriptor_, LOCK_UN);
  }

 private:
  const int descriptor_;
  bool held_ = false;
};

/// A line of lrt that lacks only its line feed: one object that is complete.
bool is_whole(std::string_view line) noexcept {
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '\\') ++i;
    else if (line[i] == '"') quoted = !quoted;
  }
  return !quoted && line.size() > 1 && line.front() == '{' && line.back() == '}';
}

Unexpected not_an_audit(const std::string& path, const std::string& found) {
  return unexpected(Errc::invalid_option, "\"" + path + "\": expected a file with lines of an audit, or none; found " + found);
}

class File final : public OpenAuditFile, public std::enable_shared_from_this<File> {
 public:
  File(std::string path, const security::AuditFileOptions& options) : path_(std::move(path)), options_(options) {}

  const security::AuditFileOptions& options() const noexcept { return options_; }

  Result<void> open_first() {
    const std::lock_guard lock(mutex_);
    if (Result<void> made = make_directory(directory_of(path_)); !made) return made;
    return open();
  }

  void reopen() noexcept override {
    reopen_.store(true, std::memory_order_release);
    waker_.wake();
  }
  security::AuditFileCounters counters() const override {
    const std::lock_guard lock(counters_mutex_);
    return counters_;
  }

 private:
  std::unique_ptr<Output> make_output(const Place& place) override;
  bool claim() noexcept override { return !claimed_.exchange(true); }
  void release() noexcept override { claimed_ = false; }
  void wake() noexcept override { waker_.wake(); }
  void wait(std::chrono::milliseconds time) noexcept override { waker_.wait(time); }

  Appended append(const std::vector<std::string_view>& lines) override {
    const std::lock_guard lock(mutex_);
    Appended result;
    try {
      while (result.lines < lines.size()) {
        const std::size_t before = result.lines;
        std::string text;
        std::vector<std::size_t> ends;
        for (std::size_t i = before; i < lines.size() && (ends.empty() || text.size() + lines[i].size() < max_write_bytes); ++i) {
          text.append(lines[i]).append("\n");
          ends.push_back(text.size());
        }
        std::optional<std::string> trouble = put(text, ends, result.lines);
        {
          const std::lock_guard counting(counters_mutex_);
          counters_.written += result.lines - before;
        }
        if (trouble) {
          result.trouble = *std::move(trouble);
          break;
        }
      }
      if (result.lines == 0) return result;
      unsynced_ = true;
      if (options_.sync == security::AuditFileOptions::Sync::each_line) {
        if (std::optional<FileFailure> failure = sync()) {
          result.trouble = failed(*failure);
          result.synced = false;
        }
      } else if (options_.sync == security::AuditFileOptions::Sync::interval && !sync_at_) {
        sync_at_ = Steady::now() + options_.sync_interval;
      }
    } catch (const std::bad_alloc&) { result.trouble = "no memory"; }
    return result;
  }

  std::chrono::milliseconds tend() override {
    const std::lock_guard lock(mutex_);
    if (reopen_.exchange(false, std::memory_order_acq_rel)) {
      if (unsynced_ && options_.sync != security::AuditFileOptions::Sync::never)
        if (const auto failure = sync()) failed(*failure);
      if (const Result<void> opened = open(); !opened) failed(opened.error());
    }
    if (!sync_at_) return std::chrono::hours(1);
    const auto now = Steady::now();
    if (*sync_at_ > now) return std::chrono::duration_cast<std::chrono::milliseconds>(*sync_at_ - now) + std::chrono::milliseconds(1);
    if (const auto failure = sync()) failed(*failure);
    return std::chrono::hours(1);
  }

  std::string failed(const FileFailure& failure) { return failed(file_error(failure, path_).error); }
  std::string failed(const Error& error) {
    const std::lock_guard lock(counters_mutex_);
    ++counters_.errors;
    return counters_.newest_error = error.message;
  }

  std::optional<FileFailure> sync() {
    sync_at_.reset();
    unsynced_ = false;  // after a failure the system does not try these bytes again
    if (::fsync(file_.get()) != 0 && errno != EINVAL && errno != EROFS) return FileFailure{"syncing", errno};
    return std::nullopt;
  }

  /// The path names the open file.
  bool is_current() const noexcept {
    struct stat named {};
    return file_ && ::lstat(path_.c_str(), &named) == 0 && named.st_dev == device_ && named.st_ino == inode_;
  }

  /// Opens what is at the path, or makes it. The file that was open is closed, unless there is an error.
  Result<void> open() {
    Descriptor opened;
    bool made = false;
    for (int tries = 0; !opened; ++tries) {
      opened = Descriptor(::open(path_.c_str(), O_RDWR | O_APPEND | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY));
      if (opened) break;
      if (errno == ELOOP) return not_an_audit(path_, "a symbolic link. Name the file that it leads to");
      if (errno == EISDIR) return not_an_audit(path_, "a directory");
      if (errno == ENXIO) return not_an_audit(path_, "a socket");
      if (errno != ENOENT || tries >= max_openings) return file_error({"opening", errno}, path_);
      opened = Descriptor(::open(path_.c_str(), O_RDWR | O_APPEND | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600));
      made = static_cast<bool>(opened);
      if (!opened && errno == ENOENT) {  // the directory is gone
        if (Result<void> directory = make_directory(directory_of(path_)); !directory) return directory;
      } else if (!opened && errno != EEXIST) {
        return file_error({"making", errno}, path_);
      }
    }
    struct stat about {};
    if (::fstat(opened.get(), &about) != 0) return file_error({"examining", errno}, path_);
    if (!S_ISREG(about.st_mode)) return not_an_audit(path_, kind_of_file(about.st_mode));
    if (about.st_uid != ::geteuid() && about.st_uid != 0) return not_an_audit(path_, "a file of another user");
    if (about.st_size > 0) {
      char beginning[2] = {};
      const auto got = ::pread(opened.get(), beginning, sizeof beginning, 0);
      if (got < 0) return file_error({"reading", errno}, path_);
      if (beginning[0] != '{' || (got > 1 && beginning[1] != '"')) return not_an_audit(path_, "a file of another program. Choose another path");
    }
    if ((about.st_mode & 07777) != 0600) (void)::fchmod(opened.get(), 0600);  // not if it is of root
    if (made && options_.sync != security::AuditFileOptions::Sync::never)
      if (const auto failure = write_directory(directory_of(path_))) failed(*failure);
    file_ = std::move(opened);
    device_ = about.st_dev;
    inode_ = about.st_ino;
    return {};
  }

  /// The file at the path is open. If that cannot be, the open file stays in use as long as it has a name.
  std::optional<std::string> ensure_open() {
    if (reopen_.exchange(false, std::memory_order_acq_rel) || !is_current()) file_is_old_ = true;
    if (!file_is_old_) return std::nullopt;
    if (file_ && unsynced_ && options_.sync != security::AuditFileOptions::Sync::never)
      if (const auto failure = sync()) failed(*failure);
    const Result<void> opened = open();
    if (opened) {
      file_is_old_ = false;
      return std::nullopt;
    }
    struct stat about {};
    std::string trouble = failed(opened.error());
    const bool has_name = file_ && ::fstat(file_.get(), &about) == 0 && about.st_nlink > 0;
    return has_name ? std::nullopt : std::optional(std::move(trouble));
  }

  /// Appends lines. `lines` grows by those that are in the file whole.
  /// @param ends  of the lines in the text
  /// @return  what failed
  std::optional<std::string> put(std::string_view text, const std::vector<std::size_t>& ends, std::size_t& lines) {
    for (int tries = 0;; ++tries) {
      if (auto trouble = ensure_open()) return trouble;
      FileLock lock(file_.get());
      if (!file_is_old_ && !is_current() && tries < max_openings) continue;  // another process has renamed it
      struct stat about {};
      if (::fstat(file_.get(), &about) != 0) return failed(FileFailure{"examining", errno});
      auto size = static_cast<std::uint64_t>(about.st_size);
      if (size > 0)
        if (const auto failure = end_torn_line(size, lock.held())) return failed(*failure);
      if (options_.max_bytes != 0 && size > 0 && size + text.size() > options_.max_bytes && lock.held() && !file_is_old_ && tries < max_openings) {
        if (const auto failure = rename_files()) failed(*failure);  // and this file grows
        else continue;
      }
      std::size_t done = 0;
      std::optional<FileFailure> failure;
      while (done < text.size() && !failure) {
        const auto wrote = ::write(file_.get(), text.data() + done, text.size() - done);
        if (wrote > 0) done += static_cast<std::size_t>(wrote);
        else if (wrote == 0 || errno != EINTR) failure = FileFailure{"writing", wrote == 0 ? ENOSPC : errno};
      }
      const auto whole = std::upper_bound(ends.begin(), ends.end(), done);
      lines += static_cast<std::size_t>(whole - ends.begin());
      const std::size_t kept = whole == ends.begin() ? 0 : *(whole - 1);
      // Takes the part of a line away again, if nobody has written behind it. Else it is ended before the next line.
      if (failure && done > kept && lock.held() && ::fstat(file_.get(), &about) == 0 && static_cast<std::uint64_t>(about.st_size) == size + done)
        (void)::ftruncate(file_.get(), static_cast<off_t>(size + kept));
      return failure ? std::optional(failed(*failure)) : std::nullopt;
    }
  }

  /// A file whose last line has no end gets one. @param size  of the file; becomes the new one
  std::optional<FileFailure> end_torn_line(std::uint64_t& size, bool locked) {
    char last = 0;
    if (::pread(file_.get(), &last, 1, static_cast<off_t>(size - 1)) != 1) return FileFailure{"reading", errno};
    if (last == '\n') return std::nullopt;
    std::string tail(static_cast<std::size_t>(std::min<std::uint64_t>(size, max_torn_bytes)), '\0');
    const auto got = ::pread(file_.get(), tail.data(), tail.size(), static_cast<off_t>(size - tail.size()));
    if (got != static_cast<ssize_t>(tail.size())) return FileFailure{"reading", got < 0 ? errno : EIO};
    const std::size_t feed = tail.rfind('\n');
    const bool found = feed != std::string::npos || tail.size() == size;
    if (feed != std::string::npos) tail.erase(0, feed + 1);
    std::string end = "\n";
    // The part becomes the text of a line. Where the file cannot be cut (chattr +a), it stays as it is.
    if (locked && found && !is_whole(tail)) {
      std::string line = "{\"time\":\"" + to_xsd_date_time(std::chrono::system_clock::now()) + "\",\"event\":\"torn\",\"text\":";
      append_ascii_json_string(line, tail);
      if (::ftruncate(file_.get(), static_cast<off_t>(size - tail.size())) == 0) {
        size -= tail.size();
        end = line + "}\n";
      }
    }
    for (std::size_t done = 0; done < end.size();) {
      const auto wrote = ::write(file_.get(), end.data() + done, end.size() - done);
      if (wrote > 0) done += static_cast<std::size_t>(wrote);
      else if (wrote == 0 || errno != EINTR) return FileFailure{"writing", wrote == 0 ? ENOSPC : errno};
    }
    size += end.size();
    return std::nullopt;
  }

  std::string numbered(std::size_t n) const { return path_ + "." + std::to_string(n); }

  /// path -> path.1 -> path.2 ... The next look finds that the path names no file.
  std::optional<FileFailure> rename_files() {
    if (unsynced_ && options_.sync != security::AuditFileOptions::Sync::never)
      if (auto failure = sync()) failed(*failure);
    std::size_t last = 1;  // the first number that is free
    for (struct stat about{}; last < options_.kept_files && ::lstat(numbered(last).c_str(), &about) == 0;) ++last;
    for (std::size_t n = last; n > 0; --n) {
      const std::string from = n == 1 ? path_ : numbered(n - 1), to = numbered(n);
      if (::rename(from.c_str(), to.c_str()) != 0) return FileFailure{"renaming", errno};
    }
    return std::nullopt;
  }

  const std::string path_;
  const security::AuditFileOptions options_;
  EventWaker waker_;
  std::atomic<bool> reopen_{false};
  std::atomic<bool> claimed_{false};
  std::mutex mutex_;  ///< guards the rest
  Descriptor file_;
  dev_t device_ = 0;
  ino_t inode_ = 0;
  bool file_is_old_ = false;  ///< the path names another file that could not be opened
  bool unsynced_ = false;
  std::optional<Steady::time_point> sync_at_;
  mutable std::mutex counters_mutex_;  ///< guards counters_: mutex_ is held while the disk is waited for
  security::AuditFileCounters counters_;
};

}  // namespace

// ------------------------------------------------------------------------------------------------------- AuditFileWriter

AuditFileWriter::AuditFileWriter(const security::Audit& options, const Clock& clock, LogCallback log, Settled settled)
    : file_(std::static_pointer_cast<OpenAuditFile>(options.file)),
      max_lines_(options.max_waiting_lines),
      max_bytes_(options.max_waiting_bytes),
      clock_(clock),
      log_(std::move(log)),
      settled_(std::move(settled)) {}

AuditFileWriter::~AuditFileWriter() {
  if (claimed_) file_->release();
}

Result<void> AuditFileWriter::claim() {
  claimed_ = file_->claim();
  return claimed_ ? Result<void>()
                  : unexpected(Errc::invalid_option, "security.audit.file: another server writes to this object; open the file again");
}

void AuditFileWriter::stop() noexcept {
  stopping_ = true;
  file_->wake();
}

std::uint64_t AuditFileWriter::write(std::string line) noexcept {
  const std::size_t bytes = line.size();
  const std::size_t lines_before = waiting_.fetch_add(1, std::memory_order_relaxed);
  const std::size_t bytes_before = waiting_bytes_.fetch_add(bytes, std::memory_order_relaxed);
  if (lines_before < max_lines_ && (bytes_before == 0 || bytes_before + bytes <= max_bytes_)) try {
      lines_.put({std::move(line), number_ + 1});
      ++number_;
      file_->wake();
      return number_;
    } catch (...) {}  // no memory for the line
  waiting_.fetch_sub(1, std::memory_order_relaxed);
  waiting_bytes_.fetch_sub(bytes, std::memory_order_relaxed);
  drop();
  return 0;
}

void AuditFileWriter::drop() noexcept {
  const std::int64_t now = std::chrono::duration_cast<std::chrono::nanoseconds>(clock_.now().utc.time_since_epoch()).count();
  std::int64_t none = 0;
  dropped_from_.compare_exchange_strong(none, now, std::memory_order_relaxed);
  dropped_to_.store(now, std::memory_order_relaxed);
  dropped_.fetch_add(1, std::memory_order_release);
  all_dropped_.fetch_add(1, std::memory_order_relaxed);
}

void AuditFileWriter::run() noexcept {
  while (true) {
    const bool last = stopping_;
    lines_.take_all([this](Line line) { take(std::move(line)); });
    const std::chrono::milliseconds pause = write_all();
    if (last) break;
    file_->wait(pause);
  }
  lose_rest();
}

/// Of the failures until the file can be written, the first.
void AuditFileWriter::say_once(const char* why) noexcept {
  if (std::exchange(fails_, true) || !log_) return;
  try {
    log_(LogLevel::error, std::string("the audit waits in memory, and lines beyond security.audit.max_waiting_bytes are lost: ") + why);
  } catch (...) {}
}

void AuditFileWriter::settle(std::uint64_t number, bool saved) noexcept {
  try {
    if (settled_) settled_(number, saved);
  } catch (...) {}  // no memory: the response is that of the deadline
}

void AuditFileWriter::take(Line line) noexcept {
  const std::size_t bytes = line.text.size();
  const std::uint64_t number = line.number;
  try {
    return pending_.push_back(std::move(line));
  } catch (...) {}
  waiting_.fetch_sub(1, std::memory_order_relaxed);
  waiting_bytes_.fetch_sub(bytes, std::memory_order_relaxed);
  drop();
  settle(number, false);
}

/// @return  when to call it again
std::chrono::milliseconds AuditFileWriter::write_all() noexcept {
  constexpr std::chrono::milliseconds retry_pause{1'000};
  try {
    if (!write_pending() || !write_lost()) {
      say_once(trouble_.c_str());
      settle(0, false);
      return retry_pause;
    }
    fails_ = false;
    return file_->tend();
  } catch (...) { return retry_pause; }  // no memory
}

/// @return  whether the file has all of them
bool AuditFileWriter::write_pending() {
  while (!pending_.empty()) {
    std::vector<std::string_view> texts;
    texts.reserve(pending_.size());
    for (const Line& line : pending_) texts.push_back(line.text);
    const OpenAuditFile::Appended appended = file_->append(texts);
    const auto end = pending_.begin() + static_cast<std::ptrdiff_t>(appended.lines);
    if (appended.lines != 0) {
      std::size_t bytes = 0;
      for (auto line = pending_.begin(); line != end; ++line) bytes += line->text.size();
      const std::uint64_t newest = (end - 1)->number;
      pending_.erase(pending_.begin(), end);
      waiting_.fetch_sub(appended.lines, std::memory_order_relaxed);
      waiting_bytes_.fetch_sub(bytes, std::memory_order_relaxed);
      if (!appended.synced) {
        const auto now = clock_.now().utc;
        if (unsynced_.count == 0) unsynced_.from = now;
        unsynced_.to = now;
        unsynced_.count += appended.lines;
      }
      settle(newest, appended.synced);
    }
    if (!appended.trouble.empty()) {
      trouble_ = appended.trouble;
      if (appended.lines == 0 || !appended.synced) return false;
    }
  }
  return true;
}

/// Writes what the file does not have.
/// @return  false: it cannot be written
bool AuditFileWriter::write_lost() {
  if (const std::uint64_t count = dropped_.exchange(0, std::memory_order_acquire); count != 0) {
    const auto time_of = [](std::int64_t time) {
      return std::chrono::system_clock::time_point(std::chrono::duration_cast<std::chrono::system_clock::duration>(std::chrono::nanoseconds(time)));
    };
    const auto from = time_of(dropped_from_.exchange(0, std::memory_order_relaxed));
    if (lost_.count == 0) lost_.from = from;
    lost_.to = time_of(dropped_to_.load(std::memory_order_relaxed));
    lost_.count += count;
  }
  const std::string_view reason = trouble_.empty() ? std::string_view("more lines came than could be written") : trouble_;
  if (!write_missing("lost", lost_, reason) || !write_missing("unsynced", unsynced_, reason)) return false;
  trouble_.clear();
  return true;
}

bool AuditFileWriter::write_missing(std::string_view event, Missing& missing, std::string_view reason) {
  if (missing.count == 0) return true;
  std::string line = "{\"time\":\"" + to_xsd_date_time(clock_.now().utc) + "\",\"event\":\"";
  line.append(event).append("\",\"count\":" + std::to_string(missing.count));
  line += ",\"from\":\"" + to_xsd_date_time(missing.from) + "\",\"to\":\"" + to_xsd_date_time(missing.to) + "\"";
  line += ",\"reason\":";
  append_ascii_json_string(line, reason);
  line += '}';
  const OpenAuditFile::Appended appended = file_->append({line});
  if (appended.lines == 1) missing = {};
  else if (!appended.trouble.empty()) trouble_ = appended.trouble;
  return appended.lines == 1;
}

/// The server stops, and the file cannot be written.
void AuditFileWriter::lose_rest() noexcept {
  const std::uint64_t count = pending_.size();
  if (count == 0) return;
  all_dropped_.fetch_add(count, std::memory_order_relaxed);
  settle(pending_.back().number, false);
  try {
    if (log_) log_(LogLevel::error, std::to_string(count) + " lines of the audit are lost, because the server stopped: " + trouble_);
  } catch (...) {}
}

// ---------------------------------------------------------------------------------------------------------------- Output

namespace {

/// What was carried out keeps its fields for browsers only.
void make_unsaved(http::Response& response) {
  http::Response made;
  for (const http::Field& field : response.fields.list())
    if (field.name.substr(0, 14) == "Access-Control" || field.name == "Vary") made.fields.add(field.name, field.value);
  http::set_problem(made, {503, "The request was carried out with the status " + std::to_string(response.status) +
                                    ", but its line of the audit could not be saved."});
  response = std::move(made);
}

/// The audit of one server in a file.
class FileOutput final : public security::AuditFile::Output, public AuditHold {
 public:
  FileOutput(SharedEngine& server, bool holds)
      : server_(server),
        holds_(holds),
        writer_(server.options().security.audit, server.clock(), server.waking_log(),
                holds ? AuditFileWriter::Settled([this](std::uint64_t line, bool saved) { settled(line, saved); }) : nullptr) {}

  Result<void> prepare() override { return writer_.claim(); }
  void run() noexcept override { writer_.run(); }
  void stop() noexcept override { writer_.stop(); }
  std::uint64_t write(std::string line) noexcept override { return writer_.write(std::move(line)); }
  void drop() noexcept override { writer_.drop(); }
  void count(ServerCounters& all) const override {
    all.audit_dropped = writer_.dropped();
    all.audit_waiting = writer_.waiting();
    all.audit_errors = writer_.errors();
  }
  AuditHold* hold() noexcept override { return holds_ ? this : nullptr; }

  bool keep(std::uint64_t line, engine::Reply& reply) override {
    if (line == 0 || server_.is_stopping()) return make_unsaved(reply.response), false;
    engine::Reply rest;
    rest.ticket = reply.ticket;
    held_.emplace(line, Held{std::exchange(reply, std::move(rest)), server_.clock().now().steady + server_.options().limits.host_timeout});
    if (held_.size() > 1) return true;
    set_deadline();
    server_.loop().wake_io();
    return true;
  }
  void abandon(engine::Ticket ticket) noexcept override {
    const auto found = std::find_if(held_.begin(), held_.end(), [&](const auto& one) { return one.second.reply.ticket == ticket; });
    if (found != held_.end()) held_.erase(found);
    set_deadline();
  }
  void end() noexcept override {
    try {
      release(held_.end(), false);
    } catch (...) {}
  }
  void end_waits(TimePoint now) override {
    if (is_due(now)) release(std::find_if(held_.begin(), held_.end(), [&](const auto& one) { return one.second.deadline > now.steady; }), false);
  }
  void turn(TimePoint now) override {
    if (is_due(now)) server_.use_now([&] { end_waits(now); }, now);
  }
  std::optional<Steady::time_point> next_deadline() const override {
    const std::int64_t deadline = deadline_;
    if (deadline == no_deadline) return std::nullopt;
    return Steady::time_point(std::chrono::duration_cast<Steady::duration>(std::chrono::nanoseconds(deadline)));
  }

 private:
  static constexpr std::int64_t no_deadline = std::numeric_limits<std::int64_t>::max();
  struct Held {
    engine::Reply reply;
    Steady::time_point deadline;
  };
  using All = std::map<std::uint64_t, Held>;

  bool is_due(TimePoint now) const {
    const auto due = next_deadline();
    return due && *due <= now.steady;
  }
  void set_deadline() noexcept {
    deadline_ =
        held_.empty() ? no_deadline : std::chrono::duration_cast<std::chrono::nanoseconds>(held_.begin()->second.deadline.time_since_epoch()).count();
  }
  void release(const All::iterator& end, bool saved) {
    while (held_.begin() != end) {
      engine::Reply reply = std::move(held_.begin()->second.reply);
      held_.erase(held_.begin());
      if (!saved) make_unsaved(reply.response);
      server_.reply(std::move(reply));
    }
    set_deadline();
  }
  /// On the thread of the audit.
  void settled(std::uint64_t line, bool saved) {
    server_.use([&] { release(held_.upper_bound(line), saved); });
    turn(server_.clock().now());  // of a host that does not poll
    server_.loop().wake_io();
  }

  SharedEngine& server_;
  const bool holds_;
  All held_;                                         ///< by the number of the line; guarded by the engine's lock
  std::atomic<std::int64_t> deadline_{no_deadline};  ///< of the first of them [ns]
  AuditFileWriter writer_;
};

std::unique_ptr<security::AuditFile::Output> File::make_output(const Place& place) {
  return std::make_unique<FileOutput>(place.server, options_.respond_when_saved);
}

}  // namespace
}  // namespace lrt

namespace lrt::security {
inline namespace v0 {

Result<std::shared_ptr<AuditFile>> audit_file(std::string path, AuditFileOptions options) {
  const auto wrong = [](const char* what, const char* expected) {
    return unexpected(Errc::invalid_option, std::string("audit_file: ") + what + ": expected " + expected);
  };
  if (path.empty() || path.back() == '/' || path.find('\0') != std::string::npos) return wrong("path", "the name of a file");
  if (options.sync_interval < std::chrono::milliseconds(10) || options.sync_interval > std::chrono::hours(1))
    return wrong("sync_interval", "10 ms to 1 h");
  if (options.max_bytes != 0 && (options.max_bytes < 64 * 1024 || options.max_bytes > std::uint64_t{1} << 40))
    return wrong("max_bytes", "0, or 64 KiB to 1 TiB");
  if (options.kept_files < 1 || options.kept_files > 1'000) return wrong("kept_files", "1 to 1000");
  auto file = std::make_shared<File>(std::move(path), options);
  if (Result<void> opened = file->open_first(); !opened) return Unexpected{opened.error()};
  return std::shared_ptr<AuditFile>(std::move(file));
}

}  // namespace v0
}  // namespace lrt::security
