#include <lrt/http/etag.hpp>
#include <lrt/http/negotiate.hpp>
#include <lrt/http/problem.hpp>

#include "src/engine/impl.hpp"
#include "src/engine/page.hpp"

namespace lrt::engine {

std::string Engine::Impl::allow(const Resource& resource) const {
  std::string methods = "GET, HEAD, OPTIONS";
  switch (resource.kind) {
    case Kind::property:
      if (static_cast<const PropertyResource&>(resource).spec->write) methods += ", PUT";
      break;
    case Kind::action:
    case Kind::subscriptions: methods += ", POST"; break;
    case Kind::invocation:
    case Kind::subscription: methods += ", DELETE"; break;
    case Kind::collection:
      if (static_cast<const CollectionResource&>(resource).spec->create) methods += ", POST";
      break;
    case Kind::member:
      if (static_cast<const MemberResource&>(resource).collection->spec->remove) methods += ", DELETE";
      break;
    default: break;
  }
  return methods;
}

void Engine::Impl::add_allow(http::Fields& fields, const Resource& resource) const {
  const std::string methods = allow(resource);
  fields.add("Allow", methods);
  if (methods.find("POST") != std::string::npos) fields.add("Accept-Post", readable_types(resource.kind != Kind::subscriptions));
}

/// LDP 4.2.1.4, 5.2.1.4: on every answer, what the resource is.
void Engine::Impl::add_types(http::Fields& fields, const Resource& resource) const {
  http::LinkWriter links;
  links.add(vocab::ldp::Resource.text, "type");
  if (is_container(resource)) links.add(vocab::ldp::BasicContainer.text, "type");
  links.finish(fields, {});
}

/// LDP 4.2.1.6: what constrains a refused PUT or POST.
void Engine::Impl::add_constrained_by(http::Fields& fields, const Context& context) {
  const std::string& base = bases_[context.base];
  http::LinkWriter links;
  links.add(context.resource && context.resource->thing ? names_base(*context.resource->thing, base) : base + terms_.path, vocab::ldp::constrainedBy.text);
  links.finish(fields, {});
}

/// SPEC 3.4: RFC 9457 problem details as JSON, or as Turtle or HTML where that is preferred; never 406.
http::Response Engine::Impl::problem(const Context& context, int status, std::string detail) {
  constexpr std::size_t longest = 2000;  // enough to say what was found; what a client sent is not sent back whole
  if (detail.size() > longest) {
    std::size_t end = longest;
    while (end > 0 && (static_cast<unsigned char>(detail[end]) & 0xC0) == 0x80) --end;
    detail.resize(end);
    detail += " (cut)";
  }
  static const std::vector<std::string_view> offers = {"application/problem+json", "text/turtle", "application/json", "text/html"};
  http::Response response;
  response.status = status;
  const bool has_accept = context.request.find("Accept").has_value();
  const std::size_t choice =
      has_accept ? http::negotiate(std::string_view(context.request.joined("Accept")), offers).value_or(0) : 0;
  if (choice == 1) {
    rdf::Graph graph;
    const rdf::TermId node = graph.fresh_blank();
    const auto add = [&](Iri predicate, const rdf::TermView& object) { graph.add(node, graph.intern(predicate), graph.intern(object)); };
    const std::string code = std::to_string(status);
    add(vocab::rdf::type, vocab::http_core::Response);
    add(vocab::http_core::statusCodeValue, rdf::literal(code, vocab::xsd::integer));
    add(vocab::http_core::reasonPhrase, rdf::literal(http::reason_phrase(status)));
    add(vocab::dcterms::description, rdf::literal(detail));
    if (Result<std::string> text = rdf::write(graph, rdf::Syntax::turtle, options_.prefixes)) {
      response.fields.add("Content-Type", "text/turtle");
      response.set_body(*std::move(text));
    }
  }
  if (choice == 3) {
    add_page_fields(response.fields);
    response.set_body(error_page(status, detail, bases_[context.base] + root_.path));
  }
  if (!response.body) {
    response.fields.add("Content-Type", choice == 2 ? "application/json" : "application/problem+json");
    response.set_body(http::to_json({status, std::move(detail)}));
  }
  if (context.resource && (status == 405 || context.request.method == "OPTIONS")) add_allow(response.fields, *context.resource);
  add_types(response.fields, context.resource ? *context.resource : terms_);  // where nothing was found, too: this server speaks LDP
  if (status < 500 && (context.request.method == "PUT" || context.request.method == "POST")) add_constrained_by(response.fields, context);
  response.fields.add("Vary", "Accept");
  return response;
}

/// An Error of user code as an answer: what the type refuses is 422, what the robot declines 409, what it failed at 500.
http::Response Engine::Impl::refused(const Context& context, const std::string& what, const Error& error) {
  int status = 500;
  if (error.code == Errc::expected_value) status = 422;
  if (error.code == Errc::refused || error.code == Errc::out_of_range || error.code == Errc::limit_exceeded) status = 409;
  if (status == 500) log(LogLevel::warning, what + ": " + error.message);
  return problem(context, status, what + ": " + error.message);
}

/// What waited for the host in vain. It has not happened and will not.
http::Response Engine::Impl::too_late(const Context& context) {
  http::Response response = problem(context, 503, "the robot's program did not take the request in time");
  response.fields.set("Retry-After", std::to_string(options_.retry_after.count()));
  return response;
}

http::Response Engine::Impl::no_content(const Context& context, int status) {
  http::Response response;
  response.status = status;
  if (context.resource) add_types(response.fields, *context.resource);
  return response;
}

http::Response Engine::Impl::violation(Context& context, const shacl::Report& report) {
  static const std::vector<std::string_view> offers = [] {
    std::vector<std::string_view> types;
    for (const rdf::Syntax s : rdf::available_syntaxes()) types.push_back(rdf::media_type(s));
    types.insert(types.end(), {"application/problem+json", "application/json"});
    return types;
  }();
  const auto choice = context.request.find("Accept") ? http::negotiate(std::string_view(context.request.joined("Accept")), offers) : 0;
  if (!choice || *choice >= rdf::available_syntaxes().size()) {
    std::string text = report.to_text();
    if (!text.empty() && text.back() == '\n') text.pop_back();
    return problem(context, 422, std::move(text));
  }
  http::Response response = with_graph(context, 422, report.to_graph());
  add_constrained_by(response.fields, context);
  return response;
}

http::Response Engine::Impl::with_graph(const Context& context, int status, const rdf::Graph& graph, const Said* said) {
  Offers offers = said ? offers_of_values() : offers_of_graphs();
  http::Response response;
  response.status = status;
  while (!offers.types.empty()) {
    std::optional<std::size_t> choice = 0;
    if (context.request.find("Accept")) choice = http::negotiate(std::string_view(context.request.joined("Accept")), offers.types);
    const std::size_t at = choice.value_or(0);  // what has happened is not taken back for the want of a format
    const Form form = offers.forms[at];
    const std::string_view type = offers.types[at];
    if (Result<std::string> text = form.is_rdf() ? write(graph, form, context.base) : rdf::write_plain(*said->type, *said->facets, said->value(), form.plain())) {
      response.fields.add("Content-Type", content_type(form, type));
      if (status < 300) response.fields.add("ETag", http::entity_tag(type, *text));
      response.fields.add("Vary", "Accept");
      if (context.resource) add_types(response.fields, *context.resource);
      response.set_body(*std::move(text));
      return response;
    }
    offers.types.erase(offers.types.begin() + static_cast<std::ptrdiff_t>(at));
    offers.forms.erase(offers.forms.begin() + static_cast<std::ptrdiff_t>(at));
  }
  return problem(context, 500, "the result cannot be written");
}

}  // namespace lrt::engine
