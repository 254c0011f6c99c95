// SPDX-License-Identifier: Apache-2.0
#include "src/security/policy.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include <lrt/base/iri.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/canonical_path.hpp"
#include "src/base/read_file.hpp"

namespace lrt::security {
inline namespace v0 {
namespace {

constexpr std::size_t max_policy_bytes = 1024 * 1024;
/// The base of relative IRIs in a policy.
constexpr std::string_view file_iri = "http://lrt.invalid/";

/// A path from the root, as the registry has it: without a slash at the end.
Result<std::string> path_of(std::string_view given) {
  if (given.empty() || given.front() != '/')
    return unexpected(Errc::invalid_option, "expected a path such as /arm, found \"" + std::string(given) + "\"");
  if (given.size() > 1 && given.back() == '/') given.remove_suffix(1);
  Result<std::string> path = canonical_path(given);
  if (!path) return unexpected(Errc::invalid_option, "\"" + std::string(given) + "\": " + path.error().message);
  return path;
}

bool concerns(const Who& who, const Principal* principal) noexcept {
  switch (who.kind) {
    case Who::Kind::anyone: return true;
    case Who::Kind::authenticated: return principal != nullptr;
    case Who::Kind::role: return principal && std::find(principal->roles.begin(), principal->roles.end(), who.name) != principal->roles.end();
    case Who::Kind::principal: return principal && principal->name == who.name;
  }
  return false;
}

/// The path above; empty: there is none.
std::string_view parent_of(std::string_view path) noexcept {
  if (path.size() <= 1) return {};
  const std::size_t slash = path.rfind('/');
  return slash == 0 ? path.substr(0, 1) : path.substr(0, slash);
}

/// Reads one acl:Authorization after the other.
class AuthorizationReader {
 public:
  explicit AuthorizationReader(const rdf::Graph& graph) : graph_(graph) {}

  Result<std::vector<Rule>> read() {
    const auto type = graph_.find(vocab::rdf_::type), authorization = graph_.find(vocab::acl::Authorization);
    if (type && authorization)
      for (const rdf::Triple& t : graph_.match(std::nullopt, *type, *authorization))
        if (Result<void> result = read(t.subject); !result) return Unexpected{std::move(result).error()};
    if (rules_.empty()) return unexpected(Errc::invalid_option, "expected at least one acl:Authorization, found none");
    return std::move(rules_);
  }

 private:
  Result<void> read(rdf::TermId node) {
    const rdf::TermView name = graph_.term(node);
    const std::string here = "the authorization " + (name.is_iri() ? "<" + relative(name.text) + ">" : std::string("without an IRI"));
    std::vector<std::pair<std::string, Scope>> targets;
    std::vector<Who> agents;
    Rights rights;
    for (const rdf::Triple& t : graph_.match(node, std::nullopt, std::nullopt)) {
      const std::string_view predicate = graph_.term(t.predicate).text;
      if (predicate.substr(0, acl.size()) != acl) continue;  // rdf:type, labels
      const Result<void> taken = take(predicate, graph_.term(t.object), targets, agents, rights);
      if (!taken) return unexpected(Errc::invalid_option, here + ": " + taken.error().message);
    }
    if (targets.empty()) return unexpected(Errc::invalid_option, here + ": expected acl:accessTo or acl:default, found neither");
    if (agents.empty()) return unexpected(Errc::invalid_option, here + ": expected acl:agent, acl:agentGroup or acl:agentClass, found none");
    if (rights.empty()) return unexpected(Errc::invalid_option, here + ": expected acl:mode, found none");
    for (const auto& [path, scope] : targets)
      for (const Who& who : agents) rules_.push_back({path, scope, who, rights});
    return {};
  }

  static Result<void> take(std::string_view predicate, const rdf::TermView& object, std::vector<std::pair<std::string, Scope>>& targets,
                           std::vector<Who>& agents, Rights& rights) {
    const std::string local(predicate.substr(acl.size()));
    if (!object.is_iri()) return unexpected(Errc::invalid_option, "acl:" + local + ": expected an IRI");
    const Iri iri{object.text};
    if (predicate == vocab::acl::accessTo.text || predicate == vocab::acl::default_.text) {
      if (iri.text.substr(0, file_iri.size()) != file_iri || iri.text.find_first_of("?#") != std::string_view::npos)
        return unexpected(Errc::invalid_option,
                          "acl:" + local + ": expected a path of this server such as </arm>, found <" + relative(iri.text) + ">");
      const Result<std::string> path = path_of(iri.text.substr(file_iri.size() - 1));
      if (!path) return unexpected(Errc::invalid_option, "acl:" + local + ": " + path.error().message);
      targets.emplace_back(*path, predicate == vocab::acl::accessTo.text ? Scope::here : Scope::below);
    } else if (predicate == vocab::acl::agent.text || predicate == vocab::acl::agentGroup.text) {
      Result<std::string> name = name_of(iri.text);
      if (!name) return unexpected(Errc::invalid_option, "acl:" + local + ": " + name.error().message);
      agents.push_back({predicate == vocab::acl::agent.text ? Who::Kind::principal : Who::Kind::role, *std::move(name)});
    } else if (predicate == vocab::acl::agentClass.text) {
      if (iri == vocab::foaf::Agent) agents.push_back({Who::Kind::anyone});
      else if (iri == vocab::acl::AuthenticatedAgent) agents.push_back({Who::Kind::authenticated});
      else
        return unexpected(Errc::invalid_option, "acl:agentClass: expected foaf:Agent or acl:AuthenticatedAgent, found <" + relative(iri.text) + ">");
    } else if (predicate == vocab::acl::mode.text) {
      const std::optional<Right> right = right_of(iri);
      if (!right)
        return unexpected(Errc::invalid_option,
                          "acl:mode: expected acl:Read, acl:Write, acl:Control, lrt:Invoke, lrt:Release, lrt:Subscribe or lrt:TakeOver, found <" +
                              relative(iri.text) + ">");
      rights = rights | *right;
    } else {
      return unexpected(Errc::invalid_option, "acl:" + local + " is not supported");
    }
    return {};
  }

  static std::optional<Right> right_of(Iri mode) noexcept {
    if (mode == vocab::acl::Read) return Right::read;
    if (mode == vocab::acl::Write) return Right::write;
    if (mode == vocab::acl::Control) return Right::manage;
    if (mode == vocab::lrt_::Invoke) return Right::invoke;
    if (mode == vocab::lrt_::Release) return Right::release;
    if (mode == vocab::lrt_::Subscribe) return Right::subscribe;
    if (mode == vocab::lrt_::TakeOver) return Right::control;
    return std::nullopt;
  }

  /// `<#anna>`: "anna". Other IRIs are names as they are.
  static Result<std::string> name_of(std::string_view iri) {
    if (iri.substr(0, file_iri.size()) != file_iri) return std::string(iri);
    if (iri.size() <= file_iri.size() + 1 || iri[file_iri.size()] != '#')
      return unexpected(Errc::invalid_option, "expected <#NAME> or an absolute IRI, found <" + relative(iri) + ">");
    return iri::decode(iri.substr(file_iri.size() + 1));
  }

  /// An IRI as it may stand in the file.
  static std::string relative(std::string_view iri) {
    return std::string(iri.substr(0, file_iri.size()) == file_iri
                           ? iri.substr(file_iri.size() - (iri.size() > file_iri.size() && iri[file_iri.size()] == '#' ? 0 : 1))
                           : iri);
  }

  static constexpr std::string_view acl = vocab::acl::Authorization.text.substr(0, vocab::acl::Authorization.text.find('#') + 1);

  const rdf::Graph& graph_;
  std::vector<Rule> rules_;
};

}  // namespace

// ------------------------------------------------------------------------------------------------------------------ View

std::optional<std::string> View::Targets::around(std::string_view path) const {
  std::string_view nearest;
  for (const Target& target : all) {
    const std::string_view own = target.path;
    if (own.substr(0, path.size()) == path && (own.size() == path.size() || own[path.size()] == '/')) return std::nullopt;
    const bool is_above = own == "/" || (path.substr(0, own.size()) == own && path.size() > own.size() && path[own.size()] == '/');
    if (is_above && target.below && own.size() > nearest.size()) nearest = own;
  }
  return std::string(nearest);
}

View::View(std::shared_ptr<const Targets> targets, std::vector<Granted> granted) : targets_(std::move(targets)), granted_(std::move(granted)) {
  for (const Granted& g : granted_) anywhere_ = anywhere_ | g.here | g.below;
  reads_everything_ = at("/").has(Right::read) && below("/").has(Right::read);
  for (std::size_t i = 0; i < granted_.size(); ++i) {
    const Targets::Target& target = targets_->all[i];
    reads_everything_ &= (!target.here || granted_[i].here.has(Right::read)) && (!target.below || granted_[i].below.has(Right::read));
  }
}

/// An index into Targets::all; granted_.size(): there is none.
std::size_t View::target_of(std::string_view path) const noexcept {
  const auto found = targets_->by_path.find(path);
  return found == targets_->by_path.end() ? granted_.size() : found->second;
}

Rights View::at(std::string_view path) const noexcept {
  if (!targets_) return everywhere_;
  if (const std::size_t own = target_of(path); own != granted_.size() && targets_->all[own].here) return granted_[own].here;
  return below(parent_of(path));
}

Rights View::below(std::string_view path) const noexcept {
  if (!targets_) return everywhere_;
  for (; !path.empty(); path = parent_of(path))
    if (const std::size_t i = target_of(path); i != granted_.size() && targets_->all[i].below) return granted_[i].below;
  return {};
}

/// Between two paths with rules the rights do not change, so that these paths and the root are enough.
bool View::grants_the_same_as(const View& other) const noexcept {
  const auto same_at = [&](std::string_view path) { return at(path) == other.at(path) && below(path) == other.below(path); };
  const auto same_at_all = [&](const View& one) {
    return !one.targets_ || std::all_of(one.targets_->all.begin(), one.targets_->all.end(), [&](const auto& target) { return same_at(target.path); });
  };
  return same_at("/") && same_at_all(*this) && same_at_all(other);
}

// ---------------------------------------------------------------------------------------------------------------- Policy

Result<std::shared_ptr<Policy>> Policy::create(const std::vector<Rule>& rules) {
  std::shared_ptr<Policy> policy(new Policy);
  const auto targets = std::make_shared<View::Targets>();
  std::map<std::string, std::size_t> known;
  for (const Rule& rule : rules) {
    Result<std::string> path = path_of(rule.path);
    if (!path) return unexpected(Errc::invalid_option, "rules: " + path.error().message);
    const bool is_named = rule.who.kind == Who::Kind::role || rule.who.kind == Who::Kind::principal;
    if (is_named == rule.who.name.empty())
      return unexpected(Errc::invalid_option, "rules: " + *path + ": a role or principal has a name, and nobody else");
    const auto [at, is_new] = known.emplace(*path, targets->all.size());
    if (is_new) targets->all.push_back({*std::move(path)});
    View::Targets::Target& target = targets->all[at->second];
    target.here = target.here || rule.scope != Scope::below;
    target.below = target.below || rule.scope != Scope::here;
    policy->grants_.push_back({at->second, rule.scope, rule.who, rule.rights});
  }
  for (std::size_t i = 0; i < targets->all.size(); ++i) targets->by_path.emplace(targets->all[i].path, i);  // views: no text moves from here on
  policy->targets_ = targets;
  return policy;
}

Result<std::vector<Rule>> parse_rules(std::string_view turtle) {
  rdf::ReadOptions options;
  options.base = file_iri;
  const Result<rdf::Graph> graph = rdf::read(turtle, rdf::Syntax::turtle, options);
  if (!graph) return Unexpected{graph.error()};
  return AuthorizationReader(*graph).read();
}

Result<std::vector<Rule>> load_rules(const std::string& file) {
  Result<std::string> text = read_file(file, max_policy_bytes);
  if (!text) return Unexpected{std::move(text).error()};
  if (text->size() > max_policy_bytes) return unexpected(Errc::invalid_option, file + ": expected at most 1 MiB");
  Result<std::vector<Rule>> rules = parse_rules(*text);
  if (!rules) return unexpected(rules.error().code, file + ": " + rules.error().message);
  return rules;
}

std::shared_ptr<const View> Policy::view(const Principal* principal) {
  std::vector<View::Granted> granted(targets_->all.size());
  for (const Grant& grant : grants_) {
    if (!concerns(grant.who, principal)) continue;
    View::Granted& to = granted[grant.target];
    if (grant.scope != Scope::below) to.here = to.here | grant.rights;
    if (grant.scope != Scope::here) to.below = to.below | grant.rights;
  }
  const std::lock_guard lock(mutex_);
  views_.erase(std::remove_if(views_.begin(), views_.end(), [](const auto& v) { return v.second.expired(); }), views_.end());
  for (const auto& [known, view] : views_)
    if (known == granted)
      if (auto shared = view.lock()) return shared;
  auto made = std::make_shared<const View>(targets_, granted);
  views_.emplace_back(std::move(granted), made);
  return made;
}

}  // namespace v0
}  // namespace lrt::security
