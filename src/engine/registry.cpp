#include <algorithm>

#include <lrt/base/iri.hpp>
#include <lrt/base/media_type.hpp>
#include <lrt/base/utf8.hpp>
#include <lrt/http/etag.hpp>
#include <lrt/rdf/lexical.hpp>

#include "src/engine/impl.hpp"

namespace lrt::engine {

namespace {
std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return out;
}
/// Reads documents about a resource into one graph, with the placeholder as base. Blank nodes of two documents are two nodes even if
/// both are called b0.
Result<void> read_documents(rdf::Graph& all, const std::vector<std::string>& documents, const std::string& path, const char* what) {
  const std::string base = std::string(placeholder_base) + path;
  rdf::ReadOptions options;
  options.base = base;
  for (const std::string& text : documents) {
    Result<rdf::Graph> graph = rdf::read(text, rdf::Syntax::turtle, options);
    if (!graph) {
      Error error = std::move(graph).error();
      error.message = "thing \"" + path + "\", " + what + ": " + error.message;
      return Unexpected{std::move(error)};
    }
    std::map<rdf::TermId, rdf::TermId> renamed;
    const auto import = [&](rdf::TermId id) {
      const rdf::TermView term = graph->term(id);
      if (!term.is_blank()) return all.intern(term);
      const auto known = renamed.find(id);
      return known != renamed.end() ? known->second : renamed.emplace(id, all.fresh_blank()).first->second;
    };
    for (const rdf::Triple& triple : graph->triples()) {
      const rdf::TermId s = import(triple.subject), p = import(triple.predicate), o = import(triple.object);
      all.add(s, p, o);
    }
  }
  return {};
}

/// Each media type once, as clients ask for it; numbers where octets are wanted.
Result<void> check_formats(model::PropertySpec& property, const std::string& name) {
  if (property.octets && !rdf::octets_of(*property.type))
    return unexpected(Errc::invalid_option, name + ": octets() needs a number or lists of numbers");
  if (property.representations.size() > 100) return unexpected(Errc::limit_exceeded, name + ": more than 100 representations");
  std::vector<std::string> taken;
  for (const std::string_view type : offers_of_values().with_page) taken.emplace_back(type.substr(0, type.find(';')));
  if (property.octets) taken.emplace_back(rdf::media_type(rdf::Plain::octets));
  const auto is_taken = [&](const std::string& type) { return std::find(taken.begin(), taken.end(), type) != taken.end(); };
  for (model::RepresentationSpec& r : property.representations) {
    const Result<MediaType> type = MediaType::parse(r.media_type);
    if (!type || type->type == "*" || type->subtype == "*")
      return unexpected(Errc::expected_media_type, name + ": expected a media type, found \"" + r.media_type + "\"");
    r.media_type = type->to_string();
    if (is_taken(type->essence()) || is_taken(r.media_type)) return unexpected(Errc::duplicate_path, name + ": there is " + r.media_type + " of it already");
    taken.push_back(r.media_type);
    if (!r.element_type.empty() && !iri::is_absolute(r.element_type))
      return unexpected(Errc::expected_iri, name + ": expected an absolute IRI as element type");
  }
  return {};
}

/// Another one for another text, as a word for a query.
std::string version_of(const std::string& text) {
  std::string version = http::entity_tag({}, text);
  version.erase(std::remove_if(version.begin(), version.end(), [](char c) { return c == '"'; }), version.end());
  return iri::encode_segment(version);
}

}  // namespace

Engine::Impl::Impl(Options options)
    : options_(std::move(options)),
      clock_(options_.clock ? *options_.clock : system_clock()),
      context_text_(rdf::json_ld_context(options_.prefixes)),
      context_version_(version_of(context_text_)),
      allowed_(subscription::AllowedHosts::parse(options_.subscriptions.callbacks.allow)) {
  if (!options_.ids) options_.ids = std::make_shared<RandomIds>();
  while (!options_.public_base.empty() && options_.public_base.back() == '/') options_.public_base.pop_back();
  take_path(root_);
  take_path(terms_);
  take_path(context_);
  listens_on("127.0.0.1", 80, false);
}

Engine::Impl::~Impl() {
  things_.clear();  // before what their subscriptions count in
}

