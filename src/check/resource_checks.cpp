// SPDX-License-Identifier: Apache-2.0
// R0.3 to R0.6 and R0.9 to R0.11: what each resource shows to GET, HEAD and OPTIONS.

#include <algorithm>

#include <lrt/rdf/vocab.hpp>

#include "src/base/ascii.hpp"
#include "src/base/random.hpp"
#include "src/check/survey.hpp"

namespace lrt::check {
namespace {

using lrt::detail::trim;

std::set<std::string> methods_of(const http::Fields& fields) {
  std::set<std::string> methods;
  const std::string joined = fields.joined("Allow");
  std::string_view rest = joined;
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find(','), rest.size());
    if (const std::string_view method = trim(rest.substr(0, end)); !method.empty()) methods.emplace(method);
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return methods;
}

bool is_weak(const std::string& tag) { return tag.compare(0, 2, "W/") == 0; }

bool is_entity_tag(std::string_view tag) {
  if (tag.substr(0, 2) == "W/") tag.remove_prefix(2);
  if (tag.size() < 2 || tag.front() != '"' || tag.back() != '"') return false;
  tag = tag.substr(1, tag.size() - 2);
  return std::all_of(tag.begin(), tag.end(), [](char c) { return c == 0x21 || (static_cast<unsigned char>(c) >= 0x23 && c != 0x7F); });
}

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
    if (r.advertised_by.empty()) continue;
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

/// PUT or POST although Allow does not list it. Three parts of the request prevent an effect even if the server does not refuse it: a false
/// condition, an unknown media type, and a body without meaning.
void check_refused_methods(Context& context, const Resource& r) {
  if (r.allow.empty() || context.probe.exhausted()) return;
  const char* method = r.allow.count("PUT") == 0 ? "PUT" : r.allow.count("POST") == 0 ? "POST" : nullptr;
  if (method == nullptr || r.action || r.allow.count("POST") != 0) return;
  const Exchange exchange =
      context.probe.ask(method, r.url, {{"If-Match", "\"lrt-check\""}, {"Content-Type", "application/x-lrt-check"}}, "lrt check: to be refused");
  if (!exchange.reply.error) context.bad_requests.push_back(exchange);
  const int status = exchange.reply.status;
  if (exchange.reply.error) return context.verdicts.not_testable("methods.refused", outcome_of(exchange), &exchange);
  if (status < 400)
    return context.verdicts.fail("methods.refused", std::string(method) + " is not in Allow of " + r.url + " and gets " + std::to_string(status),
                                 &exchange);
  if (status != 405) return context.verdicts.pass("methods.refused", &exchange, "refused with " + std::to_string(status) + " instead of 405");
  context.verdicts.pass("methods.refused", &exchange);
  if (exchange.reply.fields.find("Allow")) context.verdicts.pass("methods.allow-of-405", &exchange);
  else context.verdicts.fail("methods.allow-of-405", "the 405 has no Allow", &exchange);
}

// ------------------------------------------------------------------------------------------------------------------------- R0.9 to R0.11

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
}

void check_tags(Context& context, Resource& r) {
  Verdicts& verdicts = context.verdicts;
  const std::string before = r.get.reply.field("ETag");
  const Exchange head = context.probe.ask("HEAD", r.url);
  if (head.reply.error) verdicts.fail("http.head", r.url + ": " + outcome_of(head), &head);
  else if (head.reply.status != r.get.reply.status && !(head.reply.ok() && r.get.reply.ok()))
    verdicts.fail("http.head", r.url + ": GET gets " + std::to_string(r.get.reply.status) + ", HEAD " + std::to_string(head.reply.status), &head);
  else verdicts.pass("http.head", &head);

  const Exchange again = context.probe.ask("GET", r.url);
  if (!again.reply.ok() || (again.reply.body.empty() && again.reply.fields.find("Content-Type") == std::nullopt))
    return;  // it has changed, or has no representation
  const std::string after = again.reply.field("ETag");
  if (before.empty() || after.empty()) {
    verdicts.fail("etag.get", r.url + ": there is no ETag", before.empty() ? &r.get : &again);
    for (const char* id : {"etag.head", "etag.syntax", "etag.changes", "etag.stable", "etag.media-types", "etag.304", "etag.304-tag"})
      verdicts.not_applicable(id, "GET has no ETag");
    return;
  }
  r.etag = after;
  verdicts.pass("etag.get", &again);
  if (is_entity_tag(after)) verdicts.pass("etag.syntax", &again);
  else verdicts.fail("etag.syntax", "\"" + excerpt(after, 60) + "\" is no entity tag", &again);

  const bool same_bytes = r.get.reply.body == again.reply.body && r.get.reply.media_type() == again.reply.media_type();
  const bool unstable = same_bytes && before != after && is_weak(before) == is_weak(after);
  if (unstable) verdicts.fail("etag.stable", r.url + ": the same bytes have the tags " + before + " and " + after, &again);
  else if (same_bytes) verdicts.pass("etag.stable", &again);
  if (!same_bytes && before == after && !is_weak(before))
    verdicts.fail("etag.changes", r.url + ": two representations that differ have the tag " + before, &again);
  else if (!same_bytes) verdicts.pass("etag.changes", &again);

  const std::string of_head = head.reply.field("ETag");
  if (head.reply.ok()) {
    if (of_head.empty()) verdicts.fail("etag.head", r.url + ": the response to HEAD has no ETag", &head);
    else if (before == after && of_head != before)
      verdicts.fail("etag.head", r.url + ": HEAD has " + of_head + ", GET before and after it " + before, &head);
    else verdicts.pass("etag.head", &head);
  } else {
    verdicts.not_applicable("etag.head", "HEAD has no success");
  }

  const Exchange conditional = context.probe.ask("GET", r.url, {{"If-None-Match", after}});
  if (conditional.reply.status == 304) {
    verdicts.pass("etag.304", &conditional);
    if (conditional.reply.fields.find("ETag")) verdicts.pass("etag.304-tag", &conditional);
    else verdicts.fail("etag.304-tag", r.url + ": the 304 has no ETag", &conditional);
  } else if (conditional.reply.ok() && conditional.reply.field("ETag") == after) {
    verdicts.fail("etag.304", r.url + ": the tag is still " + after + ", and the response is " + std::to_string(conditional.reply.status),
                  &conditional);
  } else if (!conditional.reply.ok()) {
    verdicts.fail("etag.304", r.url + ": " + outcome_of(conditional), &conditional);
  } else {
    verdicts.not_testable("etag.304", "the representation changes between two requests", &conditional);
  }
}

}  // namespace

void check_resources(Context& context) {
  check_uris(context);
  check_root(context);
  check_links(context);
  for (Resource& r : context.resources) {
    if (!r.exists() || context.probe.exhausted()) continue;
    context.verdicts.pass("methods.get", &r.get);
    check_options(context, r);
    check_tags(context, r);
  }
  for (const Resource& r : context.resources)
    if (r.exists()) check_refused_methods(context, r);
  context.verdicts.otherwise("methods.refused", Outcome::not_testable, "no resource has an Allow without PUT and POST");
  context.verdicts.otherwise("methods.allow-of-405", Outcome::not_testable, "no response was 405");
  check_unknown(context);
  for (const char* id : {"etag.changes", "etag.stable", "etag.304-tag"})
    context.verdicts.otherwise(id, Outcome::not_testable, "no two responses show it");
}

}  // namespace lrt::check
