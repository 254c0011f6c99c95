// SPDX-License-Identifier: Apache-2.0
#include "src/shacl/run.hpp"

#include <algorithm>

#include <lrt/rdf/vocab.hpp>

#include "src/shacl/messages.hpp"

namespace lrt::shacl {
inline namespace v0 {
namespace {
constexpr std::size_t few = 16;  // up to this size a set is searched linearly
}

Run::Run(const Shapes& shapes, const rdf::Graph& data, const ValidateOptions& options)
    : plan_(shapes.plan()), data_(data), options_(options), data_terms_(static_cast<Node>(data.term_count())) {
  bound_.assign(plan_->graph.term_count(), nothing);
  nodes_.reserve(64);
}

// ---- terms

Node Run::node_of(Constant constant) noexcept {
  const auto at = static_cast<std::uint32_t>(constant);
  Node& node = bound_[at];
  if (node == nothing) {
    const rdf::TermView view = plan_->graph.term(constant);
    const auto found = view.is_blank() ? std::nullopt : data_.find(view);
    node = found ? static_cast<Node>(*found) : data_terms_ + at;
  }
  return node;
}

rdf::TermView Run::term(Node node) const noexcept {
  if (node < data_terms_) return data_.term(rdf::TermId{node});
  if (node == outsider) return *outsider_;
  return plan_->graph.term(rdf::TermId{node - data_terms_});
}

const std::vector<std::pair<Node, Node>>& Run::hub(Hubs& hubs, Node node) {
  const auto [at, is_new] = hubs.of.try_emplace(node);
  if (is_new) {
    for (const rdf::Triple& t : triples_of(hubs, node))
      at->second.emplace_back(static_cast<Node>(t.predicate), static_cast<Node>(hubs.outgoing ? t.object : t.subject));
    const auto by_predicate = [](const auto& a, const auto& b) { return a.first < b.first; };
    std::stable_sort(at->second.begin(), at->second.end(), by_predicate);
    step(at->second.size());
  }
  return at->second;
}

const std::vector<Node>& Run::subclasses(Constant class_iri) {
  const auto [at, is_new] = subclasses_.try_emplace(static_cast<std::uint32_t>(class_iri));
  if (!is_new) return at->second;
  const Node top = node_of(class_iri), sub_class_of = node_of(plan_->sub_class_of);
  Set found(*this);
  found.insert(top);
  for (std::size_t i = found.begin(); i < found.end() && step(); ++i) {
    const std::size_t start = nodes_.size();
    each_subject(sub_class_of, nodes_[i], [&](Node sub) { return nodes_.push_back(sub), true; });
    found.take_in(start);
  }
  if (found.end() - found.begin() > 1) {
    at->second.assign(nodes_.begin() + static_cast<std::ptrdiff_t>(found.begin()), nodes_.end());
    std::sort(at->second.begin(), at->second.end());
  }
  return at->second;
}

bool Run::is_instance(Node node, Constant class_iri) {
  const Node wanted = node_of(class_iri);
  const Node type = node_of(plan_->type);
  if (has(node, type, wanted)) return true;
  if (!in_data(node_of(plan_->sub_class_of)) || !in_data(wanted)) return false;
  const std::vector<Node>& classes = subclasses(class_iri);
  if (classes.empty()) return false;
  bool found = false;
  each_object(node, type, [&](Node found_class) {
    found = std::binary_search(classes.begin(), classes.end(), found_class);
    return !found && step();
  });
  return found;
}

// ---- sets

bool Run::Set::stamped(Node node) const noexcept {
  const Stamps& stamps = run_.stamps_[level_];
  return stamps.of[node == outsider ? stamps.of.size() - 1 : node] == epoch_;
}

void Run::Set::stamp(Node node) {
  Stamps& stamps = run_.stamps_[level_];
  stamps.of[node == outsider ? stamps.of.size() - 1 : node] = epoch_;
}

bool Run::Set::contains(Node node) const noexcept {
  if (epoch_ != 0) return stamped(node);
  return std::find(run_.nodes_.begin() + static_cast<std::ptrdiff_t>(begin_), run_.nodes_.end(), node) != run_.nodes_.end();
}

bool Run::Set::insert(Node node) {
  if (contains(node)) return false;
  run_.nodes_.push_back(node);
  if (epoch_ != 0) {
    stamp(node);
  } else if (run_.nodes_.size() - begin_ > few) {
    while (run_.stamps_.size() <= level_) run_.stamps_.emplace_back();
    Stamps& stamps = run_.stamps_[level_];
    if (stamps.of.empty()) stamps.of.assign(run_.data_terms_ + run_.bound_.size() + 1, 0);
    epoch_ = ++stamps.epoch;
    for (std::size_t i = begin_; i < run_.nodes_.size(); ++i) stamp(run_.nodes_[i]);
  }
  return true;
}

void Run::Set::take_in(std::size_t start) {
  const std::size_t top = run_.nodes_.size();
  // The new nodes are read in place while the set grows over them. Writing never overtakes reading.
  std::size_t read = start;
  std::vector<Node>& nodes = run_.nodes_;
  if (epoch_ == 0) {
    std::size_t write = start;
    while (read < top && write - begin_ <= few) {
      const Node node = nodes[read++];
      if (std::find(nodes.begin() + static_cast<std::ptrdiff_t>(begin_), nodes.begin() + static_cast<std::ptrdiff_t>(write), node) ==
          nodes.begin() + static_cast<std::ptrdiff_t>(write))
        nodes[write++] = node;
    }
    if (read == top) {
      nodes.resize(write);
      return;
    }
    while (run_.stamps_.size() <= level_) run_.stamps_.emplace_back();
    Stamps& stamps = run_.stamps_[level_];
    if (stamps.of.empty()) stamps.of.assign(run_.data_terms_ + run_.bound_.size() + 1, 0);
    epoch_ = ++stamps.epoch;
    for (std::size_t i = begin_; i < write; ++i) stamp(nodes[i]);
    start = write;
  }
  std::size_t write = start;
  while (read < top) {
    const Node node = nodes[read++];
    if (stamped(node)) continue;
    stamp(node);
    nodes[write++] = node;
  }
  nodes.resize(write);
}

// ---- paths

/// SHACL 2.3.1. An inverse path is followed in reverse direction, so the inverse of a sequence is the reversed sequence of inverses.
void Run::walk(PathIndex index, bool backward, Node from) {
  if (!step()) return;
  const Path& path = plan_->paths[index];
  const std::size_t before = nodes_.size();
  switch (path.kind) {
    case Path::Kind::predicate: {
      const Node predicate = node_of(path.predicate);
      const auto take = [&](Node node) {
        nodes_.push_back(node);
        return ++path_nodes_ <= options_.max_path_nodes;
      };
      if (backward) each_subject(predicate, from, take);
      else each_object(from, predicate, take);
      step(nodes_.size() - before);
      if (path_nodes_ > options_.max_path_nodes) stop("max_path_nodes", options_.max_path_nodes);
      return;
    }
    case Path::Kind::inverse: return walk(path.parts.front(), !backward, from);
    case Path::Kind::sequence: {
      const std::size_t n = path.parts.size();
      walk(path.parts[backward ? n - 1 : 0], backward, from);
      for (std::size_t part = 1; part < n && !stopped_; ++part) {
        const std::size_t end = nodes_.size();
        if (end == before) return;
        if (end - before == 1) {  // the usual case: duplicates are impossible
          const Node only = nodes_[before];
          nodes_.pop_back();
          walk(path.parts[backward ? n - 1 - part : part], backward, only);
          continue;
        }
        {
          Set found(*this);
          for (std::size_t i = before; i < end && !stopped_; ++i) {
            const std::size_t start = nodes_.size();
            walk(path.parts[backward ? n - 1 - part : part], backward, nodes_[i]);
            found.take_in(start);
          }
          found.release();
        }
        nodes_.erase(nodes_.begin() + static_cast<std::ptrdiff_t>(before), nodes_.begin() + static_cast<std::ptrdiff_t>(end));
      }
      return;
    }
    case Path::Kind::alternative: {
      Set found(*this);
      for (const PathIndex part : path.parts) {
        const std::size_t start = nodes_.size();
        walk(part, backward, from);
        found.take_in(start);
        if (stopped_) break;
      }
      found.release();
      return;
    }
    case Path::Kind::zero_or_one:
    case Path::Kind::zero_or_more:
    case Path::Kind::one_or_more: {
      Set found(*this);
      if (path.kind == Path::Kind::one_or_more) {
        const std::size_t start = nodes_.size();
        walk(path.parts.front(), backward, from);
        found.take_in(start);
      } else {
        found.insert(from);
      }
      for (std::size_t i = found.begin(); i < found.end() && !stopped_; ++i) {
        const std::size_t start = nodes_.size();
        walk(path.parts.front(), backward, nodes_[i]);
        found.take_in(start);
        if (path.kind == Path::Kind::zero_or_one) break;
      }
      found.release();
      return;
    }
  }
}

// ---- validation

void Run::validate(ShapeIndex index, Node focus) {
  const Shape& shape = plan_->shapes[index];
  if (shape.deactivated || !step()) return;
  if (shape.recursive) {
    const std::pair<ShapeIndex, Node> here(index, focus);
    if (std::find(active_.begin(), active_.end(), here) != active_.end()) return;  // conforms, see Shapes
    active_.push_back(here);
  }
  if (++depth_ > options_.max_depth) {
    stop("max_depth", options_.max_depth);
  } else {
    const std::size_t begin = nodes_.size();
    if (shape.path == nothing) {
      nodes_.push_back(focus);
    } else {
      path_nodes_ = 0;
      walk(shape.path, false, focus);
    }
    const Scene scene{shape, focus, begin, nodes_.size()};
    for (const auto& constraint : shape.constraints) {
      if (done() || !step(1 + scene.size() / 4)) break;
      constraint->check(*this, scene);
    }
    nodes_.resize(begin);
  }
  --depth_;
  if (shape.recursive) active_.pop_back();
}

bool Run::conforms(Node node, ShapeIndex shape) {
  const bool was_quiet = std::exchange(quiet_, true), had_failed = std::exchange(failed_, false);
  validate(shape, node);
  const bool result = !failed_;
  quiet_ = was_quiet;
  failed_ = had_failed;
  return result;
}

void Run::collect_targets(const Shape& shape, Set& out) {
  const auto with = [&](auto&& append) {
    const std::size_t start = nodes_.size();
    append();
    out.take_in(start);
    step(nodes_.size() - start);
  };
  with([&] {
    for (const Constant c : shape.target_nodes) nodes_.push_back(node_of(c));
  });
  const auto push = [&](Node node) { return nodes_.push_back(node), true; };
  for (const Constant c : shape.target_classes) {
    const Node type = node_of(plan_->type), wanted = node_of(c);
    if (!in_data(type) || !in_data(wanted)) continue;
    const auto instances = [&](Node of) {
      with([&] {
        for (const rdf::Triple& t : data_.match(std::nullopt, rdf::TermId{type}, rdf::TermId{of})) push(static_cast<Node>(t.subject));
      });
    };
    instances(wanted);
    if (!in_data(node_of(plan_->sub_class_of))) continue;
    for (const Node sub : subclasses(c)) instances(sub);
  }
  for (const Constant c : shape.target_subjects_of) {
    const Node predicate = node_of(c);
    if (!in_data(predicate)) continue;
    with([&] {
      for (const rdf::Triple& t : data_.match(std::nullopt, rdf::TermId{predicate}, std::nullopt)) push(static_cast<Node>(t.subject));
    });
  }
  for (const Constant c : shape.target_objects_of) {
    const Node predicate = node_of(c);
    if (!in_data(predicate)) continue;
    with([&] {
      for (const rdf::Triple& t : data_.match(std::nullopt, rdf::TermId{predicate}, std::nullopt)) push(static_cast<Node>(t.object));
    });
  }
}

Result<Report> Run::all_targets() {
  for (ShapeIndex i = 0; i < plan_->shapes.size() && !done(); ++i) {
    const Shape& shape = plan_->shapes[i];
    if (shape.deactivated || !shape.has_target()) continue;
    Set focus_nodes(*this);
    collect_targets(shape, focus_nodes);
    const std::size_t end = focus_nodes.end();
    for (std::size_t at = focus_nodes.begin(); at < end && !done(); ++at) validate(i, nodes_[at]);
  }
  return finish();
}

Result<Report> Run::one(const rdf::TermView& focus, ShapeIndex shape) {
  Node node = outsider;
  if (const auto id = data_.find(focus)) {
    node = static_cast<Node>(*id);
  } else if (const auto known = focus.is_blank() ? std::nullopt : plan_->graph.find(focus)) {
    node = node_of(*known);
  } else {
    outsider_ = focus;
  }
  validate(shape, node);
  return finish();
}

ValidationResult* Run::add_result(const Scene& scene, const Constraint& constraint, std::optional<Node> value) {
  if (result_count_ >= options_.max_results) {
    full_ = true;
    return nullptr;
  }
  ++result_count_;
  const rdf::Graph& shapes = plan_->graph;
  ValidationResult result;
  result.focus = term(scene.focus);
  if (scene.shape.path != nothing) result.path = PropertyPath(plan_, scene.shape.path);
  if (value) result.value = rdf::Term(term(*value));
  result.source_shape = shapes.term(scene.shape.id);
  result.component = constraint.component;
  result.severity = shapes.term(scene.shape.severity);
  for (const rdf::TermId m : scene.shape.messages) result.messages.emplace_back(shapes.term(m));
  results_->push_back(std::move(result));
  return &results_->back();
}

void Run::add_details(std::size_t at, Node value, ShapeIndex inner) {
  std::vector<ValidationResult> found;
  std::vector<ValidationResult>* const outer = std::exchange(results_, &found);
  validate(inner, value);
  results_ = outer;
  (*results_)[at].details = std::move(found);
}

std::string Run::reason(Node value, ShapeIndex shape) {
  std::vector<ValidationResult> found;
  std::vector<ValidationResult>* const outer = std::exchange(results_, &found);
  const std::size_t count = std::exchange(result_count_, 0);
  const bool was_full = std::exchange(full_, false);
  validate(shape, value);
  results_ = outer;
  result_count_ = count;
  full_ = was_full;
  return found.empty() || found.front().messages.empty() ? std::string() : std::string(found.front().messages.front().view().text);
}

void Run::stop(const char* limit, std::size_t value) {
  if (stopped_) return;
  stopped_ = Error{Errc::limit_exceeded, std::string("the validation was not complete within ") + limit + " = " + std::to_string(value)};
}

bool Run::look() {
  if (steps_ > options_.max_steps) {
    stop("max_steps", options_.max_steps);
    return false;
  }
  turns_->rest();
  next_look_ = next_look();
  return !stopped_;
}

Result<Report> Run::finish() {
  if (stopped_) return unexpected(*std::move(stopped_));
  report_.complete_ = !full_;
  return std::move(report_);
}

// ---- the public functions

Result<Report> validate(const Shapes& shapes, const rdf::Graph& data, const ValidateOptions& options) {
  return Run(shapes, data, options).all_targets();
}

Result<Report> validate(const Shapes& shapes, const rdf::Graph& data, const rdf::TermView& focus, const rdf::TermView& shape,
                        const ValidateOptions& options) {
  const Plan& plan = *shapes.plan();
  const auto id = plan.graph.find(shape);
  const ShapeIndex index = id ? plan.find(*id) : nothing;
  if (index == nothing) return unexpected(Errc::expected_value, "expected a shape, found " + shown(shape));
  return Run(shapes, data, options).one(focus, index);
}

}  // namespace v0
}  // namespace lrt::shacl
