// SPDX-License-Identifier: Apache-2.0
// R0.3 to R0.6, R0.9 and R0.10: what each resource announces (methods, links, media types, members), and whether it is so.

#include <algorithm>
#include <map>

#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/ascii.hpp"
#include "src/base/random.hpp"
#include "src/check/survey.hpp"
#include "src/rdf/json_parse.hpp"

namespace lrt::check {
namespace {

using lrt::detail::lower;
using lrt::detail::trim;

constexpr std::string_view contains = "<http://www.w3.org/ns/ldp#contains>";
constexpr const char* unknown_type = "application/x-lrt-check";
constexpr std::size_t max_links = 60, max_links_if_slow = 8;  // whose targets are read
constexpr std::size_t max_members = 20;                       // of one container
constexpr std::size_t max_types = 8;                          // of one Accept-Post

std::set<std::string> methods_of(const http::Fields& fields) {
  std::set<std::string> methods;
  for (std::string& method : list_of(fields.joined("Allow"))) methods.insert(std::move(method));
  return methods;
}

std::string joined(const std::set<std::string>& words) {
  std::string all;
  for (const std::string& word : words) all += (all.empty() ? "" : ", ") + word;
  return all;
}

/// By its links or triples.
bool is_container(const Resource& r) {
  for (const client::Link& link : r.links)
    if (link.relation == "type" && link.target.compare(0, 24, "http://www.w3.org/ns/ldp") == 0 && link.target.find("Container") != std::string::npos)
      return true;
  return r.graph && (r.graph->contains(rdf::iri(r.url), vocab::rdf_::type, vocab::ldp::Container) ||
                     r.graph->contains(rdf::iri(r.url), vocab::rdf_::type, vocab::ldp::BasicContainer));
}

/// Another response's Allow is that of OPTIONS.
void check_same_allow(Context& context, const Resource& r, const Exchange& other, const std::string& what) {
  const std::set<std::string> methods = methods_of(other.reply.fields);
  if (methods.empty() || r.allow.empty()) return;
  if (methods == r.allow) context.verdicts.pass("options.agrees", &other);
  else
    context.verdicts.fail("options.agrees",
                          r.url + ": Allow is \"" + joined(r.allow) + "\" in the response to OPTIONS, and \"" + joined(methods) + "\" in " + what,
                          &other, Certainty::likely);
}

bool is_gone(int status) { return status == 404 || status == 410; }

std::string random_name() {
  unsigned char bytes[8];
  fill_random(bytes, sizeof bytes);
  std::string name = "lrt-check-";
  for (const unsigned char byte : bytes) name += "0123456789abcdef"[byte % 16];
  return name;
}

// -------------------------------------------------------------------------------------------------------------------------- R0.3 to R0.6

void check_uris(Context& context) {
  bool advertised = false;
  for (const Resource& r : context.resources) {
    // What only a container lists is judged by container.members.
    if (r.advertised_by.empty() || r.advertised_by.compare(0, contains.size(), contains) == 0) continue;
    advertised = true;
    const int status = r.get.reply.status;
    if (r.get.reply.error)
      context.verdicts.fail("uri.get", r.url + ", advertised by " + r.advertised_by + ", has no response: " + r.get.reply.error->message, &r.get,
                            r.get.reply.error->code == Errc::timed_out ? Certainty::likely : Certainty::certain);
    else if (r.exists()) context.verdicts.pass("uri.get", &r.get);
    else if (status == 401 || status == 403) context.verdicts.not_testable("uri.get", "there is no right to read " + r.url, &r.get);
    else if (status == 429 || status >= 500)
      context.verdicts.not_testable("uri.get", r.url + " cannot be read now: " + std::to_string(status), &r.get);
    else context.verdicts.fail("uri.get", r.url + ", advertised by " + r.advertised_by + ", gets " + std::to_string(status), &r.get);
  }
  if (!advertised) context.verdicts.not_applicable("uri.get", "no sub-resource is advertised");
  bool named = false;
  for (const Resource* r : context.things()) {
    if (!r->graph) continue;
    for (const Iri predicate : {vocab::hybrit::property, vocab::hybrit::action, vocab::hybrit::subscriptions, vocab::hybrit::blueprint}) {
      for (const rdf::TermView& object : r->graph->objects(rdf::iri(r->url), predicate)) {
        named = true;
        if (object.is_iri()) context.verdicts.pass("uri.named", &r->get);
        else
          context.verdicts.fail(
              "uri.named", "the object of <" + std::string(predicate.text) + "> is " + excerpt(rdf::to_string(object), 100) + ", expected an IRI",
              &r->get);
      }
    }
  }
  if (!named) context.verdicts.not_applicable("uri.named", "no sub-resource is stated in RDF");
}

void check_root(Context& context) {
  const Result<http::Url> parts = url_of(context.url);
  if (!parts || context.probe.exhausted()) return;
  const std::string root = context.options.root.empty() ? parts->origin() + "/" : context.options.root;
  const Exchange exchange = root == context.url ? context.resources.front().get : get(context, root);
  if (root != context.url && exchange.reply.ok()) context.root = exchange;
  if (exchange.reply.ok()) return context.verdicts.pass("root.get", &exchange);
  const int status = exchange.reply.status;
  if (status == 401 || status == 403) return context.verdicts.not_testable("root.get", "there is no right to read " + root, &exchange);
  if (context.options.root.empty() && status == 404) {  // a server that is mounted below a path of another
    std::string path = parts->target.substr(0, parts->target.find('?'));
    while (path.size() > 1) {
      path.resize(path.rfind('/', path.back() == '/' ? path.size() : path.size() - 1) + 1);
      if (path.size() <= 1 || context.probe.exhausted()) break;
      const Exchange above = get(context, parts->origin() + path);
      if (above.reply.ok())
        return context.verdicts.pass("root.get", &above, "taken as the root, because \"/\" is 404 and may belong to another server");
      path.pop_back();
    }
  }
  context.verdicts.fail("root.get", root + ": " + outcome_of(exchange), &exchange);
}

void check_unknown(Context& context) {
  if (context.probe.exhausted()) return;
  const Result<http::Url> parts = url_of(context.url);
  if (!parts) return;
  std::string path = parts->target.substr(0, parts->target.find('?'));
  if (path.back() != '/') path += '/';
  const Exchange exchange = context.probe.ask("GET", parts->origin() + path + random_name());
  context.bad_requests.push_back(exchange);
  const int status = exchange.reply.status;
  if (exchange.reply.error) context.verdicts.fail("status.not-found", outcome_of(exchange), &exchange);
  else if (status == 401 || status == 403)
    context.verdicts.not_testable("status.not-found", "there is no right to ask: " + std::to_string(status), &exchange);
  else if (status >= 400 && status < 500) context.verdicts.pass("status.not-found", &exchange);
  else if (status < 400)
    context.verdicts.fail("status.not-found", "a GET of a URI that does not exist returned " + std::to_string(status) + "; expected 404", &exchange);
  // 5xx: status.blame
}

/// Methods that Allow lacks. Three parts of the request prevent an effect even if the server does not refuse it: a false condition, an unknown media
/// type, and a body without meaning.
void check_refused_methods(Context& context, const Resource& r) {
  for (const char* method : {"PUT", "POST", "PATCH", "DELETE"}) {
    if (r.allow.empty() || r.allow.count(method) != 0 || context.probe.exhausted()) continue;
    const bool body = std::string_view(method) != "DELETE";
    FieldList fields = {{"If-Match", never_a_tag}};
    if (body) fields.emplace_back("Content-Type", unknown_type);
    const Exchange exchange = context.probe.ask(method, r.url, fields, body ? "lrt check: to be refused" : "");
    if (!exchange.reply.error) context.bad_requests.push_back(exchange);
    const int status = exchange.reply.status;
    if (exchange.reply.error) {
      context.verdicts.not_testable("methods.refused", outcome_of(exchange), &exchange);
    } else if (status < 400) {
      context.verdicts.fail("methods.refused", std::string(method) + " is not in Allow of " + r.url + " and gets " + std::to_string(status),
                            &exchange);
    } else if (status != 405) {
      context.verdicts.pass("methods.refused", &exchange, "refused with " + std::to_string(status) + " instead of 405");
    } else {
      context.verdicts.pass("methods.refused", &exchange);
      if (!exchange.reply.fields.find("Allow")) {
        context.verdicts.fail("methods.allow-of-405", std::string(method) + " " + r.url + ": the 405 has no Allow", &exchange);
      } else {
        context.verdicts.pass("methods.allow-of-405", &exchange);
        check_same_allow(context, r, exchange, "the 405 of " + std::string(method));
      }
    }
  }
}

/// Methods that Allow lists, by requests that cannot have an effect: their body never comes. What the user permits to write is tested by writing.
void check_announced_methods(Context& context, const Resource& r) {
  const bool container = r.subscriptions || is_container(r);
  for (const char* method : {"PUT", "PATCH", "POST"}) {
    // A server might invoke an action before it reads the body.
    if (r.allow.count(method) == 0 || context.may_write(r.url) || context.probe.exhausted() || (std::string_view(method) == "POST" && !container))
      continue;
    const Exchange exchange = context.probe.ask_without_body(method, r.url, {{"If-Match", never_a_tag}, {"Content-Type", unknown_type}});
    const int status = exchange.reply.status;
    if (exchange.reply.error) context.verdicts.not_testable("methods.announced", outcome_of(exchange), &exchange);
    else if (status == 100) context.verdicts.not_testable("methods.announced", "the server wants the body before it judges the request", &exchange);
    else if (status == 405 || status == 501)
      context.verdicts.fail("methods.announced",
                            std::string(method) + " is in Allow of " + r.url + " (" + joined(r.allow) + ") and gets " + std::to_string(status),
                            &exchange);
    else context.verdicts.pass("methods.announced", &exchange);
  }
}

/// The media types that Accept-Post lists are not refused as unsupported. The bodies never come.
void check_accept_post(Context& context, const Resource& r, const Exchange& options) {
  Verdicts& v = context.verdicts;
  const bool invoked = std::any_of(context.options.invoke.begin(), context.options.invoke.end(), [&](const Invocation& i) { return i.url == r.url; });
  const bool container = r.subscriptions || is_container(r);
  const std::vector<std::string> types = list_of(r.get.reply.fields.joined("Accept-Post"));
  if (container && r.allow.count("POST") != 0) {
    if (options.reply.fields.find("Accept-Post")) v.pass("accept-post.options", &options);
    else v.fail("accept-post.options", "OPTIONS " + r.url + ": Allow has POST, and there is no Accept-Post", &options);
  }
  if (!(invoked || r.subscriptions) || types.empty() || r.allow.count("POST") == 0 || context.probe.exhausted()) return;
  const Exchange unknown = context.probe.ask_without_body("POST", r.url, {{"Content-Type", unknown_type}, {"If-Match", never_a_tag}});
  if (unknown.reply.error || unknown.reply.status == 100)
    return v.not_testable("accept-post.media-types", "the server wants the body before it judges the media type", &unknown);
  for (std::size_t i = 0; i < types.size() && i < max_types; ++i) {
    if (types[i].find('*') != std::string::npos || context.probe.exhausted()) continue;
    const Exchange exchange = context.probe.ask_without_body("POST", r.url, {{"Content-Type", types[i]}});
    if (exchange.reply.status == 415)
      v.fail("accept-post.media-types", "GET " + r.url + " lists " + types[i] + " in Accept-Post, and a POST of it gets 415", &exchange);
    else if (!exchange.reply.error) v.pass("accept-post.media-types", &exchange);
  }
}

void check_accept_patch(Context& context, const Resource& r, const Exchange& options) {
  const bool listed = options.reply.fields.find("Accept-Patch").has_value() || r.get.reply.fields.find("Accept-Patch").has_value();
  const bool allowed = r.allow.count("PATCH") != 0;
  if (r.allow.empty()) return;  // options.allow
  if (listed && !allowed)
    context.verdicts.fail("accept-patch.announced", r.url + " has Accept-Patch, and Allow has no PATCH: " + joined(r.allow), &options);
  else if (allowed && !options.reply.fields.find("Accept-Patch"))
    context.verdicts.fail("accept-patch.announced", "OPTIONS " + r.url + ": Allow has PATCH, and there is no Accept-Patch", &options);
  else if (allowed) context.verdicts.pass("accept-patch.announced", &options);
}

// ------------------------------------------------------------------------------------------------------------------------ R0.9, R0.10

void check_links(Context& context) {
  bool applicable = false;
  for (const Resource* r : context.things()) {
    if (!r->graph) continue;
    std::vector<std::string> missing;
    std::size_t stated = 0;
    for (const Iri predicate : {vocab::hybrit::property, vocab::hybrit::action, vocab::hybrit::subscriptions}) {
      for (const rdf::TermView& object : r->graph->objects(rdf::iri(r->url), predicate)) {
        const std::string target = without_fragment(std::string(object.text));
        if (!object.is_iri() || !client::same_origin(target, r->url)) continue;
        ++stated;
        if (r->related.count(target) == 0) missing.push_back(target);
      }
    }
    if (stated == 0) continue;
    applicable = true;
    if (missing.empty()) context.verdicts.pass("link.related", &r->get);
    else
      context.verdicts.fail("link.related",
                            std::to_string(missing.size()) + " of " + std::to_string(stated) + " sub-resources of <" + r->url +
                                "> have no link, such as <" + missing.front() + ">",
                            &r->get);
  }
  if (applicable) return;
  for (const Resource& r : context.resources)
    if (!r.related.empty()) return context.verdicts.pass("link.related", &r.get);
  context.verdicts.not_testable("link.related", "no response states a sub-resource, so none can be missing", &context.resources.front().get);
}

void check_options(Context& context, Resource& r) {
  const Exchange exchange = context.probe.ask("OPTIONS", r.url);
  if (!exchange.reply.ok()) {
    if (exchange.reply.status == 401 || exchange.reply.status == 403)
      return context.verdicts.not_testable("options.success", "no right: " + std::to_string(exchange.reply.status), &exchange);
    context.verdicts.fail("options.success", r.url + ": " + outcome_of(exchange), &exchange);
    return context.verdicts.not_applicable("options.allow", "OPTIONS has no success");
  }
  context.verdicts.pass("options.success", &exchange);
  r.allow = methods_of(exchange.reply.fields);
  if (r.allow.empty()) context.verdicts.fail("options.allow", r.url + ": there is no Allow", &exchange);
  else if (r.allow.count("GET") == 0) context.verdicts.fail("options.allow", r.url + ": GET works and is not in Allow", &exchange);
  else context.verdicts.pass("options.allow", &exchange);
  check_same_allow(context, r, r.get, "that to GET");
  check_accept_post(context, r, exchange);
  check_accept_patch(context, r, exchange);
  if (r.allow.empty()) return;
  if (r.allow.count("HEAD") != 0) context.verdicts.pass("options.complete", &exchange);
  else if (r.allow.count("GET") != 0) {
    const Exchange head = context.probe.ask("HEAD", r.url);
    if (head.reply.ok()) context.verdicts.fail("options.complete", "HEAD " + r.url + " works and is not in Allow: " + joined(r.allow), &exchange);
  }
}

// ------------------------------------------------------------------------------------------------------------------------------ links

/// The target of a link, as the visit has read it or as it is read now.
class Targets {
 public:
  explicit Targets(Context& context) : context_(context) {
    for (const Resource& r : context.resources) known_.emplace(r.url, r.get);
  }
  /// nullptr: too many have been read.
  const Exchange* read(const std::string& target) {
    const std::string url = without_fragment(target);
    if (const auto found = known_.find(url); found != known_.end()) return &found->second;
    const std::size_t max = context_.sample().size() == existing() ? max_links : max_links_if_slow;
    if (read_ >= max || context_.probe.exhausted()) return nullptr;
    ++read_;
    return &known_.emplace(url, get(context_, url)).first->second;
  }

