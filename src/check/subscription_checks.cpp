// SPDX-License-Identifier: Apache-2.0
// R0.12 to R0.17: WebSockets and web callbacks.

#include <algorithm>

#include <lrt/base/iri.hpp>
#include <lrt/base/media_type.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/ascii.hpp"
#include "src/check/notifications.hpp"
#include "src/check/receiver.hpp"
#include "src/check/survey.hpp"
#include "src/check/websocket.hpp"

namespace lrt::check {
namespace {

constexpr std::size_t max_candidates = 4;
constexpr std::chrono::milliseconds beginning_time{300};  // a server that sends a callback at the beginning does it at once
constexpr std::size_t max_ignored = 2;                    // resources at which a callback is waited for in vain
constexpr const char* other_type = "application/n-triples";

bool names_protocol(const Resource& r, std::string_view protocol) {
  return lrt::detail::lower(r.get.reply.fields.joined("Upgrade")).find(protocol) != std::string::npos;
}

/// The verdicts on the changes that were seen, by the ids of a protocol.
void judge_changes(Context& context, const Observation& found, std::string_view notified, std::string_view content, const Exchange& opened) {
  Verdicts& v = context.verdicts;
  const Exchange* const proof = found.proof ? &*found.proof : &opened;
  if (!found.not_testable.empty()) {
    v.not_testable(notified, found.not_testable, proof);
    v.not_testable(content, found.not_testable, proof);
  } else if (!found.missing.empty()) {
    v.fail(notified, found.missing, proof);
    v.not_testable(content, "a change had no message");
  } else {
    v.pass(notified, proof, found.seen);
    if (found.wrong.empty()) v.pass(content, proof, found.seen);
    else v.fail(content, found.wrong, proof);
  }
}

/// The resource to subscribe to: one that may be written, so that there are changes; one that changes by itself; one that is marked as observable;
/// Properties before Things before others.
std::vector<const Resource*> candidates(const Context& context, std::string_view protocol) {
  std::vector<const Resource*> all;
  for (const Resource& r : context.resources)
    if (r.exists() && !r.subscriptions && !r.subscription && !r.blueprint) all.push_back(&r);
  const auto rank = [&](const Resource* r) {
    return (context.may_write(r->url) ? 0 : 40) + (r->changes ? 0 : 20) + (names_protocol(*r, protocol) ? 0 : 10) +
           (r->property ? 0
            : r->thing  ? 1
            : r->action ? 3
                        : 2);
  };
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

// ------------------------------------------------------------------------------------------------------------------------ WebSockets

constexpr const char* websocket_ids[] = {"ws.accept",        "ws.fields",   "ws.frames",  "ws.ping",      "ws.close",
                                         "ws.first-message", "ws.notified", "ws.content", "ws.media-type"};

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
  const auto message_until = [&] { return context.probe.patiently(context.options.message_time); };
  if (socket.accept_is_right()) v.pass("ws.accept", &opened);
  else
    v.fail("ws.accept",
           "Sec-WebSocket-Accept is \"" + excerpt(opened.reply.field("Sec-WebSocket-Accept"), 60) + "\", which does not belong to the key", &opened);
  if (const std::string fault = socket.field_fault(); fault.empty()) v.pass("ws.fields", &opened);
  else v.fail("ws.fields", fault, &opened);

  const auto shown_as = [&opened](const std::string& payload) {
    Exchange shown = opened;
    shown.sent = "(a message of the WebSocket, after)\n" + shown.sent;
    shown.reply.body = payload;
    return shown;
  };
  const std::string usual = before.reply.media_type();
  const std::optional<WebSocket::Message> first = socket.message(message_until());
  const Exchange after = context.probe.ask("GET", url, accept_of(type));
  const bool changed = before.reply.ok() && after.reply.ok() && before.reply.body != after.reply.body;
  if (first) {
    const Exchange shown = shown_as(first->payload);
    if (same_content(first->payload, before.reply.body, usual, url) || same_content(first->payload, after.reply.body, usual, url))
      v.pass("ws.first-message", &shown);
    else if (changed) v.not_testable("ws.first-message", "the resource changes too fast to compare its messages with GET", &shown);
    else if (type.empty() || reads_as(first->payload, type, url) || !before.reply.ok())
      v.fail("ws.first-message", "the first message is not what GET responds", &shown);
  } else if (socket.fault().empty()) {
    v.fail("ws.first-message", "there was no message after the handshake", &opened);
  }
  bool any = first.has_value(), typed = !first || type.empty() || reads_as(first->payload, type, url);
  Exchange typed_by = first ? shown_as(first->payload) : opened;
  if (socket.fault().empty() && !socket.is_closed()) {
    const Observation found = observe(context, url, type, [&](exchange::Instant until) -> std::optional<Message> {
      std::optional<WebSocket::Message> message = socket.message(until);
      if (!message) return std::nullopt;
      any = true;
      Message taken{std::move(message->payload), {}, {}};
      taken.shown = shown_as(taken.body);
      if (typed && !type.empty() && !taken.body.empty() && !reads_as(taken.body, type, url)) typed = false, typed_by = taken.shown;
      return taken;
    });
    if (socket.fault().empty() && !socket.is_closed()) judge_changes(context, found, "ws.notified", "ws.content", opened);
  }
  if (type.empty()) v.not_applicable("ws.media-type", "the resource has one media type");
  else if (!any) v.not_testable("ws.media-type", "there was no message");
  else if (socket.is_closed()) v.not_testable("ws.media-type", "the server has closed the WebSocket");
  else if (typed) v.pass("ws.media-type", &typed_by);
  else v.fail("ws.media-type", "`Accept: " + type + "` was requested, and a message is something else", &typed_by);
  const bool answers = socket.fault().empty() && socket.ping(message_until());
  if (answers) v.pass("ws.ping", &opened);
  else if (!context.probe.is_fast()) v.not_testable("ws.ping", "there was no pong in time, and the server is slow", &opened);
  else if (socket.fault().empty() && !socket.is_closed()) v.fail("ws.ping", "a ping has no pong with its payload", &opened);
  if (socket.is_closed()) {
    v.fail("ws.handshake", "the server opens the WebSocket and closes it without being asked to", &opened);
    for (const char* id : {"ws.ping", "ws.close"}) v.not_testable(id, "the server has closed the WebSocket");
  } else if (socket.fault().empty()) {
    if (socket.close(message_until())) v.pass("ws.close", &opened);
    else if (socket.fault().empty() && !context.probe.is_fast())
      v.not_testable("ws.close", "there was no close frame in time, and the server is slow", &opened);
    else if (socket.fault().empty()) v.fail("ws.close", "a close frame has no response", &opened);
  }
  if (socket.fault().empty()) v.pass("ws.frames", &opened);
  else v.fail("ws.frames", socket.fault(), &opened);
  for (const char* id : websocket_ids)
    v.otherwise(id, Outcome::not_testable, socket.fault().empty() ? "the server has closed the WebSocket" : "a frame was ill-formed");
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

constexpr const char* callback_ids[] = {"callback.delivered", "callback.content",       "callback.media-type", "callback.cancel",
                                        "callback.ends",      "subscription.described", "container.created",   "container.removed"};

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

/// The Subscriptions resource that lists a subscription, and its GET; nullopt: none that was visited does.
std::optional<Exchange> container_of(Context& context, const std::string& subscription) {
  for (const Resource& r : context.resources) {
    if (!r.subscriptions || !r.exists() || context.probe.exhausted()) continue;
    Exchange exchange = context.probe.ask("GET", r.url, {{"Accept", "text/turtle, application/n-triples;q=0.9"}});
    const std::optional<rdf::Graph> graph = graph_of(context, exchange);
    if (!graph) continue;
    const rdf::TermView predicate = vocab::ldp::contains;
    for (const rdf::Triple& t : graph->match(nullptr, &predicate, nullptr))
      if (without_fragment(std::string(graph->term(t.object).text)) == subscription) return exchange;
  }
  return std::nullopt;
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

/// Whether the subscription is gone.
bool cancel(Context& context, std::string url, const std::string& receiver, const std::string& target, const Exchange& created) {
  Verdicts& v = context.verdicts;
  const bool located = !url.empty();
  if (url.empty()) url = find_subscription(context, receiver);
  if (url.empty()) {
    context.notes.push_back("a callback to " + receiver + " was created, and the server does not say where it can be cancelled");
    for (const char* id : {"subscription.described", "callback.cancel", "container.created", "container.removed"})
      v.not_testable(id, "the server does not say where the subscription is");
    return false;
  }
  judge_description(context, url, target, receiver);
  const bool has_container =
      std::any_of(context.resources.begin(), context.resources.end(), [](const Resource& r) { return r.subscriptions && r.exists() && r.graph; });
  const std::optional<Exchange> listed = container_of(context, url);
  if (listed) v.pass("container.created", &*listed);
  else if (has_container && located)
    v.fail("container.created", "GET " + created.url + " with Upgrade: callback has created <" + url + ">, and no Subscriptions resource lists it",
           &created);
  else v.not_testable("container.created", "no Subscriptions resource in RDF was found");
  const Exchange options = context.probe.ask("OPTIONS", url);
  const Exchange removed = context.probe.ask("DELETE", url);
  if (!removed.reply.ok()) {
    context.notes.push_back("the subscription " + url + " could not be cancelled");
    v.fail("callback.cancel",
           "DELETE of " + url +
               (removed.reply.error ? " has no response: " + removed.reply.error->message : " gets " + std::to_string(removed.reply.status)),
           &removed);
    v.not_testable("container.removed", "the subscription could not be cancelled");
    return false;
  }
  if (options.reply.ok() && options.reply.fields.find("Allow")) {
    const std::vector<std::string> allow = list_of(options.reply.fields.joined("Allow"));
    if (std::find(allow.begin(), allow.end(), "DELETE") != allow.end()) v.pass("options.complete", &options);
    else v.fail("options.complete", "DELETE of " + url + " works and is not in Allow", &options);
  }
  const Exchange gone = context.probe.ask("GET", url);
  if (gone.reply.ok()) {
    v.fail("callback.cancel", url + " is still there after DELETE", &gone);
    v.not_testable("container.removed", "the subscription could not be cancelled");
    return false;
  }
  v.pass("callback.cancel", &removed);
  if (!listed) {
    v.not_testable("container.removed", "no Subscriptions resource has listed it");
  } else if (const std::optional<Exchange> still = container_of(context, url)) {
    v.fail("container.removed", "GET " + still->url + " lists <" + url + ">, which was deleted and now gets " + std::to_string(gone.reply.status),
           &*still);
  } else {
    v.pass("container.removed", &gone);
  }
  return true;
}

/// A notification as evidence.
Exchange shown_of(const Receiver::Notification& notification, const std::string& url) {
  Exchange shown{url, "(received by the check)\n" + notification.text, {}};
  shown.reply.error = Error{Errc::failed, "this was a request of the server; the check responded 204"};
  return shown;
}

std::string media_type_of(const Receiver::Notification& notification) {
  const std::string field(notification.fields.find("Content-Type").value_or(std::string_view()));
  return lrt::detail::lower(lrt::detail::trim(std::string_view(field).substr(0, field.find(';'))));
}

/// The media type of a notification, whatever its content. An empty one is judged by callback.content.
void judge_media_type(Context& context, const Receiver::Notification& notification, const std::string& type, const std::string& url) {
  Verdicts& v = context.verdicts;
  const Exchange shown = shown_of(notification, url);
  const std::string found = media_type_of(notification);
  if (type.empty()) v.not_applicable("callback.media-type", "the resource has one media type");
  else if (found != type)
    v.fail("callback.media-type", "`Accept: " + type + "` was requested, and the notification is " + (found.empty() ? "without Content-Type" : found),
           &shown);
  else if (!notification.body.empty() && !reads_as(notification.body, type, url))
    v.fail("callback.media-type", "the notification says " + type + " and is something else", &shown);
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
    std::optional<Receiver::Notification> first = claimed ? std::nullopt : (*receiver)->wait(context.probe.patiently(context.options.message_time));
    if (!first && !claimed) {  // an ordinary GET: Upgrade was ignored
      ++ignored;
      continue;
    }
    v.pass("callback.created", &asked);
    // What is sent at the beginning tells of no change.
    if (!first) first = (*receiver)->wait(context.probe.patiently(std::min(context.options.message_time, beginning_time)));
    if (first) judge_media_type(context, *first, type, r->url);
    const Observation found = observe(context, r->url, type, [&](exchange::Instant until) -> std::optional<Message> {
      const std::optional<Receiver::Notification> notification = (*receiver)->wait(until);
      if (!notification) return std::nullopt;
      judge_media_type(context, *notification, type, r->url);
      return Message{notification->body, media_type_of(*notification), shown_of(*notification, r->url)};
    });
    judge_changes(context, found, "callback.delivered", "callback.content", asked);
    v.otherwise("callback.media-type", Outcome::not_testable, "there was no notification");
    const bool cancelled = cancel(context, subscription_of(context, asked), (*receiver)->url(), r->url, asked);
    if (cancelled) {
      while ((*receiver)->wait(std::chrono::steady_clock::now())) {}
      Change change(context, r->url);  // of which nobody must be told
      if (!change.make()) v.not_testable("callback.ends", change.reason());
      else context.ended = {*std::move(receiver), r->url};
    } else {
      v.not_testable("callback.ends", "the subscription could not be cancelled");
    }
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

/// The receiver of a cancelled callback has got nothing while the other checks have changed the value.
void check_ended_subscriptions(Context& context) {
  if (!context.ended.receiver) return;
  if (const std::optional<Receiver::Notification> late = context.ended.receiver->wait(std::chrono::steady_clock::now())) {
    const Exchange shown = shown_of(*late, context.ended.url);
    context.verdicts.fail("callback.ends",
                          "the subscription of " + context.ended.url + " was deleted, and a change after that was sent to its receiver", &shown);
  } else {
    context.verdicts.pass("callback.ends", nullptr, "a change after the end had no notification");
  }
}

void check_subscriptions(Context& context) {
  if (!context.options.subscribe) return;
  check_websocket(context);
  check_callback(context);
}

}  // namespace lrt::check
