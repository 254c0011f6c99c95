// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <lrt/base/abi.hpp>
#include <lrt/base/language.hpp>

namespace lrt {
inline namespace v0 {

/// The source of the ids of invocations, members of collections and subscriptions. An id is the last path segment of
/// their IRIs.
///
/// @par Threads  A server calls next() on any of its threads, one call at a time. Servers that share a source call it
///               concurrently.
/// @par Time     Requests wait for next().
class LRT_API IdSource {
 public:
  virtual ~IdSource() = default;
  /// A new id of unreserved URI characters. A source never returns the same id twice.
  virtual std::string next() = 0;
};

/// Random UUIDs (RFC 9562 version 4) from the system's entropy. They are unpredictable, and unique across restarts.
///
/// @par Threads  Any, concurrently: it has no state.
/// @par Time     One system call. Allocates.
class LRT_API RandomIds final : public IdSource {
 public:
  std::string next() override;
};

}  // namespace v0
}  // namespace lrt
