// SPDX-License-Identifier: Apache-2.0
// What stays true when the documents of a server are merged into one graph: shapes, nodes, classes. And what Actions say of themselves.

#include <algorithm>
#include <array>
#include <chrono>
#include <deque>
#include <map>
#include <utility>

#include <lrt/base/iri.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/vocab.hpp>
#include <lrt/shacl/validator.hpp>

#include "src/check/survey.hpp"
#include "src/client/binding.hpp"

namespace lrt::check {
namespace {

using rdf::Graph;
using rdf::TermId;
using rdf::TermView;
using rdf::Triple;

constexpr std::size_t reserved_requests = 100;  // for the checks that follow
constexpr const char* accepted = "text/turtle, application/n-triples;q=0.9, application/ld+json;q=0.5";
constexpr const char* merge_ids[] = {"merge.conforms", "merge.doubles", "merge.entailment", "blueprint.targets", "action.described"};

struct Document {
  std::string url;
  Exchange exchange;
  Graph graph;
};

/// A subject and a predicate whose objects are literals.
using Place = std::pair<std::string, std::string>;
using Texts = std::set<std::string>;

std::string shown(const TermView& term) { return excerpt(rdf::to_string(term), 200); }
std::string angled(const std::string& url) { return "<" + url + ">"; }

/// Reads the documents of a server, and merges them.
class Crawl {
 public:
  explicit Crawl(Context& context) : context_(context), end_(std::chrono::steady_clock::now() + context.options.merge_time) {}

  void run() {
    want(context_.url);
    if (const Result<http::Url> parts = url_of(context_.url)) want(parts->origin() + "/");
    if (!context_.options.root.empty()) want(context_.options.root);
    for (const Resource& r : context_.resources)
      if (r.exists()) want(r.url);
    std::size_t triples = 0;
    for (; !wanted_.empty() && complete_; wanted_.pop_front()) {
      if (documents_.size() >= context_.options.max_merged_documents) limit("max_merged_documents", context_.options.max_merged_documents);
      else if (is_late()) limit("merge_time [ms]", static_cast<std::size_t>(context_.options.merge_time.count()));
      else if (context_.probe.exhausted() || context_.probe.requests() + reserved_requests >= context_.options.max_requests)
        limit("max_requests", context_.options.max_requests);
      if (!complete_) break;
      Document document{wanted_.front(), {}, {}};
      std::optional<Graph> graph;
      const auto visited =
          std::find_if(context_.resources.begin(), context_.resources.end(), [&](const Resource& r) { return r.url == document.url; });
      if (visited != context_.resources.end() && visited->graph) {
        document.exchange = visited->get;
        graph = visited->graph;
      } else {
        document.exchange = get(context_, document.url, {{"Accept", accepted}});
        graph = graph_of(context_, document.exchange);
      }
      read_.insert(document.url);
      if (!graph || !is_ours(document.exchange.url) || !urls_.insert(document.exchange.url).second) continue;
      read_.insert(document.exchange.url);
      document.url = document.exchange.url;
      triples += graph->size();
      if (triples > context_.options.max_merged_triples) {
        limit("max_merged_triples", context_.options.max_merged_triples);
        break;
      }
      document.graph = *std::move(graph);
      follow(document);
      documents_.push_back(std::move(document));
    }
    find_moments();
    merge();
  }

  const std::vector<Document>& documents() const noexcept { return documents_; }
  const Graph& merged() const noexcept { return merged_; }
  bool complete() const noexcept { return complete_; }
  bool is_late() const { return std::chrono::steady_clock::now() >= end_; }
  bool is_ours(std::string_view iri) const { return client::same_origin(std::string(iri), context_.url); }
  /// Whether what this server says of a node is in the merged graph.
  bool is_read(const TermView& node) const {
    return node.is_blank() || (node.is_iri() && read_.count(without_fragment(std::string(node.text))) != 0);
  }
  /// The documents that say something of a node, by a predicate if there is one that they use.
  std::vector<const Document*> sources(const TermView& node, const std::string& predicate) const {
    if (node.is_blank()) {
      const auto found = document_of_blank_.find(*merged_.find(node));
      return found == document_of_blank_.end() ? std::vector<const Document*>() : std::vector<const Document*>{&documents_[found->second]};
    }
    std::vector<const Document*> with, about;
    const TermView p = rdf::iri(predicate);
    for (const Document& d : documents_) {
      if (!d.graph.match(&node, nullptr, nullptr).empty()) about.push_back(&d);
      if (!predicate.empty() && !d.graph.match(&node, &p, nullptr).empty()) with.push_back(&d);
    }
    return with.empty() ? about : with;
  }

