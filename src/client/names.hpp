// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <lrt/base/thread_options.hpp>

#include "src/base/resolve.hpp"
#include "src/exchange/wire.hpp"

namespace lrt::client {

/// Resolves names within a time limit. The system's resolver cannot be interrupted: a thread that is still in it is left behind, ends when it
/// returns, and uses memory of its own only.
/// @par Threads  Any.
class NameResolver {
 public:
  explicit NameResolver(ThreadOptions threads, Resolve resolve = lrt::resolve);

  /// The addresses of a host of a URL. A name is resolved again after 30 s.
  /// @par Errors  io_error, timed_out; limit_exceeded: too many names are being resolved
  Result<std::vector<Address>> find(const std::string& host, exchange::WaitLimit limit);

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace lrt::client
