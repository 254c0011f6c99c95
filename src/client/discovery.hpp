// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include <lrt/client/things.hpp>

namespace lrt::client {
inline namespace v0 {

/// Finds the Things from one URL: breadth first, by links and triples, each resource once. Only Things, and resources whose kind the linking triples do
/// not show, are read. Properties, Actions and shapes are read when they are used. Predicates are not a closed set (R1.6): an unknown one may link to
/// a Thing.
class Discovery {
 public:
  Discovery(std::shared_ptr<Session> session, std::string url);
  ~Discovery();
  /// @par Errors  of the exchange with the first URL; limit_exceeded; cancelled
  Result<Robot> run();

 private:
  struct Found;
  std::vector<std::string> candidates(const Found& found) const;
  Thing thing_of(const Found& found) const;
  void assume_kinds();
  Result<Robot> assemble();
  void report(std::string problem);

  // Only Properties can be inline.
  static Property make(const std::vector<Property>&) { return {}; }
  static Action make(const std::vector<Action>&) { return {}; }
  static void set_inline(Property& property, const std::string& predicate) { property.predicate_ = predicate; }
  static void set_inline(Action&, const std::string&) {}

  std::shared_ptr<Session> session_;
  const std::string given_;  // by the program
  std::string start_;
  std::map<std::string, Found> found_;  // by URL
  std::vector<std::string> order_;      // URLs in the order in which they were read
  std::vector<std::string> problems_;
  std::size_t requests_ = 0;
};

}  // namespace v0
}  // namespace lrt::client
