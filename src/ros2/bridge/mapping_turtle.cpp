// SPDX-License-Identifier: Apache-2.0
// A mapping in Turtle: nodes of the types below, in the vocabulary https://w3id.org/lrt/ros2#, with the words and units of the usual vocabularies.
#include <charconv>
#include <cstdlib>
#include <string>

#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/quote.hpp"
#include "src/ros2/bridge/mapping_file.hpp"
#include "src/ros2/bridge/units.hpp"

namespace lrt::ros2 {
namespace {

#define LRT_ROS2_NS "https://w3id.org/lrt/ros2#"
constexpr std::string_view rules_ns = LRT_ROS2_NS;
constexpr std::string_view type_iri = "http://www.w3.org/1999/02/22-rdf-syntax-ns#type";

class TurtleReader {
 public:
  explicit TurtleReader(const rdf::Graph& graph) : graph_(graph) {}

  Result<std::vector<Rule>> rules() {
    static constexpr std::pair<std::string_view, Rule::Of> kinds[] = {{LRT_ROS2_NS "TopicRule", Rule::Of::topic},
                                                                      {LRT_ROS2_NS "TypeRule", Rule::Of::type},
                                                                      {LRT_ROS2_NS "ServiceRule", Rule::Of::service},
                                                                      {LRT_ROS2_NS "ActionRule", Rule::Of::action},
                                                                      {LRT_ROS2_NS "ParameterRule", Rule::Of::parameter}};
    std::vector<Rule> all;
    const rdf::TermView a = rdf::iri(type_iri);
    for (const rdf::Triple& t : graph_.match(nullptr, &a, nullptr)) {
      const rdf::TermView kind = graph_.term(t.object);
      if (kind.text.substr(0, rules_ns.size()) != rules_ns) continue;
      bool known = false;
      for (const auto& [iri, of] : kinds) {
        if (kind != rdf::iri(iri)) continue;
        known = true;
        if (all.size() == max_rules) return unexpected(Errc::limit_exceeded, "a mapping has at most " + std::to_string(max_rules) + " rules");
        if (!rule(graph_.term(t.subject), of, all.emplace_back())) return Unexpected{std::move(error_)};
      }
      if (!known) return unexpected(Errc::expected_value, "unknown class " + rdf::to_string(kind));
    }
    if (all.empty())
      return unexpected(Errc::expected_value, "the document has no rule: a node with the type <" LRT_ROS2_NS
                                              "TopicRule>, TypeRule, ServiceRule, ActionRule or ParameterRule");
    return all;
  }

 private:
  bool fail(const rdf::TermView& subject, std::string what, Errc code = Errc::expected_value) {
    error_ = Error{code, rdf::to_string(subject) + ": " + std::move(what)};
    return false;
  }
  bool text(const rdf::TermView& subject, const rdf::TermView& object, std::string_view term, std::string& to) {
    if (!object.is_literal()) return fail(subject, std::string(term) + ": expected a text, found " + rdf::to_string(object));
    to = std::string(object.text);
    return true;
  }
  bool truth(const rdf::TermView& subject, const rdf::TermView& object, std::string_view term, std::optional<bool>& to) {
    if (object.is_literal() && (object.text == "true" || object.text == "1")) return to = true, true;
    if (object.is_literal() && (object.text == "false" || object.text == "0")) return to = false, true;
    return fail(subject, std::string(term) + ": expected true or false, found " + rdf::to_string(object));
  }
  bool number(const rdf::TermView& subject, const rdf::TermView& object, std::string_view term, double& to) {
    const std::string lexical(object.is_literal() ? object.text : std::string_view());
    char* end = nullptr;
    to = std::strtod(lexical.c_str(), &end);
    if (!lexical.empty() && end == lexical.c_str() + lexical.size()) return true;
    return fail(subject, std::string(term) + ": expected a number, found " + rdf::to_string(object));
  }
  bool iri(const rdf::TermView& subject, const rdf::TermView& object, std::string_view term, std::string& to) {
    if (!object.is_iri()) return fail(subject, std::string(term) + ": expected an IRI, found " + rdf::to_string(object), Errc::expected_iri);
    to = std::string(object.text);
    return true;
  }
  bool time(const rdf::TermView& subject, const rdf::TermView& object, std::string_view term, std::optional<std::chrono::milliseconds>& to) {
    double ms = 0;
    if (!number(subject, object, term, ms)) return false;
    if (!(ms >= 0 && ms <= 86'400'000)) return fail(subject, std::string(term) + ": expected 0 to 86400000", Errc::out_of_range);
    to = std::chrono::milliseconds(static_cast<std::int64_t>(ms));
    return true;
  }

