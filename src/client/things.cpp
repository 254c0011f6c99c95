// SPDX-License-Identifier: Apache-2.0
#include <lrt/client/things.hpp>

#include <poll.h>

#include <algorithm>
#include <utility>

#include <lrt/base/iri.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/ascii.hpp"
#include "src/base/charset.hpp"
#include "src/client/binding.hpp"
#include "src/client/session.hpp"
#include "src/client/stored_document.hpp"
#include "src/http/robot_time.hpp"
#include "src/client/things.hpp"

namespace lrt::client {
inline namespace v0 {

using rdf::Graph;
using rdf::TermId;
using rdf::TermView;
using rdf::Triple;
using std::chrono::milliseconds;

namespace {

/// The Properties that a shape of an effect is about, by the present name of the predicate and by the former one.
std::vector<TermView> changed_by(const Graph& graph, const TermView& shape) {
  std::vector<TermView> found = graph.objects(shape, vocab::sosa::forProperty);
  for (const TermView& property : graph.objects(shape, vocab::ssn::forProperty))
    if (std::find(found.begin(), found.end(), property) == found.end()) found.push_back(property);
  return found;
}

bool ends_with_path(std::string_view url, std::string_view name) noexcept {
  while (!name.empty() && name.front() == '/') name.remove_prefix(1);
  if (name.empty() || url.size() <= name.size()) return false;
  const char before = url[url.size() - name.size() - 1];
  return url.substr(url.size() - name.size()) == name && (before == '/' || before == '#');
}

/// As people write it: without percent-encoding, if that is UTF-8.
std::string decoded(std::string_view text) {
  if (text.find('%') == std::string_view::npos) return std::string(text);
  Result<std::string> name = iri::decode(text);
  return name ? *std::move(name) : std::string(text);
}

/// 2: the text is an IRI of the resource or of its predicate. 1: it is one of its shorter names. 0: it names something else.
int fits(std::string_view url, const Names& names, std::string_view text) {
  if (url == text || std::find(names.predicates.begin(), names.predicates.end(), text) != names.predicates.end()) return 2;
  if (std::find(names.titles.begin(), names.titles.end(), text) != names.titles.end() || ends_with_path(url, text)) return 1;
  if (url.find('%') != std::string_view::npos && ends_with_path(decoded(url), text)) return 1;
  const auto is_its_name = [&](const std::string& p) {
    const std::string_view local = local_name(p);
    return local == text || (local.find('%') != std::string_view::npos && decoded(local) == text);
  };
  return std::any_of(names.predicates.begin(), names.predicates.end(), is_its_name) ? 1 : 0;
}

/// By the predicate to it. lrt:stop says what an action is for, and is the name of none.
std::string short_name(std::string_view url, const Names& names) {
  for (const std::string& predicate : names.predicates)
    if (predicate != vocab::lrt_::stop.text) return decoded(local_name(predicate));
  return decoded(local_name(url));
}

/// The only one of `all` with a name.
template <class T>
Result<T> find_named(const std::vector<T>& all, std::string_view name, const char* kind, const std::string& where) {
  for (const int wanted : {2, 1}) {
    const T* found = nullptr;
    std::string several;
    for (const T& one : all) {
      if (fits(one.url(), one.names(), name) < wanted || (found && found->url() == one.url())) continue;
      if (found) several += (several.empty() ? found->url() + ", " : ", ") + one.url();
      else found = &one;
    }
    if (!several.empty())
      return unexpected(Errc::expected_value, std::string(kind) + " \"" + std::string(name) + "\" is ambiguous: " + several.substr(0, 500));
    if (found) return *found;
  }
  std::string list;
  std::vector<std::string> listed;  // Things of one kind have equal names
  for (const T& one : all) {
    if (std::string known = one.name(); std::find(listed.begin(), listed.end(), known) == listed.end()) listed.push_back(std::move(known));
    else continue;
    if (list.size() > 300) {
      list += ", ...";
      break;
    }
    list += (list.empty() ? "" : ", ") + listed.back();
  }
  return unexpected(Errc::unknown_path, where + " has no " + kind + " \"" + std::string(name) + "\"" + (list.empty() ? "" : "; it has " + list));
}

/// The RDF syntax of a Content-Type that a binding states.
std::optional<rdf::Syntax> stated_syntax(const std::vector<std::pair<std::string, std::string>>& fields) {
  for (const auto& [name, value] : fields)
    if (lrt::detail::iequals_ascii(name, "Content-Type"))
      return rdf::syntax_of(lrt::detail::lower(lrt::detail::trim(std::string_view(value).substr(0, value.find(';')))));
  return std::nullopt;
}

/// The first syntax of a list of media types, as in Accept of a 415 (RFC 9110 15.5.16).
std::optional<rdf::Syntax> first_syntax(std::string_view list) {
  while (!list.empty()) {
    const std::size_t end = std::min(list.find(','), list.size());
    const std::string_view one = list.substr(0, end);
    if (const auto syntax = rdf::syntax_of(lrt::detail::lower(lrt::detail::trim(one.substr(0, one.find(';')))))) return syntax;
    list.remove_prefix(std::min(end + 1, list.size()));
  }
  return std::nullopt;
}

/// Sends a graph. If the server refuses the syntax, sends it once more in a syntax that the server names.
Result<Response> send_graph(Session& session, Request request, const Graph& graph) {
  rdf::Syntax syntax = stated_syntax(request.fields).value_or(rdf::Syntax::turtle);
  const auto is_type = [](const auto& field) { return lrt::detail::iequals_ascii(field.first, "Content-Type"); };
  const auto is_accept = [](const auto& field) { return lrt::detail::iequals_ascii(field.first, "Accept"); };
  request.fields.erase(std::remove_if(request.fields.begin(), request.fields.end(), is_accept), request.fields.end());
  request.fields.emplace_back("Accept", session.accept());
  for (int attempt = 0;; ++attempt) {
    Result<std::string> body = rdf::write(graph, syntax);
    if (!body) return unexpected(std::move(body).error());
    request.body = *std::move(body);
    request.fields.erase(std::remove_if(request.fields.begin(), request.fields.end(), is_type), request.fields.end());
    request.fields.emplace_back("Content-Type", charset::content_type(rdf::media_type(syntax), request.body));
    Result<Response> response = session.http().send(request);
    if (!response) return response;
    if (response->status == 415 && attempt == 0) {
      std::string list = response->fields.joined("Accept");
      if (list.empty()) list = response->fields.joined(request.method == "POST" ? "Accept-Post" : "Accept-Put");
      if (const std::optional<rdf::Syntax> other = first_syntax(list); other && *other != syntax) {
        syntax = *other;
        continue;
      }
    }
    return response;
  }
}

/// Commands are sent to the resource's origin only, whatever its binding says: a robot must not make a client move another robot.
Result<void> must_be_here(const std::string& url, const std::string& resource) {
  if (same_origin(url, resource)) return {};
  return unexpected(Errc::refused, "\"" + resource + "\" has a binding to another server, \"" + url.substr(0, 200) + "\"");
}

Invocation::Status status_of(const Representation& representation) {
  using Status = Invocation::Status;
  const std::pair<Iri, Status> known[] = {{vocab::lrt_::pending, Status::pending},
                                          {vocab::lrt_::running, Status::running},
                                          {vocab::lrt_::succeeded, Status::succeeded},
                                          {vocab::lrt_::failed, Status::failed},
                                          {vocab::lrt_::cancelled, Status::cancelled}};
  for (const std::string& found : representation.objects(vocab::lrt_::status))
    for (const auto& [iri, status] : known)
      if (found == iri.text) return status;
  return Status::unknown;
}

std::optional<TermView> literal_of(const Representation& representation, Iri predicate) {
  if (!representation.focus) return std::nullopt;
  const std::optional<TermId> id = representation.graph.find(predicate);
  if (!id) return std::nullopt;
  const std::optional<TermId> object = representation.graph.object(*representation.focus, *id);
  if (!object || !representation.graph.term(*object).is_literal()) return std::nullopt;
  return representation.graph.term(*object);
}

/// Whether a server describes its actions with the terms of lrt: its invocations then have an lrt:status.
bool uses_own_terms(const Graph& graph) {
  const std::string_view space = vocab::lrt_::status.text.substr(0, vocab::lrt_::status.text.find('#') + 1);
  for (const Triple& t : graph.triples())
    if (graph.term(t.predicate).text.substr(0, space.size()) == space || graph.term(t.object).text.substr(0, space.size()) == space) return true;
  return false;
}

Unexpected no_node(const std::string& url) {
  return unexpected(Errc::expected_value, "\"" + url + "\": it is not clear which node of its representation is meant");
}

/// The graph of a value for a request.
struct Body {
  Graph graph;
  TermId focus;
};
Body body_of_value(const std::string& url, const rdf::Type& type, const rdf::Value& value, const lrt::Unit& unit, const std::string& vocabulary,
                   const std::optional<Shape>& shape) {
  Body body;
  body.focus = body.graph.intern(rdf::iri(url));
  rdf::write_value(body.graph, body.focus, type, rdf::Facets(unit), value, vocabulary);
  if (shape) {
    body.graph = with_datatypes_of(*shape, body.graph);
    body.focus = body.graph.intern(rdf::iri(url));
    if (!body.graph.empty())
      for (const std::string& of : required_classes(*shape))
        body.graph.add(body.focus, body.graph.intern(vocab::rdf_::type), body.graph.intern(rdf::iri(of)));
  }
  return body;
}

/// The unit in which a value is sent. @par Errors  expected_value: the caller's unit is not the declared one
Result<lrt::Unit> agreed_unit(const lrt::Unit& given, const std::optional<lrt::Unit>& declared) {
  if (!declared) return given;
  if (given.empty() || given.qudt == declared->qudt || (given.qudt.empty() && given.vom == declared->vom)) return *declared;
  const auto name = [](const lrt::Unit& unit) {
    return unit.ucum.empty() ? rdf::abbreviate(unit.qudt.empty() ? unit.vom.text : unit.qudt.text) : std::string(unit.ucum);
  };
  return unexpected(Errc::expected_value, "expected the unit " + name(*declared) + ", found " + name(given));
}

/// Validates the request body, with Options::validate and if there is a shape.
Result<void> judged(const Session& session, const Graph& graph, TermId focus, const std::optional<Shape>& shape) {
  return session.options().validate && shape ? conforms(graph, focus, *shape) : Result<void>();
}

}  // namespace

std::string_view to_string(Invocation::Status status) noexcept {
  switch (status) {
    case Invocation::Status::pending: return "pending";
    case Invocation::Status::running: return "running";
    case Invocation::Status::succeeded: return "succeeded";
    case Invocation::Status::failed: return "failed";
    case Invocation::Status::cancelled: return "cancelled";
    case Invocation::Status::unknown: break;
  }
  return "unknown";
}

// --- Property ---

std::string Property::name() const { return short_name(url_, names_); }

Result<RepresentationPtr> Property::get() const { return session_->get(url_); }

bool Property::is_resource() const noexcept { return predicate_.empty() && url_.find('#') == std::string::npos; }

std::optional<TermId> Property::node_in(const Graph& graph, std::optional<TermId> focus) const noexcept {
  if (url_.find('#') != std::string::npos) focus = graph.find(rdf::iri(url_));
  if (!focus || predicate_.empty()) return focus;
  const std::optional<TermId> predicate = graph.find(rdf::iri(predicate_));
  return predicate ? graph.object(*focus, *predicate) : std::nullopt;
}

Result<TermId> Property::value_node(const Graph& graph, std::optional<TermId> focus) const {
  if (const std::optional<TermId> node = node_in(graph, focus)) return *node;
  if (focus && !predicate_.empty())
    return unexpected(Errc::unknown_path, "\"" + url_ + "\" no longer has the property " + rdf::abbreviate(predicate_));
  return no_node(url_);
}

Result<rdf::Value> Property::decode(const Graph& graph, std::optional<TermId> focus, const rdf::Type& type, const lrt::Unit& unit) const {
  const Result<TermId> node = value_node(graph, focus);
  if (!node) return unexpected(node.error());
  Result<rdf::Value> value = value_at(graph, *node, type, unit);
  if (value) return value;
  Error error = std::move(value).error();
  // In the state of its Thing, a property that cannot be read says why.
  const std::optional<TermView> failure = graph.object(graph.term(*node), vocab::lrt_::error);
  if (failure && failure->is_literal()) error = {Errc::failed, std::string(failure->text)};
  error.message = "\"" + url_ + "\": " + error.message;
  return unexpected(std::move(error));
}

Result<rdf::Value> Property::decode(const Representation& representation, const rdf::Type& type, const lrt::Unit& unit) const {
  const Graph& graph = representation.graph;
  const std::optional<TermId> self = predicate_.empty() ? graph.find(rdf::iri(url_)) : std::nullopt;  // in the state of its Thing
  return decode(graph, self && !graph.match(self, std::nullopt, std::nullopt).empty() ? self : representation.focus, type, unit);
}

Result<rdf::Value> Property::decode(const Change& change, const rdf::Type& type, const lrt::Unit& unit) const {
  const Result<Graph> graph = change.graph();
  if (!graph) return unexpected(graph.error());
  return decode(*graph, find_focus(*graph, document_of(url_)), type, unit);
}

Result<Watch> Property::watch(const WatchOptions& options, OnChange on_change) const {
  return session_->watches().watch(std::string(document_of(url_)), options, std::move(on_change));
}

Result<Watch> Property::watch_at_once(const WatchOptions& options, OnChange on_change) const {
  return session_->watches().watch(std::string(document_of(url_)), options, std::move(on_change), Watches::Delivery::at_once);
}

Result<std::optional<Shape>> Property::shape() const {
  const Result<RepresentationPtr> found = session_->described(url_);
  if (!found) return unexpected(found.error());
  for (const Binding& binding : bindings_of(**found)) {
    if (binding.method != "PUT" || !binding.shape) continue;
    Result<Shape> shape = session_->shape(*binding.shape, **found);
    if (!shape) return unexpected(std::move(shape).error());
    return std::optional<Shape>(*std::move(shape));
  }
  // Without a binding: a shape for this very node, where the links lead (LDP 4.2.1.6).
  for (const Link& link : (*found)->links) {
    if (link.relation != "describedby" && link.relation != "http://www.w3.org/ns/ldp#constrainedBy") continue;
    if (!same_origin(link.target, url_)) continue;
    const Result<RepresentationPtr> document = session_->described(link.target);
    if (!document) continue;
    const Graph& graph = (*document)->graph;
    for (const TermView& node : graph.subjects(vocab::sh::targetNode, rdf::iri(url_))) {
      Result<Shape> shape = session_->shape(node, **document);
      if (shape) return std::optional<Shape>(*std::move(shape));
    }
  }
  return std::optional<Shape>();
}

Result<std::optional<Shape>> Property::present_shape() const {
  const Result<RepresentationPtr> found = session_->described(url_);
  if (!found) return unexpected(found.error());
  const std::optional<TermId> node = node_in((*found)->graph, (*found)->focus);
  return node ? client::present_shape((*found)->graph, *node) : std::optional<Shape>();
}

Result<std::optional<Shape>> Property::value_shape() const {
  Result<std::optional<Shape>> own = shape();
  if (!own || *own) return own;
  const Result<RepresentationPtr> found = session_->described(url_);
  if (!found) return unexpected(found.error());
  // The Blueprint of this Thing alone, and one that refers to that of its kind, say more than that. The first is nearer to the Property.
  std::vector<RepresentationPtr> documents;
  for (const Link& link : (*found)->links) {
    if (link.relation != "describedby" || !same_origin(link.target, url_)) continue;
    if (const Result<RepresentationPtr> document = session_->described(link.target)) documents.push_back(*document);
  }
  const auto refers = [&](const RepresentationPtr& document) {
    return std::any_of(documents.begin(), documents.end(), [&](const RepresentationPtr& other) {
      return other != document && !document->graph.subjects(vocab::sh::node, rdf::iri(other->url)).empty();
    });
  };
  std::vector<std::pair<int, RepresentationPtr>> ranked;
  for (const RepresentationPtr& document : documents) {
    const std::string& target = document->url;
    const std::size_t folder = target.rfind('/') + 1;
    ranked.emplace_back(url_.compare(0, folder, target, 0, folder) == 0 ? 0 : refers(document) ? 1 : 2, document);
  }
  std::stable_sort(ranked.begin(), ranked.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<std::string> predicates = names_.predicates;
  if (predicates.empty() && !ranked.empty()) predicates = predicates_to(**found);
  for (const auto& [rank, document] : ranked) {
    const Graph& graph = document->graph;
    for (const std::string& predicate : predicates) {
      for (const TermView& node : graph.subjects(vocab::sh::path, rdf::iri(predicate))) {
        // Besides the named shape of the value there are the shapes of all resources of a server.
        std::vector<TermView> parts = graph.objects(node, vocab::sh::node);
        // A value may be absent: the other alternative describes the present one.
        for (const TermView& list : graph.objects(node, vocab::sh::or_))
          for (const TermId part : graph.list(*graph.find(list)).value_or(std::vector<TermId>{}))
            if (!is_absence(graph, part)) parts.push_back(graph.term(part));
        const auto named = std::find_if(parts.begin(), parts.end(),
                                        [&](const TermView& part) { return part.is_iri() && !is_about_resources(graph, *graph.find(part)); });
        if (named == parts.end() && !parts.empty()) continue;
        Result<Shape> shape = session_->shape(named == parts.end() ? node : *named, *document);
        if (shape) return std::optional<Shape>(*std::move(shape));
      }
    }
  }
  return std::optional<Shape>();
}

/// The predicates to a property that is known by its URL alone: its Thing, to which it links, has them.
std::vector<std::string> Property::predicates_to(const Representation& representation) const {
  std::vector<std::string> predicates;
  for (const Link& link : representation.links) {
    if (link.relation != "up" || !same_origin(link.target, url_)) continue;
    const Result<RepresentationPtr> thing = session_->described(link.target);
    if (!thing) continue;
    const Graph& graph = (*thing)->graph;
    const std::optional<TermId> self = graph.find(rdf::iri(url_));
    if (!self) continue;
    for (const Triple& t : graph.match(std::nullopt, std::nullopt, *self))
      if (const std::string_view predicate = graph.term(t.predicate).text; predicate != vocab::hybrit::property.text)
        predicates.emplace_back(predicate);
  }
  return predicates;
}

Result<lrt::Unit> Property::unit() const {
  if (declared_ && (declared_->is_simple || !declared_->unit.empty())) return declared_->unit;
  const Result<RepresentationPtr> found = session_->described(url_);
  if (!found) return unexpected(found.error());
  if (const std::optional<TermId> node = node_in((*found)->graph, (*found)->focus))
    if (const std::optional<lrt::Unit> stated = stated_unit((*found)->graph, *node)) return *stated;
  const Result<std::optional<Shape>> shape = this->shape();
  if (!shape) return unexpected(shape.error());
  if (*shape)
    if (const std::optional<lrt::Unit> required = required_unit(**shape)) return *required;
  return lrt::unit::none;
}

Result<bool> Property::is_writable() const {
  if (declared_) return declared_->may_change;
  const Result<RepresentationPtr> found = session_->described(url_);
  if (!found) return unexpected(found.error());
  if (!is_resource()) return false;
  const std::vector<Binding> bindings = bindings_of(**found);
  return (*found)->allows("PUT") || std::any_of(bindings.begin(), bindings.end(), [](const Binding& b) { return b.method == "PUT"; });
}

Result<void> Property::write(const rdf::Type& type, const rdf::Value& value, const WriteOptions& options) const {
  const CommandTime time(session_->options().command_life);
  const Result<std::optional<Shape>> shape = this->shape();
  if (!shape) return unexpected(shape.error());
  std::optional<lrt::Unit> declared = *shape ? required_unit(**shape) : std::nullopt;
  const Result<RepresentationPtr> found = session_->described(url_);
  if (!found) return unexpected(found.error());
  if (!declared && (*found)->focus) declared = stated_unit((*found)->graph, *(*found)->focus);
  const Result<lrt::Unit> unit = agreed_unit(options.unit, declared);
  if (!unit) return unexpected(unit.error());
  std::string vocabulary = *shape ? vocabulary_of(type, (*shape)->graph) : std::string();
  if (vocabulary.empty()) vocabulary = vocabulary_of(type, (*found)->graph);
  const Body body = body_of_value(url_, type, value, *unit, vocabulary, *shape);
  return put(body.graph, body.focus, *shape, options);
}

Result<void> Property::write(const Graph& graph, TermId focus, const WriteOptions& options) const {
  const CommandTime time(session_->options().command_life);
  const Result<std::optional<Shape>> shape = session_->options().validate ? this->shape() : std::optional<Shape>();
  if (!shape) return unexpected(shape.error());
  return put(graph, focus, *shape, options);
}

Result<void> Property::put(const Graph& graph, TermId focus, const std::optional<Shape>& shape, const WriteOptions& options) const {
  if (!is_resource()) return unexpected(Errc::refused, "\"" + url_ + "\": the property is no resource of its own and cannot be written");
  if (Result<void> good = judged(*session_, graph, focus, shape); !good) return good;
  const Result<RepresentationPtr> found = session_->described(url_);
  if (!found) return unexpected(found.error());
  std::vector<Binding> bindings = bindings_of(**found);
  const bool has_binding = std::any_of(bindings.begin(), bindings.end(), [](const Binding& b) { return b.method == "PUT"; });
  if (!has_binding) {
    const Result<std::optional<Shape>> published = shape ? Result<std::optional<Shape>>(shape) : this->shape();
    if (!published) return unexpected(published.error());
    if (!*published) return put_in_document(graph, focus, options);
  }
  Request request{"PUT", url_, {}, {}};
  for (Binding& binding : bindings) {
    if (binding.method != "PUT") continue;
    if (!binding.url.empty()) request.url = binding.url;
    request.fields = std::move(binding.fields);
    break;
  }
  if (Result<void> here = must_be_here(request.url, url_); !here) return here;
  if (!options.if_match.empty()) request.fields.emplace_back("If-Match", options.if_match);
  const Result<Response> response = send_graph(*session_, request, graph);
  if (!response) return unexpected(response.error());
  session_->forget(url_);
  if (!response->ok()) return unexpected(error_of(*response, "PUT", request.url));
  if (response->status == 202)
    return unexpected(Errc::unconfirmed, "PUT " + request.url + ": the robot has begun to write it and has not said yet whether it succeeded");
  return {};
}

Result<void> Property::patch(const Patch& patch, const WriteOptions& options) const {
  const CommandTime time(session_->options().command_life);
  if (!is_resource()) return unexpected(Errc::refused, "\"" + url_ + "\": the property is no resource of its own and cannot be written");
  if (!options.unit.empty())
    return unexpected(Errc::invalid_option, "a patch has no unit; write {\"value\": ..., \"unit\": ...} in its JSON where a number has another one");
  Request request{"PATCH", url_, {{"Content-Type", "application/merge-patch+json"}, {"Accept", session_->accept()}}, patch.json()};
  if (!options.if_match.empty()) request.fields.emplace_back("If-Match", options.if_match);
  const Result<Response> response = session_->http().send(request);
  if (!response) return unexpected(response.error());
  session_->forget(url_);
  if (response->status == 405 || response->status == 501 || (response->status == 415 && response->fields.find("Accept-Patch")))
    return unexpected(Errc::unsupported_syntax, "PATCH " + url_ + ": the server takes no merge patch of this property; write the whole value (" +
                                                    error_of(*response, "PATCH", url_).message + ")");
  if (!response->ok()) return unexpected(error_of(*response, "PATCH", url_));
  if (response->status == 202)
    return unexpected(Errc::unconfirmed, "PATCH " + url_ + ": the robot has begun to write it and has not said yet whether it succeeded");
  return {};
}

Result<void> Property::put_in_document(const Graph& value, TermId focus, const WriteOptions& options) const {
  constexpr int max_attempts = 3;
  for (int attempt = 1;; ++attempt) {
    const Result<RepresentationPtr> found = session_->get(url_);
    if (!found) return unexpected(found.error());
    const Representation& present = **found;
    const std::optional<TermId> node = node_in(present.graph, present.focus);
    if (!node) return no_node(url_);
    const bool has_tag = !present.entity_tag.empty() && present.entity_tag.compare(0, 2, "W/") != 0;
    if (options.if_match.empty() && !has_tag && says_more(present.graph, *node))
      return unexpected(Errc::refused,
                        "\"" + url_ +
                            "\" is stored as a document, whose other statements could be lost: it has no strong entity tag; to write it "
                            "nevertheless, state the entity tag that it must have (*: any)");
    Request request{"PUT", url_, {}, {}};
    if (!options.if_match.empty() || has_tag)
      request.fields.emplace_back("If-Match", options.if_match.empty() ? present.entity_tag : options.if_match);
    request.fields.emplace_back("Content-Type", present.media_type);
    const Graph changed = with_value(present.graph, *node, value, focus);
    std::optional<std::string> plain;
    if (!rdf::syntax_of(present.media_type)) plain = plain_text_of(changed, changed.find(present.graph.term(*node)).value(), present.media_type);
    if (plain) request.body = *std::move(plain);
    const Result<Response> response = request.body.empty() ? send_graph(*session_, request, changed) : session_->http().send(request);
    if (!response) return unexpected(response.error());
    session_->forget(url_);
    if (response->ok()) return {};
    const bool is_late = response->body.find(http::late_command_type) != std::string::npos;
    if (response->status != 412 || is_late || !options.if_match.empty() || attempt == max_attempts)
      return unexpected(error_of(*response, "PUT", url_));
  }
}

// --- Action ---

std::string Action::name() const { return short_name(url_, names_); }

Result<RepresentationPtr> Action::get() const { return session_->get(url_); }

Result<std::optional<Shape>> Action::input_shape() const {
  const Result<RepresentationPtr> found = session_->described(url_);
  if (!found) return unexpected(found.error());
  std::vector<rdf::Term> shapes = shapes_of(**found, vocab::hybrit::consumes);
  for (const Binding& binding : bindings_of(**found))
    if (shapes.empty() && binding.shape) shapes.push_back(*binding.shape);
  if (shapes.empty()) return std::optional<Shape>();
  Result<Shape> shape = session_->shape(shapes.front(), **found);
  if (!shape) return unexpected(std::move(shape).error());
  return std::optional<Shape>(*std::move(shape));
}

Result<std::optional<Shape>> Action::output_shape() const {
  const Result<RepresentationPtr> found = session_->described(url_);
  if (!found) return unexpected(found.error());
  for (const rdf::Term& node : shapes_of(**found, vocab::hybrit::produces)) {
    Result<Shape> shape = session_->shape(node, **found);
    if (!shape) return unexpected(std::move(shape).error());
    const TermView subject = shape->node.view();
    if (!changed_by(shape->graph, subject).empty()) continue;  // an effect
    return std::optional<Shape>(*std::move(shape));
  }
  return std::optional<Shape>();
}

Result<lrt::Unit> Action::unit() const {
  if (declared_ && (declared_->is_simple || !declared_->unit.empty())) return declared_->unit;
  const Result<std::optional<Shape>> shape = input_shape();
  if (!shape) return unexpected(shape.error());
  return *shape ? required_unit(**shape).value_or(lrt::unit::none) : lrt::unit::none;
}

Result<std::vector<std::string>> Action::effects() const {
  const Result<RepresentationPtr> found = session_->described(url_);
  if (!found) return unexpected(found.error());
  std::vector<std::string> result;
  for (const rdf::Term& node : shapes_of(**found, vocab::hybrit::produces))
    for (const TermView& property : changed_by((*found)->graph, node))
      if (property.is_iri() && std::find(result.begin(), result.end(), property.text) == result.end()) result.emplace_back(property.text);
  return result;
}

Result<std::vector<std::string>> Action::classes_of(Iri predicate) const {
  const Result<RepresentationPtr> found = session_->described(url_);
  if (!found) return unexpected(found.error());
  std::vector<std::string> result;
  for (const rdf::Term& node : shapes_of(**found, predicate)) {
    const Result<Shape> shape = session_->shape(node, **found);
    if (!shape) return unexpected(shape.error());
    for (std::string& name : client::classes_of(*shape))
      if (std::find(result.begin(), result.end(), name) == result.end()) result.push_back(std::move(name));
  }
  if (predicate == vocab::hybrit::consumes)
    for (Binding& binding : bindings_of(**found))
      for (std::string& name : binding.classes)
        if (std::find(result.begin(), result.end(), name) == result.end()) result.push_back(std::move(name));
  return result;
}

Result<std::vector<std::string>> Action::consumed_classes() const { return classes_of(vocab::hybrit::consumes); }
Result<std::vector<std::string>> Action::produced_classes() const { return classes_of(vocab::hybrit::produces); }

Result<bool> Action::is_available() const {
  const Result<RepresentationPtr> found = get();
  if (!found) return unexpected(found.error());
  return !literal_of(**found, vocab::lrt_::unavailable).has_value();
}

Result<std::vector<std::string>> Action::invocations() const {
  const Result<RepresentationPtr> found = get();
  if (!found) return unexpected(found.error());
  return (*found)->objects(vocab::lrt_::invocation);
}

Result<Invocation> Action::invoke(const InvokeOptions& options) const {
  if (is_stop_) return stop(options);
  const CommandTime time(session_->options().command_life);
  return send(nullptr, options);
}

Result<Invocation> Action::invoke(const rdf::Type& type, const rdf::Value& input, const InvokeOptions& options) const {
  const CommandTime time(session_->options().command_life);
  const Result<std::optional<Shape>> shape = input_shape();
  if (!shape) return unexpected(shape.error());
  const Result<lrt::Unit> unit = agreed_unit(options.unit, *shape ? required_unit(**shape) : std::nullopt);
  if (!unit) return unexpected(unit.error());
  const Body body = body_of_value(url_, type, input, *unit, *shape ? vocabulary_of(type, (*shape)->graph) : std::string(), *shape);
  if (Result<void> good = judged(*session_, body.graph, body.focus, *shape); !good) return unexpected(std::move(good).error());
  return send(&body.graph, options);
}

Result<Invocation> Action::invoke(const Graph& input, TermId focus, const InvokeOptions& options) const {
  const CommandTime time(session_->options().command_life);
  const Result<std::optional<Shape>> shape = session_->options().validate ? input_shape() : std::optional<Shape>();
  if (!shape) return unexpected(shape.error());
  if (Result<void> good = judged(*session_, input, focus, *shape); !good) return unexpected(std::move(good).error());
  return send(&input, options);
}

namespace {

/// A stop never expires: it is to be carried out whenever it arrives.
bool is_stop(const Representation& action) {
  const std::vector<std::string> types = action.types();
  return std::find(types.begin(), types.end(), vocab::lrt_::StopAction.text) != types.end();
}

}  // namespace

Result<Invocation> Action::send(const Graph* input, const InvokeOptions& options) const {
  const Result<RepresentationPtr> found = session_->described(url_);
  if (!found) return unexpected(found.error());
  Request request{"POST", url_, {}, {}};
  if (std::vector<Binding> bindings = bindings_of(**found); !bindings.empty()) {
    request.method = bindings.front().method;
    if (!bindings.front().url.empty()) request.url = bindings.front().url;
    request.fields = std::move(bindings.front().fields);
  }
  if (Result<void> here = must_be_here(request.url, url_); !here) return unexpected(std::move(here).error());
  if (is_stop(**found)) request.life = std::chrono::milliseconds(0);
  if (options.async) request.fields.emplace_back("Prefer", "respond-async");
  request.fields.insert(request.fields.end(), options.fields.begin(), options.fields.end());
  if (!input) {
    request.fields.emplace_back("Accept", session_->accept());
    const auto describes_body = [](const auto& field) { return lrt::detail::iequals_ascii(field.first, "Content-Type"); };
    request.fields.erase(std::remove_if(request.fields.begin(), request.fields.end(), describes_body), request.fields.end());
  }
  const Result<Response> response = input ? send_graph(*session_, request, *input) : session_->http().send(request);
  if (!response) return unexpected(response.error());
  return invoked(*response, request.method, uses_own_terms((*found)->graph));
}

/// A stop of an lrt server is a POST to its URL without a body. Nothing is read before it: that could be what a link delays.
Result<Invocation> Action::stop(const InvokeOptions& options) const {
  Request request{"POST", url_, {{"Accept", session_->accept()}}, {}, milliseconds(0)};
  if (options.async) request.fields.emplace_back("Prefer", "respond-async");
  request.fields.insert(request.fields.end(), options.fields.begin(), options.fields.end());
  const Result<Response> response = session_->http().send(request);
  if (!response) return unexpected(response.error());
  return invoked(*response, request.method, true);
}

/// What a response says of the invocation.
Result<Invocation> Action::invoked(const Response& response, const std::string& method, bool states_status) const {
  session_->forget(url_);
  if (!response.ok()) return unexpected(error_of(response, method, response.url));
  Invocation invocation;
  invocation.session_ = session_;
  if (const auto location = response.fields.find("Location")) {
    Result<std::string> url = iri::resolve(response.url, *location);
    if (url && same_origin(*url, url_)) invocation.url_ = *std::move(url);
  }
  if (response.status == 200 && !response.body.empty()) {
    if (Result<RepresentationPtr> read = read_representation(response, session_->options())) invocation.ended_.representation = *std::move(read);
  }
  if (response.status != 202) invocation.ended_.status = Invocation::Status::succeeded;
  invocation.states_status_ = states_status;
  return invocation;
}

// --- Invocation ---

Result<Invocation::State> Invocation::state() const {
  if (url_.empty()) return ended_;
  Result<RepresentationPtr> found = session_->get(url_);
  if (!found) {
    const Errc code = found.error().code;
    const bool has_no_document = code == Errc::unknown_path || code == Errc::unsupported_syntax || code == Errc::refused;
    if (has_no_document && !states_status_ && has_ended(ended_.status)) return ended_;
    return unexpected(std::move(found).error());
  }
  State state;
  state.status = status_of(**found);
  if (state.status == Status::unknown) state.status = ended_.status;  // R0.7, R0.8 ask for no status: then the response has said how it ended
  if (const auto progress = literal_of(**found, vocab::lrt_::progress)) {
    if (const std::optional<double> number = rdf::lexical::parse_double(progress->text)) state.progress = std::clamp(*number, 0.0, 1.0);
  }
  if (const auto error = literal_of(**found, vocab::lrt_::error)) state.error = error->text;
  state.representation = *std::move(found);
  return state;
}

Result<Invocation::State> Invocation::wait(milliseconds at_most, const std::function<void(const State&)>& on_progress) const {
  const auto end = std::chrono::steady_clock::now() + at_most;
  milliseconds pause{10};
  std::optional<State> last;
  while (true) {
    Result<State> now = state();
    if (!now) return now;
    if (on_progress && (!last || last->status != now->status || last->progress != now->progress)) on_progress(*now);
    if (has_ended(now->status) || now->status == Status::unknown || url_.empty()) return now;
    last = *now;
    const auto rest = std::chrono::duration_cast<milliseconds>(end - std::chrono::steady_clock::now());
    if (rest.count() <= 0) return unexpected(Errc::timed_out, "\"" + url_ + "\" is still " + std::string(to_string(now->status)));
    pollfd stop{session_->http().stop_descriptor(), POLLIN, 0};
    if (::poll(&stop, 1, static_cast<int>(std::min(pause, rest).count())) > 0) return unexpected(Errc::cancelled, "the client stops");
    pause = std::min(pause + pause / 2, milliseconds(250));
  }
}

Result<void> Invocation::cancel() const {
  if (url_.empty()) return unexpected(Errc::unknown_path, "the invocation has ended and has no resource");
  const Result<Response> response = session_->change({"DELETE", url_, {}, {}, std::chrono::milliseconds(0)});
  if (!response) return unexpected(response.error());
  return {};
}

Result<Invocation::ResultNode> Invocation::result_node() const {
  Result<State> found = state();
  if (!found) return unexpected(std::move(found).error());
  RepresentationPtr representation = found->representation ? found->representation : ended_.representation;
  if (!representation) return unexpected(Errc::expected_value, "the action has given no result");
  if (!representation->focus) return no_node(representation->url);
  const Graph& graph = representation->graph;
  TermId node = *representation->focus;
  if (const std::optional<TermId> predicate = graph.find(vocab::lrt_::result)) {
    if (const std::optional<TermId> object = graph.object(node, *predicate)) node = *object;
  } else if (!url_.empty()) {
    return unexpected(Errc::expected_value, "\"" + url_ + "\" has no result");
  }
  return ResultNode{std::move(representation), node};
}

Result<rdf::Value> Invocation::result(const rdf::Type& type, const lrt::Unit& unit) const {
  const Result<ResultNode> found = result_node();
  if (!found) return unexpected(found.error());
  return value_at(found->representation->graph, found->node, type, unit);
}

// --- Thing ---

std::string Thing::name() const { return names_.titles.empty() ? short_name(url(), names_) : names_.titles.front(); }

bool Thing::is(Iri type) const {
  const std::vector<std::string> all = types();
  return std::find(all.begin(), all.end(), type.text) != all.end();
}

Result<Property> Thing::property(std::string_view name) const { return find_named(properties_, name, "property", "\"" + this->name() + "\""); }
Result<Action> Thing::action(std::string_view name) const { return find_named(actions_, name, "action", "\"" + this->name() + "\""); }

const RepresentationPtr& Thing::representation() const {
  const std::lock_guard lock(document_->mutex);
  if (!document_->read) {
    if (Result<RepresentationPtr> found = session_->described(url_)) {
      document_->read = *std::move(found);
    } else {
      auto none = std::make_shared<Representation>();
      none->url = url_;
      document_->read = std::move(none);
    }
  }
  return document_->read;
}

// --- Robot ---

std::vector<Thing> Robot::things(Iri type) const {
  std::vector<Thing> result;
  std::copy_if(things_->begin(), things_->end(), std::back_inserter(result), [&](const Thing& thing) { return thing.is(type); });
  return result;
}

Result<Thing> Robot::thing(std::string_view name) const { return find_named(*things_, name, "Thing", "\"" + url_ + "\""); }

namespace {

/// "right_s1/friction": a name of the Thing and one of its part; or the end of the part's URL; or a name that only one part has.
template <class T>
Result<T> find_part(const std::vector<Thing>& things, const std::vector<T>& (Thing::*parts)() const, std::string_view name, const char* kind,
                    const std::string& where) {
  std::vector<T> all;
  const std::size_t slash = name.rfind('/');
  const bool is_iri = name.find("://") != std::string_view::npos;
  const Thing* owner = nullptr;  // the only Thing with the first name
  if (!is_iri && slash != std::string_view::npos) {
    for (const Thing& thing : things) {
      if (fits(thing.url(), thing.names(), name.substr(0, slash)) == 0) continue;
      owner = owner ? nullptr : &thing;
      for (const T& part : (thing.*parts)())
        if (fits(part.url(), part.names(), name.substr(slash + 1)) > 0) all.push_back(part);
    }
    if (all.size() == 1) return all.front();
    all.clear();
  }
  for (const Thing& thing : things) all.insert(all.end(), (thing.*parts)().begin(), (thing.*parts)().end());
  Result<T> found = find_named(all, name, kind, where);
  if (!found && found.error().code == Errc::unknown_path && owner)  // lists the parts of that Thing
    return find_named((owner->*parts)(), name.substr(slash + 1), kind, "\"" + owner->name() + "\"");
  return found;
}

}  // namespace

Result<Property> Robot::property(std::string_view name) const {
  return find_part(*things_, &Thing::properties, name, "property", "\"" + url_ + "\"");
}
Result<Action> Robot::action(std::string_view name) const { return find_part(*things_, &Thing::actions, name, "action", "\"" + url_ + "\""); }

Result<std::vector<Action>> Robot::actions(const ActionQuery& query) const {
  std::vector<Action> result;
  const auto has = [](const std::vector<std::string>& all, std::string_view one) { return std::find(all.begin(), all.end(), one) != all.end(); };
  for (const Thing& thing : *things_) {
    if (!query.thing.empty() && thing.url() != query.thing) continue;
    for (const Action& action : thing.actions()) {
      if (!query.consumes.empty()) {
        const Result<std::vector<std::string>> classes = action.consumed_classes();
        if (!classes) return unexpected(classes.error());
        if (!has(*classes, query.consumes.text)) continue;
      }
      if (!query.produces.empty()) {
        const Result<std::vector<std::string>> classes = action.produced_classes();
        if (!classes) return unexpected(classes.error());
        if (!has(*classes, query.produces.text)) continue;
      }
      if (!query.affects.empty()) {
        const Result<std::vector<std::string>> effects = action.effects();
        if (!effects) return unexpected(effects.error());
        const auto is_meant = [&](const std::string& url) {
          if (url == query.affects) return true;
          for (const Thing& owner : *things_)
            for (const Property& property : owner.properties())
              if (property.url() == url && has(property.names().predicates, query.affects)) return true;
          return false;
        };
        if (std::none_of(effects->begin(), effects->end(), is_meant)) continue;
      }
      result.push_back(action);
    }
  }
  return result;
}

Result<Robot> Robot::refresh() const { return session_->open(url_); }

}  // namespace v0
}  // namespace lrt::client
