// SPDX-License-Identifier: Apache-2.0
// A library to be loaded before others (LD_PRELOAD): while the file that LRT_FULL_DISK names is there, the disk is full (the file is empty), or fails
// with the error whose number the file has.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

namespace {

template <class F>
F real(const char* name) {
  void* const found = ::dlsym(RTLD_NEXT, name);
  F function = nullptr;
  std::memcpy(&function, &found, sizeof function);
  return function;
}

/// Sets errno.
bool is_full() {
  const char* const path = std::getenv("LRT_FULL_DISK");
  if (path == nullptr) return false;
  const int file = ::open(path, O_RDONLY | O_CLOEXEC);
  if (file < 0) return false;
  char number[8] = {};
  const auto got = ::read(file, number, sizeof number - 1);
  ::close(file);
  errno = got > 0 ? std::atoi(number) : ENOSPC;
  return true;
}

bool is_file(int descriptor) {
  struct stat about {};
  return ::fstat(descriptor, &about) == 0 && S_ISREG(about.st_mode);
}

}  // namespace

extern "C" {

ssize_t pwrite(int descriptor, const void* bytes, size_t size, off_t offset) {
  static const auto next = real<ssize_t (*)(int, const void*, size_t, off_t)>("pwrite");
  if (is_full()) {
    if (size < 20) return -1;
    const int error = errno;
    (void)next(descriptor, bytes, size / 2, offset);  // a part of it finds room
    errno = error;
    return -1;
  }
  return next(descriptor, bytes, size, offset);
}
ssize_t pwrite64(int descriptor, const void* bytes, size_t size, off64_t offset) {
  return pwrite(descriptor, bytes, size, static_cast<off_t>(offset));
}
ssize_t write(int descriptor, const void* bytes, size_t size) {
  static const auto next = real<ssize_t (*)(int, const void*, size_t)>("write");
  return is_file(descriptor) && descriptor != STDERR_FILENO && is_full() ? -1 : next(descriptor, bytes, size);
}
int fdatasync(int descriptor) {
  static const auto next = real<int (*)(int)>("fdatasync");
  return is_full() ? -1 : next(descriptor);
}
int fsync(int descriptor) {
  static const auto next = real<int (*)(int)>("fsync");
  return is_full() ? -1 : next(descriptor);
}

}  // extern "C"
