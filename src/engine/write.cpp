#include <algorithm>

#include <lrt/base/media_type.hpp>
#include <lrt/http/target.hpp>

#include "src/engine/impl.hpp"

namespace lrt::engine {

namespace {
std::size_t longest_list(const rdf::Value& value) {
  const rdf::Value::Sequence* members = value.sequence();
  if (!members) return 0;
  std::size_t longest = members->size();
  for (const rdf::Value& m : *members) longest = std::max(longest, longest_list(m));
  return longest;
}

/// SPEC 3.3: the focus node is <> if that is a subject, else the only subject of the target class. Of several, two are given.
std::vector<rdf::TermId> focus_nodes(const rdf::Graph& graph, const std::string& here, const rdf::Type& type) {
  const auto self = graph.find(rdf::iri(here));
  if (self && !graph.match(*self, std::nullopt, std::nullopt).empty()) return {*self};
  const Iri wanted = rdf::target_class(type);
  const auto predicate = graph.find(wanted.empty() ? vocab::rdf::value : vocab::rdf::type);
  const auto object = wanted.empty() ? std::optional<rdf::TermId>() : graph.find(wanted);
  std::vector<rdf::TermId> found;
  if (!predicate || (!wanted.empty() && !object)) return found;
  for (const rdf::Triple& t : graph.match(std::nullopt, *predicate, object)) {
    if (std::find(found.begin(), found.end(), t.subject) == found.end()) found.push_back(t.subject);
    if (found.size() > 1) break;
  }
  return found;
}

}  // namespace

std::variant<Engine::Impl::Body, http::Response> Engine::Impl::read_body(Context& context, const rdf::Type* value, const rdf::Facets& facets) {
  const http::Request& request = context.request;
  if (const auto coding = request.find("Content-Encoding"); coding && !http::iequals(*coding, "identity")) {
    http::Response response = problem(context, 415, "Content-Encoding: expected identity, found \"" + std::string(*coding) + "\"");
    response.fields.set("Accept-Encoding", "identity");
    return response;
  }
  if (request.find("Content-Range")) return problem(context, 400, "Content-Range has no meaning here (RFC 9110 14.5)");

  const auto content_type = request.find("Content-Type");
  if (!content_type && request.body.empty()) return Body{};
  const bool octets =
      value && offers_of(*context.resource).type_of(Form(rdf::Plain::octets)) != std::string_view() && rdf::reads_octets(*value);
  const auto unsupported = [&](const std::string& found) {
    std::string types = readable_types(value != nullptr);
    if (octets) types += ", " + std::string(rdf::media_type(rdf::Plain::octets));
    http::Response response = problem(context, 415, "Content-Type: expected one of " + types + ", found " + found);
    response.fields.set("Accept", types);  // RFC 9110 15.5.16
    if (request.method == "POST") response.fields.set("Accept-Post", types);
    return response;
  };
  if (!content_type) return unsupported("none");
  const Result<MediaType> type = MediaType::parse(*content_type);
  if (!type || request.count("Content-Type") > 1) return unsupported("\"" + request.joined("Content-Type") + "\"");
  const auto syntax = rdf::syntax_of(type->essence());
  std::optional<rdf::Plain> format;
  if (value && !syntax) format = rdf::plain_of(*type);
  if (!syntax && (!format || (*format == rdf::Plain::octets && !octets))) return unsupported(type->essence());
  if (const std::string_view charset = type->parameter("charset"); !charset.empty() && !http::iequals(charset, "utf-8"))
    return unsupported("charset " + std::string(charset));

  const std::string base = iri_of(context, context.resource->path);
  if (format) {
    Body body;
    body.empty = request.body.empty();
    const Result<void> read = rdf::read_plain(request.body, *format, *value, facets, names_base(*context.resource->thing, bases_[context.base]),
                                              options_.body_triples, body.graph, body.graph.intern(rdf::iri(base)));
    if (read) return body;
    const Errc code = read.error().code;
    return problem(context, code == Errc::limit_exceeded ? 413 : code == Errc::expected_rdf ? 400 : 422, "body: " + read.error().message);
  }
  rdf::ReadOptions read_options;
  read_options.base = base;
  read_options.max_triples = options_.body_triples;
  read_options.max_bytes = options_.body_text;
  const std::string own_context = iri_of(context, context_.path);
  read_options.context = own_context;
  read_options.context_prefixes = &options_.prefixes;
  Result<rdf::Graph> graph = rdf::read(request.body, *syntax, read_options);
  if (!graph) {
    const Error& e = graph.error();
    return problem(context, e.code == Errc::limit_exceeded ? 413 : 400, "body: " + e.message);
  }
  return Body{*std::move(graph), request.body.empty()};
}

std::variant<rdf::Value, http::Response> Engine::Impl::read_value(Context& context, const rdf::Type& type, const rdf::Facets& facets) {
  auto read = read_body(context, &type, facets);
  if (auto* answer = std::get_if<http::Response>(&read)) return std::move(*answer);
  const rdf::Graph& graph = std::get<Body>(read).graph;

  const std::string here = iri_of(context, context.resource->path);
  const std::vector<rdf::TermId> nodes = focus_nodes(graph, here, type);
  if (nodes.size() > 1) {
    const Iri wanted = rdf::target_class(type);
    return problem(context, 422, "body: expected triples about <> or one subject " +
                                     (wanted.empty() ? std::string("with rdf:value") : "of type " + rdf::abbreviate(wanted.text)) +
                                     ", found several");
  }
  if (nodes.empty() && type.kind == rdf::Type::Kind::optional && graph.empty()) return rdf::Value();

  ThingNode& thing = *context.resource->thing;
  const auto node = nodes.empty() ? std::nullopt : std::optional(nodes.front());
  if (auto answer = refused_by_shape(context, graph, node, shape_name(*context.resource))) return *std::move(answer);
  if (nodes.empty()) return problem(context, 422, "body: expected triples about <> or one node that carries the value, found none");

  std::vector<rdf::Mismatch> mismatches;
  Result<rdf::Value> value = rdf::read_value(graph, nodes.front(), type, facets, names_base(thing, bases_[context.base]), mismatches);
  if (value && longest_list(*value) > options_.list_members)
    return problem(context, 413, "body: expected lists of at most " + std::to_string(options_.list_members) + " members");
  if (value) return *std::move(value);
  std::string detail;
  for (const rdf::Mismatch& m : mismatches) detail += (detail.empty() ? "" : "; ") + m.path + ": " + m.message;
  return problem(context, 422, std::move(detail));
}

std::optional<http::Response> Engine::Impl::refused_by_shape(Context& context, const rdf::Graph& graph, std::optional<rdf::TermId> node,
                                                             std::string_view name) {
  ThingNode& thing = *context.resource->thing;
  const Result<const shacl::Shapes*> shapes = shapes_of(thing, context.base);
  if (!shapes) return problem(context, 500, "the blueprint: " + shapes.error().message);
  shacl::ValidateOptions limits;
  limits.max_results = 64;  // more help nobody
  limits.max_steps = 1'000'000;
  // Nothing said about anything is judged as nothing said about <>, so that the report tells what is missing.
  const std::string here = iri_of(context, context.resource->path);
  const std::string shape = names_base(thing, bases_[context.base]) + "#" + std::string(name);
  const Result<shacl::Report> report = shacl::validate(**shapes, graph, node ? graph.term(*node) : rdf::iri(here), rdf::iri(shape), limits);
  if (!report) return problem(context, 422, "body: it could not be judged: " + report.error().message);
  if (!report->conforms()) return violation(context, *report);
  return std::nullopt;
}

Outcome Engine::Impl::put(Context& context) {
  auto& property = static_cast<PropertyResource&>(*context.resource);
  auto read = read_value(context, *property.spec->type, property.spec->facets);
  if (auto* answer = std::get_if<http::Response>(&read)) return std::move(*answer);
  Ticket ticket{};
  Outcome outcome = defer(context, options_.host_time, ticket);
  if (!find_waiting(ticket)) return outcome;
  if (property.writes.size() > 64) {  // those whose clients were answered 503 meanwhile; the first is under way
    const auto gone = [this](const PropertyResource::Write& w) { return find_waiting(w.ticket) == nullptr; };
    property.writes.erase(std::remove_if(property.writes.begin() + 1, property.writes.end(), gone), property.writes.end());
  }
  property.writes.push_back({ticket, std::move(std::get<rdf::Value>(read))});
  if (!property.writing) next_write(property, context.now);
  return outcome;
}

/// Takes up the first write that still has a client. Preconditions are looked at when its turn comes, so that of two writers with the
/// same If-Match the second finds what the first left.
void Engine::Impl::next_write(PropertyResource& property, TimePoint now) {
  while (!property.writes.empty()) {
    const Waiting* waiting = find_waiting(property.writes.front().ticket);
    if (!waiting) {
      property.writes.pop_front();
      continue;
    }
    property.writing = true;
    const bool conditional = std::any_of(waiting->request.fields.begin(), waiting->request.fields.end(), [](const auto& f) {
      return http::iequals(f.first, "If-Match") || http::iequals(f.first, "If-None-Match");
    });
    if (conditional && property.spec->read) {
      read(property, [this, path = property.path](const Result<void>& result) {
        Resource* r = find(path);
        if (!r || r->kind != Kind::property) return;
        auto& p = static_cast<PropertyResource&>(*r);
        if (p.writes.empty()) return;
        if (result) return decide_write(p, clock_.now());
        if (Waiting* w = find_waiting(p.writes.front().ticket)) {
          const http::Request request = w->request.view();
          const Context context = resumed(request, clock_.now(), &p);
          reply(p.writes.front().ticket, problem(context, 500, result.error().message));
        }
        p.writes.pop_front();
        p.writing = false;
        next_write(p, clock_.now());
      });
    } else {
      decide_write(property, now);
    }
    return;
  }
  property.writing = false;
}

void Engine::Impl::decide_write(PropertyResource& property, TimePoint now) {
  const Ticket ticket = property.writes.front().ticket;
  Waiting* waiting = find_waiting(ticket);
  std::optional<http::Response> answer;
  if (waiting) {
    const http::Request request = waiting->request.view();
    Context context = resumed(request, now, &property);
    (void)sync(property);
    answer = precondition(context);
  }
  if (!waiting || answer) {
    if (answer) reply(ticket, *std::move(answer));
    property.writes.pop_front();
    property.writing = false;
    return next_write(property, now);
  }
  property.write_claim = waiting->claim = std::make_shared<Claim>();
  add_job(where(*property.thing), [door = door_, spec = property.spec, claim = waiting->claim, path = property.path,
                                   value = property.writes.front().value]() mutable {
    Result<void> result;
    if (claim->take()) {
      if (spec->slot) spec->slot->forget();
      result = guarded<void>([&] { return spec->write(value); });
    } else {
      result = unexpected(Errc::cancelled, "called off");
    }
    door->put([path, claim, result = std::move(result)](Engine::Impl& engine, TimePoint at) mutable {
      engine.write_done(path, claim, std::move(result), at);
    });
  });
}

void Engine::Impl::write_done(const std::string& path, const std::shared_ptr<Claim>& claim, Result<void> result, TimePoint now) {
  Resource* resource = find(path);
  if (!resource || resource->kind != Kind::property) return;
  auto& property = static_cast<PropertyResource&>(*resource);
  if (property.write_claim != claim || property.writes.empty()) return;
  property.write_claim = nullptr;
  const PropertyResource::Write write = std::move(property.writes.front());
  property.writes.pop_front();

  if (result && property.spec->slot) {
    // What was published since the lambda began counts, even the old value; else the written one is shown until the robot publishes.
    const bool published = property.spec->slot->has_news();
    (void)sync(property);
    if (!published && !rdf::same(property.value, write.value)) {
      auto whole = guarded<std::shared_ptr<const void>>([&] { return property.spec->whole ? property.spec->whole(write.value) : nullptr; });
      take_value(property, write.value, whole ? *std::move(whole) : nullptr, now.utc);
    }
  }
  if (Waiting* waiting = find_waiting(write.ticket)) {
    const http::Request request = waiting->request.view();
    Context context = resumed(request, now, &property);
    if (!result) {
      reply(write.ticket, refused(context, "property \"" + path + "\" was not written", result.error()));
    } else if (http::parse_prefer(request.joined("Prefer")).return_ == http::Preferences::Return::representation) {
      // The representation afterwards: of a pulled property it has to be read first.
      const auto show = [this, ticket = write.ticket, path](const Result<void>& read_result) {
        Waiting* w = find_waiting(ticket);
        Resource* r = find(path);
        if (!w || !r) return;
        const http::Request original = w->request.view();
        http::Request plain = original;
        plain.fields.erase(std::remove_if(plain.fields.begin(), plain.fields.end(),
                                          [](const http::Field& f) {
                                            return http::iequals(f.name, "If-Match") || http::iequals(f.name, "If-None-Match");
                                          }),
                           plain.fields.end());
        Context c = resumed(plain, clock_.now(), r);
        if (!read_result) return reply(ticket, problem(c, 500, read_result.error().message));
        http::Response response = represent(c);
        response.fields.add("Preference-Applied", "return=representation");
        response.fields.add("Content-Location", iri_of(c, r->path));
        reply(ticket, std::move(response));
      };
      if (property.spec->read) read(property, show);
      else show(Result<void>());
    } else {
      reply(write.ticket, no_content(context));
    }
  }
  next_write(property, now);
}

}  // namespace lrt::engine
