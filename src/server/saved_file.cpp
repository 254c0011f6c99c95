// SPDX-License-Identifier: Apache-2.0
#include "src/server/saved_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <functional>
#include <mutex>
#include <set>
#include <system_error>
#include <utility>

#include "src/base/replace_file.hpp"
#include "src/base/thread.hpp"
#include "src/base/utf8.hpp"

namespace lrt {
namespace {

constexpr std::chrono::seconds retry_pause{10};
constexpr std::chrono::seconds last_time{5};

// --------------------------------------------------------------------------------------------------------- first line

constexpr std::string_view mark = "# lrt 1: ";  ///< a comment in Turtle

/// FNV-1a, 64 bits: finds damage. It does not protect against deliberate changes.
std::uint64_t checksum(std::string_view text) noexcept {
  std::uint64_t sum = 0xCBF29CE484222325U;
  for (const char c : text) sum = (sum ^ static_cast<unsigned char>(c)) * 0x100000001B3U;
  return sum;
}

std::string first_line(std::string_view text) {
  char line[80];
  const int size =
      std::snprintf(line, sizeof line, "%s%zu bytes, checksum %016llx\n", mark.data(), text.size(), static_cast<unsigned long long>(checksum(text)));
  return std::string(line, static_cast<std::size_t>(size));
}

/// The beginning of a file is that of a file of lrt, whole or cut off.
bool begins_like_ours(std::string_view beginning) { return beginning.substr(0, mark.size()) == mark.substr(0, beginning.size()); }

// ------------------------------------------------------------------------------------------------------------- places

Unexpected not_ours(const std::string& path, const std::string& found) {
  return unexpected(Errc::invalid_option, "\"" + path + "\": expected a file that lrt wrote, or none; found " + found + ". Choose another path");
}

/// The lock files of this process, by device and number. System locks alone are not enough: some file systems have none.
class Claimed {
 public:
  using Key = std::pair<dev_t, ino_t>;
  /// False: the process has it already.
  bool add(const Key& key) {
    const std::lock_guard lock(mutex_);
    return all_.insert(key).second;
  }
  void remove(const Key& key) noexcept {
    const std::lock_guard lock(mutex_);
    all_.erase(key);
  }
  bool has(const Key& key) {
    const std::lock_guard lock(mutex_);
    return all_.count(key) != 0;
  }

 private:
  std::mutex mutex_;
  std::set<Key> all_;
};

/// It is not destroyed: a server may end after the static objects.
Claimed& claimed_files() {
  static Claimed& all = *new Claimed;
  return all;
}

/// A lock that belongs to the open file where the system has that: closing another descriptor of the file does not release it.
int lock_whole(int descriptor) noexcept {
  struct flock whole {};
  whole.l_type = F_WRLCK;
#ifdef F_OFD_SETLK
  if (::fcntl(descriptor, F_OFD_SETLK, &whole) == 0) return 0;
  if (errno != EINVAL) return errno;
#endif
  return ::fcntl(descriptor, F_SETLK, &whole) == 0 ? 0 : errno;
}

/// The empty file at that path stays: removing it would let two processes lock two files of that name.
Result<SavedFile::Claim> claim(const std::string& lock) {
  const auto taken = [&](Errc code, const char* by) -> Result<SavedFile::Claim> {
    return unexpected(code, "\"" + lock + "\": another " + by + " writes this file. Choose another path");
  };
  constexpr const char* here = "graph or server of this program";
  struct stat about {};
  // Before it is opened: closing it again would release a lock that belongs to the process.
  if (::lstat(lock.c_str(), &about) == 0 && claimed_files().has({about.st_dev, about.st_ino})) return taken(Errc::invalid_option, here);
  Descriptor file(::open(lock.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0600));
  if (!file) {
    if (errno == ENOSPC || errno == EDQUOT) return SavedFile::Claim(lock, -1);  // a full disk does not stop the start
    return file_error({"opening", errno}, lock);
  }
  if (::fstat(file.get(), &about) != 0) return file_error({"examining", errno}, lock);
  const Claimed::Key key(about.st_dev, about.st_ino);
  if (!claimed_files().add(key)) return taken(Errc::invalid_option, here);
  const int error = lock_whole(file.get());
  if (error != EACCES && error != EAGAIN) return SavedFile::Claim(lock, file.release());  // some file systems have no locks
  claimed_files().remove(key);
  return taken(Errc::io_error, "process");
}

}  // namespace

/// Shared with its thread, which is detached if the disk does not respond.
class SavedFile::Writer {
 public:
  Writer(std::string path, Written written, LogCallback log, ThreadOptions threads, Claim claim)
      : path_(std::move(path)), claim_(std::move(claim)), threads_(std::move(threads)), written_(std::move(written)), log_(std::move(log)) {}

  void save(Make make, std::uint64_t revision, const std::shared_ptr<Writer>& self) {
    const std::lock_guard lock(mutex_);
    waiting_ = Text{std::move(make), revision};
    is_fresh_ = true;
    if (!thread_.joinable()) thread_ = start_thread("lrt-save", threads_, [self] { self->run(); }).value();
    changed_.notify_all();
  }