 private:
  void want(const std::string& iri) {
    const std::string url = without_fragment(iri);
    // A query selects a format, a page or a graph: another representation of what has a name, or what a user stores.
    if (url.find('?') != std::string::npos || !is_ours(url) || wanted_.size() >= 20 * context_.options.max_merged_documents) return;
    if (known_.insert(url).second) wanted_.push_back(url);
  }
  void follow(const Document& document) {
    std::vector<bool> seen(document.graph.term_count());
    for (const Triple& t : document.graph.triples())
      for (const TermId id : {t.subject, t.predicate, t.object}) {
        if (seen[static_cast<std::size_t>(id)]) continue;
        seen[static_cast<std::size_t>(id)] = true;
        if (const TermView term = document.graph.term(id); term.is_iri()) want(std::string(term.text));
      }
    for (const client::Link& link : client::links(document.exchange.reply.fields, document.url))
      for (const char* relation : {"related", "up", "item", "next", "describedby", "http://www.w3.org/ns/ldp#constrainedBy"})
        if (link.relation == relation) want(link.target);
  }
  void limit(const char* option, std::size_t value) {
    if (complete_)
      context_.notes.push_back(std::string(option) + " (" + std::to_string(value) + ") was reached, and " + std::to_string(documents_.size()) +
                               " documents were merged");
    complete_ = false;
  }

  static std::map<Place, Texts> literals_of(const Graph& graph) {
    std::map<Place, Texts> places;
    for (const Triple& t : graph.triples())
      if (graph.term(t.subject).is_iri() && graph.term(t.object).is_literal())
        places[{std::string(graph.term(t.subject).text), std::string(graph.term(t.predicate).text)}].insert(rdf::to_string(graph.term(t.object)));
    return places;
  }
  /// The documents are of different moments. Where two have different literals, and a second reading shows that these change, only one is used.
  void find_moments() {
    std::map<Place, std::vector<std::pair<std::size_t, Texts>>> places;
    for (std::size_t i = 0; i < documents_.size(); ++i)
      for (auto& [place, texts] : literals_of(documents_[i].graph)) places[place].emplace_back(i, std::move(texts));
    const auto is_part = [](const Texts& a, const Texts& b) { return std::includes(b.begin(), b.end(), a.begin(), a.end()); };
    std::set<Place> conflicts;
    std::map<std::size_t, std::map<Place, Texts>> again;
    for (const auto& [place, all] : places)
      for (std::size_t i = 1; i < all.size(); ++i)
        if (!is_part(all[0].second, all[i].second) && !is_part(all[i].second, all[0].second)) {
          conflicts.insert(place);
          for (const auto& [document, texts] : all) again[document];
          break;
        }
    for (auto& [i, literals] : again) {
      if (context_.probe.exhausted() || is_late()) break;
      const Exchange exchange = get(context_, documents_[i].url, {{"Accept", accepted}});
      if (const std::optional<Graph> graph = graph_of(context_, exchange)) literals = literals_of(*graph);
    }
    for (const Place& place : conflicts) {
      const auto& all = places[place];
      bool moves = false, agree = true;
      for (const auto& [document, texts] : all) {
        const Texts& now = again[document][place];
        moves = moves || now != texts;
        agree = agree && now == again[all.front().first][place];
      }
      if (!moves && !agree) continue;
      const std::string own = without_fragment(place.first);
      const auto best = std::find_if(all.begin(), all.end(), [&](const auto& one) { return documents_[one.first].url == own; });
      moment_[place] = best == all.end() ? all.front().first : best->first;
    }
  }
  void merge() {
    for (std::size_t i = 0; i < documents_.size(); ++i) {
      const Graph& graph = documents_[i].graph;
      std::vector<std::optional<TermId>> placed(graph.term_count());
      const auto place = [&](TermId id) {
        std::optional<TermId>& there = placed[static_cast<std::size_t>(id)];
        if (there) return *there;
        there = graph.term(id).is_blank() ? merged_.fresh_blank() : merged_.intern(graph.term(id));
        if (graph.term(id).is_blank()) document_of_blank_[*there] = i;
        return *there;
      };
      for (const Triple& t : graph.triples()) {
        if (!moment_.empty() && graph.term(t.object).is_literal()) {
          const auto other = moment_.find({std::string(graph.term(t.subject).text), std::string(graph.term(t.predicate).text)});
          if (other != moment_.end() && other->second != i) continue;
        }
        const TermId s = place(t.subject), p = place(t.predicate), o = place(t.object);
        merged_.add(s, p, o);
      }
    }
  }

