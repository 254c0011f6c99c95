#include <algorithm>

#include <lrt/http/etag.hpp>
#include <lrt/http/negotiate.hpp>
#include <lrt/http/range.hpp>

#include "src/engine/impl.hpp"
#include "src/engine/page.hpp"

namespace lrt::engine {

namespace {

constexpr std::string_view revalidated = "no-cache", kept_for_a_day = "max-age=86400";

/// LDP 7.2: only what the container says of itself.
bool asks_for_minimal_container(const http::Preferences& preferences) {
  using Return = http::Preferences::Return;
  if (preferences.return_ == Return::minimal) return true;
  if (preferences.return_ != Return::representation) return false;
  const auto has = [](const std::vector<std::string>& list, std::string_view iri) { return std::find(list.begin(), list.end(), iri) != list.end(); };
  if (has(preferences.include, vocab::ldp::PreferContainment.text)) return false;
  return has(preferences.include, vocab::ldp::PreferMinimalContainer.text) || has(preferences.omit, vocab::ldp::PreferContainment.text);
}

/// Which of the media types, the page's among them, suits accept_of() best. Judged once a request.
std::optional<std::size_t> choice_of(Context& context) {
  if (!context.choice) context.choice = http::negotiate(accept_of(context), offers_of(*context.resource).with_page);
  return *context.choice;
}

/// Whether Accept prefers the page to everything else there is, as browsers do.
bool asks_for_page(Context& context) {
  const auto choice = choice_of(context);
  return choice && offers_of(*context.resource).with_page[*choice] == page_type;
}

}  // namespace

std::vector<PropertyResource*> Engine::Impl::pulled_of(Resource& resource) {
  std::vector<PropertyResource*> pulled;
  if (resource.kind == Kind::property) {
    if (auto& p = static_cast<PropertyResource&>(resource); p.spec->read) pulled.push_back(&p);
  } else if (resource.kind == Kind::state) {
    for (const auto& p : resource.thing->properties)
      if (p->spec->read) pulled.push_back(p.get());
  }
  return pulled;
}

void Engine::Impl::take_value(PropertyResource& property, rdf::Value value, std::shared_ptr<const void> whole, Utc since) {
  const bool promised = property.promises_triples();
  property.value = std::move(value);
  property.whole = std::move(whole);
  property.modified = since;
  const model::PropertySpec& spec = *property.spec;
  property.only_octets = spec.octets && has_more_than(options_.value_members, property.value) && rdf::octets_of(*spec.type, property.value);
  if (property.promises_triples() != promised) structure_changed();  // the blueprint says it
  changed(property);
}

bool Engine::Impl::sync(Resource& resource) {
  const auto one = [this](PropertyResource& p) {
    if (!p.spec->slot) return true;
    model::SlotBase& slot = *p.spec->slot;
    if (!slot.has_change()) return false;
    rdf::Value value;
    Utc since;
    // Of values that are kept each is a change, but a writer without end must not hold up the others.
    for (int most = slot.keeps() ? 1024 : 1; most > 0 && slot.take(value, since); --most) {
      if (!slot.every_sample() && rdf::same(value, p.value)) continue;  // SPEC 3.8
      take_value(p, std::move(value), slot.whole(), since);
    }
    return false;
  };
  switch (resource.kind) {
    case Kind::property: return one(static_cast<PropertyResource&>(resource));
    case Kind::state: {
      bool pulled = false;
      for (const auto& p : resource.thing->properties) pulled |= one(*p);
      return pulled;
    }
    case Kind::invocation: {
      auto& invocation = static_cast<InvocationResource&>(resource);
      if (const double now = invocation.core->fraction(); !invocation.finished() && now != invocation.progress) {
        invocation.progress = now;
        changed(invocation);
      }
      return false;
    }
    case Kind::blueprint:
      for (const auto& p : resource.thing->properties) (void)one(*p);
      return false;
    default: return false;
  }
}

Outcome Engine::Impl::get(Context& context, bool fresh) {
  if (asks_for_page(context)) return represent(context);  // it has no values: nothing to be read for it
  if (sync(*context.resource) && !fresh) return read_first(context, pulled_of(*context.resource));
  return represent(context);
}

Outcome Engine::Impl::read_first(Context& context, const std::vector<PropertyResource*>& pulled) {
  Ticket ticket{};
  Outcome outcome = defer(context, options_.host_time, ticket);
  Waiting* waiting = find_waiting(ticket);
  if (!waiting) return outcome;
  waiting->open_reads = pulled.size();
  for (PropertyResource* property : pulled)
    read(*property, [this, ticket](const Result<void>& result) {
      Waiting* w = find_waiting(ticket);
      if (!w) return;
      if (!result && !w->failure) w->failure = result.error();
      if (--w->open_reads == 0) resume(ticket, clock_.now());
    });
  return outcome;
}

std::variant<const Rendering*, http::Response> Engine::Impl::negotiated(Context& context, bool page_too) {
  Resource& resource = *context.resource;
  const Offers& all = offers_of(resource);
  std::vector<std::string_view> fewer;  // only when a format turned out not to carry what there is
  std::string why;                      // it did not
  const std::vector<std::string_view>* offers = page_too ? &all.with_page : &all.types;
  while (true) {
    const auto choice = offers == &all.with_page ? choice_of(context) : http::negotiate(accept_of(context), *offers);
    if (!choice)
      return problem(context, 406, !why.empty() ? why : "none of the accepted media types is available; there are " + list_of(all) +
                                                            (page_too ? ", " + std::string(page_type) : ""));
    const std::string_view type = (*offers)[*choice];
    if (type == page_type) return &context.rendering.emplace(page_of(resource, context.base, context.page));
    const Form form = *all.form_of(type);
    Result<const Rendering*> rendered = render(resource, context.base, form, context.page);
    if (rendered) return *rendered;
    why = rendered.error().message;
    const Errc code = rendered.error().code;
    if (code != Errc::limit_exceeded && (code != Errc::unsupported_syntax || form == Form())) {  // Turtle carries everything
      log(LogLevel::error, resource.path + ": " + why);
      return problem(context, 500, why);
    }
    if (fewer.empty()) fewer = *offers;
    fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(*choice));
    offers = &fewer;
  }
}

