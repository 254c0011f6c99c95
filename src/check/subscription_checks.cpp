// SPDX-License-Identifier: Apache-2.0
// R0.12 to R0.17: WebSockets and web callbacks.

#include <algorithm>

#include <lrt/base/iri.hpp>
#include <lrt/base/media_type.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/ascii.hpp"
#include "src/check/receiver.hpp"
#include "src/check/survey.hpp"
#include "src/check/websocket.hpp"

namespace lrt::check {
namespace {

constexpr std::size_t max_candidates = 4;
constexpr std::size_t max_ignored = 2;  // resources at which a callback is waited for in vain
constexpr const char* other_type = "application/n-triples";

bool names_protocol(const Resource& r, std::string_view protocol) {
  return lrt::detail::lower(r.get.reply.fields.joined("Upgrade")).find(protocol) != std::string::npos;
}

/// The resource to subscribe to: one that is marked as observable, Properties before Things before others.
std::vector<const Resource*> candidates(const Context& context, std::string_view protocol) {
  std::vector<const Resource*> all;
  for (const Resource& r : context.resources)
    if (r.exists() && !r.subscriptions && !r.subscription && !r.blueprint) all.push_back(&r);
  const auto rank = [&](const Resource* r) { return (names_protocol(*r, protocol) ? 0 : 10) + (r->property ? 0 : r->thing ? 1 : r->action ? 3 : 2); };
  std::stable_sort(all.begin(), all.end(), [&](const Resource* a, const Resource* b) { return rank(a) < rank(b); });
  if (all.size() > max_candidates) all.resize(max_candidates);
  return all;
}

/// The media type that is requested for notifications. It is not the default, so that the response shows whether Accept has an effect. Empty:
/// the resource has no other type.
std::string type_to_request(Context& context, const Resource& r) {
  const Exchange exchange = context.probe.ask("GET", r.url, {{"Accept", other_type}});
  return exchange.reply.ok() && exchange.reply.media_type() == other_type && r.get.reply.media_type() != other_type ? other_type : "";
}

FieldList accept_of(const std::string& type) { return type.empty() ? FieldList() : FieldList{{"Accept", type}}; }

/// Whether the bytes are RDF of that type.
bool reads_as(const std::string& bytes, const std::string& type, const std::string& base) {
  const auto syntax = rdf::syntax_of(type);
  return syntax && rdf::read(bytes, *syntax, {base}).has_value();
}

/// The triples as texts, sorted, without the labels of blank nodes.
std::vector<std::string> lines_of(const rdf::Graph& graph) {
  std::vector<std::string> lines;
  const auto text = [&graph](rdf::TermId id) {
    const rdf::TermView term = graph.term(id);
    return term.is_blank() ? std::string("_:") : rdf::to_string(term);
  };
  for (const rdf::Triple& t : graph.triples()) lines.push_back(text(t.subject) + " " + text(t.predicate) + " " + text(t.object));
  std::sort(lines.begin(), lines.end());
  return lines;
}

/// Whether the graphs are equal, without a comparison of blank nodes: graph isomorphism takes unbounded time for a hostile graph.
bool same_graph(const std::string& a, const std::string& b, const std::string& type, const std::string& base) {
  if (a == b) return true;
  const auto syntax = rdf::syntax_of(type);
  if (!syntax) return false;
  const Result<rdf::Graph> x = rdf::read(a, *syntax, {base}), y = rdf::read(b, *syntax, {base});
  return x && y && lines_of(*x) == lines_of(*y);
}

// ------------------------------------------------------------------------------------------------------------------------ WebSockets

constexpr const char* websocket_ids[] = {"ws.accept", "ws.fields",        "ws.frames",   "ws.ping",
                                         "ws.close",  "ws.first-message", "ws.notified", "ws.media-type"};

void check_version(Context& context, const std::string& url) {
  const Exchange exchange = context.probe.ask(
      "GET", url,
      {{"Connection", "Upgrade"}, {"Upgrade", "websocket"}, {"Sec-WebSocket-Version", "7"}, {"Sec-WebSocket-Key", "bHJ0IGNoZWNrIGxydCBjaA=="}});
  if (exchange.reply.error) context.verdicts.not_testable("ws.version", "there is no response: " + exchange.reply.error->message, &exchange);
  else if (exchange.reply.status == 101) context.verdicts.fail("ws.version", "version 7 is accepted", &exchange);
  else if (exchange.reply.ok()) context.verdicts.pass("ws.version", &exchange, "the Upgrade is ignored");
  else if (!exchange.reply.fields.find("Sec-WebSocket-Version"))
    context.verdicts.fail("ws.version", "the response is " + std::to_string(exchange.reply.status) + " without Sec-WebSocket-Version", &exchange);
  else context.verdicts.pass("ws.version", &exchange);
}

void use_websocket(Context& context, WebSocket& socket, const std::string& url, const std::string& type, const Exchange& before) {
  Verdicts& v = context.verdicts;
  const Exchange& opened = socket.exchange();
  const auto message_until = [&] { return context.probe.within(context.options.message_time); };
  if (socket.accept_is_right()) v.pass("ws.accept", &opened);
  else
    v.fail("ws.accept",
           "Sec-WebSocket-Accept is \"" + excerpt(opened.reply.field("Sec-WebSocket-Accept"), 60) + "\", which does not belong to the key", &opened);
  if (const std::string fault = socket.field_fault(); fault.empty()) v.pass("ws.fields", &opened);
  else v.fail("ws.fields", fault, &opened);

  const std::optional<WebSocket::Message> first = socket.message(message_until());
  const Exchange after = context.probe.ask("GET", url, accept_of(type));
  const bool changed = before.reply.ok() && after.reply.ok() && before.reply.body != after.reply.body;
  if (first) {
    Exchange shown = opened;
    shown.reply.body = first->payload;
    v.pass("ws.notified", &shown);
    const std::string usual = before.reply.media_type();
    if (same_graph(first->payload, before.reply.body, usual, url) || same_graph(first->payload, after.reply.body, usual, url))
      v.pass("ws.first-message", &shown);
    else if (changed) v.not_testable("ws.first-message", "the resource changes too fast to compare its messages with GET", &shown);
    else if (type.empty() || reads_as(first->payload, type, url) || !before.reply.ok())
      v.fail("ws.first-message", "the first message is not what GET responds", &shown);
    if (type.empty()) v.not_applicable("ws.media-type", "the resource has one media type");
    else if (reads_as(first->payload, type, url)) v.pass("ws.media-type", &shown);
    else v.fail("ws.media-type", "`Accept: " + type + "` was requested, and the message is something else", &shown);
  } else if (socket.fault().empty()) {
    v.not_testable("ws.media-type", "there was no message");
    if (changed) v.fail("ws.notified", "the resource has changed, and there was no message", &opened);
    else v.not_testable("ws.notified", "the resource has not changed meanwhile");
    v.fail("ws.first-message", "there was no message after the handshake", &opened);
  }
  const bool answers = socket.fault().empty() && socket.ping(message_until());
  if (answers) v.pass("ws.ping", &opened);
  else if (socket.fault().empty() && !socket.is_closed()) v.fail("ws.ping", "a ping has no pong with its payload", &opened);
  if (socket.is_closed()) {
    v.fail("ws.handshake", "the server opens the WebSocket and closes it without being asked to", &opened);
    for (const char* id : {"ws.ping", "ws.close"}) v.not_testable(id, "the server has closed the WebSocket");
  } else if (socket.fault().empty()) {
    if (socket.close(message_until())) v.pass("ws.close", &opened);
    else if (socket.fault().empty()) v.fail("ws.close", "a close frame has no response", &opened);
  }
  if (socket.fault().empty()) v.pass("ws.frames", &opened);
  else v.fail("ws.frames", socket.fault(), &opened);
  for (const char* id : websocket_ids) v.otherwise(id, Outcome::not_testable, "a frame was ill-formed");
}

void check_websocket(Context& context) {
  Verdicts& v = context.verdicts;
  std::vector<std::pair<std::string, const Resource*>> urls;
  for (const Resource* r : candidates(context, "websocket")) urls.emplace_back(r->url, r);
  // Where a server has its WebSockets elsewhere: hybrit:websocketUrl of the authors' later server.
  for (const Resource& r : context.resources) {
    if (!r.graph || urls.size() > 2 * max_candidates) continue;
    const rdf::TermView predicate = vocab::hybrit::websocketUrl;
    for (const rdf::Triple& t : r.graph->match(nullptr, &predicate, nullptr)) {
      std::string url(r.graph->term(t.object).text);
      if (url.compare(0, 2, "ws") != 0) continue;
      url = "http" + url.substr(2);
      const bool known = std::any_of(urls.begin(), urls.end(), [&url](const auto& u) { return u.first == url; });
      if (!known && client::same_origin(url, context.url) && urls.size() <= 2 * max_candidates) urls.emplace_back(url, &r);
    }
  }
  std::optional<Exchange> refused, last;
  for (const auto& [url, resource] : urls) {
    if (context.probe.exhausted()) break;
    const std::string type = type_to_request(context, *resource);
    const Exchange before = context.probe.ask("GET", resource->url, accept_of(type));
    WebSocket socket(context.probe, context.options, url, accept_of(type));
    const Reply& reply = socket.exchange().reply;
    if (socket.is_open()) {
      v.pass("ws.handshake", &socket.exchange());
      use_websocket(context, socket, resource->url, type, before);
      return check_version(context, url);
    }
    if (reply.status == 401 || reply.status == 403) refused = socket.exchange();
    last = socket.exchange();
  }
  if (refused) v.not_testable("ws.handshake", "there is no right to subscribe: " + std::to_string(refused->reply.status), &*refused);
  else if (last && last->reply.error) v.fail("ws.handshake", "the handshake has no response: " + last->reply.error->message, &*last);
  else if (last)
    v.fail("ws.handshake",
           "none of " + std::to_string(urls.size()) + " resources opens a WebSocket; the last response is " + std::to_string(last->reply.status),
           &*last);
  else v.not_testable("ws.handshake", "no resource could be asked");
  for (const char* id : websocket_ids) v.otherwise(id, Outcome::not_testable, "no WebSocket could be opened");
  v.otherwise("ws.version", Outcome::not_testable, "no WebSocket could be opened");
}

// ------------------------------------------------------------------------------------------------------------------------- callbacks

constexpr const char* callback_ids[] = {"callback.delivered", "callback.media-type", "callback.cancel", "subscription.described"};

/// The URL of the subscription by the response: Location, Content-Location, or the subject of its description. Empty: there is none.
std::string subscription_of(const Context& context, const Exchange& exchange) {
  for (const char* name : {"Location", "Content-Location"}) {
    const std::string value = exchange.reply.field(name);
    const Result<std::string> url = value.empty() ? Result<std::string>(value) : iri::resolve(exchange.url, value);
    if (url && !url->empty() && *url != exchange.url && client::same_origin(*url, exchange.url)) return without_fragment(*url);
  }
  if (const std::optional<rdf::Graph> graph = graph_of(context, exchange)) {
    const rdf::TermView type = vocab::rdf_::type;
    for (const Iri kind : {vocab::hybrit::Subscription, vocab::hybrit::WebCallback}) {
      const rdf::TermView object = kind;
      for (const rdf::Triple& t : graph->match(nullptr, &type, &object))
        if (const rdf::TermView subject = graph->term(t.subject); subject.is_iri() && client::same_origin(std::string(subject.text), exchange.url))
          return without_fragment(std::string(subject.text));
    }
  }
  return {};
}

/// The response claims that there is a callback now.
bool claims_callback(const Exchange& exchange, const std::string& receiver) {
  return exchange.reply.status == 201 || exchange.reply.status == 202 || exchange.reply.fields.find("Location") ||
         exchange.reply.body.find(receiver) != std::string::npos;
}

/// Finds a subscription by its receiver in the containers, for servers that do not say where it is.
std::string find_subscription(Context& context, const std::string& receiver) {
  for (const Resource& r : context.resources) {
    if (!r.subscriptions || context.probe.exhausted()) continue;
    const Exchange exchange = context.probe.ask("GET", r.url, {{"Accept", "text/turtle, application/n-triples;q=0.9"}});
    const std::optional<rdf::Graph> graph = graph_of(context, exchange);
    if (!graph) continue;
    for (const rdf::Triple& t : graph->triples())
      if (graph->term(t.object).text == receiver && graph->term(t.subject).is_iri())
        return without_fragment(std::string(graph->term(t.subject).text));
  }
  return {};
}

/// Type, media type, target and protocol data of a callback (paper 5.3). Others may have terms of their own for all but the type.
void judge_description(Context& context, const std::string& url, const std::string& target, const std::string& receiver) {
  Verdicts& v = context.verdicts;
  if (context.probe.exhausted()) return;
  const Exchange exchange = context.probe.ask("GET", url, {{"Accept", "text/turtle, application/n-triples;q=0.9"}});
  if (exchange.reply.status == 401 || exchange.reply.status == 403 || exchange.reply.error)
    return v.not_testable("subscription.described", outcome_of(exchange), &exchange);
  const std::optional<rdf::Graph> graph = graph_of(context, exchange);
  if (!graph) return v.fail("subscription.described", url + ": there is no RDF: " + outcome_of(exchange), &exchange);
  bool type = false, media_type = false, resource = false, protocol = false;
  const rdf::TermView subject = rdf::iri(url);
  for (const rdf::Triple& t : graph->match(&subject, nullptr, nullptr)) {
    const rdf::TermView predicate = graph->term(t.predicate), object = graph->term(t.object);
    constexpr std::string_view hybrit = "https://hybr-it-projekt.de/ns/hybr-it#";
    if (predicate == vocab::rdf_::type) type = type || object.text.substr(0, hybrit.size()) == hybrit;
    else if (object.text == receiver) protocol = true;
    else if (object.is_iri() && without_fragment(std::string(object.text)) == target) resource = true;
    else if (object.is_literal() && object.text.find('/') != std::string_view::npos && MediaType::parse(object.text)) media_type = true;
  }
  std::string missing;
  const auto need = [&](bool is, const char* what) {
    if (!is) missing += (missing.empty() ? "" : ", ") + std::string(what);
  };
  need(type, "its type");
  need(media_type, "its media type");
  need(resource, "its target");
  need(protocol, "the URL that is called");
  if (missing.empty()) v.pass("subscription.described", &exchange);
  else v.fail("subscription.described", "<" + url + "> does not state " + missing, &exchange);
}

void cancel(Context& context, std::string url, const std::string& receiver, const std::string& target) {
  Verdicts& v = context.verdicts;
  if (url.empty()) url = find_subscription(context, receiver);
  if (url.empty()) {
    context.notes.push_back("a callback to " + receiver + " was created, and the server does not say where it can be cancelled");
    v.not_testable("subscription.described", "the server does not say where the subscription is");
    return v.not_testable("callback.cancel", "the server does not say where the subscription is");
  }
  judge_description(context, url, target, receiver);
  const Exchange removed = context.probe.ask("DELETE", url);
  if (!removed.reply.ok()) {
    context.notes.push_back("the subscription " + url + " could not be cancelled");
    return v.fail("callback.cancel",
                  "DELETE of " + url +
                      (removed.reply.error ? " has no response: " + removed.reply.error->message : " gets " + std::to_string(removed.reply.status)),
                  &removed);
  }
  const Exchange gone = context.probe.ask("GET", url);
  if (gone.reply.ok()) return v.fail("callback.cancel", url + " is still there after DELETE", &gone);
  v.pass("callback.cancel", &removed);
}

void judge_notification(Context& context, const Receiver::Notification& notification, const std::string& type, const std::string& url) {
  Verdicts& v = context.verdicts;
  Exchange shown{url, "(received by the check)\n" + notification.text, {}};
  shown.reply.error = Error{Errc::failed, "this was a request of the server; the check responded 204"};
  v.pass("callback.delivered", &shown);
  const std::string field(notification.fields.find("Content-Type").value_or(std::string_view()));
  const std::string found = lrt::detail::lower(lrt::detail::trim(std::string_view(field).substr(0, field.find(';'))));
  if (type.empty()) v.not_applicable("callback.media-type", "the resource has one media type");
  else if (found != type)
    v.fail("callback.media-type", "`Accept: " + type + "` was requested, and the notification is " + (found.empty() ? "without Content-Type" : found),
           &shown);
  else if (!reads_as(notification.body, type, url)) v.fail("callback.media-type", "the notification says " + type + " and is something else", &shown);
  else v.pass("callback.media-type", &shown);
}

void check_callback(Context& context) {
  Verdicts& v = context.verdicts;
  const auto not_testable = [&](const std::string& reason, const Exchange* exchange = nullptr) {
    if (exchange != nullptr) v.not_testable("callback.created", reason, exchange);
    v.otherwise("callback.created", Outcome::not_testable, reason);
    for (const char* id : callback_ids) v.otherwise(id, Outcome::not_testable, reason);
    v.otherwise("callback.requires-uri", Outcome::not_testable, reason);
  };
  const Result<http::Url> parts = url_of(context.url);
  std::string address = context.options.callback_address;
  if (address.empty() && parts) {
    const auto literal = literal_address(parts->host);
    const std::string text = literal ? literal->text : parts->host;
    if (text == "localhost" || text.compare(0, 4, "127.") == 0) address = "127.0.0.1";
    else if (text == "::1") address = "[::1]:0";
  }
  if (address.empty()) return not_testable("the server is on another machine; an option gives the address at which it can reach this one");
  Result<std::unique_ptr<Receiver>> receiver = Receiver::open(address, context.options.max_body_bytes, context.options.client.threads);
  if (!receiver) return not_testable(receiver.error().message);

  std::optional<Exchange> refused, last;
  std::size_t ignored = 0;
  for (const Resource* r : candidates(context, "callback")) {
    if (context.probe.exhausted() || ignored == max_ignored) break;
    const std::string type = type_to_request(context, *r);
    const Exchange before = context.probe.ask("GET", r->url, accept_of(type));
    FieldList fields = {{"Connection", "close, Upgrade"}, {"Upgrade", "callback"}, {"Callback", (*receiver)->url()}};
    if (!type.empty()) fields.emplace_back("Accept", type);
    const Exchange asked = context.probe.ask("GET", r->url, fields);
    if (asked.reply.status == 401 || asked.reply.status == 403) {  // a policy is one of the server, not of this resource
      refused = asked;
      break;
    }
    last = asked;
    if (!asked.reply.ok()) continue;
    const bool claimed = claims_callback(asked, (*receiver)->url());
    const std::optional<Receiver::Notification> notification = (*receiver)->wait(context.probe.within(context.options.message_time));
    if (!notification && !claimed) {  // an ordinary GET: Upgrade was ignored
      ++ignored;
      continue;
    }
    v.pass("callback.created", &asked);
    if (notification) {
      judge_notification(context, *notification, type, r->url);
    } else {
      const Exchange after = context.probe.ask("GET", r->url, accept_of(type));
      if (before.reply.ok() && after.reply.ok() && before.reply.body != after.reply.body)
        v.fail("callback.delivered", "the resource has changed, and there was no notification", &asked);
      else
        v.not_testable("callback.delivered", "the resource has not changed meanwhile, and the paper does not ask for a notification at the beginning",
                       &asked);
      v.not_testable("callback.media-type", "there was no notification");
    }
    cancel(context, subscription_of(context, asked), (*receiver)->url(), r->url);
    const Exchange without = context.probe.ask("GET", r->url, {{"Connection", "close, Upgrade"}, {"Upgrade", "callback"}});
    context.bad_requests.push_back(without);
    if (without.reply.error) v.not_testable("callback.requires-uri", "there is no response", &without);
    else if (without.reply.status == 201 || without.reply.status == 202 ||
             (without.reply.ok() && without.reply.body != before.reply.body && without.reply.fields.find("Location")))
      v.fail("callback.requires-uri", "the response is " + std::to_string(without.reply.status), &without);
    else if (without.reply.ok())
      v.fail("callback.requires-uri", "the response is " + std::to_string(without.reply.status) + ", as if the Upgrade were not there", &without,
             Certainty::likely);
    else if (without.reply.status < 500) v.pass("callback.requires-uri", &without);
    return;
  }
  if (refused)
    return not_testable("the server refuses the receiver " + (*receiver)->url() + " by policy: " + std::to_string(refused->reply.status), &*refused);
  if (last && last->reply.ok())
    v.fail("callback.created", "the Upgrade is ignored: the response is that of an ordinary GET, and there is no notification", &*last);
  else if (last)
    v.fail("callback.created",
           last->reply.error ? "there is no response: " + last->reply.error->message : "the response is " + std::to_string(last->reply.status),
           &*last);
  not_testable("no callback could be created");
}

}  // namespace

void check_subscriptions(Context& context) {
  if (!context.options.subscribe) return;
  check_websocket(context);
  check_callback(context);
}

}  // namespace lrt::check
