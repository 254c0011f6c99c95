// SPDX-License-Identifier: Apache-2.0
// R0.5 to R0.8 and R0.11: requests that change something, for resources that the user has named.

#include <algorithm>

#include <lrt/base/iri.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/check/alternatives.hpp"
#include "src/check/notifications.hpp"
#include "src/check/survey.hpp"

namespace lrt::check {
namespace {

constexpr const char* turtle_type = "text/turtle";
constexpr const char* no_rdf = "<> <urn:lrt:check> \"this Turtle has no end";

/// The verdict on a request that must be refused with 4xx.
void must_be_refused(Context& context, std::string_view id, const Exchange& exchange, const std::string& what) {
  const int status = exchange.reply.status;
  if (exchange.reply.error) context.verdicts.not_testable(id, outcome_of(exchange), &exchange);
  else if (status == 401 || status == 403 || status == 429 || status == 503)
    context.verdicts.not_testable(id, "the response is " + std::to_string(status), &exchange);
  else if (status >= 400 && status < 500) context.verdicts.pass(id, &exchange);
  else context.verdicts.fail(id, exchange.url + ": " + what + " gets " + std::to_string(status) + ", expected 4xx", &exchange);
}

/// The graph with its value replaced by one of another datatype. It is well-formed, but no shape allows it. Empty: there is no such value.
std::string violating(const rdf::Graph& graph) {
  const auto rank = [](const rdf::Triple&, const rdf::TermView& object, const rdf::TermView& predicate) {
    if (!object.is_literal()) return 0;
    if (predicate == vocab::vom::numericalValue) return 3;
    if (predicate == vocab::rdf_::value) return 2;
    const std::string_view type = object.datatype;
    for (const std::string_view numeric : {"#double", "#float", "#decimal", "#integer", "#int", "#long", "#boolean"})
      if (type.size() > numeric.size() && type.substr(type.size() - numeric.size()) == numeric) return 1;
    return 0;
  };
  const rdf::Triple* best = nullptr;
  int most = 0;
  for (const rdf::Triple& t : graph.triples())
    if (const int r = rank(t, graph.term(t.object), graph.term(t.predicate)); r > most) best = &t, most = r;
  if (best == nullptr) return {};
  rdf::Graph changed;
  for (const rdf::Triple& t : graph.triples()) {
    const rdf::TermView object = graph.term(t.object);
    const bool text = object.datatype == vocab::xsd::string.text;
    changed.add(graph.term(t.subject), graph.term(t.predicate),
                !(t == *best) ? object
                : text        ? rdf::literal("12.5", vocab::xsd::double_)
                              : rdf::literal("lrt check: not a number"));
  }
  return rdf::write(changed, rdf::Syntax::turtle).value_or(std::string());
}

bool has_blueprint(const Context& context) {
  return std::any_of(context.resources.begin(), context.resources.end(), [](const Resource& r) { return r.blueprint && r.exists(); });
}

/// A command that is right may be refused now: no right, another state, too many. 412 of a server with Robot-Time is judged by expiry.valid.
bool is_refusal(const Context& context, int status) {
  return status == 401 || status == 403 || status == 409 || status == 429 || status == 503 || (status == 412 && context.probe.robot_time);
}

/// A method that has worked is in Allow.
void check_works(Context& context, const std::string& method, const std::string& url, const Exchange& exchange) {
  for (const Resource& r : context.resources) {
    if (r.url != url || r.allow.empty()) continue;
    if (r.allow.count(method) != 0) context.verdicts.pass("options.complete", &exchange);
    else
      context.verdicts.fail("options.complete", method + " " + url + " gets " + std::to_string(exchange.reply.status) + " and is not in Allow",
                            &exchange);
  }
}

/// A server that says it has applied a preference has done so.
void check_preference(Context& context, const std::string& url, const Exchange& present) {
  Verdicts& v = context.verdicts;
  FieldList fields = context.probe.command_fields();
  fields.emplace_back("Content-Type", present.reply.field("Content-Type"));
  fields.emplace_back("Prefer", "return=representation");
  fields.emplace_back("Accept", "text/turtle, */*;q=0.5");
  const Exchange put = context.probe.ask("PUT", url, fields, present.reply.body);
  const std::string applied = put.reply.fields.joined("Preference-Applied");
  if (!put.reply.ok() || applied.find("return=representation") == std::string::npos) return;
  const Exchange now = context.probe.ask("GET", url, {{"Accept", "text/turtle, */*;q=0.5"}});
  if (put.reply.body.empty())
    v.fail("prefer.applied",
           "PUT " + url + " with Prefer: return=representation: \"Preference-Applied: " + excerpt(applied, 60) + "\", and the response (" +
               std::to_string(put.reply.status) + ") has no body",
           &put);
  else if (put.reply.media_type() == now.reply.media_type() && !same_content(put.reply.body, now.reply.body, now.reply.media_type(), url) &&
           put.reply.field("ETag") == now.reply.field("ETag"))
    v.fail("prefer.applied", "PUT " + url + " with Prefer: return=representation: the body is not what GET responds", &put);
  else v.pass("prefer.applied", &put);
}

void check_put(Context& context, const std::string& url) {
  Verdicts& v = context.verdicts;
  const Exchange present = context.probe.ask("GET", url, {{"Accept", "text/turtle, */*;q=0.5"}});
  if (!present.reply.ok()) return v.not_testable("write.put", url + ": GET: " + outcome_of(present), &present);
  const std::string tag = present.reply.field("ETag"), type = present.reply.field("Content-Type");
  const auto with = [&](const std::string& condition, const std::string& media_type) {
    FieldList fields = context.probe.command_fields();
    fields.emplace_back("Content-Type", media_type);
    if (!condition.empty()) fields.emplace_back("If-Match", condition);
    return fields;
  };
  // Requests that must be refused. Sent first, while the value is unchanged.
  const Exchange other_tag = context.probe.ask("PUT", url, with("\"lrt-check\"", type), present.reply.body);
  if (other_tag.reply.status == 412) v.pass("write.if-match", &other_tag);
  else if (other_tag.reply.ok())
    v.fail("write.if-match", url + ": a PUT with the tag of another representation gets " + std::to_string(other_tag.reply.status), &other_tag);
  else v.not_testable("write.if-match", outcome_of(other_tag), &other_tag);

  const Exchange bad = context.probe.ask("PUT", url, with(tag, turtle_type), no_rdf);
  must_be_refused(context, "write.bad-rdf", bad, "a body that is no Turtle");
  const Exchange unknown = context.probe.ask("PUT", url, with(tag, "application/x-lrt-check"), "lrt check");
  must_be_refused(context, "write.media-type", unknown, "a body of an unknown media type");
  std::string wrong;
  if (const std::optional<rdf::Graph> graph = graph_of(context, present)) wrong = violating(*graph);
  std::optional<Exchange> violation;
  if (!has_blueprint(context)) v.not_applicable("write.shape", "no Blueprint says which bodies are valid");
  else if (wrong.empty()) v.not_testable("write.shape", url + " has no literal value that could be replaced by a wrong one");
  else {
    violation = context.probe.ask("PUT", url, with(tag, turtle_type), wrong);
    must_be_refused(context, "write.shape", *violation, "a value of another datatype");
  }

  bool accepts_wrong = false;
  if (const std::optional<rdf::Graph> graph = graph_of(context, present)) {
    for (const WrongBody& body : with_wrong_alternatives(context, *graph, url)) {
      const Exchange put = context.probe.ask("PUT", url, with(tag, turtle_type), body.turtle);
      must_be_refused(context, "write.alternatives", put, body.what);
      accepts_wrong = accepts_wrong || put.reply.ok();
    }
  }
  v.otherwise("write.alternatives", Outcome::not_applicable, "no Blueprint says that a value is one of several alternatives");

  const Exchange after = context.probe.ask("GET", url, {{"Accept", "text/turtle, */*;q=0.5"}});
  if (after.reply.ok() && after.reply.body == present.reply.body) v.pass("write.unchanged", &after);
  else if (bad.reply.ok() || unknown.reply.ok() || accepts_wrong || (violation && violation->reply.ok()))
    v.not_testable("write.unchanged", "a body that must be refused was accepted");
  else if (after.reply.ok())
    v.fail("write.unchanged", url + " has changed after requests that were refused; it may also change by itself", &after, Certainty::likely);

  const std::string now_tag = after.reply.field("ETag");
  const Exchange put = context.probe.ask("PUT", url, with(tag.empty() || now_tag != tag ? std::string() : tag, type), present.reply.body);
  if (put.reply.ok()) v.pass("write.put", &put);
  else if (is_refusal(context, put.reply.status)) v.not_testable("write.put", outcome_of(put), &put);
  else
    v.fail("write.put", url + ": " + outcome_of(put) + (put.reply.error ? "" : "; the server may want less than the whole representation"), &put,
           Certainty::likely);
  if (!put.reply.ok()) return v.not_applicable("write.no-content", "no PUT succeeded");
  check_works(context, "PUT", url, put);
  if (put.reply.status == 204) v.pass("write.no-content", &put);
  else if (put.reply.status == 202) v.pass("write.no-content", &put, "202: the change is not complete yet");
  else v.fail("write.no-content", url + ": a PUT that asks for nothing more gets " + std::to_string(put.reply.status), &put);
  check_preference(context, url, present);
}

void judge_success(Context& context, const Exchange& posted) {
  Verdicts& v = context.verdicts;
  const int status = posted.reply.status;
  if (status == 204 || status == 202) v.pass("invoke.no-content", &posted);
  else if (status == 201) v.pass("invoke.no-content", &posted, "201, as LDP demands of containers");
  else if (!posted.reply.body.empty()) v.pass("invoke.no-content", &posted, std::to_string(status) + " with an output, which 204 cannot carry");
  else v.fail("invoke.no-content", posted.url + ": the response is " + std::to_string(status) + " without a body", &posted);
  const std::string location = posted.reply.field("Location");
  if (location.empty()) {
    v.not_applicable("post.location-get", "there is no Location");
    return v.fail("post.location", posted.url + ": the response " + std::to_string(status) + " has no Location", &posted);
  }
  v.pass("post.location", &posted);
  const Result<std::string> created = iri::resolve(posted.url, location);
  if (!created || !url_of(*created)) return v.fail("post.location-get", "Location is \"" + excerpt(location, 100) + "\", which is no URL", &posted);
  const Exchange exchange = get(context, *created);
  if (exchange.reply.ok()) v.pass("post.location-get", &exchange);
  else if (exchange.reply.status == 401 || exchange.reply.status == 403)
    v.not_testable("post.location-get", "no right: " + std::to_string(exchange.reply.status), &exchange);
  else v.fail("post.location-get", *created + ": " + outcome_of(exchange), &exchange);
}

void check_post(Context& context, const Invocation& invocation) {
  Verdicts& v = context.verdicts;
  const Exchange action = get(context, invocation.url, {{"Accept", turtle_type}});
  const std::optional<rdf::Graph> graph = graph_of(context, action);
  const bool consumes = !invocation.body.empty() || (graph && graph->object(rdf::iri(action.url), vocab::hybrit::consumes));
  FieldList as_turtle = context.probe.command_fields();
  as_turtle.emplace_back("Content-Type", turtle_type);
  if (consumes) {
    const Exchange bad = context.probe.ask("POST", invocation.url, as_turtle, no_rdf);
    must_be_refused(context, "invoke.bad-rdf", bad, "a body that is no Turtle");
    rdf::ReadOptions options;
    options.base = invocation.url;
    const auto syntax = rdf::syntax_of(invocation.media_type);
    std::string wrong;
    if (const Result<rdf::Graph> input = syntax ? rdf::read(invocation.body, *syntax, options) : unexpected(Errc::unsupported_syntax, ""); input) {
      wrong = violating(*input);
      for (const WrongBody& body : with_wrong_alternatives(context, *input, invocation.url))
        must_be_refused(context, "invoke.alternatives", context.probe.ask("POST", invocation.url, as_turtle, body.turtle), body.what);
    }
    v.otherwise("invoke.alternatives", Outcome::not_applicable, "no shape says that an input is one of several alternatives");
    if (!has_blueprint(context)) {
      v.not_applicable("invoke.shape", "no Blueprint says which bodies are valid");
    } else if (wrong.empty()) {
      v.not_testable("invoke.shape", "the given input has no literal value that could be replaced by a wrong one");
    } else {
      const Exchange violation = context.probe.ask("POST", invocation.url, as_turtle, wrong);
      must_be_refused(context, "invoke.shape", violation, "a value of another datatype");
    }
  } else {
    v.not_applicable("invoke.bad-rdf", "the action states no input");
    v.not_applicable("invoke.shape", "the action states no input");
    v.not_applicable("invoke.alternatives", "the action states no input");
  }
  if (invocation.body.empty() && !invocation.send_empty) return;
  FieldList fields = context.probe.command_fields();
  if (!invocation.body.empty()) fields.emplace_back("Content-Type", invocation.media_type);
  const Exchange posted = context.probe.ask("POST", invocation.url, fields, invocation.body);
  const int status = posted.reply.status;
  if (posted.reply.ok()) v.pass("invoke.post", &posted);
  else if (is_refusal(context, status)) v.not_testable("invoke.post", outcome_of(posted), &posted);
  else v.fail("invoke.post", invocation.url + ": " + outcome_of(posted), &posted, Certainty::likely);
  if (!posted.reply.ok()) return;
  check_works(context, "POST", invocation.url, posted);
  judge_success(context, posted);
}

}  // namespace

void check_writes(Context& context) {
  for (const std::string& url : context.options.write)
    if (!context.probe.exhausted()) check_put(context, url);
  for (const Invocation& invocation : context.options.invoke)
    if (!context.probe.exhausted()) check_post(context, invocation);
  context.verdicts.otherwise("prefer.applied", Outcome::not_applicable, "no response has Preference-Applied");
  for (const char* id : {"write.put", "write.no-content", "write.if-match", "write.bad-rdf", "write.media-type", "write.shape", "write.alternatives",
                         "write.unchanged"})
    context.verdicts.otherwise(id, Outcome::not_testable,
                               context.options.write.empty() ? "nothing may be written: no resource was named for it" : "no response shows it");
  for (const char* id :
       {"invoke.post", "invoke.no-content", "invoke.bad-rdf", "invoke.shape", "invoke.alternatives", "post.location", "post.location-get"})
    context.verdicts.otherwise(id, Outcome::not_testable,
                               context.options.invoke.empty() ? "nothing may be invoked: no action was named for it" : "no response shows it");
}

}  // namespace lrt::check