  /// @return  nullopt: it is no predicate of a field
  std::optional<bool> field(const rdf::TermView& s, std::string_view p, const rdf::TermView& o, FieldRule& to) {
    if (p == vocab::qudt::hasUnit.text || p == vocab::qudt::unit.text) {
      to.unit = o.is_iri() || o.is_literal() ? find_unit(o.text) : std::nullopt;
      return to.unit ? true : fail(s, "unknown unit " + rdf::to_string(o));
    }
    if (p == vocab::qudt::hasQuantityKind.text) return iri(s, o, "qudt:hasQuantityKind", to.quantity_kind);
    double n = 0;
    if (p == LRT_ROS2_NS "min") return number(s, o, "min", n) ? (to.min = n, true) : false;
    if (p == LRT_ROS2_NS "max") return number(s, o, "max", n) ? (to.max = n, true) : false;
    if (p == LRT_ROS2_NS "as") return text(s, o, "as", to.name);
    if (p == LRT_ROS2_NS "term") return iri(s, o, "term", to.term);
    if (p == LRT_ROS2_NS "leftOut") return truth(s, o, "leftOut", to.left_out);
    if (p == LRT_ROS2_NS "readOnly") return truth(s, o, "readOnly", to.read_only);
    if (p == LRT_ROS2_NS "value") {
      const auto name = graph_.object(o, rdf::iri(LRT_ROS2_NS "name"));
      const auto code = graph_.object(o, rdf::iri(LRT_ROS2_NS "number"));
      if (!name || !code) return fail(s, "value: expected a node with a name and a number");
      Enumerator e{std::string(name->text), 0};
      const char* const end = code->text.data() + code->text.size();
      if (const auto read = std::from_chars(code->text.data(), end, e.number); read.ec != std::errc() || read.ptr != end)
        return fail(s, "number: expected an integer, found " + rdf::to_string(*code));
      to.enumerators.push_back(std::move(e));
      return true;
    }
    return std::nullopt;
  }
  static bool words(std::string_view p, const rdf::TermView& o, Texts& titles, Texts& descriptions) {
    Texts* to = p == vocab::dcterms::title.text ? &titles : p == vocab::dcterms::description.text ? &descriptions : nullptr;
    if (!to || !o.is_literal()) return false;
    to->add(std::string(o.text), std::string(o.language));
    return true;
  }

  bool one_field(const rdf::TermView& node, Rule& to) {
    const auto path = graph_.object(node, rdf::iri(LRT_ROS2_NS "path"));
    if (!path || !path->is_literal() || path->text.empty()) return fail(node, "field: expected a node with a path");
    FieldRule& made = to.fields[std::string(path->text)];
    for (const rdf::Triple& t : graph_.match(&node, nullptr, nullptr)) {
      const rdf::TermView p = graph_.term(t.predicate), o = graph_.term(t.object);
      if (p.text == LRT_ROS2_NS "path" || words(p.text, o, made.titles, made.descriptions)) continue;
      const std::optional<bool> good = field(node, p.text, o, made);
      if (!good) return fail(node, "unknown predicate " + rdf::to_string(p) + " of a field");
      if (!*good) return false;
    }
    return true;
  }

  bool rule(const rdf::TermView& s, Rule::Of of, Rule& to) {
    to.of = of;
    for (const rdf::Triple& t : graph_.match(&s, nullptr, nullptr)) {
      const rdf::TermView predicate = graph_.term(t.predicate), o = graph_.term(t.object);
      const std::string_view p = predicate.text;
      bool good = true;
      if (p == type_iri || words(p, o, to.titles, to.descriptions)) continue;
      if (p == LRT_ROS2_NS "matches") good = text(s, o, "matches", to.matches);
      else if (p == LRT_ROS2_NS "frame") good = text(s, o, "frame", to.frame);
      else if (p == LRT_ROS2_NS "hidden") good = truth(s, o, "hidden", to.hidden);
      else if (p == LRT_ROS2_NS "requiresExpiry") good = truth(s, o, "requiresExpiry", to.requires_expiry);
      else if (p == LRT_ROS2_NS "lifeMilliseconds") good = time(s, o, "lifeMilliseconds", to.life);
      else if (p == LRT_ROS2_NS "intervalMilliseconds") good = time(s, o, "intervalMilliseconds", to.interval);
      else if (p == LRT_ROS2_NS "success") good = text(s, o, "success", to.success);
      else if (p == LRT_ROS2_NS "progress") good = text(s, o, "progress", to.progress);
      else if (p == LRT_ROS2_NS "field") good = one_field(o, to);
      else if (const std::optional<bool> of_value = field(s, p, o, to.value)) good = *of_value;
      else good = fail(s, "unknown predicate " + rdf::to_string(predicate));
      if (!good) return false;
    }
    if (std::string fault = fault_of_rule(to); !fault.empty()) return fail(s, std::move(fault));
    return true;
  }

  const rdf::Graph& graph_;
  Error error_{Errc::expected_value, {}};
};
#undef LRT_ROS2_NS

}  // namespace

Result<std::vector<Rule>> rules_from_turtle(std::string_view text) {
  if (text.size() > max_mapping_bytes)
    return unexpected(Errc::limit_exceeded, "the mapping has more than " + std::to_string(max_mapping_bytes) + " bytes");
  rdf::ReadOptions options;
  options.base = "urn:lrt:ros2";
  options.max_bytes = 16 * max_mapping_bytes;
  const Result<rdf::Graph> graph = rdf::read(text, rdf::Syntax::turtle, options);
  if (!graph) return Unexpected{graph.error()};
  return TurtleReader(*graph).rules();
}

}  // namespace lrt::ros2
