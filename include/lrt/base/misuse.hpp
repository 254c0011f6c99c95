// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <lrt/base/abi.hpp>

/// Whether the headers check how the program uses lrt: 1 or 0. Default: 1 unless NDEBUG is defined. The library and the
/// layout of all types are the same with and without checks, so that programs may link files of both kinds.
#ifndef LRT_CHECKS
#ifdef NDEBUG
#define LRT_CHECKS 0
#else
#define LRT_CHECKS 1
#endif
#endif

namespace lrt {
inline namespace v0 {

/// Gets the sentence about a mistake of the program: what, where, and what to do instead.
using MisuseHandler = void (*)(const char* message);

/// Sets what happens when a check of the headers fails (LRT_CHECKS). Default, also by nullptr: the sentence is written
/// to the standard error stream, and std::abort() ends the process. If the handler returns, the call that was wrong has no
/// effect; only `*`, `->` and error() of a Result, which have nothing to return, then call std::abort(). The handler must
/// not throw.
/// @return  the handler before
/// @par Threads  Any; the handler is called on the thread of the mistake, also at the same time as on another one.
LRT_API MisuseHandler set_misuse_handler(MisuseHandler handler) noexcept;

}  // namespace v0
}  // namespace lrt

namespace lrt::detail {
inline namespace v0 {

/// Whether this file is compiled with checks.
inline constexpr bool checks = LRT_CHECKS != 0;
/// Reports a mistake to the handler.
LRT_API void misuse(const char* message) noexcept;
/// The same of a call that cannot return.
[[noreturn]] LRT_API void fatal_misuse(const char* message) noexcept;

}  // namespace v0
}  // namespace lrt::detail

/// A precondition without which there is nothing to return.
#define LRT_REQUIRE(condition, message) (LRT_CHECKS && !(condition) ? ::lrt::detail::fatal_misuse(message) : static_cast<void>(0))
