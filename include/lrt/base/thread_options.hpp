// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <lrt/base/language.hpp>

namespace lrt {
inline namespace v0 {

/// Scheduling policies of threads (sched(7)).
enum class Scheduling : std::uint8_t {
  normal,       ///< not real-time: SCHED_OTHER
  fifo,         ///< SCHED_FIFO
  round_robin,  ///< SCHED_RR
};

/// How lrt's own threads run. They inherit nothing from the thread that creates the server: if a control loop with
/// SCHED_FIFO is bound to one CPU, lrt's threads have the normal policy and may run on the other CPUs.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
///               Servers and clients copy it when they are created.
struct ThreadOptions {
  /// With a real-time policy, the threads parse requests of clients at real-time priority. Clients can then keep robot
  /// code of a lower priority from running.
  Scheduling policy = Scheduling::normal;
  int priority = 0;  ///< of fifo and round_robin: 1 to 99 (sched_get_priority_max); of normal: 0
  /// The CPUs on which the threads may run, 0 to CPU_SETSIZE - 1. Empty: those that the process could use when lrt was
  /// loaded, before the host bound its threads to CPUs. These respect taskset(1), isolcpus and the container.
  std::vector<unsigned> cpus{};
  /// Stack of a thread in bytes, at least PTHREAD_STACK_MIN; 0: the system's default (ulimit -s, usually 8 MiB). User
  /// code that runs on these threads uses it as well. After mlockall(MCL_FUTURE) all of it is resident.
  std::size_t stack_bytes = 0;
};

}  // namespace v0
}  // namespace lrt
