// SPDX-License-Identifier: Apache-2.0
#include "tests/attack/failing_calls.hpp"

#include <dlfcn.h>
#include <fcntl.h>
#include <netdb.h>
#include <poll.h>
#include <pthread.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/timerfd.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <iterator>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace lrt::test {
namespace {

enum Function : std::size_t {
  socket_f,
  bind_f,
  listen_f,
  accept_f,
  connect_f,
  setsockopt_f,
  getsockopt_f,
  getsockname_f,
  getpeername_f,
  shutdown_f,
  recv_f,
  send_f,
  read_socket_f,
  write_socket_f,
  read_file_f,
  write_file_f,
  epoll_create_f,
  epoll_add_f,
  epoll_mod_f,
  epoll_wait_f,
  poll_f,
  eventfd_f,
  timerfd_f,
  pipe_f,
  duplicate_f,
  lock_f,
  open_f,
  fopen_f,
  fsync_f,
  fstat_f,
  lstat_f,
  link_f,
  rename_f,
  unlink_f,
  mkdir_f,
  access_f,
  close_f,
  pthread_create_f,
  getaddrinfo_f,
  getrandom_f,
  functions
};

struct About {
  Function function;
  const char* name;
  std::vector<int> errors;
};

const std::vector<About>& table() {
  static const std::vector<About>* const made = new std::vector<About>{
      {socket_f, "socket", {EMFILE, ENFILE, ENOBUFS, ENOMEM}},
      {bind_f, "bind", {EADDRINUSE, ENOMEM}},
      {listen_f, "listen", {EADDRINUSE}},
      {accept_f, "accept", {EINTR, EAGAIN, ECONNABORTED, EMFILE, ENFILE, ENOBUFS, ENOMEM, EPERM}},
      {connect_f, "connect", {EAGAIN, EADDRNOTAVAIL, ECONNREFUSED, ENETUNREACH}},
      {setsockopt_f, "setsockopt", {ENOMEM, ENOBUFS}},
      {getsockopt_f, "getsockopt", {ENOBUFS}},
      {getsockname_f, "getsockname", {ENOBUFS}},
      {getpeername_f, "getpeername", {ENOBUFS, ENOTCONN}},
      {shutdown_f, "shutdown", {ENOTCONN}},
      {recv_f, "recv", {EINTR, EAGAIN, ECONNRESET, ENOMEM, ETIMEDOUT, short_transfer}},
      {send_f, "send", {EINTR, EAGAIN, EPIPE, ECONNRESET, ENOBUFS, ENOMEM, short_transfer}},
      {read_socket_f, "read of a socket", {EINTR, EAGAIN, ECONNRESET, short_transfer}},
      {write_socket_f, "write to a socket", {EINTR, EAGAIN, EPIPE, ENOBUFS, short_transfer}},
      {read_file_f, "read of a file", {EINTR, EIO, short_transfer}},
      {write_file_f, "write to a file", {EINTR, EIO, ENOSPC, EDQUOT, short_transfer}},
      {epoll_create_f, "epoll_create1", {EMFILE, ENFILE, ENOMEM}},
      {epoll_add_f, "epoll_ctl ADD", {ENOMEM, ENOSPC}},
      {epoll_mod_f, "epoll_ctl MOD", {ENOMEM}},
      {epoll_wait_f, "epoll_wait", {EINTR}},
      {poll_f, "poll", {EINTR, ENOMEM}},
      {eventfd_f, "eventfd", {EMFILE, ENFILE, ENOMEM}},
      {timerfd_f, "timerfd_create", {EMFILE, ENFILE, ENOMEM}},
      {pipe_f, "pipe", {EMFILE, ENFILE}},
      {duplicate_f, "fcntl F_DUPFD", {EMFILE}},
      {lock_f, "fcntl F_SETLK", {ENOLCK}},
      {open_f, "open", {EINTR, EMFILE, ENFILE, ENOMEM, EIO, EACCES, ENOSPC}},
      {fopen_f, "fopen", {EMFILE, ENFILE, ENOMEM, EACCES}},
      {fsync_f, "fsync", {EINTR, EIO, ENOSPC, EDQUOT}},
      {fstat_f, "fstat", {EIO, ENOMEM}},
      {lstat_f, "lstat", {EIO, ENOMEM}},
      {link_f, "link", {EIO, ENOSPC}},
      {rename_f, "rename", {EIO, ENOSPC, EACCES}},
      {unlink_f, "unlink", {EIO, EACCES}},
      {mkdir_f, "mkdir", {EIO, ENOSPC, EACCES}},
      {access_f, "faccessat", {EIO, EACCES}},
      {close_f, "close", {EINTR, EIO}},
      {pthread_create_f, "pthread_create", {EAGAIN}},
      {getaddrinfo_f, "getaddrinfo", {EAI_MEMORY, EAI_AGAIN}},
      {getrandom_f, "getrandom", {EINTR, short_transfer}},
  };
  return *made;
}

thread_local bool is_server = false;
std::array<std::atomic<std::size_t>, functions> counts{};
std::atomic<std::size_t> armed_function{functions}, armed_from{0}, armed_to{0};
std::atomic<int> armed_error{0};
std::atomic<bool> failed{false};

/// Counts a call. The error with which it is to fail; 0: it is carried out.
int fault_of(Function function) noexcept {
  if (!is_server) return 0;
  const std::size_t n = ++counts[function];
  if (armed_function != function || n < armed_from || n >= armed_to) return 0;
  failed = true;
  return armed_error;
}

/// Sets errno. False: the call is carried out.
bool fails(Function function) noexcept {
  const int error = fault_of(function);
  if (error != 0) errno = error;
  return error != 0;
}

/// @param size  becomes 1 if the transfer is to be short
bool fails(Function function, std::size_t& size) noexcept {
  const int error = fault_of(function);
  if (error == short_transfer) size = std::min<std::size_t>(size, 1);
  else if (error != 0) errno = error;
  return error != 0 && error != short_transfer;
}

template <class F>
F* real(const char* name) noexcept {
  void* const found = ::dlsym(RTLD_NEXT, name);
  F* function = nullptr;
  std::memcpy(&function, &found, sizeof function);
  return function;
}

struct Start {
  void* (*run)(void*);
  void* given;
};
void* begin(void* given) {
  const Start start = *static_cast<Start*>(given);
  delete static_cast<Start*>(given);
  is_server = true;
  return start.run(start.given);
}

/// A descriptor as far as faults differ.
enum class Kind { file, socket, other };
Kind kind_of(int descriptor) noexcept {
  static auto* const next = real<int(int, struct stat*)>("fstat");
  struct stat about {};
  if (!is_server || next(descriptor, &about) != 0) return Kind::other;
  return S_ISREG(about.st_mode) ? Kind::file : S_ISSOCK(about.st_mode) ? Kind::socket : Kind::other;
}

bool is_read_refused(int descriptor, std::size_t& size) noexcept {
  const Kind kind = kind_of(descriptor);
  return kind != Kind::other && fails(kind == Kind::file ? read_file_f : read_socket_f, size);
}
bool is_write_refused(int descriptor, std::size_t& size) noexcept {
  const Kind kind = kind_of(descriptor);
  return kind != Kind::other && fails(kind == Kind::file ? write_file_f : write_socket_f, size);
}

}  // namespace

