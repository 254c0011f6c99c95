// SPDX-License-Identifier: Apache-2.0
#include "src/engine/responses.hpp"

#include <vector>

#include <lrt/base/immortal.hpp>
#include <lrt/base/media_type.hpp>
#include <lrt/http/problem.hpp>
#include <lrt/rdf/vocab.hpp>

#include <lrt/engine/page_source.hpp>
#include "src/base/utf8.hpp"
#include "src/engine/resources/session.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/http/etag.hpp"
#include "src/http/negotiate.hpp"
#include "src/http/target.hpp"

namespace lrt::engine {

namespace {

/// The limit for text of the client in a message.
constexpr std::size_t max_detail = 2000;

std::string cut(std::string detail) {
  if (detail.size() <= max_detail) return detail;
  detail.resize(utf8::prefix(detail, max_detail).size());
  return detail + " (cut)";
}

rdf::Graph problem_graph(const http::Problem& problem) {
  rdf::Graph graph;
  const rdf::TermId node = graph.fresh_blank();
  const auto add = [&](Iri predicate, const rdf::TermView& object) { graph.add(node, graph.intern(predicate), graph.intern(object)); };
  const std::string code = std::to_string(problem.status);
  add(vocab::rdf_::type, vocab::http_core::Response);
  if (!problem.type.empty()) add(vocab::rdf_::type, rdf::iri(problem.type));
  add(vocab::http_core::statusCodeValue, rdf::literal(code, vocab::xsd::integer));
  add(vocab::http_core::reasonPhrase, rdf::literal(http::reason_phrase(problem.status)));
  add(vocab::dcterms::description, rdf::literal(problem.detail));
  return graph;
}

}  // namespace

http::Response Responses::problem(const Context& context, http::Problem problem) const {
  const int status = problem.status;
  const std::string& detail = problem.detail = cut(std::move(problem.detail));
  static const Immortal<std::vector<std::string_view>> offers(
      std::vector<std::string_view>{"application/problem+json", "text/turtle", "application/json", page_type});
  const http::Request& request = context.request();
  http::Response response;
  response.status = status;
  std::size_t choice = 0;
  if (request.find("Accept")) choice = http::negotiate(std::string_view(request.joined("Accept")), *offers).value_or(0);
  if (choice == 1) {
    if (Result<std::string> text = rdf::write(problem_graph(problem), rdf::Syntax::turtle, options_.prefixes)) {
      response.fields.add("Content-Type", content_type(Variant(), rdf::media_type(rdf::Syntax::turtle), *text));
      response.set_body(*std::move(text));
    }
  }
  if (choice == 3 && options_.page) {
    const bool can_log_in =
        status == 401 && options_.sessions && options_.page->add_login(response, bases_[context.base] + SessionResource::location);
    if (!can_log_in) {
      options_.page->add_fields(response.fields);
      response.set_body(options_.page->error(status, detail, bases_[context.base] + "/"));
    }
  }
  if (!response.body) {
    response.fields.add("Content-Type", choice == 2 ? "application/json" : "application/problem+json");
    response.set_body(http::to_json(problem));
  }
  if (context.resource && (status == 405 || request.method == "OPTIONS")) add_allow(response.fields, *context.resource, context.audience);
  add_types(response.fields, context.resource);
  if (status < 500 && (request.method == "PUT" || request.method == "POST" || request.method == "PATCH"))
    add_constrained_by(response.fields, context);
  response.fields.add("Vary", context.vary());
  return response;
}

http::Response Responses::refused(const Context& context, const std::string& what, const Error& error) const {
  int status = 500;
  if (error.code == Errc::expected_value) status = 422;
  if (error.code == Errc::refused || error.code == Errc::out_of_range || error.code == Errc::limit_exceeded) status = 409;
  if (error.code == Errc::unavailable) status = 503;
  if (status == 500) log(LogLevel::warning, what + ": " + error.message);
  return problem(context, status, what + ": " + error.message);
}

http::Response Responses::no_resource(const Context& context) const {
  const auto target = http::split_target(context.request().target);
  return problem(context, 404, "there is no resource at \"" + std::string(target ? target->path : std::string_view()) + "\"; GET / lists the Things");
}

http::Response Responses::gone(const Context& context) const { return problem(context, 404, "the thing was removed while the request waited"); }

http::Response Responses::timed_out(const Context& context) const {
  http::Response response =
      problem(context, 503, "the robot's program did not process the request in time; the request was cancelled, try again later");
  add_retry_after(response);
  return response;
}

http::Response Responses::overloaded(const Context& context) const {
  http::Response response = problem(context, 503, "too many requests are waiting for the robot's program; try again later");
  add_retry_after(response);
  return response;
}

http::Response Responses::stopping(const Context& context) const {
  http::Response response = problem(context, 503, "the server is stopping");
  response.close = true;
  return response;
}

http::Response Responses::violation(const Context& context, const shacl::Report& report, const std::vector<BodyError>& errors) const {
  const http::Request& request = context.request();
  const auto& syntaxes = rdf::available_syntaxes();
  std::vector<std::string_view> offers;
  for (const rdf::Syntax s : syntaxes) offers.push_back(rdf::media_type(s));
  const Result<MediaType> body = MediaType::parse(request.find("Content-Type").value_or(std::string_view()));
  const bool is_plain = body && (rdf::plain_of(*body) || body->essence() == merge_patch_type);
  offers.insert(is_plain ? offers.begin() : offers.end(), {"application/problem+json", "application/json"});
  const auto choice = request.find("Accept") ? http::negotiate(std::string_view(request.joined("Accept")), offers) : 0;
  if (!choice || !rdf::syntax_of(offers[*choice])) return problem(context, 422, sentence_of(errors), json_of(errors));
  rdf::Graph placed;  // IRIs of what the server keeps
  add_placed(placed, report.to_graph(), bases_[context.base]);
  http::Response response = graph(context, 422, placed);
  add_constrained_by(response.fields, context);
  return response;
}

http::Response Responses::no_content(const Context& context, int status) const {
  http::Response response;
  response.status = status;
  if (context.resource) add_types(response.fields, context.resource);
  if (context.request().method != "DELETE") response.fields.add("Vary", context.vary());
  return response;
}

http::Response Responses::graph(const Context& context, int status, const rdf::Graph& graph, const PlainValue* value) const {
  Variants left = value ? value_variants() : graph_variants();
  const http::Request& request = context.request();
  http::Response response;
  response.status = status;
  while (!left.types.empty()) {
    std::optional<std::size_t> choice = 0;
    if (request.find("Accept")) choice = http::negotiate(std::string_view(request.joined("Accept")), left.types);
    const std::size_t at = choice.value_or(0);  // the request has been carried out: no 406
    const Variant variant = left.variants[at];
    const std::string_view type = left.types[at];
    const Result<std::string> text =
        variant.is_rdf() ? write(graph, variant, context.base) : rdf::write_plain(*value->type, *value->facets, value->value(), variant.plain());
    if (text) {
      response.fields.add("Content-Type", content_type(variant, type, *text));
      if (status < 300) response.fields.add("ETag", http::entity_tag(type, *text));
      response.fields.add("Vary", context.vary());
      if (context.resource) add_types(response.fields, context.resource);
      response.set_body(*text);
      return response;
    }
    left.types.erase(left.types.begin() + static_cast<std::ptrdiff_t>(at));
    left.variants.erase(left.variants.begin() + static_cast<std::ptrdiff_t>(at));
  }
  return problem(context, 500, "the result cannot be written");
}

void Responses::add_retry_after(http::Response& response) const { response.fields.set("Retry-After", std::to_string(options_.retry_after.count())); }

void Responses::add_allow(http::Fields& fields, const Resource& resource, const Audience& audience) const {
  const Methods methods = audience.methods(resource);
  fields.add("Allow", methods.text());
  if (methods.post) {
    const OwnProtocol* const own = resource.own_protocol();
    const std::string types = own ? std::string(own->posted_types()) : readable_types(resource.kind().is(Trait::plain_bodies));
    if (!types.empty()) fields.add("Accept-Post", types);
  }
  if (methods.put && resource.graph_store()) fields.add("Accept-Put", GraphStore::dataset_types());
  if (methods.patch) fields.add("Accept-Patch", resource.patch_types());
}

void Responses::add_types(http::Fields& fields, const Resource* resource) const {
  http::LinkWriter links;
  links.add(vocab::ldp::Resource.text, "type");
  if (resource && resource->container()) links.add(vocab::ldp::BasicContainer.text, "type");
  links.finish(fields, {});
}

/// LDP 4.2.1.6: a link to the constraints of a refused PUT or POST.
void Responses::add_constrained_by(http::Fields& fields, const Context& context) const {
  const std::string& base = bases_[context.base];
  http::LinkWriter links;
  const Resource* const r = context.resource;
  links.add(r && r->thing ? r->thing->shapes_of(base, r->input_shape()) : base + terms_, vocab::ldp::constrainedBy.text);
  links.finish(fields, {});
}

Result<std::string> Responses::write(const rdf::Graph& graph, Variant variant, std::size_t base) const {
  const bool refers = variant == Variant(rdf::Syntax::json_ld);
  return rdf::write(graph, variant.syntax(), options_.prefixes, refers ? context_iri(base) : std::string());
}

void Responses::log(LogLevel level, const std::string& message) const {
  if (options_.log) options_.log(level, message);
}

void Responses::log(LogLevel level, const char* what, const std::exception& why) const noexcept {
  try {
    log(level, std::string(what) + ": " + why.what());
  } catch (...) {}
}

}  // namespace lrt::engine