http::Response Engine::Impl::represent(Context& context) {
  Resource& resource = *context.resource;
  const bool minimal = is_container(resource) && asks_for_minimal_container(context.preferences) && !asks_for_page(context);
  if (minimal) context.page = minimal_page;
  std::variant<const Rendering*, http::Response> chosen = negotiated(context, true);
  if (auto* answer = std::get_if<http::Response>(&chosen)) return std::move(*answer);
  const Rendering* rendering = std::get<const Rendering*>(chosen);

  // RFC 9110 13.2.2
  if (context.request.find("If-Match") || context.request.find("If-None-Match")) {
    if (context.request.find("If-Match")) {
      const http::Match match = http::matches(context.request.joined("If-Match"), rendering->tag, false);
      if (match == http::Match::malformed) return problem(context, 400, "If-Match: expected a list of entity tags or *");
      if (match == http::Match::no) return problem(context, 412, "If-Match: the entity tag is " + rendering->tag);
    }
    if (context.request.find("If-None-Match")) {
      const http::Match match = http::matches(context.request.joined("If-None-Match"), rendering->tag, true);
      if (match == http::Match::malformed) return problem(context, 400, "If-None-Match: expected a list of entity tags or *");
      if (match == http::Match::yes) {
        http::Response response;
        response.status = 304;
        add_types(response.fields, resource);
        response.fields.add("ETag", rendering->tag);
        response.fields.add("Vary", minimal ? "Accept, Prefer" : "Accept");
        response.fields.add("Cache-Control", resource.kind == Kind::context ? kept_for_a_day : revalidated);
        return response;
      }
    }
  }
  http::Response response;
  response.fields = rendering->fields;
  response.body = rendering->body;
  if (minimal)
    response.fields.add("Preference-Applied", context.preferences.return_ == http::Preferences::Return::minimal ? "return=minimal" : "return=representation");
  // RFC 9110 14: part of the representation, if it is still the one that the client has the rest of.
  const auto wanted_range = context.request.find("Range");
  const auto unchanged = context.request.find("If-Range");
  if (!wanted_range || context.request.method != "GET" || (unchanged && *unchanged != rendering->tag)) return response;
  const std::string size = std::to_string(rendering->body->size());
  const http::ByteRange range = http::parse_range(*wanted_range, rendering->body->size());
  if (range.kind == http::ByteRange::Kind::unsatisfiable) {
    response = problem(context, 416, "Range: the representation has " + size + " bytes");
    response.fields.add("Content-Range", "bytes */" + size);
  } else if (range.kind == http::ByteRange::Kind::part) {
    response.status = 206;
    response.fields.add("Content-Range", "bytes " + std::to_string(range.first) + "-" + std::to_string(range.first + range.length - 1) + "/" + size);
    response.set_body(rendering->body->substr(range.first, range.length));
  }
  return response;
}

Rendering Engine::Impl::page_of(Resource& resource, std::size_t base, std::size_t page) {
  Rendering made{&resource, base, {}, page, 0, 0, {}, {}, page_tag(), page_html()};
  add_page_fields(made.fields);
  made.fields.add("ETag", made.tag);
  made.fields.append(fields_of(resource, base, page, revalidated));
  return made;
}

