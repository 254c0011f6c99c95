// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>

#include <lrt/base/thread_options.hpp>
#include <lrt/model/dispatch.hpp>

namespace lrt {
inline namespace v0 {

/// Which thread does the I/O (SPEC 3.10).
enum class Io : std::uint8_t {
  own_thread,  ///< a thread of lrt: requests for pushed and static resources do not need the host
  in_poll,     ///< Server::poll does everything except parsing large bodies (Threads::body_threads)
};

/// Which threads run what.
/// @par Threads  Set-up only, as Options.
struct Threads {
  Io io = Io::own_thread;                 ///< which thread does the I/O
  Dispatch dispatch = Dispatch::in_poll;  ///< of things that do not set their own
  /// Runs the lambdas of things with Dispatch::executor. It must run each function exactly once, at any time, on any
  /// thread.
  std::function<void(std::function<void()>)> executor;
  /// How many request bodies above Limits::small_body_bytes are parsed and validated at a time, on threads of lrt's, so
  /// that neither the control loop nor other clients wait for them. The threads start with the first such body and run no
  /// lambda. Bodies of several clients take turns, which needs a thread for each client, at most 32 more than this. 0: the
  /// I/O thread parses every body; 1 MiB takes up to 0.2 s.
  unsigned body_threads = 1;
  /// Policy, CPUs and stack of all threads that the server starts: lrt-io (Io::own_thread), lrt-run (Server::start),
  /// lrt-callback, lrt-resolve, lrt-save, lrt-body, lrt-query, lrt-audit. They do not inherit those of the thread that
  /// creates the server. They block all signals; a process that a lambda starts on such a thread inherits the mask.
  ThreadOptions own;
};

}  // namespace v0
}  // namespace lrt
