// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/engine/engine.hpp>
#include <lrt/security/audit_file.hpp>

#include "src/server/service.hpp"

namespace lrt {

class SharedEngine;

/// Responses that wait until their lines of the audit are saved. Called with the engine's lock, except as TurnWork says.
class AuditHold : public TurnWork {
 public:
  /// Tickets of the responses that the engine did not defer begin here; those of Postponed have the bit above.
  static constexpr std::uint64_t first_ticket = std::uint64_t{1} << 62;

  /// Keeps a response until its line is saved. False: it is to be sent now, and may have become another.
  /// @param line  its number; 0: it was dropped
  virtual bool keep(std::uint64_t line, engine::Reply& reply) = 0;
  /// Those that are due become 503.
  virtual void end_waits(TimePoint now) = 0;
  /// The client of a response does not wait for it.
  virtual void abandon(engine::Ticket ticket) noexcept = 0;
  /// The server stops: they become 503.
  virtual void end() noexcept = 0;

 protected:
  ~AuditHold() = default;
};

/// Where the lines of the audit go: a sink or a file.
///
/// @par Threads  write(): one at a time. run(): its own. The others: any
class AuditOutput {
 public:
  virtual ~AuditOutput() = default;
  /// @par Errors  invalid_option
  virtual Result<void> prepare() { return {}; }
  /// Saves lines until stop() has been called and all are saved, or cannot be.
  virtual void run() noexcept = 0;
  virtual void stop() noexcept = 0;
  /// @return  the number of the line; 0: it was dropped
  virtual std::uint64_t write(std::string line) noexcept = 0;
  /// Counts a line that could not be created.
  virtual void drop() noexcept = 0;
  virtual void count(ServerCounters& all) const = 0;
  /// nullptr: responses do not wait.
  virtual AuditHold* hold() noexcept { return nullptr; }
};

/// The server that an AuditFile serves.
struct security::AuditFile::Place {
  SharedEngine& server;
  std::unique_ptr<Output> output_to(AuditFile& file) const;
};
class LRT_LOCAL security::AuditFile::Output : public AuditOutput {};
inline std::unique_ptr<security::AuditFile::Output> security::AuditFile::Place::output_to(AuditFile& file) const { return file.make_output(*this); }

}  // namespace lrt