void Engine::Impl::listens_on(std::string_view address, std::uint16_t port, bool secure) {
  const std::uint16_t default_port = secure ? 443 : 80;
  const std::string suffix = ":" + std::to_string(port);
  const std::string numeric = address.find(':') == std::string_view::npos ? std::string(address) : "[" + std::string(address) + "]";
  port_ = port;
  hosts_.clear();
  const auto accept = [&](std::string host) {
    const std::string default_suffix = ":" + std::to_string(default_port);
    if (host.size() > default_suffix.size() &&
        host.compare(host.size() - default_suffix.size(), std::string::npos, default_suffix) == 0)
      host.resize(host.size() - default_suffix.size());
    if (std::find(hosts_.begin(), hosts_.end(), host) == hosts_.end()) hosts_.push_back(std::move(host));
  };
  accept(lower(numeric) + suffix);
  accept("localhost" + suffix);
  accept("127.0.0.1" + suffix);
  accept("[::1]" + suffix);
  for (const std::string& named : options_.allowed_hosts) {
    const auto parsed = http::parse_host(named);
    accept(lower(named) + (parsed && !parsed->port ? suffix : ""));
  }
  for (const Rendering& kept : renderings_) kept.resource->renderings.clear();  // they are of the bases that were
  renderings_.clear();
  rendered_bytes_ = 0;
  for (const auto& [path, resource] : by_path_) forget_renderings(*resource);
  for (const auto& [path, thing] : things_) thing->door.clear();
  bases_.clear();
  answered_.clear();
  intern_base(options_.public_base.empty() ? (secure ? "https://" : "http://") + hosts_.front() : options_.public_base, true);
}

bool Engine::Impl::take_path(Resource& resource) { return by_path_.emplace(resource.path, &resource).second; }

void Engine::Impl::drop_path(Resource& resource) {
  end_observers(resource);
  forget_renderings(resource);
  const auto found = by_path_.find(resource.path);
  if (found != by_path_.end() && found->second == &resource) by_path_.erase(found);
}

Resource* Engine::Impl::find(std::string_view path) const {
  const auto found = by_path_.find(path);
  return found == by_path_.end() ? nullptr : found->second;
}

