// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>

#include <lrt/base/abi.hpp>

namespace lrt {

/// Lets long work on several threads take turns. The work calls rest() every few microseconds, where it holds nothing that others wait for.
///
/// Work that does not know on which thread it runs uses the static functions, which do nothing where no turns are taken.
class LRT_INTERNAL_API Turns {
 public:
  using Duration = std::chrono::steady_clock::duration;
  /// Of a loop over triples or rows: a rest after so many.
  static constexpr std::size_t units_between_rests = 64;

  Turns() noexcept = default;
  Turns(const Turns&) = delete;
  Turns& operator=(const Turns&) = delete;
  virtual ~Turns() = default;

  /// Returns at once, or when it is this thread's turn again.
  /// @return  how long it was not
  virtual Duration rest() noexcept = 0;
  /// The work waits for other work: meanwhile others have its place.
  virtual void leave() noexcept = 0;
  /// It waits no longer. Returns at once.
  virtual void come_back() noexcept = 0;

  /// Of this thread; nullptr: its work takes no turns.
  static Turns* current() noexcept;
  /// @param turns  nullptr: none
  /// @return  the former ones
  static Turns* set_current(Turns* turns) noexcept;
  static void rest_now() noexcept {
    if (Turns* const turns = current()) turns->rest();
  }

  /// While one exists, the work of this thread does not rest: it holds something that others wait for.
  class Held {
   public:
    Held() noexcept : turns_(set_current(nullptr)) {}
    ~Held() { set_current(turns_); }
    Held(const Held&) = delete;
    Held& operator=(const Held&) = delete;

   private:
    Turns* const turns_;
  };
  /// While one exists, the work of this thread waits for other work.
  class Waiting {
   public:
    Waiting() noexcept : turns_(current()) {
      if (turns_) turns_->leave();
    }
    ~Waiting() {
      if (turns_) turns_->come_back();
    }
    Waiting(const Waiting&) = delete;
    Waiting& operator=(const Waiting&) = delete;

   private:
    Turns* const turns_;
  };
};

}  // namespace lrt
