#include "src/server/saved_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <climits>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <set>
#include <system_error>
#include <utility>

#include "src/base/thread.hpp"

namespace lrt {
namespace {

constexpr std::chrono::seconds retry_pause{10};
constexpr std::chrono::seconds last_time{5};

class Descriptor {
 public:
  explicit Descriptor(int number) noexcept : number_(number) {}
  ~Descriptor() { close(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  explicit operator bool() const noexcept { return number_ >= 0; }
  int get() const noexcept { return number_; }
  bool close() noexcept { return number_ < 0 || ::close(std::exchange(number_, -1)) == 0; }

 private:
  int number_;
};

/// The step that failed, with its errno.
struct Failure {
  std::string step;
  int error;
};

Unexpected io_error(const std::string& step, const std::string& path, int error) {
  return unexpected(Errc::io_error, step + " \"" + path + "\": " + std::system_category().message(error));
}

std::string directory_of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  if (slash == std::string::npos) return ".";
  return slash == 0 ? "/" : path.substr(0, slash);
}

/// Where symbolic links lead, also to a file that is not there yet.
std::string followed(std::string path) {
  for (int links = 0; links < 16; ++links) {
    char target[PATH_MAX];
    const auto size = ::readlink(path.c_str(), target, sizeof target);
    if (size <= 0 || size == static_cast<ssize_t>(sizeof target)) break;
    const std::string next(target, static_cast<std::size_t>(size));
    path = next.front() == '/' ? next : directory_of(path) + "/" + next;
  }
  return path;
}

std::optional<Failure> write_whole(const std::string& link, const std::string& text) {
  const std::string path = followed(link);
  const std::string fresh = path + ".new";
  // Never opens what is there: a leftover is removed, and a link laid in its place is not followed.
  if (::unlink(fresh.c_str()) != 0 && errno != ENOENT) return Failure{"removing what was left of", errno};
  Descriptor file(::open(fresh.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600));
  if (!file) return Failure{"opening a file beside", errno};
  const auto fail = [&](const char* step) {
    const int error = errno;
    file.close();
    ::unlink(fresh.c_str());
    return Failure{step, error};
  };
  for (std::size_t done = 0; done < text.size();) {
    const auto put = ::write(file.get(), text.data() + done, text.size() - done);
    if (put > 0) done += static_cast<std::size_t>(put);
    else if (put == 0 || errno != EINTR) return fail("writing beside");
  }
  if (::fsync(file.get()) != 0) return fail("writing beside");
  if (!file.close()) return fail("closing beside");
  if (::rename(fresh.c_str(), path.c_str()) != 0) return fail("replacing");
  // The new name is on the disk only when the directory is. Some file systems cannot: the text is in its place all the same.
  const Descriptor directory(::open(directory_of(path).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (directory && ::fsync(directory.get()) != 0 && errno != EINVAL && errno != EROFS) return Failure{"writing the directory of", errno};
  return std::nullopt;
}

}  // namespace

/// Shared with its thread, which is detached if the disk does not respond.
class SavedFile::Writer {
 public:
  Writer(std::string path, LogCallback log, ThreadOptions threads)
      : path_(std::move(path)), threads_(std::move(threads)), log_(std::move(log)) {}

  void save(std::string text, const std::shared_ptr<Writer>& self) {
    const std::lock_guard lock(mutex_);
    waiting_ = std::move(text);
    is_fresh_ = true;
    if (!thread_.joinable()) thread_ = start_thread("lrt-save", threads_, [self] { self->run(); }).value();
    changed_.notify_all();
  }

  void finish() noexcept {
    std::unique_lock lock(mutex_);
    ending_ = true;
    changed_.notify_all();
    if (!thread_.joinable()) return;
    if (changed_.wait_for(lock, last_time, [&] { return over_; })) {
      lock.unlock();
      thread_.join();
    } else {
      log_ = nullptr;  // the host's, which may be destroyed now
      thread_.detach();
    }
  }

  void say(const std::string& text) noexcept {
    try {
      LogCallback log;
      {
        const std::lock_guard lock(mutex_);
        log = log_;
      }
      if (log) log(LogLevel::error, text);
    } catch (...) {
    }
  }
  const std::string& path() const noexcept { return path_; }

 private:
  void run() noexcept {
    std::unique_lock lock(mutex_);
    while (true) {
      const auto wake = [&] { return ending_ || is_fresh_; };
      if (waiting_) changed_.wait_for(lock, retry_pause, wake);
      else changed_.wait(lock, wake);
      if (waiting_) {
        const bool last = ending_;
        const std::string text = *std::exchange(waiting_, std::nullopt);
        is_fresh_ = false;
        lock.unlock();
        const bool written = write(text);
        lock.lock();
        if (!written && !waiting_ && !last) waiting_ = text;
        if (!last) continue;
      }
      if (ending_ && !is_fresh_) break;
    }
    over_ = true;
    changed_.notify_all();
  }

  bool write(const std::string& text) noexcept {
    try {
      const std::optional<Failure> failure = write_whole(path_, text);
      if (!failure) {
        told_.clear();
        return true;
      }
      if (told_.emplace(failure->step, failure->error).second) {
        say(failure->step + " \"" + path_ + "\": " + std::system_category().message(failure->error));
      }
    } catch (...) {
      say("saving \"" + path_ + "\": out of memory");
    }
    return false;
  }

  const std::string path_;
  const ThreadOptions threads_;
  std::set<std::pair<std::string, int>> told_;  // the thread's
  std::mutex mutex_;
  LogCallback log_;
  std::condition_variable changed_;
  Thread thread_;
  std::optional<std::string> waiting_;
  bool is_fresh_ = false;  ///< `waiting_` was not tried yet
  bool ending_ = false;
  bool over_ = false;
};

SavedFile::SavedFile(std::string path, LogCallback log, ThreadOptions threads)
    : writer_(std::make_shared<Writer>(std::move(path), std::move(log), std::move(threads))) {}
SavedFile::~SavedFile() { writer_->finish(); }

void SavedFile::save(std::string text) noexcept {
  try {
    writer_->save(std::move(text), writer_);
  } catch (...) {
    writer_->say("saving \"" + writer_->path() + "\": no thread to write it");
  }
}

Result<std::optional<std::string>> SavedFile::load(const std::string& path, std::size_t max_bytes) {
  // Without O_NONBLOCK a FIFO in its place would wait for a writer.
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!file) {
    if (errno == ENOENT) return std::optional<std::string>();
    return io_error("opening", path, errno);
  }
  struct stat about {};
  if (::fstat(file.get(), &about) != 0) return io_error("reading", path, errno);
  if (!S_ISREG(about.st_mode)) return unexpected(Errc::io_error, "reading \"" + path + "\": not a file");
  std::string text;
  while (true) {
    char buffer[16 * 1024];
    const auto got = ::read(file.get(), buffer, sizeof buffer);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return io_error("reading", path, errno);
    if (got == 0) return std::optional<std::string>(std::move(text));
    text.append(buffer, static_cast<std::size_t>(got));
    if (text.size() > max_bytes) {
      return unexpected(Errc::limit_exceeded, "reading \"" + path + "\": more than " + std::to_string(max_bytes) + " bytes");
    }
  }
}

Result<std::string> SavedFile::set_aside(const std::string& path) {
  for (unsigned n = 1; n < 10'000; ++n) {
    std::string aside = path + ".damaged-" + std::to_string(n);
#ifdef RENAME_NOREPLACE
    if (::renameat2(AT_FDCWD, path.c_str(), AT_FDCWD, aside.c_str(), RENAME_NOREPLACE) == 0) return aside;
    if (errno == EEXIST) continue;
    if (errno != EINVAL && errno != ENOSYS) return io_error("renaming", path, errno);  // these: the file system cannot
#endif
    struct stat about {};
    if (::lstat(aside.c_str(), &about) == 0) continue;
    if (::rename(path.c_str(), aside.c_str()) != 0) return io_error("renaming", path, errno);
    return aside;
  }
  return unexpected(Errc::io_error, "renaming \"" + path + "\": too many damaged ones");
}

}  // namespace lrt