/// Takes a thing in, or nothing of it.
Result<void> Engine::Impl::insert(Thing thing, std::vector<ThingNode*>& added) {
  std::unique_ptr<model::ThingSpec> spec = std::move(thing).release();
  if (!spec) return unexpected(Errc::closed, "the thing was given away already");
  if (spec->first_error) return Unexpected{*spec->first_error};

  // What could turn out to be no IRI when it is written is refused here, once.
  const auto check_iris = [&](const std::vector<std::string>& iris, const char* what) -> Result<void> {
    for (const std::string& text : iris)
      if (!iri::is_absolute(text))
        return unexpected(Errc::expected_iri, "thing \"" + spec->path + "\": expected an absolute IRI as " + what + ", found \"" + text + "\"");
    return {};
  };
  const auto check_text = [&](const std::string& text) -> Result<void> {
    if (utf8::find_invalid(text) || text.find('\0') != std::string::npos)
      return unexpected(Errc::expected_rdf, "thing \"" + spec->path + "\": expected UTF-8 without NUL as text");
    return {};
  };
  const auto check_statements = [&](const std::vector<Statement>& statements) -> Result<void> {
    for (const Statement& s : statements) {
      if (Result<void> r = check_iris({s.predicate}, "predicate"); !r) return r;
      const Object& o = s.object;
      if (o.kind() == Object::Kind::iri) {
        if (Result<void> r = check_iris({o.text()}, "object"); !r) return r;
      } else if (o.kind() == Object::Kind::resource) {
        if (Result<std::string> r = model::encode_path(o.text()); !r) return Unexpected{std::move(r).error()};
      } else {
        if (!o.datatype().empty())
          if (Result<void> r = check_iris({o.datatype()}, "datatype"); !r) return r;
        if (!o.language().empty() && !rdf::lexical::is_well_formed(o.language(), rdf::lexical::Datatype::language))
          return unexpected(Errc::expected_rdf, "thing \"" + spec->path + "\": expected a language tag, found \"" + o.language() + "\"");
        if (Result<void> r = check_text(o.text()); !r) return r;
      }
    }
    return {};
  };
  const auto check_facets = [&](const std::string& path, const rdf::Facets& f) -> Result<void> {
    const bool empty = f.min() && f.max() && (*f.min() > *f.max() || (*f.min() == *f.max() && (f.min_exclusive() || f.max_exclusive())));
    if (empty || f.min_length() > f.max_length())
      return unexpected(Errc::invalid_option, "\"" + spec->path + "/" + path + "\": the bounds leave no value");
    return {};
  };
  const auto check_resource = [&](const model::ResourceSpec& r) -> Result<void> {
    if (Result<void> e = check_iris(r.classes, "type"); !e) return e;
    if (Result<void> e = check_iris(r.predicates, "predicate"); !e) return e;
    return check_statements(r.statements);
  };
  if (Result<void> e = check_text(spec->title); !e) return e;
  if (Result<void> e = check_iris(spec->classes, "type"); !e) return e;
  if (Result<void> e = check_statements(spec->statements); !e) return e;
  if (!spec->blueprint.empty())
    if (Result<void> e = check_iris({spec->blueprint}, "blueprint"); !e) return e;
  for (const auto& p : spec->properties) {
    if (Result<void> e = check_resource(*p); !e) return e;
    if (Result<void> e = check_facets(p->path, p->facets); !e) return e;
    if (p->frame)
      if (Result<void> e = check_statements({{std::string(vocab::lrt::frame.text), *p->frame}}); !e) return e;
    if (Result<void> e = check_formats(*p, "property \"" + spec->path + "/" + p->path + "\""); !e) return e;
  }
  for (const auto& a : spec->actions) {
    if (Result<void> e = check_resource(*a); !e) return e;
    for (const rdf::Facets* f : {&a->input_facets, &a->output_facets})
      if (Result<void> e = check_facets("actions/" + a->path, *f); !e) return e;
  }
  for (const auto& c : spec->collections) {
    if (Result<void> e = check_resource(*c); !e) return e;
    if (Result<void> e = check_facets(c->path, c->facets); !e) return e;
  }

  auto node = std::make_unique<ThingNode>(std::move(spec));
  ThingNode& t = *node;
  if (Result<void> r = read_documents(t.statements, t.spec->turtle, t.self.path, "its Turtle"); !r) return r;
  if (Result<void> r = read_documents(t.user_shapes, t.spec->shapes, t.blueprint.path, "its shapes"); !r) return r;
  for (const auto& p : t.spec->properties) {
    t.properties.push_back(std::make_unique<PropertyResource>(t.self.path + "/" + p->path, &t, p));
    if (p->octets || !p->representations.empty()) t.properties.back()->offers = std::make_unique<const Offers>(offers_of(*p));
  }
  t.state_type = state_type(*t.spec);
  for (const auto& a : t.spec->actions)
    t.actions.push_back(std::make_unique<ActionResource>(t.self.path + "/actions/" + a->path, &t, a));
  for (const auto& a : t.actions) a->invocation_type = invocation_type(*a->spec);
  for (const auto& c : t.spec->collections)
    t.collections.push_back(std::make_unique<CollectionResource>(t.self.path + "/" + c->path, &t, c));

  std::vector<Resource*> all = {&t.self, &t.state, &t.blueprint, &t.subscriptions};
  for (const auto& p : t.properties) all.push_back(p.get());
  for (const auto& a : t.actions) all.push_back(a.get());
  for (const auto& c : t.collections) all.push_back(c.get());
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (take_path(*all[i])) continue;
    for (std::size_t j = 0; j < i; ++j) drop_path(*all[j]);
    return unexpected(Errc::duplicate_path, "path \"" + all[i]->path + "\" is taken already");
  }

  if (!t.user_shapes.empty()) {
    if (const Result<const shacl::Shapes*> compiled = shapes_of(t, 0); !compiled) {
      for (Resource* r : all) drop_path(*r);
      Error error = compiled.error();
      error.message = "thing \"" + t.spec->path + "\", its shapes: " + error.message;
      return Unexpected{std::move(error)};
    }
  }

  for (const auto& p : t.spec->properties) {
    p->sealed = true;
    if (p->slot) p->slot->set_clock(clock_);
    if (p->slot) p->slot->attach(wake_signal_);
    if (p->changes) p->changes->attach(wake_signal_);
  }
  for (const auto& a : t.spec->actions) a->sealed = true;
  for (const auto& c : t.spec->collections) c->sealed = true;
  things_.emplace(t.self.path, std::move(node));
  adopt(t);
  (void)sync(t.state);  // takes what was published before
  added.push_back(&t);
  return {};
}

/// Undoes insert(). Things that were there before and are below it stay.
void Engine::Impl::withdraw(ThingNode& thing) {
  std::vector<ThingNode*>& siblings = siblings_of(thing);
  siblings.erase(std::remove(siblings.begin(), siblings.end(), &thing), siblings.end());
  for (ThingNode* child : thing.children) {
    child->parent = thing.parent;
    siblings.push_back(child);
  }
  thing.children.clear();
  drop_thing(thing);
}

