#include <algorithm>

#include <lrt/rdf/lexical.hpp>

#include "src/engine/about.hpp"
#include "src/engine/impl.hpp"
#include "src/engine/terms.hpp"

namespace lrt::engine {

namespace {

using rdf::Graph;
using rdf::TermId;

void add_classes(About& about, const std::vector<std::string>& classes) {
  for (const std::string& c : classes) about.a(Iri(std::string_view(c)));
}

void value_classes(About& about, const rdf::Type& type) {
  if (type.kind == rdf::Type::Kind::optional) return value_classes(about, *type.element);
  if (type.kind == rdf::Type::Kind::record) add_classes(about, type.classes);
  else if (type.is_number()) about.a(vocab::maths::Scalar);
}

}  // namespace

/// Adds a kept graph with the placeholder replaced by the base.
Iri status_iri(Status status) {
  switch (status) {
    case Status::pending: return vocab::lrt::pending;
    case Status::running: return vocab::lrt::running;
    case Status::succeeded: return vocab::lrt::succeeded;
    case Status::failed: return vocab::lrt::failed;
    case Status::cancelled: return vocab::lrt::cancelled;
  }
  return {};
}

void add_placed(Graph& graph, const Graph& kept, const std::string& base) {
  std::map<TermId, TermId> blanks;  // its blank nodes are nobody else's
  const auto placed = [&](TermId id) {
    const rdf::TermView term = kept.term(id);
    if (term.is_blank()) {
      const auto known = blanks.find(id);
      return known != blanks.end() ? known->second : blanks.emplace(id, graph.fresh_blank()).first->second;
    }
    if (!term.is_iri() || term.text.substr(0, placeholder_base.size()) != placeholder_base) return graph.intern(term);
    return graph.intern(rdf::iri(base + std::string(term.text.substr(placeholder_base.size()))));
  };
  for (const rdf::Triple& t : kept.triples()) {
    const TermId s = placed(t.subject), p = placed(t.predicate), o = placed(t.object);
    graph.add(s, p, o);
  }
}

bool is_container(const Resource& resource) noexcept {
  return resource.kind == Kind::root || resource.kind == Kind::subscriptions || resource.kind == Kind::collection;
}

std::vector<Resource*> Engine::Impl::members_of(Resource& container) const {
  std::vector<Resource*> members;
  if (container.kind == Kind::root)
    for (ThingNode* thing : roots_) members.push_back(&thing->self);
  if (container.kind == Kind::collection)
    for (const auto& m : static_cast<CollectionResource&>(container).members) members.push_back(m.get());
  if (container.kind == Kind::subscriptions)
    for (const auto& s : container.thing->members) members.push_back(s.get());
  return members;
}

std::string Engine::Impl::blueprint_iri(const ThingNode& thing, const std::string& base) const {
  return thing.spec->blueprint.empty() ? base + thing.blueprint.path : thing.spec->blueprint;
}

std::string Engine::Impl::context_iri(const std::string& base) const { return base + context_.path + "?v=" + context_version_; }

TermId Engine::Impl::object_term(Graph& graph, const Object& o, const std::string& base) {
  switch (o.kind()) {
    case Object::Kind::iri: return graph.intern(rdf::iri(o.text()));
    case Object::Kind::resource: return graph.intern(rdf::iri(base + "/" + model::encode_path(o.text()).value_or(std::string())));
    case Object::Kind::literal: break;
  }
  if (!o.language().empty()) return graph.intern(rdf::tagged_literal(o.text(), o.language()));
  return graph.intern(o.datatype().empty() ? rdf::literal(o.text()) : rdf::literal(o.text(), Iri(std::string_view(o.datatype()))));
}

void Engine::Impl::add_statements(Graph& graph, TermId subject, const std::vector<Statement>& statements, const std::string& base) {
  for (const Statement& s : statements) {
    const TermId predicate = graph.intern(rdf::iri(s.predicate)), object = object_term(graph, s.object, base);
    graph.add(subject, predicate, object);
  }
}

/// The types of a resource, said where it is linked to (SPEC 2).
void Engine::Impl::describe_type(Graph& graph, Resource& resource, TermId subject) {
  About about(graph, subject);
  switch (resource.kind) {
    case Kind::thing:
      about.a(vocab::hybrit::RoboticThing);
      add_classes(about, resource.thing->spec->classes);
      break;
    case Kind::property: {
      const auto& p = static_cast<PropertyResource&>(resource);
      about.a(vocab::hybrit::Property);
      value_classes(about, *p.spec->type);
      add_classes(about, p.spec->classes);
      break;
    }
    case Kind::action: {
      const auto& a = static_cast<ActionResource&>(resource);
      about.a(vocab::hybrit::Action);
      if (a.spec->asynchronous) about.a(vocab::hybrit::AsynchronousAction);
      add_classes(about, a.spec->classes);
      break;
    }
    case Kind::invocation: about.a(vocab::lrt::Invocation).a(vocab::prov::Activity); break;
    case Kind::subscription:
      about.a(vocab::hybrit::Subscription)
          .a(static_cast<SubscriptionResource&>(resource).protocol == Protocol::callback ? vocab::hybrit::WebCallback
                                                                                        : vocab::hybrit::WebSocket);
      break;
    case Kind::root:
    case Kind::subscriptions:
    case Kind::collection: about.a(vocab::ldp::BasicContainer).a(vocab::ldp::Container).a(vocab::ldp::RDFSource); break;
    case Kind::member: {
      const auto& m = static_cast<MemberResource&>(resource);
      about.a(vocab::ldp::RDFSource);
      value_classes(about, *m.collection->spec->type);
      break;
    }
    default: break;
  }
}

void Engine::Impl::describe(Graph& graph, Resource& resource, const std::string& base, std::size_t page) {
  switch (resource.kind) {
    case Kind::root: return describe_container(graph, resource, base, page);
    case Kind::terms: {
      rdf::ReadOptions options;
      options.base = vocab::lrt::state.text.substr(0, vocab::lrt::state.text.find('#'));
      if (Result<Graph> terms = rdf::read(term_list(), rdf::Syntax::turtle, options)) graph.merge(*terms);
      return;
    }
    case Kind::context: return;
    case Kind::thing: return describe_thing(graph, *resource.thing, base);
    case Kind::state:
      describe_thing(graph, *resource.thing, base);
      for (const auto& p : resource.thing->properties) describe_property(graph, *p, base);
      return;
    case Kind::blueprint: return describe_blueprint(graph, *resource.thing, base);
    case Kind::subscriptions:
    case Kind::collection: return describe_container(graph, resource, base, page);
    case Kind::property: return describe_property(graph, static_cast<PropertyResource&>(resource), base);
    case Kind::action: return describe_action(graph, static_cast<ActionResource&>(resource), base);
    case Kind::invocation: return describe_invocation(graph, static_cast<InvocationResource&>(resource), base);
    case Kind::subscription: return describe_subscription(graph, static_cast<SubscriptionResource&>(resource), base);
    case Kind::member: {
      const auto& m = static_cast<MemberResource&>(resource);
      const TermId self = graph.intern(rdf::iri(base + m.path));
      describe_type(graph, resource, self);
      rdf::write_value(graph, self, *m.collection->spec->type, m.collection->spec->facets, m.value, names_base(*m.thing, base));
      return;
    }
  }
}

void Engine::Impl::describe_container(Graph& graph, Resource& container, const std::string& base, std::size_t page) {
  About about(graph, base + container.path);
  describe_type(graph, container, about.subject());
  if (container.kind == Kind::root) {
    about.add(vocab::dcterms::title, rdf::literal("Robotic Things"));
    about.link(vocab::rdfs::seeAlso, base + terms_.path);
  } else {
    about.link(vocab::rdfs::seeAlso, base + container.thing->self.path);
  }
  if (container.kind == Kind::collection)
    add_statements(graph, about.subject(), static_cast<CollectionResource&>(container).spec->statements, base);
  if (page == minimal_page) return;
  const std::vector<Resource*> members = members_of(container);
  const std::size_t first = std::min(members.size(), (page - 1) * options_.page_members);
  const std::size_t last = std::min(members.size(), first + options_.page_members);
  for (std::size_t i = first; i < last; ++i) about.link(vocab::ldp::contains, base + members[i]->path);
  for (std::size_t i = first; i < last; ++i) describe_type(graph, *members[i], graph.intern(rdf::iri(base + members[i]->path)));
}

void Engine::Impl::describe_thing(Graph& graph, ThingNode& thing, const std::string& base) {
  const model::ThingSpec& spec = *thing.spec;
  About about(graph, base + thing.self.path);
  describe_type(graph, thing.self, about.subject());
  about.add(vocab::dcterms::title, rdf::literal(spec.title));
  about.link(vocab::hybrit::blueprint, blueprint_iri(thing, base));
  about.link(vocab::hybrit::subscriptions, base + thing.subscriptions.path);  // R1.8
  about.link(vocab::lrt::state, base + thing.state.path);
  if (thing.parent) about.link(vocab::dcterms::isPartOf, base + thing.parent->self.path);
  for (const auto& a : thing.actions) about.link(vocab::hybrit::action, base + a->path);        // R1.10
  for (const auto& p : thing.properties) about.link(vocab::hybrit::property, base + p->path);  // R1.9
  for (const auto& c : thing.collections) about.link(vocab::lrt::collection, base + c->path);
  for (const ThingNode* child : thing.children) about.link(vocab::dcterms::hasPart, base + child->self.path);
  const auto domain = [&](const auto& resources) {
    for (const auto& r : resources)
      for (const std::string& predicate : r->spec->predicates) about.link(Iri(std::string_view(predicate)), base + r->path);
  };
  domain(thing.actions);
  domain(thing.properties);
  domain(thing.collections);
  add_statements(graph, about.subject(), spec.statements, base);

  add_placed(graph, thing.statements, base);

  // The types of what it links to.
  const auto type_of = [&](Resource& r) { describe_type(graph, r, graph.intern(rdf::iri(base + r.path))); };
  for (const auto& a : thing.actions) type_of(*a);
  for (const auto& p : thing.properties) type_of(*p);
  for (const auto& c : thing.collections) type_of(*c);
  for (ThingNode* child : thing.children) type_of(child->self);
  for (const Statement& s : spec.statements) {
    if (s.object.kind() != Object::Kind::resource) continue;
    const Result<std::string> path = model::encode_path(s.object.text());
    if (Resource* linked = path ? find("/" + *path) : nullptr) type_of(*linked);
  }
}

void Engine::Impl::describe_property(Graph& graph, PropertyResource& property, const std::string& base) {
  About about(graph, base + property.path);
  describe_type(graph, property, about.subject());
  about.link(vocab::rdfs::seeAlso, base + property.thing->self.path);
  if (!property.value.is_null() && !property.only_octets)
    rdf::write_value(graph, about.subject(), *property.spec->type, property.spec->facets, property.value,
                     names_base(*property.thing, base));
  about.when(vocab::dcterms::modified, property.modified);
  if (property.spec->frame) about.add(vocab::lrt::frame, object_term(graph, *property.spec->frame, base));
  add_statements(graph, about.subject(), property.spec->statements, base);
  describe_formats(about, property, base);
}

/// The paper's D5: binary and semantic data together. What formats there are of the present value, their sizes, and how numbers lie in them.
void Engine::Impl::describe_formats(About& about, PropertyResource& property, const std::string& base) {
  Graph& graph = about.graph();
  const auto add = [&](const std::string& type, std::size_t bytes, const Layout& layout, Iri element_type) {
    const std::string iri = format_iri(base + property.path, type);
    about.link(vocab::dcterms::hasFormat, iri);
    About format(graph, iri);
    const auto count = [&](std::size_t n) { return graph.intern(rdf::literal(std::to_string(n), vocab::xsd::nonNegativeInteger)); };
    format.a(vocab::dcat::Distribution).add(vocab::dcterms::format, rdf::literal(type));
    format.link(vocab::dcat::mediaType, "https://www.iana.org/assignments/media-types/" + escaped(type.substr(0, type.find(';'))));
    format.add(vocab::dcat::byteSize, count(bytes));
    if (element_type.empty()) return;
    std::vector<TermId> shape;
    for (const std::size_t n : layout.shape) shape.push_back(count(n));
    format.add(vocab::lrt::elementType, rdf::TermView(element_type)).add(vocab::lrt::shape, graph.add_list(shape));
    format.add(vocab::lrt::byteOrder, rdf::TermView(layout.byte_order == Layout::ByteOrder::little_endian ? vocab::lrt::littleEndian
                                                                                                          : vocab::lrt::bigEndian));
    const Unit& unit = layout.unit.empty() ? property.spec->facets.unit() : layout.unit;
    if (!unit.vom.empty()) format.add(vocab::vom::unit, rdf::TermView(unit.vom));
    if (!unit.qudt.empty()) format.add(vocab::qudt::unit, rdf::TermView(unit.qudt));
    if (property.spec->frame) format.add(vocab::lrt::frame, object_term(graph, *property.spec->frame, base));
  };
  for (std::size_t i = 0; i < property.spec->representations.size(); ++i) {
    const model::RepresentationSpec& spec = property.spec->representations[i];
    const Result<Bytes>& bytes = encoded(property, i);
    if (bytes) add(spec.media_type, (*bytes)->size(), spec.layout, Iri(std::string_view(spec.element_type)));
  }
  if (!property.spec->octets) return;
  if (const auto octets = rdf::octets_of(*property.spec->type, property.value)) {
    const Layout layout{octets->datatype, octets->shape, Layout::ByteOrder::little_endian, {}};
    add(std::string(rdf::media_type(rdf::Plain::octets)), octets->size(), layout, layout.element_type);
  }
}

void Engine::Impl::describe_action(Graph& graph, ActionResource& action, const std::string& base) {
  About about(graph, base + action.path);
  describe_type(graph, action, about.subject());
  about.link(vocab::rdfs::seeAlso, base + action.thing->self.path);
  const std::string shape = names_base(*action.thing, base) + "#actions/" + action.spec->path;
  if (action.spec->input) about.link(vocab::hybrit::consumes, shape + "/input");
  if (action.spec->output) about.link(vocab::hybrit::produces, shape + "/output");
  const TermId binding = graph.fresh_blank();
  about.add(vocab::hybrit::binding, binding);
  About request(graph, binding);
  request.a(vocab::http_core::Request)
      .add(vocab::http_core::mthd, rdf::TermView(vocab::http_methods::POST))
      .link(vocab::http_core::requestURI, base + action.path);
  if (action.spec->input) {
    const TermId body = graph.fresh_blank();
    request.add(vocab::http_core::body, body);
    About(graph, body).link(vocab::dcterms::conformsTo, shape + "/input");
  }
  constexpr std::string_view names[] = {"preempt", "queue", "reject", "parallel"};
  about.add(vocab::lrt::policy, rdf::literal(names[static_cast<std::size_t>(action.spec->policy.kind)]));
  add_statements(graph, about.subject(), action.spec->statements, base);
  for (const auto& i : action.invocations) about.link(vocab::lrt::invocation, base + i->path);
  const auto describe_one = [&](const char* which, const rdf::Type* type, const rdf::Facets& facets) {
    if (type) describe_shape(graph, *action.thing, base, "actions/" + action.spec->path + which, *type, facets);
  };
  describe_one("/input", action.spec->input, action.spec->input_facets);
  describe_one("/output", action.spec->output, action.spec->output_facets);
}

void Engine::Impl::describe_invocation(Graph& graph, InvocationResource& invocation, const std::string& base) {
  About about(graph, base + invocation.path);
  const ActionResource& action = *invocation.action;
  const std::string names = names_base(*invocation.thing, base);
  describe_type(graph, invocation, about.subject());
  about.link(vocab::rdfs::seeAlso, base + action.path);
  about.add(vocab::lrt::status, rdf::TermView(status_iri(invocation.status)));
  about.add(vocab::lrt::progress, rdf::literal(rdf::lexical::format(invocation.progress), vocab::xsd::double_));
  about.when(vocab::dcterms::created, invocation.created);
  about.when(vocab::prov::startedAtTime, invocation.started);
  about.when(vocab::prov::endedAtTime, invocation.ended);
  const auto part = [&](Iri predicate, const char* fragment, const rdf::Type& type, const rdf::Facets& facets, const rdf::Value& value) {
    const TermId node = graph.intern(rdf::iri(base + invocation.path + fragment));
    about.add(predicate, node);
    rdf::write_value(graph, node, type, facets, value, names);
  };
  if (action.spec->input && !invocation.input.is_null())
    part(vocab::lrt::input, "#input", *action.spec->input, action.spec->input_facets, invocation.input);
  if (invocation.status == Status::failed) about.add(vocab::lrt::error, rdf::literal(invocation.result.error().message));
  if (invocation.status == Status::succeeded && action.spec->output && !invocation.result->is_null())
    part(vocab::lrt::result, "#result", *action.spec->output, action.spec->output_facets, *invocation.result);
}

/// Figure 4, with our policy terms and counters (SPEC 3.5).
void Engine::Impl::describe_subscription(Graph& graph, SubscriptionResource& s, const std::string& base) {
  About about(graph, base + s.path);
  const subscription::Policy& policy = s.backlog.policy();
  describe_type(graph, s, about.subject());
  about.link(vocab::hybrit::onResource, bases_[s.base] + s.observed.path);
  if (s.protocol == Protocol::callback) about.add(vocab::hybrit::callbackURL, rdf::literal(s.url, vocab::xsd::anyURI));
  about.add(vocab::hybrit::mediaType, rdf::literal(offers_of(s.observed).type_of(s.form)));
  about.add(vocab::dcterms::identifier, rdf::literal(s.id));
  about.when(vocab::dcterms::created, s.created);
  about.add(vocab::lrt::delivery, rdf::TermView(policy.queues() ? vocab::lrt::queue : vocab::lrt::latest));
  const auto count = [&](Iri predicate, std::uint64_t n) {
    about.add(predicate, rdf::literal(std::to_string(n), vocab::xsd::integer));
  };
  if (policy.queues()) count(vocab::lrt::queueLength, policy.queue_length);
  if (policy.minimum_interval.count() > 0) {
    const double seconds = std::chrono::duration<double>(policy.minimum_interval).count();
    about.add(vocab::lrt::minimumInterval, rdf::literal(rdf::lexical::format(seconds), vocab::xsd::double_));
  }
  count(vocab::lrt::delivered, s.delivered);
  count(vocab::lrt::dropped, s.backlog.dropped());
  if (!s.last_error.empty()) about.add(vocab::lrt::lastError, rdf::literal(s.last_error));
  if (s.retry_policy.suspended()) about.add(vocab::lrt::suspended, rdf::literal("true", vocab::xsd::boolean));
}

/// RFC 8288 links of a resource: R0.9, LDP 4.2.1.4, 5.2.1.4.
void Engine::Impl::add_links(http::Fields& fields, Resource& resource, const std::string& base, std::size_t page) {
  http::LinkWriter links(options_.link_bytes);
  links.add(vocab::ldp::Resource.text, "type");
  if (resource.kind != Kind::terms && resource.kind != Kind::context) links.add(vocab::ldp::RDFSource.text, "type");
  if (is_container(resource)) {
    links.add(vocab::ldp::Container.text, "type");
    links.add(vocab::ldp::BasicContainer.text, "type");
  }
  if (resource.thing) {
    const ThingNode& thing = *resource.thing;
    const std::string blueprint = blueprint_iri(thing, base);
    std::string up = thing.self.path;
    if (resource.kind == Kind::thing) up = thing.parent ? thing.parent->self.path : root_.path;
    if (resource.kind == Kind::invocation) up = static_cast<InvocationResource&>(resource).action->path;
    if (resource.kind == Kind::subscription) up = thing.subscriptions.path;
    if (resource.kind == Kind::member) up = static_cast<MemberResource&>(resource).collection->path;
    links.add(base + up, "up");
    if (resource.kind != Kind::blueprint) links.add(blueprint, "describedby");
    const std::string methods = allow(resource);
    if (methods.find("PUT") != std::string::npos || methods.find("POST") != std::string::npos)
      links.add(names_base(thing, base), vocab::ldp::constrainedBy.text);
  } else if (resource.kind == Kind::root) {
    links.add(base + terms_.path, "describedby");
  }
  if (is_container(resource)) {
    if (page == minimal_page) return links.finish(fields, base + resource.path, "describedby");
    const std::vector<Resource*> members = members_of(resource);
    const std::size_t pages = std::max<std::size_t>(1, (members.size() + options_.page_members - 1) / options_.page_members);
    if (pages > 1) {
      const auto page_iri = [&](std::size_t n) { return base + resource.path + "?page=" + std::to_string(n); };
      links.add(page_iri(1), "first");
      links.add(page_iri(pages), "last");
      if (page > 1) links.add(page_iri(page - 1), "prev");
      if (page < pages) links.add(page_iri(page + 1), "next");
    }
    const std::size_t first = std::min(members.size(), (page - 1) * options_.page_members);
    const std::size_t last = std::min(members.size(), first + options_.page_members);
    for (std::size_t i = first; i < last; ++i) links.add(base + members[i]->path, "related");
  } else if (resource.kind == Kind::thing || resource.kind == Kind::state) {
    const ThingNode& thing = *resource.thing;
    if (resource.kind == Kind::thing) {
      links.add(base + thing.state.path, "related");
      links.add(base + thing.blueprint.path, "related");
      links.add(base + thing.subscriptions.path, "related");
      for (const auto& a : thing.actions) links.add(base + a->path, "related");
    }
    for (const auto& p : thing.properties) links.add(base + p->path, "related");
    if (resource.kind == Kind::thing) {
      for (const auto& c : thing.collections) links.add(base + c->path, "related");
      for (const ThingNode* child : thing.children) links.add(base + child->self.path, "related");
    }
  } else if (resource.kind == Kind::action) {
    for (const auto& i : static_cast<ActionResource&>(resource).invocations) links.add(base + i->path, "related");
  }
  const Offers& offers = offers_of(resource);
  for (std::size_t i = 0; i < offers.types.size(); ++i)
    if (!offers.forms[i].is_variant() && resource.kind != Kind::context)
      links.add(format_iri(base + resource.path, offers.types[i], page), "alternate", offers.types[i]);
  links.finish(fields, base + resource.path, "describedby");
}

}  // namespace lrt::engine