std::vector<Fault> all_faults() {
  std::vector<Fault> result;
  for (const About& about : table())
    for (const int error : about.errors) result.push_back({about.function, error});
  return result;
}
std::string name_of(const Fault& fault) {
  const std::string name = table().at(fault.function).name;
  if (fault.error == short_transfer) return name + ", one byte";
  return name + ", " + text_of(fault);
}
std::string text_of(const Fault& fault) {
  if (fault.error == short_transfer) return {};
  return fault.function == getaddrinfo_f ? ::gai_strerror(fault.error) : std::strerror(fault.error);
}

ServerSide::ServerSide() noexcept : before_(std::exchange(is_server, true)) {}
ServerSide::~ServerSide() { is_server = before_; }

void fail_call(const Fault& fault, std::size_t n, std::size_t repetitions) {
  fail_no_call();
  armed_error = fault.error;
  armed_from = n;
  armed_to = n + repetitions;
  armed_function = fault.function;
}
void fail_no_call() {
  armed_function = functions;
  failed = false;
  for (auto& count : counts) count = 0;
}
bool has_failed() noexcept { return failed; }
std::size_t calls_of(std::size_t function) noexcept { return counts[function]; }
std::size_t calls_of(const std::string& function) noexcept {
  for (const About& about : table())
    if (about.name == function) return counts[about.function];
  return 0;
}

}  // namespace lrt::test

using namespace lrt::test;