  void finish() noexcept {
    std::unique_lock lock(mutex_);
    ending_ = true;
    changed_.notify_all();
    if (!thread_.joinable()) {
      lock.unlock();
      return run();  // none could be started
    }
    if (changed_.wait_for(lock, last_time, [&] { return over_; })) {
      lock.unlock();
      thread_.join();
      return;
    }
    thread_.detach();
    lock.unlock();
    const std::lock_guard calls(calls_mutex_);
    written_ = nullptr;  // used by the owner, which may be destroyed now
    log_ = nullptr;
  }

  void say(const std::string& text) noexcept {
    const std::lock_guard calls(calls_mutex_);
    try {
      if (log_) log_(LogLevel::error, text);
    } catch (...) {}
  }
  /// "what PATH: why"; nothing if there is no memory for it.
  void say(const char* what, const char* why) noexcept {
    try {
      say(std::string(what) + " \"" + path_ + "\": " + why);
    } catch (...) {}
  }
  void report(std::uint64_t revision, bool written) noexcept {
    const std::lock_guard calls(calls_mutex_);
    try {
      if (written_) written_(revision, written);
    } catch (...) {}
  }
  const std::string& path() const noexcept { return path_; }

 private:
  struct Text {
    Make make;
    std::uint64_t revision;
  };

  void run() noexcept {
    std::unique_lock lock(mutex_);
    while (true) {
      const auto wake = [&] { return ending_ || is_fresh_; };
      if (waiting_) changed_.wait_for(lock, retry_pause, wake);
      else changed_.wait(lock, wake);
      if (waiting_) {
        const bool last = ending_;
        Text newest = *std::exchange(waiting_, std::nullopt);
        is_fresh_ = false;
        lock.unlock();
        const bool written = write(newest.make);
        report(newest.revision, written);
        lock.lock();
        if (!written && !waiting_ && !last) waiting_ = std::move(newest);
        if (!last) continue;
      }
      if (ending_ && !is_fresh_) break;
    }
    over_ = true;
    changed_.notify_all();
  }

  bool write(const Make& make) noexcept {
    try {
      const std::string text = make();
      if (!may_write()) return false;
      const std::optional<FileFailure> failure = replace_file(path_, {first_line(text), text}, {mark}).failure;
      if (!failure) {
        logged_.clear();
        return true;
      }
      if (logged_.emplace(failure->step, failure->error).second) say(file_error(*failure, path_).error.message);
    } catch (const BadResult& e) { say_once(e); } catch (...) {
      say("saving", "out of memory");
    }
    return false;
  }
  /// The text could not be made.
  void say_once(const BadResult& reason) noexcept {
    try {
      if (logged_.emplace(reason.what(), 0).second) say("saving", reason.what());
    } catch (...) {}  // there is no memory for the line
  }

  /// Nothing is written beside another process that has claimed the path. What such a process has left is kept.
  bool may_write() {
    const Result<bool> renewed = claim_.renew();
    if (!renewed) {
      if (logged_.emplace("claiming", 0).second) say(renewed.error().message);
      return false;
    }
    struct stat about {};
    if (!*renewed || ::lstat(followed(path_).c_str(), &about) != 0 || about.st_size == 0) return true;
    const Result<std::string> copy = keep_copy(path_);
    say("the lock of \"" + path_ + "\" was removed while the file was in use; " +
        (copy ? "what is there now is kept as \"" + *copy + "\"" : "what is there now could not be kept: " + copy.error().message));
    return true;
  }

