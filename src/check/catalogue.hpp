// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "src/check/probe.hpp"

namespace lrt::check {

/// A table in constant storage.
template <class T>
struct Table {
  const T *first, *last;
  const T* begin() const noexcept { return first; }
  const T* end() const noexcept { return last; }
};

/// The requirement of one check, and its source. The part of the id before its dot tells where the check is:
///
///     http status.blame tls                 http_checks.cpp             bytes, connections, lengths, times
///     uri root link methods options accept  resource_checks.cpp         what a resource announces, and what it does
///     alternates prefer container           resource_checks.cpp
///     etag head modified date range         caching_checks.cpp          tags, dates, parts, HEAD
///     write invoke post                     write_checks.cpp            requests that change something
///     ws callback subscription              subscription_checks.cpp     WebSockets and callbacks, by notifications.cpp
///     rdf negotiate subscriptions metadata  linked_data_checks.cpp      representations in RDF
///     property action blueprint             linked_data_checks.cpp
///     merge, what needs all documents       merging_checks.cpp
///     expiry heartbeat stop                 extension_checks.cpp        what is lrt's own, where a server announces it
struct Check {
  std::string_view id, requirements;  ///< requirements separated by spaces, the main one first
  Level level;
  std::string_view title, specification, references;
};
/// The checks in the order of the report.
Table<Check> catalogue() noexcept;

struct PaperRequirement {
  std::string_view id;
  Level level;
  std::string_view title;
  Outcome without;           ///< outcome if no finding has one
  std::string_view reason;   ///< of `without`
  std::string_view needs{};  ///< checks, separated by spaces, without whose pass the requirement does not pass
};
Table<PaperRequirement> paper_requirements() noexcept;

/// Collects verdicts of single resources to one finding for each check: a failure outweighs the rest, and a pass what could not be tested.
class Verdicts {
 public:
  void pass(std::string_view id, const Exchange* exchange = nullptr, const std::string& detail = {});
  /// A response that did not come in time shows that a server is slow, not that it is wrong: not testable then.
  void fail(std::string_view id, const std::string& detail, const Exchange* exchange = nullptr, Certainty certainty = Certainty::certain);
  /// Fails because there is no response. `is_fast`: the server is so fast that its silence is a fault; otherwise not testable.
  void fail_silent(std::string_view id, const std::string& detail, const Exchange& exchange, bool is_fast);
  /// Fails with several results, of which these are the first. @pre 0 < count <= tried
  void fail_all(std::string_view id, const std::vector<std::string>& results, std::size_t count, std::size_t tried, const Exchange* exchange);
  /// `exchange` is evidence of the reason.
  void not_testable(std::string_view id, const std::string& reason, const Exchange* exchange = nullptr);
  void not_applicable(std::string_view id, const std::string& reason);
  /// The outcome of a check that has no verdict yet.
  void otherwise(std::string_view id, Outcome outcome, const std::string& reason);
  bool failed(std::string_view id) const;

  /// All findings in the order of the catalogue. A check without a verdict is not testable, for `reason`.
  std::vector<Finding> findings(const std::string& reason) const;

 private:
  Finding& finding(std::string_view id);
  void add_failure(std::string_view id, const std::string& detail, const Exchange* exchange, Certainty certainty);
  std::map<std::string, Finding, std::less<>> findings_;
};

/// The requirements of the paper, with the worst outcome of their findings.
std::vector<Requirement> summarise(const std::vector<Finding>& findings);

}  // namespace lrt::check
