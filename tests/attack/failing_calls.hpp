// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace lrt::test {

/// System calls of a server fail where a test says. This program defines the functions of the C library by which lrt, libwebsockets and OpenSSL call
/// the system (failing_calls.cpp). They count the calls of a server, and let one of them fail.

/// A function of the C library, on one kind of descriptor where that matters, and how it fails.
struct Fault {
  std::size_t function = 0;
  int error = 0;  ///< errno, or EAI_...; short_transfer: one byte is read or written
};
constexpr int short_transfer = -1000;

/// All faults that a system may produce for valid arguments.
std::vector<Fault> all_faults();
/// "recv ECONNRESET"
std::string name_of(const Fault& fault);
/// The text of the system for its error; empty if it has none.
std::string text_of(const Fault& fault);

/// What this thread does, and what threads do that it starts, is done by a server, while this lives.
class ServerSide {
 public:
  ServerSide() noexcept;
  ~ServerSide();
  ServerSide(const ServerSide&) = delete;
  ServerSide& operator=(const ServerSide&) = delete;

 private:
  bool before_;
};

/// The n-th call of the function from now on fails, with all `repetitions` - 1 that follow.
void fail_call(const Fault& fault, std::size_t n, std::size_t repetitions = 1);
/// No further call fails. Counting begins anew.
void fail_no_call();
/// The call has failed.
bool has_failed() noexcept;
/// Calls of the function by servers, since fail_call() or fail_no_call().
std::size_t calls_of(std::size_t function) noexcept;
/// By its name: "accept", "recv".
std::size_t calls_of(const std::string& function) noexcept;

}  // namespace lrt::test