  const std::string path_;
  Claim claim_;  // the thread's, as logged_ is
  const ThreadOptions threads_;
  std::set<std::pair<std::string, int>> logged_;  // the thread's
  std::mutex calls_mutex_;                        // guards written_ and log_, and is held while they run
  Written written_;
  LogCallback log_;
  std::mutex mutex_;
  std::condition_variable changed_;
  Thread thread_;
  std::optional<Text> waiting_;
  bool is_fresh_ = false;  ///< `waiting_` was not tried yet
  bool ending_ = false;
  bool over_ = false;
};

SavedFile::SavedFile(std::string path, Written written, LogCallback log, ThreadOptions threads, Claim claim)
    : writer_(std::make_shared<Writer>(std::move(path), std::move(written), std::move(log), std::move(threads), std::move(claim))) {}
SavedFile::SavedFile(std::string path, Written written, LogCallback log, ThreadOptions threads)
    : SavedFile(std::move(path), std::move(written), std::move(log), std::move(threads), Claim()) {}
SavedFile::~SavedFile() { writer_->finish(); }

void SavedFile::save(std::string text, std::uint64_t revision) noexcept {
  try {
    save(Make([text = std::move(text)] { return text; }), revision);
  } catch (...) {
    writer_->say("saving", "out of memory");
    writer_->report(revision, false);
  }
}

void SavedFile::save(Make make, std::uint64_t revision) noexcept {
  try {
    writer_->save(std::move(make), revision, writer_);
  } catch (...) {
    writer_->say("saving", "no thread to write it");
    writer_->report(revision, false);
  }
}

SavedFile::Claim::~Claim() {
  if (descriptor_ < 0) return;
  struct stat about {};
  if (::fstat(descriptor_, &about) == 0) claimed_files().remove({about.st_dev, about.st_ino});
  ::close(descriptor_);
}

Result<bool> SavedFile::Claim::renew() {
  if (path_.empty()) return false;
  struct stat mine {
  }, named{};
  if (descriptor_ >= 0) {
    const bool is_there = ::lstat(path_.c_str(), &named) == 0;
    if (!is_there && errno != ENOENT && errno != ENOTDIR) return false;  // it cannot be known, and the write may fail, too
    if (::fstat(descriptor_, &mine) != 0) return false;
    if (is_there && mine.st_dev == named.st_dev && mine.st_ino == named.st_ino) return false;
  }
  if (Result<void> made = make_directory(directory_of(path_)); !made) return Unexpected{made.error()};
  Result<Claim> again = claim(path_);
  if (!again) return Unexpected{std::move(again).error()};
  if (again->descriptor_ < 0) return false;  // a full disk: the write says so
  const bool had_one = descriptor_ >= 0;
  *this = *std::move(again);
  return had_one;
}

Result<SavedFile::Claim> SavedFile::prepare(const std::string& given, std::string_view other_mark) {
  if (given.empty() || given.back() == '/') return not_ours(given, "the name of a directory");
  const std::string path = followed(given);
  const std::string directory = directory_of(path);
  if (Result<void> made = make_directory(directory); !made) return Unexpected{made.error()};
  struct stat about {};
  if (::lstat(path.c_str(), &about) != 0) {
    if (errno != ENOENT) return file_error({"examining", errno}, path);
  } else if (S_ISLNK(about.st_mode)) {
    return file_error({"examining", ELOOP}, path);
  } else if (!S_ISREG(about.st_mode)) {
    return not_ours(path, kind_of_file(about.st_mode));
  }
  if (Result<void> checked = check_leftover(path, mark); !checked && (other_mark.empty() || !check_leftover(path, other_mark)))
    return Unexpected{checked.error()};
  if (::faccessat(AT_FDCWD, directory.c_str(), W_OK | X_OK, AT_EACCESS) != 0) return file_error({"writing to the directory", errno}, directory);
  return claim(path + ".lock");
}

Result<std::optional<SavedFile::Content>> SavedFile::load(const std::string& path, std::size_t max_bytes) {
  // Without O_NONBLOCK a FIFO in its place would wait for a writer.
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!file) {
    if (errno == ENOENT) return std::optional<Content>();
    return file_error({"opening", errno}, path);
  }
  struct stat about {};
  if (::fstat(file.get(), &about) != 0) return file_error({"reading", errno}, path);
  if (!S_ISREG(about.st_mode)) return not_ours(path, kind_of_file(about.st_mode));
  std::string text;
  while (true) {
    char buffer[16 * 1024];
    const auto got = ::read(file.get(), buffer, sizeof buffer);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return file_error({"reading", errno}, path);
    if (got == 0) break;
    text.append(buffer, static_cast<std::size_t>(got));
    if (text.size() > max_bytes) {
      return unexpected(Errc::limit_exceeded, "reading \"" + path + "\": more than " + std::to_string(max_bytes) + " bytes");
    }
  }
  if (text.size() > utf8::byte_order_mark.size() && begins_like_ours(utf8::without_mark(text)))
    text.erase(0, text.size() - utf8::without_mark(text).size());  // of an editor
  if (text.empty() || !begins_like_ours(text)) return std::optional(Content{std::move(text), State::unmarked});
  const std::string line = text.substr(0, text.find('\n') + 1);
  text.erase(0, line.empty() ? text.size() : line.size());
  const State state = line == first_line(text) ? State::whole : State::damaged;
  return std::optional(Content{std::move(text), state});
}

Result<std::string> SavedFile::keep_copy(const std::string& given) {
  const std::string path = followed(given);
  for (unsigned n = 1; n < 10'000; ++n) {
    std::string copy = path + ".damaged-" + std::to_string(n);
    // A second name: the first one stays until a new text replaces it.
    if (::link(path.c_str(), copy.c_str()) == 0) {
      if (const auto failure = write_directory(directory_of(path))) return file_error(*failure, path);
      return copy;
    }
    if (errno == EEXIST) continue;
    if (errno != EPERM && errno != ENOTSUP && errno != EMLINK) return file_error({"linking", errno}, path);  // these: the file system cannot
    struct stat about {};
    if (::lstat(copy.c_str(), &about) == 0) continue;
    if (::rename(path.c_str(), copy.c_str()) != 0) return file_error({"renaming", errno}, path);
    return copy;
  }
  return unexpected(Errc::io_error, "linking \"" + path + "\": too many damaged ones");
}

}  // namespace lrt
