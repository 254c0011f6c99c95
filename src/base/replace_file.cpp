// SPDX-License-Identifier: Apache-2.0
#include "src/base/replace_file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <system_error>
#include <utility>

namespace lrt {

Unexpected file_error(const FileFailure& failure, const std::string& path) {
  return unexpected(Errc::io_error, failure.step + " \"" + path + "\": " + std::system_category().message(failure.error));
}

std::string directory_of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  if (slash == std::string::npos) return ".";
  return slash == 0 ? "/" : path.substr(0, slash);
}

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

const char* kind_of_file(mode_t mode) noexcept {
  if (S_ISLNK(mode)) return "a symbolic link";
  if (S_ISDIR(mode)) return "a directory";
  if (S_ISCHR(mode) || S_ISBLK(mode)) return "a device";
  if (S_ISFIFO(mode)) return "a FIFO";
  if (S_ISSOCK(mode)) return "a socket";
  return "something else";
}

std::optional<FileFailure> write_directory(const std::string& directory) {
  const Descriptor opened(::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!opened) return FileFailure{"opening the directory of", errno};
  if (::fsync(opened.get()) != 0 && errno != EINVAL && errno != EROFS) return FileFailure{"writing the directory of", errno};
  return std::nullopt;
}

Result<void> make_directory(const std::string& directory) {
  const std::string above = directory_of(directory);
  bool made = ::mkdir(directory.c_str(), 0700) == 0;
  if (!made && errno == ENOENT && above != directory) {
    if (Result<void> made_above = make_directory(above); !made_above) return made_above;
    made = ::mkdir(directory.c_str(), 0700) == 0;
  }
  if (!made) return errno == EEXIST ? Result<void>() : file_error({"making the directory", errno}, directory);
  const auto failure = write_directory(above);
  return failure ? file_error(*failure, directory) : Result<void>();
}

Result<void> check_leftover(const std::string& path, std::string_view mark) {
  const std::string fresh = path + ".new";
  const auto in_the_way = [&](const std::string& found) {
    return unexpected(Errc::invalid_option, "\"" + fresh + "\": expected a file that lrt wrote, or none; found " + found + ". Choose another path");
  };
  struct stat about {};
  if (::lstat(fresh.c_str(), &about) != 0) return errno == ENOENT ? Result<void>() : file_error({"examining", errno}, fresh);
  if (!S_ISREG(about.st_mode)) return in_the_way(kind_of_file(about.st_mode));
  const Descriptor file(::open(fresh.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  std::string beginning(mark.size(), '\0');
  const auto got = file ? ::read(file.get(), beginning.data(), beginning.size()) : -1;
  if (got < 0) return file_error({"reading", errno}, fresh);
  beginning.resize(static_cast<std::size_t>(got));
  if (beginning != mark.substr(0, beginning.size())) return in_the_way("a file of another program");
  return {};
}

Replaced replace_file(const std::string& link, std::initializer_list<std::string_view> parts, const ReplaceOptions& options) {
  const std::string path = followed(link);
  const std::string fresh = path + ".new";
  const auto failed = [](std::string step, int error) { return Replaced{FileFailure{std::move(step), error}, Descriptor()}; };
  if (!check_leftover(path, options.mark)) return failed("another file is in the place of \"" + fresh + "\", beside", EEXIST);
  // Never opens an existing file, so that a symbolic link that is put there now is not followed.
  if (::unlink(fresh.c_str()) != 0 && errno != ENOENT) return failed("removing what was left of", errno);
  Descriptor file(::open(fresh.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_APPEND | O_CLOEXEC, options.mode));
  if (!file) return failed("opening a file beside", errno);
  const auto undo = [&](const char* step, int error) {
    (void)file.close();
    ::unlink(fresh.c_str());
    return failed(step, error);
  };
  if (options.lock && ::flock(file.get(), LOCK_EX | LOCK_NB) != 0) return undo("locking a file beside", errno);
  for (const std::string_view part : parts)
    for (std::size_t done = 0; done < part.size();) {
      const auto put = ::write(file.get(), part.data() + done, part.size() - done);
      if (put > 0) done += static_cast<std::size_t>(put);
      else if (put == 0 || errno != EINTR) return undo("writing beside", errno);
    }
  if (::fsync(file.get()) != 0) return undo("writing beside", errno);
  struct stat about {};
  if (::lstat(path.c_str(), &about) == 0 && !S_ISREG(about.st_mode)) return undo("something that is not a file is in the place of", EEXIST);
  if (::rename(fresh.c_str(), path.c_str()) != 0) return undo("replacing", errno);
  return {write_directory(directory_of(path)), std::move(file)};  // the new name is on the disk only when the directory is
}

}  // namespace lrt
