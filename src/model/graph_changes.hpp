// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/rdf/graph.hpp>

namespace lrt::model {
inline namespace v0 {

class GraphEdit;

/// Changes of a graph as text, in their order, a line each: `+ SUBJECT PREDICATE OBJECT`, the same with `-`, and `clear`. Terms are in N-Triples. Labels
/// of blank nodes are those of the graph, so that a later change may name a blank node of an earlier one.
class LRT_INTERNAL_API GraphChanges {
 public:
  void add(const rdf::TermView& subject, const rdf::TermView& predicate, const rdf::TermView& object) { line('+', subject, predicate, object); }
  void remove(const rdf::TermView& subject, const rdf::TermView& predicate, const rdf::TermView& object) { line('-', subject, predicate, object); }
  /// Changes before it are dropped.
  void clear() { text_ = "clear\n"; }
  void drop() noexcept { text_.clear(); }
  const std::string& text() const noexcept { return text_; }
  std::string take() { return std::move(text_); }

 private:
  void line(char sign, const rdf::TermView& subject, const rdf::TermView& predicate, const rdf::TermView& object);
  std::string text_;
};

/// Makes the changes. A triple that is there is not added, one that is missing is not removed.
/// @par Errors  expected_rdf: at the byte `offset` of the text; as those of GraphUpdate::add()
LRT_INTERNAL_API Result<void> replay_changes(std::string_view text, GraphEdit& edit);

}  // namespace v0
}  // namespace lrt::model