http::Fields Engine::Impl::fields_of(Resource& resource, std::size_t base, std::size_t page, std::string_view cache_control) {
  http::Fields fields;
  fields.add("Vary", page == minimal_page ? "Accept, Prefer" : "Accept");
  fields.add("Cache-Control", cache_control);
  fields.add("Accept-Ranges", "bytes");
  add_allow(fields, resource);
  add_links(fields, resource, bases_[base], page);
  return fields;
}

/// What is kept of the present state of a resource; else the end.
auto Engine::Impl::find_rendering(const Resource& resource, std::size_t base, Form form, std::size_t page) const {
  return std::find_if(resource.renderings.begin(), resource.renderings.end(), [&, revision = revision_of(resource)](const auto& kept) {
    return kept->base == base && kept->form == form && kept->page == page && kept->revision == revision;
  });
}

Result<const Rendering*> Engine::Impl::render(Resource& resource, std::size_t base, Form form, std::size_t page) {
  if (const auto kept = find_rendering(resource, base, form, page); kept != resource.renderings.end()) {
    renderings_.splice(renderings_.begin(), renderings_, *kept);
    return &**kept;
  }
  const std::uint64_t revision = revision_of(resource);
  Result<Bytes> body = body_of(resource, base, form, page);
  if (!body) return Unexpected{std::move(body).error()};

  Rendering made{&resource, base, form, page, revision, structure_, {}, {}, {}, nullptr};
  // A rendering of the same kind that is out of date gives up its place, and its links where they still hold.
  for (auto at = resource.renderings.begin(); at != resource.renderings.end(); ++at) {
    Rendering& stale = **at;
    if (stale.base != base || stale.form != form || stale.page != page) continue;
    rendered_bytes_ -= stale.bytes();
    if (stale.structure == structure_ && resource.kind == Kind::property) made.links = std::move(stale.links);
    renderings_.erase(*at);
    resource.renderings.erase(at);
    break;
  }
  if (made.links.block().empty()) made.links = fields_of(resource, base, page, resource.kind == Kind::context ? kept_for_a_day : revalidated);
  const std::string_view type = offers_of(resource).type_of(form);
  made.body = *std::move(body);
  made.tag = http::entity_tag(type, *made.body);
  made.fields.add("Content-Type", content_type(form, type));
  made.fields.add("ETag", made.tag);
  made.fields.append(made.links);
  if (!form.is_text()) {
    http::LinkWriter links;
    links.add(format_iri(bases_[base] + resource.path, rdf::media_type(rdf::Syntax::turtle)), "describedby", rdf::media_type(rdf::Syntax::turtle));
    links.finish(made.fields, {});
  }
  rendered_bytes_ += made.bytes();
  renderings_.push_front(std::move(made));
  resource.renderings.push_back(renderings_.begin());
  trim_cache();
  return &renderings_.front();
}

Result<Bytes> Engine::Impl::body_of(Resource& resource, std::size_t base, Form form, std::size_t page) {
  if (form.kind() == Form::Kind::own) return encoded(static_cast<PropertyResource&>(resource), form.index());
  Result<std::string> text = context_text_;
  if (form.kind() == Form::Kind::plain) {
    const Said said = said_by(resource);
    text = rdf::write_plain(*said.type, *said.facets, said.value(), form.plain());
  } else if (resource.kind != Kind::context) {
    if (says_more_than(options_.value_members, resource))
      return unexpected(Errc::limit_exceeded, "more than " + std::to_string(options_.value_members) + " values are too many for RDF, but not for application/json");
    rdf::Graph graph;
    describe(graph, resource, bases_[base], page);
    if (form == Form(rdf::Syntax::rdf_xml) && graph.size() > options_.rdf_xml_triples)
      return unexpected(Errc::limit_exceeded, std::to_string(graph.size()) + " triples are too many for RDF/XML, which takes " +
                                                  std::to_string(options_.rdf_xml_triples) + ", but not for text/turtle");
    text = write(graph, form, base);
  }
  if (!text) return Unexpected{std::move(text).error()};
  return std::make_shared<const std::string>(*std::move(text));
}

Result<std::string> Engine::Impl::write(const rdf::Graph& graph, Form form, std::size_t base) const {
  const bool refers = form == Form(rdf::Syntax::json_ld);
  return rdf::write(graph, form.syntax(), options_.prefixes, refers ? context_iri(bases_[base]) : std::string());
}

void Engine::Impl::forget_renderings(Resource& resource) {
  for (const auto& kept : resource.renderings) {
    rendered_bytes_ -= kept->bytes();
    renderings_.erase(kept);
  }
  resource.renderings.clear();
}

