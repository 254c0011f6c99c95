// SPDX-License-Identifier: Apache-2.0
#include "src/engine/representations.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include <lrt/engine/page_source.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/engine/bases.hpp"
#include "src/engine/overview.hpp"
#include "src/engine/resources/property.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/engine/stamps.hpp"
#include "src/http/etag.hpp"
#include "src/http/negotiate.hpp"
#include "src/http/range.hpp"
#include "src/http/stamp.hpp"
#include "src/rdf/hash.hpp"

namespace lrt::engine {

namespace {

/// The bytes of a resource that is a fixed document.
std::optional<std::string_view> document_of(const Resource& resource) {
  const OwnRepresentation* const own = resource.own_representation();
  return own ? own->document() : std::nullopt;
}

/// LDP 7.2: only what the container says of itself.
bool wants_minimal_container(const Context& context) {
  const http::Preferences& preferences = context.preferences();
  if (context.wants_minimal()) return true;
  if (!context.wants_representation()) return false;
  const auto has = [](const std::vector<std::string>& list, std::string_view iri) { return std::find(list.begin(), list.end(), iri) != list.end(); };
  if (has(preferences.include, vocab::ldp::PreferContainment.text)) return false;
  return has(preferences.include, vocab::ldp::PreferMinimalContainer.text) || has(preferences.omit, vocab::ldp::PreferContainment.text);
}

/// A response that depends on rights must not be stored by shared caches (RFC 9111 5.2.2.7).
constexpr std::string_view no_cache = "no-cache";

/// All values of a field in one text. `joined` owns it if they are on several lines.
std::string_view value_of(const http::Request& request, std::string_view name, std::string& joined) {
  if (request.count(name) <= 1) return request.find(name).value_or(std::string_view());
  return joined = request.joined(name);
}

/// What a resource is: the class of its kind; empty: it has none. A representation says it, too, but may have triples that clients have written.
/// Only OPTIONS has it as a link, so that responses with values stay short.
std::string_view class_of(const Resource& resource) {
  static constexpr std::pair<std::string_view, const Iri*> classes[] = {
      {"thing", &vocab::hybrit::RoboticThing},        {"world", &vocab::lrt_::World},      {"graph", &vocab::lrt_::WorldGraph},
      {"property", &vocab::hybrit::Property},         {"action", &vocab::hybrit::Action},  {"invocation", &vocab::lrt_::Invocation},
      {"subscription", &vocab::hybrit::Subscription}, {"blueprint", &vocab::sh::NodeShape}};
  for (const auto& [kind, its_class] : classes)
    if (kind == resource.kind().name) return its_class->text;
  return {};
}

}  // namespace

namespace {

std::string with_languages(std::string_view vary, bool has_languages) { return std::string(vary) + (has_languages ? ", Accept-Language" : ""); }

/// The tag of a state differs by language, too. OwnRepresentation::for_write() takes off digits after a point: a write depends on the state alone.
std::string tag_in_language(std::string tag, const std::string& wanted) {
  std::string digits = std::to_string(static_cast<std::uint32_t>(rdf::hash_bytes(wanted, 0)));
  digits.insert(0, 10 - digits.size(), '0');
  return tag.insert(tag.size() - 1, (tag.find('.') == std::string::npos ? "." : "") + digits);
}

std::string too_large_text(std::size_t max_bytes) {
  return "the document has more than " + std::to_string(max_bytes) + " bytes; its parts can be read one by one";
}

}  // namespace

std::size_t page_count(std::size_t members, std::size_t max_page_members) noexcept {
  return std::max<std::size_t>(1, (members + max_page_members - 1) / max_page_members);
}

// ------------------------------------------------------------------------------------------------------------- requests

Outcome Representations::get(Context& context) {
  return attempt(context, [this](Context& c, bool current) -> Attempt {
    std::optional<Representation> page;
    Selected selected = select(c, &page, current);
    if (auto* missing = std::get_if<Missing>(&selected)) return *missing;
    if (auto* response = std::get_if<http::Response>(&selected)) return Outcome(std::move(*response));
    return Outcome(respond_with(*std::get<Representation*>(selected), c));
  });
}

http::Response Representations::options(const Context& context) const {
  http::Response response;
  response.status = 204;
  responses_.add_allow(response.fields, *context.resource, context.audience);
  add_upgrade(response.fields, context);
  add_links(response.fields, *context.resource, context.base, context.audience, context.page, context.first_link, class_of(*context.resource));
  return response;
}

http::Response Representations::respond(Context& context) {
  std::optional<Representation> page;
  Selected selected = select(context, &page, true);
  if (auto* response = std::get_if<http::Response>(&selected)) return std::move(*response);
  if (std::get_if<Missing>(&selected)) return responses_.problem(context, 500, "the value has not been encoded");
  return respond_with(*std::get<Representation*>(selected), context);
}

Outcome Representations::attempt(Context& context, Step step) {
  Attempt first = step(context, false);
  if (auto* outcome = std::get_if<Outcome>(&first)) return std::move(*outcome);
  const ValueResource* const values = context.resource->values();
  std::unique_ptr<const Step> again;  // for a document that can do without some values
  if (values && values->reads() == ValueResource::Reads::readable_values) again = std::make_unique<const Step>(step);
  const auto ticket = pending_.defer(context, options_.host_timeout, [this, again = std::move(again)](Ticket late, Context& c, bool) {
    if (again && c.resource && values_.give_up(*c.resource, c.audience)) {
      Attempt without = (*again)(c, true);
      auto* outcome = std::get_if<Outcome>(&without);
      if (outcome && !std::holds_alternative<Deferred>(*outcome)) return pending_.respond(late, std::move(*outcome));
    }
    pending_.respond(late, responses_.timed_out(c));
  });
  if (!ticket) return responses_.overloaded(context);
  go_on(*ticket, *context.resource, std::get<Missing>(first).encodings, std::move(step), context.audience);
  return Deferred{*ticket};
}

void Representations::respond_when_read(Ticket ticket, Resource& resource, std::function<http::Response(Context&)> respond) {
  Step step = [this, respond = std::move(respond)](Context& c, bool current) -> Attempt {
    std::optional<Representation> page;
    Selected selected = select(c, &page, current);
    if (auto* missing = std::get_if<Missing>(&selected)) return *missing;
    return Outcome(respond(c));
  };
  Context* context = pending_.resume(ticket, {});
  if (!context || !context->resource) return;
  go_on(ticket, resource, {}, std::move(step), context->audience);
}

/// Refreshes the values, and then tries the step again.
void Representations::go_on(Ticket ticket, Resource& resource, Encodings encodings, Step step, const Audience& audience) {
  auto done = [this, ticket, step = std::move(step)](const Result<void>& result, TimePoint now) {
    Context* context = pending_.resume(ticket, now);
    if (!context) return;
    if (!context->resource) return pending_.respond(ticket, responses_.gone(*context));
    if (!result) {
      const Errc code = result.error().code;
      const int status = code == Errc::closed ? 404 : code == Errc::timed_out || code == Errc::unavailable ? 503 : 500;
      return pending_.respond(ticket, responses_.problem(*context, status, result.error().message));
    }
    Attempt next = step(*context, true);
    if (auto* missing = std::get_if<Missing>(&next)) return go_on(ticket, *context->resource, missing->encodings, step, context->audience);
    pending_.respond(ticket, std::move(std::get<Outcome>(next)));
  };
  values_.refresh(resource, encodings, std::move(done), audience);
}

Representations::Selected Representations::select(Context& context, std::optional<Representation>* page, bool current) {
  Resource& resource = *context.resource;
  const Variants& all = resource.variants();
  std::vector<std::string_view> fewer;  // only after a variant could not represent the value
  std::string why;
  const bool offers_page = page && options_.page;
  const std::vector<std::string_view>* offers = offers_page ? &all.with_page : &all.types;
  while (true) {
    const auto choice = http::negotiate(context.accept(), *offers);
    if (!choice) {
      const std::string list = all.list() + (offers_page ? ", " + std::string(page_type) : "");
      return responses_.problem(context, 406,
                                !why.empty() ? why : "none of the media types in Accept is available for this resource; available are " + list);
    }
    const std::string_view type = (*offers)[*choice];
    const bool is_page = type == page_type && offers_page;
    if (is_page && !resource.kind().is(Trait::term_list)) return &page->emplace(html_page(resource, context.base, context.audience, context.page));
    const Variant variant = is_page ? Variant::term_page() : *all.find(type);
    if (const ValueResource* const values = resource.values())
      if (const std::size_t max = values->max_bytes(options_); values->exceeds(max, context.audience))
        return responses_.problem(context, 406, too_large_text(max));
    if (!values_.ready(resource, variant, current, context.audience)) return Missing{Encodings::of(variant)};
    const bool minimal = resource.container() && wants_minimal_container(context);
    const Languages languages(context.request());
    Result<Representation*> made = make(resource, context.base, variant, context.audience, minimal ? minimal_page : context.page, &languages);
    if (made) return *made;
    why = made.error().message;
    const Errc code = made.error().code;
    if (code != Errc::limit_exceeded && (code != Errc::unsupported_syntax || variant == Variant())) {  // Turtle carries everything
      responses_.log(LogLevel::error, resource.path + ": " + why);
      return responses_.problem(context, code == Errc::unavailable ? 503 : 500, why);
    }
    if (fewer.empty()) fewer = *offers;
    const bool is_too_large = code == Errc::limit_exceeded;
    const bool is_all_rdf = is_too_large && variant.is_rdf() && variant != Variant(rdf::Syntax::rdf_xml);  // which has a limit of its own
    const auto is_left_out = [&](std::string_view other) {
      const auto v = all.find(other);
      if (!v) return is_too_large;  // the page would hide from a client that accepts anything why there is no document
      return *v == variant || (is_all_rdf && v->is_rdf() && *v != Variant());  // Turtle is the shortest
    };
    fewer.erase(std::remove_if(fewer.begin(), fewer.end(), is_left_out), fewer.end());
    offers = &fewer;
  }
}

std::optional<http::Response> Representations::unacceptable(const Context& context) const {
  const Variants& all = context.resource->variants();
  if (http::negotiate(context.accept(), options_.page ? all.with_page : all.types)) return std::nullopt;
  return responses_.problem(context, 406,
                            "none of the media types in Accept is available for this resource; available are " + all.list() +
                                (options_.page ? ", " + std::string(page_type) : ""));
}

http::Response Representations::respond_with(Representation& representation, const Context& context) {
  const http::Request& request = context.request();
  const bool minimal = representation.page == minimal_page;
  // RFC 9110 13.2.2
  if (!context.ignores_conditions && request.find("If-Match")) {
    const http::Match match = http::matches(request.joined("If-Match"), representation.tag, false);
    if (match == http::Match::malformed) return responses_.problem(context, 400, "If-Match: expected a list of entity tags or *");
    if (match == http::Match::no)
      return responses_.problem(
          context, 412, "If-Match: expected the current entity tag " + representation.tag + ", found " + std::string(request.joined("If-Match")));
  }
  if (!context.ignores_conditions && request.find("If-None-Match")) {
    std::string joined;
    const http::Match match = http::matches(value_of(request, "If-None-Match", joined), representation.tag, true);
    if (match == http::Match::malformed) return responses_.problem(context, 400, "If-None-Match: expected a list of entity tags or *");
    if (match == http::Match::yes) {
      http::Response response;
      response.status = 304;
      const PreparedFields* prepared = prepared_fields(representation, context);
      response.fields = prepared ? prepared->not_modified : not_modified_fields(representation, context);
      return response;
    }
  }
  http::Response response;
  const PreparedFields* prepared = prepared_fields(representation, context);
  response.fields = prepared ? prepared->ok : fields_of(representation, context);
  response.body = representation.body;
  if (minimal) response.fields.add("Preference-Applied", context.wants_minimal() ? "return=minimal" : "return=representation");
  // RFC 9110 14: a part, if the client has the rest of the same representation.
  const auto range_field = request.find("Range");
  const auto if_range = request.find("If-Range");
  if (!range_field || request.method != "GET" || (if_range && *if_range != representation.tag)) return response;
  const std::string size = std::to_string(representation.body->size());
  const http::ByteRange range = http::parse_range(*range_field, representation.body->size());
  if (range.kind == http::ByteRange::Kind::unsatisfiable) {
    response = responses_.problem(context, 416, "Range: the representation has " + size + " bytes");
    response.fields.add("Content-Range", "bytes */" + size);
  } else if (range.kind == http::ByteRange::Kind::part) {
    response.status = 206;
    response.fields.add("Content-Range", "bytes " + std::to_string(range.first) + "-" + std::to_string(range.first + range.length - 1) + "/" + size);
    response.set_body(representation.body->substr(range.first, range.length));
  }
  return response;
}

/// All of a 200.
http::Fields Representations::fields_of(Representation& representation, const Context& context) {
  const Resource& resource = *representation.resource;
  if (representation.links.block().empty()) {
    representation.links = structure_fields(resource, representation.base, context.audience, representation.page, resource.cache_control(),
                                            representation.has_languages());
    cache_.grown(representation.links.block().size());
  }
  http::Fields fields;
  if (representation.is_page) {
    options_.page->add_fields(fields);
    if (representation.variant == Variant::term_page()) fields.add("Content-Language", "en");
  } else {
    fields.add("Content-Type", content_type(representation.variant, resource.variants().type_of(representation.variant), *representation.body));
  }
  if (representation.languages && !representation.languages->language.empty()) fields.add("Content-Language", representation.languages->language);
  fields.add("ETag", representation.tag);
  fields.append(representation.links);
  if (!representation.is_page && !representation.variant.is_text()) {
    http::LinkWriter links;
    const std::string_view turtle = rdf::media_type(rdf::Syntax::turtle);
    links.add(variant_iri(view_.bases[representation.base] + resource.path, turtle), "describedby", turtle);
    links.finish(fields, {});
  }
  if (document_of(resource)) fields.set("Cache-Control", cache_control_of(context));
  add_upgrade(fields, context);
  if (context.first_link != 0) {
    fields.remove("Link");
    add_links(fields, resource, context.base, context.audience, representation.page, context.first_link);
  }
  return fields;
}

http::Fields Representations::not_modified_fields(const Representation& representation, const Context& context) const {
  http::Fields fields;
  responses_.add_types(fields, context.resource);
  fields.add("ETag", representation.tag);
  fields.add("Vary", with_languages(context.vary(), representation.has_languages()));
  fields.add("Cache-Control", representation.is_page ? limited(context.audience, no_cache) : cache_control_of(context));
  add_upgrade(fields, context);
  return fields;
}

/// The shared header fields; nullptr: the request needs fields of its own.
const PreparedFields* Representations::prepared_fields(Representation& representation, const Context& context) {
  const http::Request& request = context.request();
  const bool is_read = request.method == "GET" || request.method == "HEAD";
  const bool is_whole = !representation.is_page && representation.page != minimal_page && context.first_link == 0 && !request.find("Range");
  if (!is_read || !is_whole || document_of(*context.resource) || request.find("Origin")) return nullptr;
  PreparedFields& prepared = representation.prepared;
  const std::string_view upgrade = upgrade_of(context);
  if (!prepared.ok.block().empty() && prepared.upgrade == upgrade) return &prepared;
  const std::size_t before = prepared.bytes();
  PreparedFields made{fields_of(representation, context), not_modified_fields(representation, context), upgrade};
  prepare(made.ok, 200, context);
  prepare(made.not_modified, 304, context);
  prepared = std::move(made);
  cache_.grown(prepared.bytes() - before);
  return &prepared;
}

/// Adds what browsers need to know of such a response, which no further step adds then.
void Representations::prepare(http::Fields& fields, int status, const Context& context) const {
  http::Response response;
  response.status = status;
  response.fields = std::move(fields);
  cors_.add_fields(context.request(), response);
  fields = std::move(response.fields);
  fields.share();
}

// ------------------------------------------------------------------------------------------------------ representations

Representation Representations::html_page(Resource& resource, std::size_t base, const Audience& audience, std::size_t page) const {
  return {&resource,
          base,
          {},
          page,
          audience.view,
          {},
          0,
          0,
          options_.page->tag(),
          options_.page->html(),
          true,
          structure_fields(resource, base, audience, page, no_cache)};
}

/// The fields of a 200 that only the structure changes.
http::Fields Representations::structure_fields(const Resource& resource, std::size_t base, const Audience& audience, std::size_t page,
                                               std::string_view cache_control, bool has_languages) const {
  http::Fields fields;
  fields.add("Vary", with_languages(vary_of(resource, audience), has_languages));
  fields.add("Cache-Control", limited(audience, cache_control));
  fields.add("Accept-Ranges", "bytes");
  responses_.add_allow(fields, resource, audience);
  add_links(fields, resource, base, audience, page);
  return fields;
}

Result<Representation*> Representations::make(Resource& resource, std::size_t base, Variant variant, const Audience& audience, std::size_t page,
                                              const Languages* languages) {
  const std::uint64_t structure = view_.registry.structure(), state = resource.state(structure);
  Representation* kept = cache_.find(resource, base, variant, page, audience, languages);
  if (kept && kept->state == state) {
    cache_.mark_used(*kept);
    return kept;
  }
  ChosenTexts texts(languages);
  Result<Bytes> body = body_of(resource, base, variant, audience, page, texts);
  if (!body) return Unexpected{std::move(body).error()};

  const bool is_page = variant == Variant::term_page();
  const std::string_view type = is_page ? page_type : resource.variants().type_of(variant);
  const OwnRepresentation* const own = resource.own_representation();
  std::string tag = own ? own->entity_tag(type, view_.bases[base], audience, false) : std::string();
  const bool is_of_state = !tag.empty();
  if (!is_of_state) tag = http::entity_tag(type, **body);
  Representation made{&resource, base,           variant,          page,   audience.view, std::string(audience.name_in(resource)), state,
                      structure, std::move(tag), *std::move(body), is_page};
  if (const std::vector<std::string>& offered = texts.offered(); !offered.empty() || !texts.language().empty()) {
    const std::string wanted = languages && !offered.empty() ? languages->wanted_of(offered) : std::string();
    made.languages = std::make_unique<const InLanguages>(InLanguages{offered, wanted, std::string(texts.language())});
    if (is_of_state && !offered.empty()) made.tag = tag_in_language(std::move(made.tag), wanted);
  }
  const bool has_same_links = kept && kept->structure == structure && kept->has_languages() == made.has_languages();
  if (has_same_links && resource.kind().is(Trait::fixed_links)) made.links = std::move(kept->links);
  return &cache_.keep(std::move(made));
}

bool Representations::is_made(Resource& resource, std::size_t base, Variant variant, const Audience& audience) const {
  const Representation* kept = cache_.find(resource, base, variant, 1, audience, nullptr);
  return kept && kept->state == resource.state(view_.registry.structure());
}

Result<Bytes> Representations::body_of(Resource& resource, std::size_t base, Variant variant, const Audience& audience, std::size_t page,
                                       ChosenTexts& texts) const {
  if (!audience.sees(resource)) return std::make_shared<const std::string>();  // it may observe the resource, and not read it
  if (variant.kind() == Variant::Kind::encoded) {
    const auto& encodings = static_cast<PropertyResource&>(resource).encodings;
    if (variant.encoder() < encodings.size() && encodings[variant.encoder()].made) return encodings[variant.encoder()].bytes;
    return unexpected(Errc::failed, "the value has not been encoded");
  }
  if (const OwnRepresentation* const own = resource.own_representation())
    if (Result<void> checked = own->check(); !checked) return Unexpected{std::move(checked).error()};
  Result<std::string> text = std::string();
  const ValueResource* const values = resource.values();
  if (variant.kind() == Variant::Kind::plain) {
    const PlainValue value = *values->plain_value(audience);
    text = rdf::write_plain(*value.type, *value.facets, value.value(), variant.plain());
  } else if (variant.kind() == Variant::Kind::answer) {
    return resource.own_representation()->answer(variant.type());
  } else if (variant == Variant::term_page()) {
    const std::string iri = view_.bases[base] + resource.path;
    text = options_.page->terms({iri, describe(resource, base, audience, page), options_.prefixes, resource.variants().types});
    if (text->empty()) return options_.page->html();
  } else if (variant == Variant::overview()) {
    text = Overview(view_, base, audience, page, texts).of(resource);
  } else if (const auto whole = document_of(resource)) {
    text = std::string(*whole);
  } else {
    if (values && !values->fits_rdf(options_.max_value_members))
      return unexpected(Errc::limit_exceeded,
                        "more than " + std::to_string(options_.max_value_members) + " values are too many for RDF, but not for application/json");
    rdf::Graph graph = describe(resource, base, audience, page);
    if (variant == Variant(rdf::Syntax::rdf_xml) && graph.size() > options_.max_rdf_xml_triples)
      return unexpected(Errc::limit_exceeded, std::to_string(graph.size()) + " triples are too many for RDF/XML, which takes " +
                                                  std::to_string(options_.max_rdf_xml_triples) + ", but not for text/turtle");
    if (values && rdf::has_named_graphs(variant.syntax()) && !values->described_resources(audience).empty())
      text = rdf::write(dataset_of(*values, base, audience, std::move(graph)), variant.syntax(), options_.prefixes);
    else text = responses_.write(graph, variant, base);
  }
  if (!text) return Unexpected{std::move(text).error()};
  if (const std::size_t max = values ? values->max_bytes(options_) : text->size(); text->size() > max)
    return unexpected(Errc::limit_exceeded, too_large_text(max));
  return std::make_shared<const std::string>(*std::move(text));
}

/// The graph, and once more the triples of each resource in it in a graph of its own: a query of the default graph finds what other syntaxes
/// have, and one of named graphs finds where it is from.
rdf::Dataset Representations::dataset_of(const ValueResource& resource, std::size_t base, const Audience& audience, rdf::Graph all) const {
  rdf::Dataset dataset{std::move(all), {}};
  std::size_t left = options_.max_value_members;
  for (const Resource* part : resource.described_resources(audience)) {
    if (!audience.sees(*part)) continue;
    rdf::Graph graph;
    UserWords words;
    resource.describe_part(*part, {graph, view_.bases[base], 1, view_, audience, audience.is_restricted() ? &words : nullptr}, left);
    dataset.named.emplace_back(view_.bases[base] + part->path, shown(std::move(graph), base, audience, words));
  }
  return dataset;
}

rdf::Graph Representations::describe(const Resource& resource, std::size_t base, const Audience& audience, std::size_t page) const {
  rdf::Graph graph;
  UserWords words;
  const Description d{graph, view_.bases[base], page, view_, audience, audience.is_restricted() ? &words : nullptr};
  resource.describe(d);
  About about(graph, d.base + resource.path);
  resource.describe_controls(about, d);
  return shown(std::move(graph), base, audience, words);
}

rdf::Graph Representations::shown(rdf::Graph graph, std::size_t base, const Audience& audience, const UserWords& words) const {
  if (!audience.is_restricted()) return graph;
  if (words.size() == 1 && words.front() == std::pair(std::size_t(0), graph.size())) return graph;  // a graph of a World may be large
  return visible_part(
      graph, [&](std::string_view iri) { return audience.sees_iri(iri, view_.bases[base], view_.registry); }, words);
}

const subscription::Item& Representations::message_of(Representation& kept, const Audience& audience) {
  if (!kept.message || kept.message->stamp.number != change_number(*kept.resource, audience))
    kept.message = std::make_shared<const subscription::Message>(subscription::Message{kept.body, kept.tag, stamp(*kept.resource, audience)});
  return kept.message;
}

const subscription::Item& Representations::event_of(Representation& kept, const Audience& audience) {
  if (kept.event && kept.event->stamp.number == change_number(*kept.resource, audience)) return kept.event;
  const std::string& body = *kept.body;
  const subscription::Stamp stamp = engine::stamp(*kept.resource, audience);
  std::string event;
  event.reserve(kept.tag.size() + body.size() + 128);
  const auto field = [&event](std::string_view name, std::string_view value) { event.append(name).append(": ").append(value).append("\n"); };
  field("id", kept.tag);
  if (stamp.at) field(http::event_time, to_xsd_date_time(*stamp.at));
  field(http::event_sequence, std::to_string(stamp.number));
  // WHATWG HTML 9.2.6: a line of data for each line of the body. A line feed at the end makes an empty last line. A carriage return ends a
  // line, too, so that the rest of a text with one is not read as another field.
  for (std::size_t start = 0; start <= body.size();) {
    const std::size_t end = std::min(body.find_first_of("\r\n", start), body.size());
    event.append("data: ").append(body, start, end - start).append("\n");
    start = body.compare(end, 2, "\r\n") == 0 ? end + 2 : end + 1;
  }
  event += "\n";
  cache_.grown(event.size());
  if (kept.event) cache_.shrunk(kept.event->body->size());
  kept.event =
      std::make_shared<const subscription::Message>(subscription::Message{std::make_shared<const std::string>(std::move(event)), kept.tag, stamp});
  return kept.event;
}

// ----------------------------------------------------------------------------------------------------------- conditions

/// A tag of any variant under this base counts, because the client chose one of them.
std::optional<http::Response> Representations::failed_precondition(const Context& context, bool* lacks_encodings) {
  const http::Request& request = context.request();
  const bool if_match = request.find("If-Match").has_value(), if_none_match = request.find("If-None-Match").has_value();
  if (!if_match && !if_none_match) return std::nullopt;
  Resource& resource = *context.resource;
  if (resource.kind().is(Trait::placeholder)) {
    if (!if_match) return std::nullopt;
    return responses_.problem(context, 412, "If-Match: the resource does not exist");
  }
  const OwnRepresentation* const own = resource.own_representation();
  const auto for_write = [&](std::string field) { return own ? own->for_write(std::move(field)) : field; };
  const std::string wanted = for_write(request.joined("If-Match")), unwanted = for_write(request.joined("If-None-Match"));
  bool matched = false, excluded = false;
  const Languages languages(request);  // the client has got the representation in these
  // Cached variants come first: the client probably has one of them, and other variants of a large value take time to encode.
  std::vector<Variant> variants = resource.variants().variants;
  std::stable_partition(variants.begin(), variants.end(), [&](Variant variant) {
    const Representation* kept = cache_.find(resource, context.base, variant, context.page, context.audience, &languages);
    return kept && kept->state == resource.state(view_.registry.structure());
  });
  for (const Variant variant : variants) {
    if (matched && !if_none_match) break;
    if (!values_.ready(resource, variant, true, context.audience)) {
      if (lacks_encodings) *lacks_encodings = true;
      continue;
    }
    std::string tag;
    if (own) tag = own->entity_tag(resource.variants().type_of(variant), view_.bases[context.base], context.audience, true);
    if (tag.empty()) {
      const Result<Representation*> made = make(resource, context.base, variant, context.audience, context.page, &languages);
      if (!made) continue;
      tag = (*made)->tag;
    }
    const auto is_well_formed = [&](bool given, const std::string& field, bool weak, bool& found) {
      if (!given) return true;
      const http::Match match = http::matches(field, tag, weak);
      found |= match == http::Match::yes;
      return match != http::Match::malformed;
    };
    if (!is_well_formed(if_match, wanted, false, matched)) return responses_.problem(context, 400, "If-Match: expected a list of entity tags or *");
    if (!is_well_formed(if_none_match, unwanted, true, excluded))
      return responses_.problem(context, 400, "If-None-Match: expected a list of entity tags or *");
  }
  if (if_match && !matched)
    return responses_.problem(context, 412,
                              wanted.empty() ? "If-Match: expected an entity tag, found none"
                                             : "If-Match: the resource has changed since it had the entity tag " + wanted + "; GET it again");
  if (excluded) return responses_.problem(context, 412, "If-None-Match: the resource has one of the given entity tags");
  return std::nullopt;
}

// ---------------------------------------------------------------------------------------------------------------- links

/// RFC 8288 links of a resource: R0.9, LDP 4.2.1.4, 5.2.1.4.
void Representations::add_links(http::Fields& fields, const Resource& resource, std::size_t base_number, const Audience& audience, std::size_t page,
                                std::size_t first_link, std::string_view its_class) const {
  const std::string& base = view_.bases[base_number];
  const std::string self = base + resource.path;
  http::LinkWriter links(options_.max_link_bytes);
  if (audience.is_restricted())
    links.leave_out([&](std::string_view target) {
      const bool is_own_blueprint = resource.thing && target == resource.thing->names_base(base);
      return !audience.sees_iri(target, base, view_.registry) || (is_own_blueprint && !resource.thing->adds_shapes(audience));
    });
  links.add(vocab::ldp::Resource.text, "type");
  if (!resource.kind().is(Trait::no_rdf_source)) links.add(vocab::ldp::RDFSource.text, "type");
  if (!its_class.empty()) links.add(its_class, "type");
  const Container* const container = resource.container();
  if (container) {
    links.add(vocab::ldp::Container.text, "type");
    links.add(vocab::ldp::BasicContainer.text, "type");
  }
  if (const std::string up = resource.up(audience); !up.empty()) links.add(base + up, "up");
  if (const std::string described_by = resource.described_by(base); !described_by.empty()) links.add(described_by, "describedby");
  if (const Methods methods = audience.methods(resource); resource.thing && (methods.put || methods.post))
    links.add(resource.thing->shapes_of(base, resource.input_shape()), vocab::ldp::constrainedBy.text);
  if (container && page == minimal_page) return links.finish(fields, self, "describedby");
  links.skip(first_link);
  const auto add_pages = [&](std::size_t pages) {
    if (pages < 2) return;
    const auto page_iri = [&](std::size_t n) { return self + (self.find('?') == std::string::npos ? "?page=" : "&page=") + std::to_string(n); };
    links.add(page_iri(1), "first");
    links.add(page_iri(pages), "last");
    if (page > 1) links.add(page_iri(page - 1), "prev");
    if (page < pages) links.add(page_iri(page + 1), "next");
  };
  if (const Paged* const paged = resource.paged()) add_pages(paged->pages(audience));
  if (container) {
    const std::vector<Resource*> members = container->members(audience);
    add_pages(page_count(members.size(), options_.max_page_members));
    const std::size_t first = std::min(members.size(), (page - 1) * options_.max_page_members);
    const std::size_t last = std::min(members.size(), first + options_.max_page_members);
    for (std::size_t i = first; i < last; ++i) links.add(base + members[i]->path, "related");
  }
  resource.link_related(links, base);
  const Variants& variants = resource.variants();
  for (std::size_t i = 0; i < variants.types.size(); ++i)
    if (!variants.variants[i].is_profile() && !document_of(resource))
      links.add(variant_iri(self, variants.types[i], page), "alternate", variants.types[i]);
  links.finish_in_parts(
      fields, [&](std::size_t next) { return self + (page > 1 ? "?page=" + std::to_string(page) + "&links=" : "?links=") + std::to_string(next); });
}

/// Shared caches may store only public responses: none that depends on rights, and none for which an authorizer was called. A
/// response that is checked each time (no-cache) needs no mark for the latter: the authorizer is then called each time.
std::string Representations::limited(const Audience& audience, std::string_view cache_control) const {
  const bool is_private = audience.is_restricted() || (!*options_.everybody_reads && cache_control != no_cache);
  return (is_private ? "private, " : "") + std::string(cache_control);
}

/// A document does not change under a target that names its version (RFC 8246).
std::string Representations::cache_control_of(const Context& context) const {
  if (document_of(*context.resource)) {
    const std::string versioned = responses_.context_iri(context.base);
    const std::string_view target = context.request().target, version = std::string_view(versioned).substr(versioned.find('?'));
    if (target.size() > version.size() && target.substr(target.size() - version.size()) == version)
      return limited(context.audience, "max-age=31536000, immutable");
  }
  return limited(context.audience, context.resource->cache_control());
}

void Representations::add_upgrade(http::Fields& fields, const Context& context) const {
  if (const std::string_view upgrade = upgrade_of(context); !upgrade.empty()) fields.add("Upgrade", upgrade);
}

/// RFC 9110 7.8: the protocols for observing the resource on this connection.
std::string_view Representations::upgrade_of(const Context& context) const {
  if (!context.resource->observable() || !context.rights.has(security::Right::subscribe)) return {};
  const Upgrades can = view_.bases.upgrades(view_.bases[context.base]);
  const bool websocket = can.websocket && context.request().local_port == 0, callback = can.callback && view_.makes_callbacks;
  if (websocket) return callback ? "websocket, callback" : "websocket";
  return callback ? "callback" : "";
}

}  // namespace lrt::engine