Result<void> Engine::Impl::add(std::vector<Thing> things) {
  std::vector<ThingNode*> added;
  for (Thing& thing : things) {
    Result<void> inserted = insert(std::move(thing), added);
    if (inserted) continue;
    for (ThingNode* before : added) withdraw(*before);
    return inserted;
  }
  structure_changed();
  adopt_parked();
  return {};
}


/// Finds the parent of a new thing, and among its siblings the things that are below it.
void Engine::Impl::adopt(ThingNode& thing) {
  std::string_view path = thing.self.path;
  for (std::size_t slash = path.rfind('/'); slash != 0 && slash != std::string_view::npos && !thing.parent; slash = path.rfind('/')) {
    path = path.substr(0, slash);
    if (const auto found = things_.find(path); found != things_.end()) thing.parent = found->second.get();
  }
  std::vector<ThingNode*>& siblings = siblings_of(thing);
  const std::string prefix = thing.self.path + "/";
  const auto below = [&](ThingNode* other) { return other->self.path.compare(0, prefix.size(), prefix) == 0; };
  // Only look if some thing is below at all: registering many siblings stays linear.
  const auto next = things_.upper_bound(prefix);
  if (next != things_.end() && below(next->second.get())) {
    for (ThingNode* other : siblings) {
      if (!below(other)) continue;
      other->parent = &thing;
      thing.children.push_back(other);
    }
    siblings.erase(std::remove_if(siblings.begin(), siblings.end(), below), siblings.end());
  }
  siblings.push_back(&thing);
}

Result<void> Engine::Impl::remove(std::string_view path) {
  Result<std::string> encoded = model::encode_path(path);
  const auto found = encoded ? things_.find("/" + *encoded) : things_.end();
  if (found == things_.end()) return unexpected(Errc::unknown_path, "no thing at \"" + std::string(path) + "\"");
  ThingNode& thing = *found->second;
  std::vector<ThingNode*>& siblings = siblings_of(thing);
  siblings.erase(std::remove(siblings.begin(), siblings.end(), &thing), siblings.end());
  drop_thing(thing);
  structure_changed();
  return {};
}

void Engine::Impl::answer_gone(Ticket ticket) {
  const Waiting* waiting = find_waiting(ticket);
  if (!waiting) return;
  const http::Request request = waiting->request.view();
  reply(ticket, problem(resumed(request, {}, nullptr), 404, "the thing was removed while the request waited"));
}

void Engine::Impl::drop_thing(ThingNode& thing) {
  for (ThingNode* child : std::vector<ThingNode*>(thing.children)) drop_thing(*child);
  for (const auto& p : thing.properties) {
    for (const auto& w : p->writes) answer_gone(w.ticket);
    if (p->write_claim) p->write_claim->call_off();
    if (p->reading) p->reading->call_off();
    for (auto* list : {&p->readers, &p->next_readers})
      for (Continuation& c : *list) c(unexpected(Errc::closed, "the thing was removed while the request waited"));
    drop_path(*p);
  }
  for (const auto& a : thing.actions) {
    for (const auto& i : a->invocations) {
      for (const Ticket ticket : i->waiting) answer_gone(ticket);
      if (!i->finished()) {
        if (i->claim) i->claim->call_off();
        if (auto hook = i->core->cancel()) run_hook(where(thing), std::move(hook));
      }
      drop_path(*i);
    }
    drop_path(*a);
  }
  for (const auto& c : thing.collections) {
    for (const auto& [ticket, claim] : c->under_way) {
      claim->call_off();
      answer_gone(ticket);
    }
    for (const auto& m : c->members) drop_path(*m);
    drop_path(*c);
  }
  for (Resource* r : {&thing.self, &thing.state, &thing.blueprint, &thing.subscriptions}) drop_path(*r);
  things_.erase(things_.find(thing.self.path));
}

std::uint64_t Engine::Impl::revision_of(const Resource& resource) const {
  switch (resource.kind) {
    case Kind::terms:
    case Kind::context: return 1;
    case Kind::subscriptions: return structure_ + resource.revision;
    case Kind::subscription: {
      const auto& s = static_cast<const SubscriptionResource&>(resource);
      return s.revision + s.delivered + s.backlog.dropped();
    }
    case Kind::property:
    case Kind::action:
    case Kind::invocation:
    case Kind::collection:
    case Kind::member: return resource.revision;
    case Kind::state: {
      std::uint64_t sum = structure_;
      for (const auto& p : resource.thing->properties) sum += p->revision;
      return sum;
    }
    default: return structure_;
  }
}

void Engine::Impl::log(LogLevel level, const std::string& message) const {
  if (options_.log) options_.log(level, message);
}

}  // namespace lrt::engine