// Each calls the function of the C library (or of a sanitizer) that it hides, unless it is to fail.
extern "C" {

int socket(int domain, int type, int protocol) noexcept {
  static auto* const next = real<int(int, int, int)>("socket");
  return fails(socket_f) ? -1 : next(domain, type, protocol);
}
int bind(int descriptor, const sockaddr* address, socklen_t size) noexcept {
  static auto* const next = real<int(int, const sockaddr*, socklen_t)>("bind");
  return fails(bind_f) ? -1 : next(descriptor, address, size);
}
int listen(int descriptor, int backlog) noexcept {
  static auto* const next = real<int(int, int)>("listen");
  return fails(listen_f) ? -1 : next(descriptor, backlog);
}
int accept(int descriptor, sockaddr* address, socklen_t* size) {
  static auto* const next = real<int(int, sockaddr*, socklen_t*)>("accept");
  return fails(accept_f) ? -1 : next(descriptor, address, size);
}
int accept4(int descriptor, sockaddr* address, socklen_t* size, int flags) {
  static auto* const next = real<int(int, sockaddr*, socklen_t*, int)>("accept4");
  return fails(accept_f) ? -1 : next(descriptor, address, size, flags);
}
int connect(int descriptor, const sockaddr* address, socklen_t size) {
  static auto* const next = real<int(int, const sockaddr*, socklen_t)>("connect");
  return fails(connect_f) ? -1 : next(descriptor, address, size);
}
int setsockopt(int descriptor, int level, int option, const void* value, socklen_t size) noexcept {
  static auto* const next = real<int(int, int, int, const void*, socklen_t)>("setsockopt");
  return fails(setsockopt_f) ? -1 : next(descriptor, level, option, value, size);
}
int getsockopt(int descriptor, int level, int option, void* value, socklen_t* size) noexcept {
  static auto* const next = real<int(int, int, int, void*, socklen_t*)>("getsockopt");
  return fails(getsockopt_f) ? -1 : next(descriptor, level, option, value, size);
}
int getsockname(int descriptor, sockaddr* address, socklen_t* size) noexcept {
  static auto* const next = real<int(int, sockaddr*, socklen_t*)>("getsockname");
  return fails(getsockname_f) ? -1 : next(descriptor, address, size);
}
int getpeername(int descriptor, sockaddr* address, socklen_t* size) noexcept {
  static auto* const next = real<int(int, sockaddr*, socklen_t*)>("getpeername");
  return fails(getpeername_f) ? -1 : next(descriptor, address, size);
}
int shutdown(int descriptor, int how) noexcept {
  static auto* const next = real<int(int, int)>("shutdown");
  return fails(shutdown_f) ? -1 : next(descriptor, how);
}
ssize_t recv(int descriptor, void* to, std::size_t size, int flags) {
  static auto* const next = real<ssize_t(int, void*, std::size_t, int)>("recv");
  return fails(recv_f, size) ? -1 : next(descriptor, to, size, flags);
}
ssize_t send(int descriptor, const void* from, std::size_t size, int flags) {
  static auto* const next = real<ssize_t(int, const void*, std::size_t, int)>("send");
  return fails(send_f, size) ? -1 : next(descriptor, from, size, flags);
}
ssize_t sendmsg(int descriptor, const msghdr* message, int flags) {
  static auto* const next = real<ssize_t(int, const msghdr*, int)>("sendmsg");
  std::size_t size = 2;
  if (fails(send_f, size)) return -1;
  if (size == 1 && message->msg_iovlen > 0)
    return send(descriptor, message->msg_iov[0].iov_base, std::min<std::size_t>(1, message->msg_iov[0].iov_len), flags);
  return next(descriptor, message, flags);
}
ssize_t read(int descriptor, void* to, std::size_t size) {
  static auto* const next = real<ssize_t(int, void*, std::size_t)>("read");
  return is_read_refused(descriptor, size) ? -1 : next(descriptor, to, size);
}
ssize_t write(int descriptor, const void* from, std::size_t size) {
  static auto* const next = real<ssize_t(int, const void*, std::size_t)>("write");
  return is_write_refused(descriptor, size) ? -1 : next(descriptor, from, size);
}
int epoll_create1(int flags) noexcept {
  static auto* const next = real<int(int)>("epoll_create1");
  return fails(epoll_create_f) ? -1 : next(flags);
}
int epoll_ctl(int set, int what, int descriptor, epoll_event* event) noexcept {
  static auto* const next = real<int(int, int, int, epoll_event*)>("epoll_ctl");
  if (what != EPOLL_CTL_DEL && fails(what == EPOLL_CTL_ADD ? epoll_add_f : epoll_mod_f)) return -1;
  return next(set, what, descriptor, event);
}
int epoll_wait(int set, epoll_event* events, int size, int time) {
  static auto* const next = real<int(int, epoll_event*, int, int)>("epoll_wait");
  return fails(epoll_wait_f) ? -1 : next(set, events, size, time);
}
int poll(pollfd* items, nfds_t size, int time) {
  static auto* const next = real<int(pollfd*, nfds_t, int)>("poll");
  return fails(poll_f) ? -1 : next(items, size, time);
}
int eventfd(unsigned value, int flags) noexcept {
  static auto* const next = real<int(unsigned, int)>("eventfd");
  return fails(eventfd_f) ? -1 : next(value, flags);
}
int timerfd_create(int clock, int flags) noexcept {
  static auto* const next = real<int(int, int)>("timerfd_create");
  return fails(timerfd_f) ? -1 : next(clock, flags);
}
int pipe(int* ends) noexcept {
  static auto* const next = real<int(int*)>("pipe");
  return fails(pipe_f) ? -1 : next(ends);
}
int fcntl(int descriptor, int command, ...) {
  static auto* const next = real<int(int, int, void*)>("fcntl");
  va_list list;
  va_start(list, command);
  void* const given = va_arg(list, void*);  // a number has its place too
  va_end(list);
  if ((command == F_DUPFD || command == F_DUPFD_CLOEXEC) && fails(duplicate_f)) return -1;
  if (command == F_SETLK && fails(lock_f)) return -1;
  return next(descriptor, command, given);
}
int open(const char* path, int flags, ...) {
  static auto* const next = real<int(const char*, int, mode_t)>("open");
  va_list list;
  va_start(list, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(list, mode_t) : 0;
  va_end(list);
  return fails(open_f) ? -1 : next(path, flags, mode);
}
std::FILE* fopen(const char* path, const char* mode) {
  static auto* const next = real<std::FILE*(const char*, const char*)>("fopen");
  return fails(fopen_f) ? nullptr : next(path, mode);
}
int fsync(int descriptor) {
  static auto* const next = real<int(int)>("fsync");
  if (!is_server) return next(descriptor);
  return fails(fsync_f) ? -1 : 0;  // no crash follows, and a disk takes its time
}
int fstat(int descriptor, struct stat* about) noexcept {
  static auto* const next = real<int(int, struct stat*)>("fstat");
  return fails(fstat_f) ? -1 : next(descriptor, about);
}
int lstat(const char* path, struct stat* about) noexcept {
  static auto* const next = real<int(const char*, struct stat*)>("lstat");
  return fails(lstat_f) ? -1 : next(path, about);
}
int link(const char* from, const char* to) noexcept {
  static auto* const next = real<int(const char*, const char*)>("link");
  return fails(link_f) ? -1 : next(from, to);
}
int rename(const char* from, const char* to) noexcept {
  static auto* const next = real<int(const char*, const char*)>("rename");
  return fails(rename_f) ? -1 : next(from, to);
}
int unlink(const char* path) noexcept {
  static auto* const next = real<int(const char*)>("unlink");
  return fails(unlink_f) ? -1 : next(path);
}
int mkdir(const char* path, mode_t mode) noexcept {
  static auto* const next = real<int(const char*, mode_t)>("mkdir");
  return fails(mkdir_f) ? -1 : next(path, mode);
}
int faccessat(int directory, const char* path, int mode, int flags) noexcept {
  static auto* const next = real<int(int, const char*, int, int)>("faccessat");
  return fails(access_f) ? -1 : next(directory, path, mode, flags);
}
/// Fails after it has closed, as Linux does.
int close(int descriptor) {
  static auto* const next = real<int(int)>("close");
  const int error = fault_of(close_f);
  const int closed = next(descriptor);
  return error == 0 ? closed : (errno = error, -1);
}
int pthread_create(pthread_t* id, const pthread_attr_t* attributes, void* (*run)(void*), void* given) noexcept {
  static auto* const next = real<int(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*)>("pthread_create");
  if (!is_server) return next(id, attributes, run, given);
  if (const int error = fault_of(pthread_create_f); error != 0) return error;
  auto* const start = new Start{run, given};
  const int error = next(id, attributes, &begin, start);
  if (error != 0) delete start;
  return error;
}
int getaddrinfo(const char* name, const char* service, const addrinfo* wanted, addrinfo** found) {
  static auto* const next = real<int(const char*, const char*, const addrinfo*, addrinfo**)>("getaddrinfo");
  const int error = fault_of(getaddrinfo_f);
  return error != 0 ? error : next(name, service, wanted, found);
}
ssize_t getrandom(void* to, std::size_t size, unsigned flags) {
  static auto* const next = real<ssize_t(void*, std::size_t, unsigned)>("getrandom");
  return fails(getrandom_f, size) ? -1 : next(to, size, flags);
}

}  // extern "C"