  Context& context_;
  const std::chrono::steady_clock::time_point end_;
  std::deque<std::string> wanted_;
  std::set<std::string> known_, read_, urls_;
  std::vector<Document> documents_;
  std::map<Place, std::size_t> moment_;  ///< the document whose literals are used
  Graph merged_;
  std::map<TermId, std::size_t> document_of_blank_;
  bool complete_ = true;
};

/// One line for each result: all of them, up to the limit. The first source is the evidence.
struct Results {
  std::vector<std::string> lines;
  std::size_t count = 0;
  const Exchange* evidence = nullptr;

  bool is_full(const Context& context) const noexcept { return lines.size() >= context.options.max_results; }
  void add(const Context& context, std::string line, const std::vector<const Document*>& sources) {
    ++count;
    if (evidence == nullptr && !sources.empty()) evidence = &sources.front()->exchange;
    if (is_full(context)) return;
    for (std::size_t i = 0; i < sources.size() && i < 4; ++i) line += (i == 0 ? "; in " : ", ") + angled(sources[i]->url);
    lines.push_back(excerpt(line, 1'000));
  }
  void judge(Context& context, std::string_view id, std::size_t tried, const Exchange* example, const std::string& detail) const {
    if (count == 0) return context.verdicts.pass(id, example, detail);
    context.verdicts.fail_all(id, lines, count, std::max(tried, count), evidence != nullptr ? evidence : example);
  }
};

// ---------------------------------------------------------------------------------------------------------------------------- shapes

bool has_shapes(const Graph& graph) {
  const TermView type = vocab::rdf_::type, node_shape = vocab::sh::NodeShape, property = vocab::sh::property;
  return !graph.match(nullptr, &type, &node_shape).empty() || !graph.match(nullptr, &property, nullptr).empty();
}

/// The shape, and if it has no name the named one that it is a part of.
std::string shown_shape(const Graph& graph, const TermView& shape) {
  TermView at = shape;
  for (int steps = 0; at.is_blank() && steps < 32; ++steps) {
    const auto above = graph.match(nullptr, nullptr, &at);
    if (above.empty()) break;
    at = graph.term(above.begin()->subject);
  }
  return at.is_blank() ? shown(shape) : shape.is_blank() ? "in " + shown(at) : shown(shape);
}

void check_conforms(Context& context, const Crawl& crawl) {
  Verdicts& v = context.verdicts;
  const auto& documents = crawl.documents();
  const auto first = std::find_if(documents.begin(), documents.end(), [](const Document& d) { return has_shapes(d.graph); });
  if (first == documents.end()) return v.not_applicable("merge.conforms", "no document has shapes");
  shacl::CompileOptions lenient;
  lenient.ignore_unsupported = true;
  const Result<shacl::Shapes> shapes = shacl::Shapes::compile(crawl.merged(), lenient);
  if (!shapes) return v.not_testable("merge.conforms", "the merged shapes are not valid: " + shapes.error().message);
  shacl::ValidateOptions options;
  options.max_steps = context.options.max_merged_steps;
  options.max_results = std::max<std::size_t>(context.options.max_results, 1) * 10;
  options.details = false;
  const Result<shacl::Report> report = shacl::validate(*shapes, crawl.merged(), options);
  if (!report) return v.not_testable("merge.conforms", report.error().message);
  Results results;
  std::size_t incomplete = 0;
  for (const shacl::ValidationResult& r : report->results()) {
    // Without a document that is named, something may seem to be missing.
    const bool value_is_read = !r.value || r.value->view().is_literal() || !crawl.is_ours(r.value->view().text) || crawl.is_read(*r.value);
    if (!crawl.is_read(r.focus) || !value_is_read) {
      ++incomplete;
      continue;
    }
    const std::string path = r.path.empty() ? std::string() : r.path.to_string();
    const std::string message = r.messages.empty() ? std::string(r.component.text) : std::string(r.messages.front().view().text);
    std::string predicate = path.size() > 2 && path.front() == '<' && path.back() == '>' ? path.substr(1, path.size() - 2) : std::string();
    for (const Triple& t : crawl.merged().match(*crawl.merged().find(r.focus), std::nullopt, std::nullopt))
      if (predicate.empty() && rdf::abbreviate(crawl.merged().term(t.predicate).text) == path) predicate = crawl.merged().term(t.predicate).text;
    results.add(context,
                "the node " + shown(r.focus) + (path.empty() ? "" : " " + path) + " by the shape " + shown_shape(crawl.merged(), r.source_shape) +
                    ": " + message,
                crawl.sources(r.focus, predicate));
  }
  results.judge(context, "merge.conforms", documents.size(), &first->exchange,
                std::to_string(crawl.merged().size()) + " triples of " + std::to_string(documents.size()) + " documents" +
                    (incomplete > 0 ? "; " + std::to_string(incomplete) + " results depend on documents that could not be read" : ""));
}

/// Shapes that judge what others say as soon as graphs are merged.
void check_targets(Context& context, const Crawl& crawl) {
  Results results;
  std::size_t tried = 0;
  const Exchange* example = nullptr;
  std::set<std::pair<std::string, std::string>> seen;
  for (const Document& d : crawl.documents()) {
    if (!has_shapes(d.graph)) continue;
    if (example == nullptr) example = &d.exchange;
    for (const Iri target : {vocab::sh::targetClass, vocab::sh::targetSubjectsOf, vocab::sh::targetObjectsOf}) {
      const TermView predicate = target;
      for (const Triple& t : d.graph.match(nullptr, &predicate, nullptr)) {
        const TermView shape = d.graph.term(t.subject), object = d.graph.term(t.object);
        ++tried;
        if (!object.is_iri() || crawl.is_ours(object.text) || !seen.emplace(rdf::to_string(shape), object.text).second) continue;
        results.add(context, "the shape " + shown(shape) + " has " + rdf::abbreviate(target.text) + " " + shown(object) + ", a term of others", {&d});
      }
    }
  }
  if (example == nullptr) return context.verdicts.not_applicable("blueprint.targets", "no document has shapes");
  results.judge(context, "blueprint.targets", tried, example, std::to_string(tried) + " targets by class or predicate");
}

// --------------------------------------------------------------------------------------------------------------------------- doubles

/// The content of a blank node, the same for equal trees. Empty: it is too deep or too large.
std::string content_of(const Graph& graph, TermId node, unsigned depth, std::size_t& left) {
  constexpr unsigned max_depth = 24;
  if (depth > max_depth) return {};
  std::vector<std::string> lines;
  for (const Triple& t : graph.match(node, std::nullopt, std::nullopt)) {
    if (left == 0) return {};
    --left;
    const TermView object = graph.term(t.object);
    std::string text = object.is_blank() ? content_of(graph, t.object, depth + 1, left) : rdf::to_string(object);
    if (text.empty()) return {};
    lines.push_back(rdf::to_string(graph.term(t.predicate)) + " " + text);
  }
  std::sort(lines.begin(), lines.end());
  std::string whole = "[";
  for (const std::string& line : lines) whole += line + ";";
  return whole + "]";
}

void check_doubles(Context& context, const Crawl& crawl) {
  Results results;
  std::size_t tried = 0, left = 4 * context.options.max_merged_triples;
  std::map<std::array<std::string, 3>, const Document*> known;
  for (const Document& d : crawl.documents())
    for (const Triple& t : d.graph.triples()) {
      const TermView subject = d.graph.term(t.subject), object = d.graph.term(t.object);
      if (!subject.is_iri() || !object.is_blank()) continue;
      ++tried;
      if (tried % 1'000 == 0 && crawl.is_late()) left = 0;
      std::string content = left > 0 ? content_of(d.graph, t.object, 0, left) : std::string();
      if (content.empty()) continue;
      const auto [first, is_new] =
          known.emplace(std::array<std::string, 3>{std::string(subject.text), std::string(d.graph.term(t.predicate).text), std::move(content)}, &d);
      if (!is_new && first->second != &d)
        results.add(context, "the node " + shown(subject) + " has two blank nodes of equal content by " + shown(d.graph.term(t.predicate)),
                    {first->second, &d});
    }
  if (left == 0 && results.count == 0)
    return context.verdicts.not_testable("merge.doubles", "a limit was reached before all blank nodes were compared");
  results.judge(context, "merge.doubles", tried, &crawl.documents().front().exchange,
                std::to_string(tried) + " blank nodes are objects of named nodes");
}

// ------------------------------------------------------------------------------------------------------------------------ entailment

/// The closure of a relation, for each of its terms: the first ones of very many.
class Above {
 public:
  Above(const Graph& graph, Iri predicate) : graph_(graph), predicate_(graph.find(predicate)) {}
  const std::vector<TermId>& of(TermId term) {
    const auto [found, is_new] = known_.try_emplace(term);
    if (!is_new || !predicate_) return found->second;
    std::vector<TermId> all;
    std::deque<TermId> open{term};
    for (std::set<TermId> seen{term}; !open.empty() && all.size() < max_terms; open.pop_front())
      for (const Triple& t : graph_.match(open.front(), *predicate_, std::nullopt))
        if (!graph_.term(t.object).is_literal() && seen.insert(t.object).second) {
          all.push_back(t.object);
          open.push_back(t.object);
        }
    return known_[term] = std::move(all);
  }

 private:
  static constexpr std::size_t max_terms = 1'000;
  const Graph& graph_;
  const std::optional<TermId> predicate_;
  std::map<TermId, std::vector<TermId>> known_;
};

void check_entailment(Context& context, const Crawl& crawl) {
  const Graph& graph = crawl.merged();
  const auto type = graph.find(vocab::rdf_::type), domain = graph.find(vocab::rdfs::domain), range = graph.find(vocab::rdfs::range);
  Above classes(graph, vocab::rdfs::subClassOf), predicates(graph, Iri("http://www.w3.org/2000/01/rdf-schema#subPropertyOf"));
  Results results;
  std::size_t tried = 0;
  bool is_late = false;
  std::size_t steps = 0;
  std::set<std::pair<TermId, TermId>> seen;
  // What the axioms of RDF say of terms and lists needs no term of the server.
  const auto is_axiomatic = [&](const TermView& subject, const TermView& of) {
    for (const Iri one : {vocab::rdfs::Resource, vocab::rdfs::Class, Iri("http://www.w3.org/2000/01/rdf-schema#Literal"),
                          Iri("http://www.w3.org/2000/01/rdf-schema#Datatype"), Iri("http://www.w3.org/1999/02/22-rdf-syntax-ns#Property")})
      if (of == TermView(one)) return true;
    return of.text == "http://www.w3.org/1999/02/22-rdf-syntax-ns#List" &&
           (subject == TermView(vocab::rdf_::nil) || graph.object(subject, TermView(vocab::rdf_::first)).has_value());
  };
  const auto entail = [&](TermId node, TermId of, const std::string& why) {
    is_late = is_late || (++steps % 10'000 == 0 && crawl.is_late());
    if (is_late) return;
    const TermView subject = graph.term(node), c = graph.term(of);
    if (subject.is_literal() || is_axiomatic(subject, c) || !seen.emplace(node, of).second) return;
    ++tried;
    // A class above a stated one is no change: nothing is said that the stated one does not say.
    if (type)
      for (const Triple& t : graph.match(node, *type, std::nullopt)) {
        const std::vector<TermId>& above = classes.of(t.object);
        if (t.object == of || std::find(above.begin(), above.end(), of) != above.end()) return;
      }
    // What others are, they say elsewhere.
    if ((subject.is_iri() && !crawl.is_ours(subject.text)) || !crawl.is_read(subject)) return;
    if (results.is_full(context)) return results.add(context, {}, {});
    results.add(context, shown(subject) + " becomes a " + shown(c) + " by " + why, crawl.sources(subject, {}));
  };
  const auto by = [&](TermId node, TermId predicate, const std::optional<TermId>& side, const char* name) {
    if (!side) return;
    const auto one = [&](TermId p) {
      for (const Triple& t : graph.match(p, *side, std::nullopt)) {
        if (is_late) return;
        const std::string why = name + (" of " + shown(graph.term(p)));
        entail(node, t.object, why);
        for (const TermId above : classes.of(t.object)) entail(node, above, why + " and rdfs:subClassOf");
      }
    };
    one(predicate);
    for (const TermId above : predicates.of(predicate)) one(above);
  };
  for (const Triple& t : graph.triples()) {
    is_late = is_late || (++steps % 10'000 == 0 && crawl.is_late());
    if (is_late) break;
    by(t.subject, t.predicate, domain, "rdfs:domain");
    if (!graph.term(t.object).is_literal()) by(t.object, t.predicate, range, "rdfs:range");
    bool is_type = type && t.predicate == *type;
    if (type)
      for (const TermId above : predicates.of(t.predicate)) is_type = is_type || above == *type;
    if (is_type && t.predicate != *type) entail(t.subject, t.object, "rdfs:subPropertyOf of " + shown(graph.term(t.predicate)));
  }
  if (is_late && results.count == 0) return context.verdicts.not_testable("merge.entailment", "merge_time was reached");
  results.judge(context, "merge.entailment", tried, &crawl.documents().front().exchange,
                std::to_string(tried) + " classes of nodes are entailed, and all of them are stated or above stated ones");
}

// --------------------------------------------------------------------------------------------------------------------------- actions

/// Empty: the Action describes itself.
std::string fault_of_action(Context& context, const Crawl& crawl, const Document& document) {
  const Graph& graph = document.graph;
  client::Representation representation;
  representation.url = document.url;
  representation.graph = graph;
  representation.focus = graph.find(rdf::iri(document.url));
  for (const Iri predicate : {vocab::hybrit::consumes, vocab::hybrit::produces})
    for (const TermView& object : graph.objects(rdf::iri(document.url), predicate)) {
      if (object.is_literal()) return rdf::abbreviate(predicate.text) + " is a literal";
      const bool is_here = !graph.match(&object, nullptr, nullptr).empty();
      const bool is_there =
          object.is_iri() && (!crawl.is_ours(object.text) || !crawl.is_read(object) || !crawl.merged().match(&object, nullptr, nullptr).empty());
      if (!is_here && !is_there) return "nothing describes " + shown(object) + ", the object of " + rdf::abbreviate(predicate.text);
    }
  const std::vector<client::Binding> bindings = client::bindings_of(representation);
  if (bindings.empty()) return "there is no hybrit:binding with a method of HTTP";
  bool works = false;
  std::string fault;
  const bool consumes = graph.object(rdf::iri(document.url), vocab::hybrit::consumes).has_value();
  for (const client::Binding& b : bindings) {
    if (b.shape && !consumes) return "a binding has a body with a shape, and there is no hybrit:consumes";
    const std::string url = b.url.empty() ? document.url : without_fragment(b.url);
    if (!url_of(url)) {
      fault = "the binding's URI " + excerpt(url, 100) + " is no URL";
    } else if (!crawl.is_ours(url) || context.probe.exhausted()) {
      works = true;  // it cannot be seen here
    } else {
      const Exchange options = context.probe.ask("OPTIONS", url);
      const std::string allow = "," + options.reply.fields.joined("Allow") + ",";
      std::string flat;
      for (const char c : allow)
        if (c != ' ') flat += c;
      if (!options.reply.ok() || flat == "," || flat == ",," || flat.find("," + b.method + ",") != std::string::npos) works = true;
      else
        fault =
            "the binding's " + b.method + " is not allowed at " + angled(url) + ", which allows" + excerpt(allow.substr(1, allow.size() - 2), 100);
    }
  }
  return works ? std::string() : fault;
}

void check_actions(Context& context, const Crawl& crawl) {
  Results results;
  std::size_t tried = 0;
  const Exchange* example = nullptr;
  for (const Document& d : crawl.documents()) {
    if (!d.graph.contains(rdf::iri(d.url), vocab::rdf_::type, vocab::hybrit::Action) &&
        !d.graph.contains(rdf::iri(d.url), vocab::rdf_::type, vocab::hybrit::AsynchronousAction))
      continue;
    if (tried >= context.options.max_described_actions) break;
    ++tried;
    if (example == nullptr) example = &d.exchange;
    if (const std::string fault = fault_of_action(context, crawl, d); !fault.empty()) results.add(context, angled(d.url) + ": " + fault, {&d});
  }
  if (tried == 0) return context.verdicts.not_applicable("action.described", "there is no Action with a document of its own");
  results.judge(context, "action.described", tried, example, std::to_string(tried) + " Actions");
}

}  // namespace

void check_merging(Context& context) {
  if (!context.probe.exhausted()) {
    Crawl crawl(context);
    crawl.run();
    if (crawl.documents().empty()) {
      for (const char* id : merge_ids) context.verdicts.not_testable(id, "there is no RDF that this check reads");
      return;
    }
    check_targets(context, crawl);
    check_conforms(context, crawl);
    check_doubles(context, crawl);
    check_entailment(context, crawl);
    check_actions(context, crawl);
  }
  for (const char* id : merge_ids) context.verdicts.otherwise(id, Outcome::not_testable, "a limit was reached before the documents were read");
}

}  // namespace lrt::check
