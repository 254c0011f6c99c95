// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include <lrt/base/language.hpp>

namespace lrt {
inline namespace v0 {

/// The place where user lambdas run. No lambda runs under a lock of lrt.
enum class Dispatch : std::uint8_t {
  as_server,  ///< as Threads::dispatch says (the default of a Thing). For a property, action or collection: as its thing
  in_poll,    ///< inside Server::poll, on the host's thread (the default of a server): robot code needs no locks
  io_thread,  ///< on the I/O thread: shortest response time; for fast, thread-safe code
  executor,   ///< passed to Threads::executor: several lambdas may run at the same time
};

/// The rule for an invocation while another one of the same action is pending or running.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
struct ActionPolicy {
  /// The rules, see the functions of these names.
  enum class Kind : std::uint8_t { preempt, queue, reject, parallel };
  Kind kind = Kind::queue;  ///< which rule
  std::size_t limit = 16;   ///< queue: number of waiting invocations; parallel: of running invocations; beyond it the client gets 429

  static constexpr ActionPolicy preempt() noexcept { return {Kind::preempt, 1}; }                 ///< the older invocation is cancelled
  static constexpr ActionPolicy queue(std::size_t n) noexcept { return {Kind::queue, n}; }        ///< one runs, at most `n` wait for it
  static constexpr ActionPolicy reject() noexcept { return {Kind::reject, 1}; }                   ///< the newer invocation is refused: 409
  static constexpr ActionPolicy parallel(std::size_t n) noexcept { return {Kind::parallel, n}; }  ///< at most `n` run at the same time
};

}  // namespace v0
}  // namespace lrt
