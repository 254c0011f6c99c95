// SPDX-License-Identifier: Apache-2.0
#include <lrt/client/description.hpp>

#include <algorithm>
#include <map>
#include <set>
#include <string_view>
#include <unordered_map>
#include <utility>

#include <lrt/base/iri.hpp>
#include <lrt/rdf/value_codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/client/binding.hpp"
#include "src/rdf/shown.hpp"

namespace lrt::client {
inline namespace v0 {
namespace {

namespace sh = vocab::sh;
using rdf::Graph;
using rdf::TermId;
using rdf::TermView;

/// Of one text; more are left out.
constexpr std::size_t max_languages = 100;

/// Ends the reading, inside this file only.
struct Refused {
  Error error;
};

std::string shown_iri(std::string_view iri) { return rdf::shown(TermView(Iri(iri))); }

class Describer {
 public:
  Describer(const Graph& graph, const DescribeOptions& options) : graph_(graph), options_(options) {}

  Description run() {
    for (const TermId thing : things()) out_.things.push_back(describe(thing));
    if (out_.things.empty()) shapes();
    if (out_.things.empty() && out_.shapes.empty()) warn("the graph describes no hybrit:RoboticThing, and no shape that a type can express");
    return std::move(out_);
  }

 private:
  void warn(std::string sentence) {
    if (out_.warnings.size() < options_.max_warnings) out_.warnings.push_back(std::move(sentence));
  }
  [[noreturn]] static void limit(std::size_t n, const char* what) {
    throw Refused{{Errc::limit_exceeded, "more than " + std::to_string(n) + " " + what}};
  }

  // ---- triples

  template <class Visit>
  void each(TermId subject, Iri predicate, Visit visit) const {
    if (const auto p = graph_.find(predicate))
      for (const rdf::Triple& t : graph_.match(subject, *p, std::nullopt)) visit(t.object);
  }
  std::optional<TermId> one(TermId subject, Iri predicate) const {
    const auto p = graph_.find(predicate);
    return p ? graph_.object(subject, *p) : std::nullopt;
  }
  bool has(TermId subject, Iri predicate, Iri object) const { return graph_.contains(graph_.term(subject), TermView(predicate), TermView(object)); }
  bool is_described(TermId node) const { return !graph_.match(node, std::nullopt, std::nullopt).empty(); }
  std::string iri_of(TermId node) const { return std::string(graph_.term(node).text); }
  std::string title_of(TermId node, const rdf::Words& words) const {
    if (const rdf::Text* title = words.titles.choose({})) return title->text;
    for (const Iri predicate : {vocab::dcterms::title, vocab::rdfs::label})
      if (const auto title = one(node, predicate); title && graph_.term(*title).is_literal())
        return iri_of(*title).substr(0, options_.schema.max_text);
    return {};
  }

  /// The name of a shape or kind for people: rdfs:label, else sh:name, else the last part of its target class; empty: none.
  std::string shape_name(TermId shape) const {
    for (const Iri predicate : {vocab::rdfs::label, sh::name})
      if (const auto name = one(shape, predicate); name && graph_.term(*name).is_literal() && !graph_.term(*name).text.empty())
        return iri_of(*name).substr(0, options_.schema.max_text);
    const auto target = one(shape, sh::targetClass);
    if (!target || !graph_.term(*target).is_iri()) return {};
    const std::string last = name_of({}, iri_of(*target), false);
    return iri::decode(last).value_or(last);
  }

  /// Things that are described, not only mentioned.
  std::vector<TermId> things() const {
    std::set<TermId> found;
    const auto add = [&](const rdf::Triple& t) {
      if (!graph_.term(t.subject).is_iri()) return;
      found.insert(t.subject);
      if (found.size() > options_.max_things) limit(options_.max_things, "Things");
    };
    for (const Iri predicate : {vocab::hybrit::property, vocab::hybrit::action, vocab::hybrit::blueprint})
      if (const auto p = graph_.find(predicate))
        for (const rdf::Triple& t : graph_.match(std::nullopt, *p, std::nullopt)) add(t);
    // Things without both are included: the links of a robot, for example.
    const auto type = graph_.find(vocab::rdf_::type), thing = graph_.find(vocab::hybrit::RoboticThing), title = graph_.find(vocab::dcterms::title);
    if (type && thing && title)
      for (const rdf::Triple& t : graph_.match(std::nullopt, *type, *thing))
        if (graph_.object(t.subject, *title)) add(t);
    std::vector<TermId> sorted(found.begin(), found.end());
    std::sort(sorted.begin(), sorted.end(), [&](TermId a, TermId b) { return graph_.term(a).text < graph_.term(b).text; });
    return sorted;
  }

  // ---- Things

  ThingDescription describe(TermId thing) {
    ThingDescription d;
    d.iri = iri_of(thing);
    d.words = words_of(graph_, thing, options_.schema.max_text);
    d.title = title_of(thing, d.words);
    const std::vector<TermId> blueprints = blueprints_of(thing, d);
    each(thing, vocab::rdf_::type, [&](TermId c) {
      const TermView of = graph_.term(c);
      if (of.is_iri() && of != TermView(vocab::hybrit::RoboticThing) && !is_blueprint_class(thing, of.text) &&
          d.classes.size() < options_.max_members)
        d.classes.emplace_back(of.text);
    });
    std::sort(d.classes.begin(), d.classes.end());
    const auto [properties, actions] = members_of(thing);
    if (properties.size() + actions.size() > options_.max_members) limit(options_.max_members, "properties and actions of one Thing");
    for (const auto& [iri, member] : properties) d.properties.push_back(property(d, thing, member, blueprints));
    for (const auto& [iri, member] : actions) d.actions.push_back(action(d, thing, member));
    return d;
  }

  /// A class that is a Blueprint of the Thing, or stands in the document of one, is no class of a domain.
  bool is_blueprint_class(TermId thing, std::string_view of) const {
    bool is = false;
    each(thing, vocab::hybrit::blueprint, [&](TermId b) {
      const std::string_view blueprint = graph_.term(b).text;
      is = is || of == blueprint || of.substr(0, of.find('#')) == blueprint;
    });
    return is;
  }

  /// Blueprints of one Thing only have IRIs below its own.
  static bool is_below(std::string_view iri, std::string_view thing) {
    while (!thing.empty() && thing.back() == '/') thing.remove_suffix(1);
    return iri.size() > thing.size() && iri.substr(0, thing.size()) == thing && (iri[thing.size()] == '/' || iri[thing.size()] == '#');
  }

  /// Its Blueprints, those that they refer to, and the classes of the Thing that are shapes. Those of the Thing alone are first, then those that
  /// refer to another one: what they say of a predicate replaces what the Blueprint of the kind says. That of the kind is the one that another one
  /// refers to, else the first that is not the Thing's own.
  std::vector<TermId> blueprints_of(TermId thing, ThingDescription& d) {
    std::vector<TermId> all;
    const auto add = [&](TermId b) {
      if (all.size() < options_.max_members && std::find(all.begin(), all.end(), b) == all.end()) all.push_back(b);
    };
    each(thing, vocab::hybrit::blueprint, [&](TermId b) {
      if (!graph_.term(b).is_literal()) add(b);
    });
    const std::size_t linked = all.size();
    each(thing, vocab::rdf_::type, [&](TermId c) {
      if (graph_.term(c).is_iri() && has(c, vocab::rdf_::type, sh::NodeShape)) add(c);
    });
    std::vector<TermId> shared, refer;
    for (std::size_t i = 0; i < all.size() && all.size() < options_.max_members; ++i)
      each(all[i], sh::node, [&](TermId b) {
        if (!graph_.term(b).is_iri()) return;
        refer.push_back(all[i]);
        if (std::find(shared.begin(), shared.end(), b) == shared.end()) shared.push_back(b);
        add(b);
      });
    const auto last = all.begin() + static_cast<std::ptrdiff_t>(linked);
    const auto is_own = [&](TermId b) { return graph_.term(b).is_iri() && is_below(graph_.term(b).text, d.iri); };
    auto kind = std::find_if(all.begin(), last, [&](TermId b) { return std::find(shared.begin(), shared.end(), b) != shared.end(); });
    if (kind == last) kind = std::find_if(all.begin(), last, [&](TermId b) { return graph_.term(b).is_iri() && !is_own(b); });
    if (kind == last && linked > 0 && graph_.term(all.front()).is_iri()) kind = all.begin();
    if (kind != last) {
      d.kind = iri_of(*kind);
      d.kind_name = shape_name(*kind);
    }
    if (linked > 0 && std::none_of(all.begin(), all.end(), [&](TermId b) { return is_described(b); }))
      warn("the graph does not have the Blueprint " + shown_iri(graph_.term(all.front()).text) + " of " + shown_iri(d.iri));
    const auto rank = [&](TermId b) { return is_own(b) ? 0 : std::find(refer.begin(), refer.end(), b) != refer.end() ? 1 : 2; };
    std::stable_sort(all.begin(), all.end(), [&](TermId a, TermId b) { return rank(a) < rank(b); });
    return all;
  }

  using Members = std::map<std::string, TermId>;
  std::pair<Members, Members> members_of(TermId thing) {
    std::pair<Members, Members> members;
    for (const rdf::Triple& t : graph_.match(thing, std::nullopt, std::nullopt)) {
      if (!graph_.term(t.object).is_iri()) continue;
      const TermView predicate = graph_.term(t.predicate);
      const bool is_property = predicate == TermView(vocab::hybrit::property), is_action = predicate == TermView(vocab::hybrit::action);
      // By a predicate of a domain, as in Figure 2b; but not that of another Thing.
      const bool elsewhere = one(t.object, vocab::rdfs::seeAlso) && !graph_.contains(t.object, *graph_.find(vocab::rdfs::seeAlso), thing);
      if (is_property || (!is_action && !elsewhere && has(t.object, vocab::rdf_::type, vocab::hybrit::Property)))
        members.first.emplace(iri_of(t.object), t.object);
      else if (is_action || (!elsewhere && has(t.object, vocab::rdf_::type, vocab::hybrit::Action)))
        members.second.emplace(iri_of(t.object), t.object);
    }
    return members;
  }

  std::vector<std::string> predicates_of(TermId thing, TermId member) const {
    std::set<std::string> predicates;
    for (const rdf::Triple& t : graph_.match(thing, std::nullopt, member)) {
      const std::string_view p = graph_.term(t.predicate).text;
      if (p != vocab::hybrit::property.text && p != vocab::hybrit::action.text && p != vocab::lrt_::stop.text &&
          predicates.size() < options_.max_members)
        predicates.emplace(p);
    }
    return {predicates.begin(), predicates.end()};
  }

  static std::string name_of(std::string_view thing, std::string_view member, bool is_action) {
    std::string_view name = member;
    while (!thing.empty() && thing.back() == '/') thing.remove_suffix(1);
    if (name.size() > thing.size() + 1 && name.substr(0, thing.size()) == thing && (name[thing.size()] == '/' || name[thing.size()] == '#')) {
      name.remove_prefix(thing.size() + 1);
    } else {
      while (name.size() > 1 && name.back() == '/') name.remove_suffix(1);
      name = name.substr(name.find_last_of("/#") + 1);
    }
    constexpr std::string_view actions = "actions/";
    if (is_action && name.size() > actions.size() && name.substr(0, actions.size()) == actions) name.remove_prefix(actions.size());
    return std::string(name);
  }

  // ---- shapes alone

  void shapes() {
    const auto type = graph_.find(vocab::rdf_::type), node_shape = graph_.find(sh::NodeShape);
    if (!type || !node_shape) return;
    std::set<std::string> iris;
    for (const rdf::Triple& t : graph_.match(std::nullopt, *type, *node_shape))
      if (graph_.term(t.subject).is_iri()) iris.insert(iri_of(t.subject));
    for (const std::string& iri : iris) {
      const TermId shape = *graph_.find(rdf::iri(iri));
      std::optional<Schema> schema = schema_of(shape, iri);
      if (!schema) continue;
      std::string name = shape_name(shape);
      if (name.empty()) name = iri::decode(name_of({}, iri, false)).value_or(iri);
      out_.shapes.push_back({iri, std::move(name), *std::move(schema)});
    }
  }

  // ---- Properties

  PropertyDescription property(const ThingDescription& thing, TermId thing_id, TermId member, const std::vector<TermId>& blueprints) {
    PropertyDescription p;
    p.iri = iri_of(member);
    p.name = name_of(thing.iri, p.iri, false);
    p.words = words_of(graph_, member, options_.schema.max_text);
    p.title = title_of(member, p.words);
    p.predicates = predicates_of(thing_id, member);
    std::vector<TermId> shapes;
    if (const auto target = graph_.find(sh::targetNode))
      for (const rdf::Triple& t : graph_.match(std::nullopt, *target, member)) {
        if (graph_.term(t.subject).is_blank()) add_value_shapes(t.subject, shapes);
        shapes.push_back(t.subject);
      }
    each(member, vocab::hybrit::binding, [&](TermId binding) {
      if (!has(binding, vocab::http_core::mthd, vocab::http_methods::PUT)) return;
      p.writable = true;
      each(binding, vocab::http_core::body, [&](TermId body) { each(body, vocab::dcterms::conformsTo, [&](TermId s) { shapes.push_back(s); }); });
    });
    for (const TermId blueprint : blueprints) add_shapes_of(blueprint, p.predicates, shapes);
    for (const TermId shape : shapes)
      if (const auto schema = schema_of(shape, p.iri)) {
        p.schema = schema;
        return p;
      }
    p.schema = by_itself(member, p.iri);
    if (!p.schema) warn(shown_iri(p.iri) + ": no shape says what its value is");
    return p;
  }

  /// The shapes that a Blueprint has for values of these predicates.
  void add_shapes_of(TermId blueprint, const std::vector<std::string>& predicates, std::vector<TermId>& shapes) {
    for (const std::string& predicate : predicates)
      for (const TermId p : property_shapes(blueprint, predicate)) add_value_shapes(p, shapes);
  }
  /// The shapes of the value in a shape of its property.
  void add_value_shapes(TermId p, std::vector<TermId>& shapes) {
    std::vector<TermId> blank;
    const auto add = [&](TermId s) {
      if (is_about_resources(graph_, s)) return;
      if (graph_.term(s).is_iri()) shapes.push_back(s);
      else blank.push_back(s);
    };
    each(p, sh::node, add);
    // A value may be absent: the other alternative describes the present one.
    each(p, sh::or_, [&](TermId list) {
      for (const TermId s : graph_.list(list).value_or(std::vector<TermId>{}))
        if (!graph_.term(s).is_literal() && !is_absence(graph_, s)) add(s);
    });
    shapes.insert(shapes.end(), blank.begin(), blank.end());
  }
  const std::vector<TermId>& property_shapes(TermId blueprint, const std::string& predicate) {
    auto& by_path = paths_[blueprint];
    if (by_path.empty()) {
      by_path[{}];
      each(blueprint, sh::property, [&](TermId p) {
        if (const auto path = one(p, sh::path)) by_path[iri_of(*path)].push_back(p);
      });
    }
    return by_path[predicate];
  }
  std::optional<Schema> schema_of(TermId shape, std::string_view of) {
    if (graph_.term(shape).is_literal() || !is_described(shape)) return std::nullopt;
    const auto known = schemas_.find(shape);
    if (known != schemas_.end()) return known->second;
    if (schemas_.size() >= options_.max_schemas) limit(options_.max_schemas, "shapes of values");
    Result<Schema> schema = Schema::read(graph_, graph_.term(shape), options_.schema);
    std::optional<Schema> usable;
    if (!schema) {
      warn(shown_iri(of) + ": " + schema.error().message);
    } else {
      for (const std::string& warning : schema->warnings()) warn(shown_iri(of) + ": " + warning);
      if (schema->usable()) usable = *std::move(schema);
    }
    return schemas_.emplace(shape, std::move(usable)).first->second;
  }

  /// The schema in the representation of a Property.
  std::optional<Schema> by_itself(TermId member, std::string_view of) {
    Graph shapes;
    const auto add = [&](TermId s, Iri p, const TermView& o) { shapes.add(shapes.term(s), TermView(p), o); };
    const TermId shape = shapes.intern(rdf::iri(of));
    const auto property = [&](TermId path) {
      const TermId p = shapes.fresh_blank();
      shapes.add(shape, shapes.intern(sh::property), p);
      shapes.add(p, shapes.intern(sh::path), path);
      add(p, sh::maxCount, rdf::literal("1", vocab::xsd::integer));
      return p;
    };
    const auto copy_unit = [&](Iri predicate) {
      if (const auto u = one(member, predicate); u && graph_.term(*u).is_iri())
        add(property(shapes.intern(predicate)), sh::hasValue, graph_.term(*u));
    };
    const auto is_iri = [&](const std::optional<TermId>& id) { return id && graph_.term(*id).is_iri(); };
    const auto stated = one(member, vocab::lrt_::datatype), number = stated ? stated : one(member, vocab::qudt::dataType);
    const auto element = one(member, vocab::lrt_::elementType), value = one(member, vocab::rdf_::value);
    const auto numerical = one(member, vocab::vom::numericalValue);
    if (is_iri(number) || (numerical && graph_.term(*numerical).is_literal())) {
      add(property(shapes.intern(vocab::vom::numericalValue)), sh::datatype,
          is_iri(number) ? graph_.term(*number) : rdf::iri(graph_.term(*numerical).datatype));
      copy_unit(vocab::vom::unit);
      copy_unit(vocab::qudt::hasUnit);
    } else if (is_iri(element)) {
      const TermId p = property(shapes.intern(vocab::rdf_::value)), rests = shapes.fresh_blank(), members = shapes.fresh_blank();
      add(rests, sh::zeroOrMorePath, vocab::rdf_::rest);
      shapes.add(p, shapes.intern(sh::property), members);
      const TermId path = shapes.add_list({rests, shapes.intern(vocab::rdf_::first)});
      shapes.add(members, shapes.intern(sh::path), path);
      add(members, sh::datatype, graph_.term(*element));
    } else if (value && graph_.term(*value).is_literal()) {
      add(property(shapes.intern(vocab::rdf_::value)), sh::datatype, rdf::iri(graph_.term(*value).datatype));
    } else {
      return std::nullopt;
    }
    const Result<Schema> schema = Schema::read(shapes, shapes.term(shape), options_.schema);
    if (!schema || !schema->usable()) return std::nullopt;
    if (!is_iri(number) && !is_iri(element)) warn(shown_iri(of) + ": no shape says what its value is; the type is that of its present value");
    return *schema;
  }

  // ---- Actions

  ActionDescription action(const ThingDescription& thing, TermId thing_id, TermId member) {
    ActionDescription a;
    a.iri = iri_of(member);
    a.name = name_of(thing.iri, a.iri, true);
    a.words = words_of(graph_, member, options_.schema.max_text);
    a.title = title_of(member, a.words);
    a.predicates = predicates_of(thing_id, member);
    a.asynchronous = has(member, vocab::rdf_::type, vocab::hybrit::AsynchronousAction);
    a.stop = has(member, vocab::rdf_::type, vocab::lrt_::StopAction);
    each(member, vocab::hybrit::consumes, [&](TermId s) {
      if (graph_.term(s).is_literal() || (graph_.term(s).is_blank() && !is_described(s))) return;
      a.has_input = true;
      if (!a.input) a.input = schema_of(s, a.iri);
    });
    each(member, vocab::hybrit::produces, [&](TermId s) {
      if (!a.output && !one(s, vocab::sosa::forProperty) && !one(s, vocab::ssn::forProperty)) a.output = schema_of(s, a.iri);
    });
    bool only_mentioned = true;
    for (const rdf::Triple& t : graph_.match(member, std::nullopt, std::nullopt))
      if (graph_.term(t.predicate) != TermView(vocab::rdf_::type)) only_mentioned = false;
    a.has_input = a.has_input || only_mentioned;
    if (only_mentioned) warn(shown_iri(a.iri) + ": the graph does not have the document of this action, so its input is not known");
    else if (a.has_input && !a.input) warn(shown_iri(a.iri) + ": no shape says what its input is");
    return a;
  }

  const Graph& graph_;
  const DescribeOptions& options_;
  Description out_;
  std::map<TermId, std::optional<Schema>> schemas_;
  std::map<TermId, std::unordered_map<std::string, std::vector<TermId>>> paths_;
};

}  // namespace

Result<Description> describe(const Graph& graph, const DescribeOptions& options) {
  try {
    return Describer(graph, options).run();
  } catch (const Refused& refused) { return unexpected(refused.error); }
}

rdf::Words words_of(const Graph& graph, TermId resource, std::size_t max_text) {
  const auto texts = [&](Iri predicate) {
    std::map<std::string, std::string> by_language;
    if (const auto p = graph.find(predicate))
      for (const rdf::Triple& t : graph.match(resource, *p, std::nullopt)) {
        const TermView text = graph.term(t.object);
        if (!text.is_literal() || text.text.size() > max_text || by_language.size() > max_languages) continue;
        const auto [known, is_new] = by_language.emplace(text.language, text.text);
        if (!is_new && text.text < known->second) known->second = text.text;
      }
    rdf::Texts all;
    for (const auto& [language, text] : by_language) all.add(text, language);
    return all;
  };
  return {texts(vocab::dcterms::title), texts(vocab::dcterms::description)};
}

void merge_document(Graph& to, const Graph& document) {
  std::vector<std::optional<TermId>> placed(document.term_count());
  const auto place = [&](TermId id) {
    std::optional<TermId>& there = placed[static_cast<std::size_t>(id)];
    if (!there) there = document.term(id).is_blank() ? to.fresh_blank() : to.intern(document.term(id));
    return *there;
  };
  for (const rdf::Triple& t : document.triples()) {
    const TermId s = place(t.subject), p = place(t.predicate), o = place(t.object);
    to.add(s, p, o);
  }
}

}  // namespace v0
}  // namespace lrt::client
