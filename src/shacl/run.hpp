// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include <lrt/shacl/validator.hpp>

#include "src/base/turns.hpp"
#include "src/shacl/plan.hpp"
#include "src/shacl/regex.hpp"

namespace lrt::shacl {
inline namespace v0 {

/// The number of a term. Terms of the data graph keep their numbers there. Larger numbers are terms of the shapes graph that the data graph
/// does not have. `outsider` is a focus node that neither graph has. Equal numbers are equal terms.
using Node = std::uint32_t;
inline constexpr Node outsider = 0xFFFFFFFE;

/// One focus node and one shape. The value nodes are run.node(begin) .. run.node(end - 1), without duplicates.
struct Scene {
  const Shape& shape;
  Node focus;
  std::size_t begin, end;
  std::size_t size() const noexcept { return end - begin; }
};

/// One validation: its scratch memory, limits and results. Constraints access the data through it.
class Run {
 public:
  Run(const Shapes& shapes, const rdf::Graph& data, const ValidateOptions& options);

  Result<Report> all_targets();
  Result<Report> one(const rdf::TermView& focus, ShapeIndex shape);

  // Used by constraints.
  Node node(std::size_t at) const noexcept { return nodes_[at]; }
  rdf::TermView term(Node node) const noexcept;
  /// The node of a term of the shapes graph. A blank node of the shapes graph is never a node of the data.
  Node node_of(Constant constant) noexcept;
  bool in_data(Node node) const noexcept { return node < data_terms_; }
  const rdf::Graph& data() const noexcept { return data_; }
  const Plan& plan() const noexcept { return *plan_; }
  bool has(Node subject, Node predicate, Node object) const noexcept {
    return in_data(subject) && in_data(predicate) && in_data(object) &&
           data_.contains(rdf::TermId{subject}, rdf::TermId{predicate}, rdf::TermId{object});
  }
  /// Calls `take(object)` for the objects of a subject and predicate until it returns false.
  template <class Take>
  void each_object(Node subject, Node predicate, Take&& take) {
    if (in_data(subject) && in_data(predicate)) each(outgoing_, subject, predicate, take);
  }
  /// Visits the subjects of triples with a predicate and an object.
  template <class Take>
  void each_subject(Node predicate, Node object, Take&& take) {
    if (in_data(object) && in_data(predicate)) each(incoming_, object, predicate, take);
  }

  /// SHACL 1.1: an instance of the class or of one of its subclasses in the data.
  bool is_instance(Node node, Constant class_iri);
  bool conforms(Node node, ShapeIndex shape);
  /// Validates a value node against a shape and adds its results to this validation: sh:property.
  void descend(Node node, ShapeIndex shape) { validate(shape, node); }

  /// A set of nodes on top of the stack of nodes, with look-up. The destructor removes it from the stack.
  class Set {
   public:
    explicit Set(Run& run) noexcept : run_(run), begin_(run.nodes_.size()), level_(run.level_++) {}
    ~Set() {
      run_.nodes_.resize(begin_);
      --run_.level_;
    }
    Set(const Set&) = delete;
    Set& operator=(const Set&) = delete;
    std::size_t begin() const noexcept { return begin_; }
    std::size_t end() const noexcept { return run_.nodes_.size(); }
    bool contains(Node node) const noexcept;
    /// False: the set had it already. @pre this set is on top of the stack
    bool insert(Node node);
    /// Adds the nodes of the stack from `start` on. @pre these are the top of the stack
    void take_in(std::size_t start);
    /// Leaves the members on the stack, for the owner of the nodes below.
    void release() noexcept { begin_ = run_.nodes_.size(); }

   private:
    bool stamped(Node node) const noexcept;
    void stamp(Node node);
    Run& run_;
    std::size_t begin_;
    std::size_t level_;
    std::uint32_t epoch_ = 0;  // 0: few members, searched linearly
  };

  /// Reports a violation. `make_message()` makes the message; it is called only if the message is needed.
  template <class MakeMessage>
  void violation(const Scene& scene, const Constraint& constraint, std::optional<Node> value, MakeMessage&& make_message) {
    if (quiet_) {
      failed_ = true;
    } else if (ValidationResult* result = add_result(scene, constraint, value)) {
      if (result->messages.empty()) result->messages.emplace_back(rdf::literal(make_message()));
    }
  }
  /// Reports a violation. The results of the shape `inner` for the value become its details (sh:detail).
  template <class MakeMessage>
  void violation_within(const Scene& scene, const Constraint& constraint, Node value, ShapeIndex inner, MakeMessage&& make_message) {
    const std::size_t before = results_ ? results_->size() : 0;
    violation(scene, constraint, value, std::forward<MakeMessage>(make_message));
    if (!quiet_ && options_.details && results_->size() > before) add_details(before, value, inner);
  }
  /// Reports a violation by a predicate of the data (sh:closed).
  template <class MakeMessage>
  void violation_at(const Scene& scene, const Constraint& constraint, Node predicate, Node value, MakeMessage&& make_message) {
    if (quiet_) {
      failed_ = true;
    } else if (ValidationResult* result = add_result(scene, constraint, value)) {
      result->path = PropertyPath(term(predicate));
      if (result->messages.empty()) result->messages.emplace_back(rdf::literal(make_message()));
    }
  }

  /// The first message about a value that does not conform to a shape. Empty: it conforms, or a limit was reached.
  std::string reason(Node value, ShapeIndex shape);

  /// The validation can end: a limit was reached, or a validation without a report has failed.
  bool done() const noexcept { return stopped_ || full_ || (quiet_ && failed_); }
  /// Counts work. False: the budget is used up.
  bool step(std::size_t n = 1) {
    steps_ += n;
    return steps_ <= next_look_ ? !stopped_ : look();
  }

  /// Appends the nodes that the path reaches from `from`, without duplicates.
  void walk(PathIndex path, bool backward, Node from);

  Regex::Scratch regex_scratch;
  std::vector<std::string_view> texts;  ///< scratch of one check

 private:
  friend class Set;

  /// The triples of nodes with many triples, by predicate, so that a path through such a node does not scan all of them.
  struct Hubs {
    bool outgoing;
    std::unordered_map<Node, std::vector<std::pair<Node, Node>>> of;  ///< predicate and other end, sorted by predicate
  };
  static constexpr std::size_t many_triples = 64;
  static constexpr std::size_t steps_between_rests = 128;

  rdf::Graph::Matches triples_of(const Hubs& hubs, Node node) const noexcept {
    const std::optional<rdf::TermId> id = rdf::TermId{node};
    return hubs.outgoing ? data_.match(id, std::nullopt, std::nullopt) : data_.match(std::nullopt, std::nullopt, id);
  }
  const std::vector<std::pair<Node, Node>>& hub(Hubs& hubs, Node node);

  template <class Take>
  void each(Hubs& hubs, Node node, Node predicate, Take&& take) {
    if (hubs.of.empty() || hubs.of.find(node) == hubs.of.end()) {
      std::size_t seen = 0;
      const rdf::Graph::Matches all = triples_of(hubs, node);
      for (auto t = all.begin(); t != all.end(); ++t)
        if (++seen > many_triples) break;
      if (seen <= many_triples) {
        for (const rdf::Triple& t : all)
          if (static_cast<Node>(t.predicate) == predicate && !take(static_cast<Node>(hubs.outgoing ? t.object : t.subject))) return;
        return;
      }
    }
    const std::vector<std::pair<Node, Node>>& sorted = hub(hubs, node);
    const auto before = [](const std::pair<Node, Node>& entry, Node p) { return entry.first < p; };
    for (auto at = std::lower_bound(sorted.begin(), sorted.end(), predicate, before); at != sorted.end() && at->first == predicate; ++at)
      if (!take(at->second)) return;
  }

  void validate(ShapeIndex shape, Node focus);
  void collect_targets(const Shape& shape, Set& out);
  /// The subclasses of a class including itself, in order of their numbers; empty: it has no other subclass.
  const std::vector<Node>& subclasses(Constant class_iri);
  ValidationResult* add_result(const Scene& scene, const Constraint& constraint, std::optional<Node> value);
  void add_details(std::size_t at, Node value, ShapeIndex inner);
  void stop(const char* limit, std::size_t value);
  bool look();
  /// Up to the limit, or until others have their turn.
  std::size_t next_look() const noexcept { return turns_ ? std::min(options_.max_steps, steps_ + steps_between_rests) : options_.max_steps; }
  Result<Report> finish();

  std::shared_ptr<const Plan> plan_;
  const rdf::Graph& data_;
  ValidateOptions options_;
  Node data_terms_;
  std::vector<Node> bound_;  // by TermId of the shapes graph; nothing: not searched yet
  std::optional<rdf::TermView> outsider_;
  Hubs outgoing_{true, {}}, incoming_{false, {}};
  std::vector<Node> nodes_;  // stack: value nodes of the active scenes and sets
  struct Stamps {
    std::vector<std::uint32_t> of;  // by Node: epoch of the set it was last added to
    std::uint32_t epoch = 0;
  };
  std::vector<Stamps> stamps_;  // one for each level of sets within sets
  std::size_t level_ = 0;
  std::vector<std::pair<ShapeIndex, Node>> active_;  // of recursive shapes
  std::unordered_map<std::uint32_t, std::vector<Node>> subclasses_;
  Turns* const turns_ = Turns::current();
  std::size_t depth_ = 0, steps_ = 0, path_nodes_ = 0;
  std::size_t next_look_ = next_look();
  bool quiet_ = false, failed_ = false;
  bool full_ = false;  // max_results was reached
  std::optional<Error> stopped_;
  Report report_;
  std::vector<ValidationResult>* results_ = &report_.results_;
  std::size_t result_count_ = 0;
};

}  // namespace v0
}  // namespace lrt::shacl