 private:
  std::size_t existing() const {
    return static_cast<std::size_t>(
        std::count_if(context_.resources.begin(), context_.resources.end(), [](const Resource& r) { return r.exists(); }));
  }
  Context& context_;
  std::map<std::string, Exchange> known_;
  std::size_t read_ = 0;
};

/// Relations whose target is there. Others name a class, or a place where something may be put (acl, edit).
bool promises_target(const std::string& relation) {
  static constexpr std::string_view all[] = {
      "about", "canonical", "collection", "contents",        "describedby",  "first",       "help",
      "index", "item",      "last",       "license",         "next",         "prev",        "previous",
      "start", "up",        "via",        "version-history", "service-desc", "service-doc", "terms-of-service"};
  return std::find(std::begin(all), std::end(all), relation) != std::end(all) || relation == "http://www.w3.org/ns/ldp#constrainedBy" ||
         relation.compare(0, 23, "https://w3id.org/lrt/ns") == 0;
}

void check_targets(Context& context, Targets& targets) {
  Verdicts& v = context.verdicts;
  const Result<http::Url> parts = url_of(context.url);
  const std::string root = parts ? parts->origin() + "/" : std::string();
  for (const Resource& r : context.resources) {
    for (const client::Link& link : r.links) {
      // Others are judged by alternates.get, uri.get and root.get.
      if (!promises_target(link.relation) || link.target == root || !client::same_origin(link.target, context.url)) continue;
      const Exchange* const target = targets.read(link.target);
      if (target == nullptr) continue;
      const bool described = link.relation == "describedby";
      const char* const id = described ? "link.describedby" : "link.targets";
      const std::string what = "GET " + r.url + " has Link: <" + link.target + ">; rel=\"" + link.relation + "\", and GET of it: ";
      if (target->reply.error) v.not_testable(id, outcome_of(*target), target);
      else if (is_gone(target->reply.status)) v.fail(id, what + std::to_string(target->reply.status), target);
      else if (described && target->reply.ok() && target->reply.body.empty()) v.fail(id, what + "the description is empty", target);
      else v.pass(id, target);
    }
  }
  v.otherwise("link.targets", Outcome::not_applicable, "no response has links to other documents of this server");
  v.otherwise("link.describedby", Outcome::not_applicable, "no response has a link with rel=describedby");
}

/// Why bytes cannot be of that media type; empty: they may be.
std::string fault_of_bytes(const Context& context, const Exchange& exchange) {
  const std::string type = exchange.reply.media_type(), &body = exchange.reply.body;
  const auto ends_with = [&type](std::string_view end) {
    return type.size() > end.size() && type.compare(type.size() - end.size(), end.size(), end) == 0;
  };
  std::string fault;
  if (rdf::syntax_of(type)) {
    (void)graph_of(context, exchange, &fault);
    return fault;
  }
  if (type == "application/json" || ends_with("+json")) {
    rdf::json::Limits limits;
    limits.values = 1'000'000, limits.depth = 200, limits.nul = true;
    const auto document = rdf::json::Document::parse(body, limits);
    // A number beyond double and a repeated member are JSON, too.
    if (!document && (body.empty() || std::string_view("{[\"-0123456789tfn \t\r\n").find(body.front()) == std::string_view::npos))
      return document.error().message;
    return {};
  }
  const std::string_view start = trim(std::string_view(body).substr(0, 1'000));
  if ((type == "text/html" || type == "application/xml" || type == "text/xml" || ends_with("+xml")) &&
      (start.empty() || (start.front() != '<' && start.front() != '\xEF' && static_cast<unsigned char>(start.front()) < 0xFE)))
    return "it does not begin with \"<\"";
  if (type == "image/png" && body.compare(0, 4, "\x89PNG") != 0) return "it has not the signature of PNG";
  if (type == "image/jpeg" && body.compare(0, 2, "\xFF\xD8") != 0) return "it has not the signature of JPEG";
  if (type == "image/gif" && body.compare(0, 3, "GIF") != 0) return "it has not the signature of GIF";
  return {};
}

void check_bytes(Context& context, const Exchange& exchange) {
  if (!exchange.reply.ok() || exchange.reply.status == 204 || exchange.reply.truncated || exchange.reply.media_type().empty()) return;
  if (const std::string fault = fault_of_bytes(context, exchange); fault.empty()) context.verdicts.pass("alternates.bytes", &exchange);
  else
    context.verdicts.fail("alternates.bytes",
                          "GET " + exchange.url + ": Content-Type is " + exchange.reply.media_type() + ", and of the body " + fault, &exchange);
}

/// The links to other representations, of one resource of each kind.
void check_alternates(Context& context) {
  Verdicts& v = context.verdicts;
  std::set<std::string> kinds;
  for (const Resource& r : context.resources) {
    if (!r.exists()) continue;
    if (!rdf::syntax_of(r.get.reply.media_type())) check_bytes(context, r.get);  // rdf.valid judges RDF
    const char* const kind = r.property ? "property" : r.action ? "action" : r.thing ? "thing" : "other";
    if (!kinds.insert(context.may_write(r.url) ? "written" : kind).second) continue;
    for (const client::Link& link : r.links) {
      if (link.relation != "alternate" || !client::same_origin(link.target, context.url) || context.probe.exhausted()) continue;
      if (without_fragment(link.target) == r.url) continue;  // by Accept: negotiate.accept
      const Exchange exchange = get(context, link.target);
      const std::string what = "GET " + r.url + " has a link to the alternate <" + link.target + "> of type " + link.type + ", and GET of it: ";
      if (exchange.reply.error || exchange.reply.status == 401 || exchange.reply.status == 403 || exchange.reply.status == 429 ||
          exchange.reply.status == 503) {
        v.not_testable("alternates.get", outcome_of(exchange), &exchange);
      } else if (!exchange.reply.ok()) {
        v.fail("alternates.get", what + std::to_string(exchange.reply.status), &exchange);
      } else if (!link.type.empty() && lower(link.type.substr(0, link.type.find(';'))) != exchange.reply.media_type()) {
        v.fail("alternates.get", what + "Content-Type is " + exchange.reply.media_type(), &exchange);
      } else {
        v.pass("alternates.get", &exchange);
        check_bytes(context, exchange);
      }
    }
  }
  v.otherwise("alternates.get", Outcome::not_applicable, "no response has a link with rel=alternate to another URL");
  v.otherwise("alternates.bytes", Outcome::not_applicable, "all representations are in RDF, which rdf.valid judges");
}

// ------------------------------------------------------------------------------------------------------------------------- containers

void check_container(Context& context, const Exchange& container, const rdf::Graph& graph, Targets& targets) {
  Verdicts& v = context.verdicts;
  const rdf::TermView subject = rdf::iri(container.url), predicate = vocab::ldp::contains;
  std::size_t count = 0;
  for (const rdf::Triple& t : graph.match(&subject, &predicate, nullptr)) {
    const rdf::TermView member = graph.term(t.object);
    if (!member.is_iri() || !client::same_origin(std::string(member.text), context.url) || ++count > max_members) continue;
    const Exchange* const read = targets.read(std::string(member.text));
    if (read == nullptr) continue;
    if (read->reply.error) v.not_testable("container.members", outcome_of(*read), read);
    else if (is_gone(read->reply.status))
      v.fail("container.members",
             "GET " + container.url + " has ldp:contains <" + std::string(member.text) + ">, and GET of it: " + std::to_string(read->reply.status),
             read);
    else v.pass("container.members", read);
  }
  if (count == 0 || context.probe.exhausted()) return;
  const Exchange minimal = context.probe.ask(
      "GET", container.url,
      {{"Accept", "text/turtle"}, {"Prefer", "return=representation; include=\"http://www.w3.org/ns/ldp#PreferMinimalContainer\""}});
  const std::string applied = minimal.reply.fields.joined("Preference-Applied");
  if (applied.empty() || !minimal.reply.ok()) return;
  const std::optional<rdf::Graph> without = graph_of(context, minimal);
  if (without && !without->match(&subject, &predicate, nullptr).empty())
    v.fail("prefer.applied",
           "GET " + container.url + " with PreferMinimalContainer: \"Preference-Applied: " + excerpt(applied, 60) +
               "\", and ldp:contains is still there",
           &minimal);
  else if (without) v.pass("prefer.applied", &minimal);
}

void check_containers(Context& context, Targets& targets) {
  for (const Resource& r : context.resources)
    if (r.exists() && r.graph) check_container(context, r.get, *r.graph, targets);
  if (context.root)
    if (const std::optional<rdf::Graph> graph = graph_of(context, *context.root)) check_container(context, *context.root, *graph, targets);
  context.verdicts.otherwise("container.members", Outcome::not_applicable, "no container with members was found");
}

}  // namespace

void check_resources(Context& context) {
  check_uris(context);
  check_root(context);
  check_links(context);
  for (Resource& r : context.resources)
    if (r.exists()) context.verdicts.pass("methods.get", &r.get);
  for (Resource* r : context.sample()) {
    if (context.probe.exhausted()) break;
    check_options(context, *r);
    check_announced_methods(context, *r);
    check_refused_methods(context, *r);
  }
  context.verdicts.otherwise("methods.refused", Outcome::not_testable, "no resource has an Allow that lacks a method");
  context.verdicts.otherwise("methods.allow-of-405", Outcome::not_testable, "no response was 405");
  context.verdicts.otherwise("methods.announced", Outcome::not_applicable, "no Allow has PUT, PATCH, or POST of a container");
  context.verdicts.otherwise("options.agrees", Outcome::not_testable, "no two responses have Allow");
  context.verdicts.otherwise("options.complete", Outcome::not_testable, "no response to OPTIONS has Allow");
  context.verdicts.otherwise("accept-post.options", Outcome::not_applicable, "no container permits POST");
  context.verdicts.otherwise("accept-post.media-types", Outcome::not_applicable,
                             "no Subscriptions resource and no action that may be invoked has Accept-Post");
  context.verdicts.otherwise("accept-patch.announced", Outcome::not_applicable, "no Allow has PATCH");
  check_unknown(context);
  Targets targets(context);
  check_targets(context, targets);
  check_alternates(context);
  check_containers(context, targets);
}

}  // namespace lrt::check