void Engine::Impl::trim_cache() {
  while (rendered_bytes_ > options_.cache_bytes && renderings_.size() > 1) {
    const auto last = std::prev(renderings_.end());
    auto& of_resource = last->resource->renderings;
    of_resource.erase(std::find(of_resource.begin(), of_resource.end(), last));
    rendered_bytes_ -= last->bytes();
    renderings_.erase(last);
  }
}

/// For PUT and DELETE: a tag of any representation under this base will do, for the client chose one of them.
std::optional<http::Response> Engine::Impl::precondition(Context& context) {
  const bool if_match = context.request.find("If-Match").has_value();
  const bool if_none_match = context.request.find("If-None-Match").has_value();
  if (!if_match && !if_none_match) return std::nullopt;
  const std::string wanted = context.request.joined("If-Match"), unwanted = context.request.joined("If-None-Match");
  bool matched = false, hit = false;
  // What there is already first: the client has one of them, and to make the others of a large value takes time.
  std::vector<Form> forms = offers_of(*context.resource).forms;
  std::stable_partition(forms.begin(), forms.end(), [&, &of = *context.resource](Form form) {
    return find_rendering(of, context.base, form, context.page) != of.renderings.end();
  });
  for (const Form form : forms) {
    if (matched && !if_none_match) break;
    const Result<const Rendering*> rendering = render(*context.resource, context.base, form, context.page);
    if (!rendering) continue;
    const auto check = [&](bool asked, const std::string& field, bool weak, bool& found) {
      if (!asked) return true;
      const http::Match match = http::matches(field, (*rendering)->tag, weak);
      found |= match == http::Match::yes;
      return match != http::Match::malformed;
    };
    if (!check(if_match, wanted, false, matched)) return problem(context, 400, "If-Match: expected a list of entity tags or *");
    if (!check(if_none_match, unwanted, true, hit)) return problem(context, 400, "If-None-Match: expected a list of entity tags or *");
  }
  if (if_match && !matched) return problem(context, 412, "If-Match: the resource has changed, no entity tag of it is " + wanted);
  if (hit) return problem(context, 412, "If-None-Match: the resource has an entity tag that was named");
  return std::nullopt;
}

void Engine::Impl::read(PropertyResource& property, Continuation done) {
  // Of so many readers most have been answered 503 already: the host does not poll. They are let go.
  if (property.readers.size() + property.next_readers.size() >= 2 * options_.waiting_requests) {
    std::vector<Continuation> readers = std::exchange(property.readers, {});
    for (Continuation& c : std::exchange(property.next_readers, {})) readers.push_back(std::move(c));
    for (Continuation& c : readers) c(unexpected(Errc::timed_out, "the robot's program did not take the request in time"));
  }
  if (property.reading) {
    property.next_readers.push_back(std::move(done));
    return;
  }
  property.readers.push_back(std::move(done));
  start_read(property);
}

void Engine::Impl::start_read(PropertyResource& property) {
  property.reading = std::make_shared<Claim>();
  add_job(where(*property.thing),
          [door = door_, spec = property.spec, claim = property.reading, path = property.path]() mutable {
            if (!claim->take()) return;
            auto reading = guarded<model::Reading>([&]() -> Result<model::Reading> { return spec->read(); });
            door->put([path, claim, reading = std::move(reading)](Engine::Impl& engine, TimePoint now) mutable {
              engine.read_done(path, claim, std::move(reading), now);
            });
          });
}

void Engine::Impl::read_done(const std::string& path, const std::shared_ptr<Claim>& claim, Result<model::Reading> reading, TimePoint now) {
  Resource* resource = find(path);
  if (!resource || resource->kind != Kind::property) return;
  auto& property = static_cast<PropertyResource&>(*resource);
  if (property.reading != claim) return;
  property.reading = nullptr;
  Result<void> result;
  if (reading) {
    property.failing = false;
    if (!rdf::same(property.value, reading->value)) {
      take_value(property, std::move(reading->value), std::move(reading->whole), now.utc);
    }
  } else {
    result = unexpected(reading.error().code == Errc::closed ? Errc::failed : reading.error().code,
                        "property \"" + property.path + "\" could not be read: " + reading.error().message);
    if (!property.failing || !property.readers.empty()) log(LogLevel::warning, result.error().message);
    property.failing = true;
  }
  std::vector<Continuation> readers = std::exchange(property.readers, std::exchange(property.next_readers, {}));
  if (!property.readers.empty()) start_read(property);
  for (Continuation& reader : readers) reader(result);
}

}  // namespace lrt::engine
