// SPDX-License-Identifier: Apache-2.0
// A shared object with a thread of lrt in it, which a host closes.
#include <atomic>
#include <thread>

#include <lrt/base/abi.hpp>

#include "src/base/thread.hpp"

extern "C" LRT_API bool start(std::atomic<int>* state);

/// Starts a thread that sets 1, waits for 2 and sets 3.
extern "C" bool start(std::atomic<int>* state) {
  auto thread = lrt::start_thread("lrt-closed", {}, [state] {
    *state = 1;
    while (*state != 2) std::this_thread::yield();
    *state = 3;
  });
  if (thread) thread->detach();
  return thread.has_value();
}
