// SPDX-License-Identifier: Apache-2.0
// What lrt adds to the paper, on servers that announce it: commands that expire, heartbeats, stop states.

#include <algorithm>
#include <charconv>

#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/ascii.hpp"
#include "src/check/notifications.hpp"
#include "src/check/survey.hpp"
#include "src/rdf/json_parse.hpp"

namespace lrt::check {
namespace {

using Json = rdf::json::Document;

constexpr const char* turtle_first = "text/turtle, */*;q=0.5";
constexpr const char* late_command = "https://w3id.org/lrt/ns#LateCommand";
constexpr const char* stopped_problem = "https://w3id.org/lrt/ns#Stopped";
const Iri stop_state("https://w3id.org/lrt/ns#stopState");
constexpr std::chrono::milliseconds heartbeat_time{3'000};

std::optional<Json> json_of(const Exchange& exchange) {
  rdf::json::Limits limits;
  limits.values = 100'000, limits.depth = 50;
  Result<Json> document = Json::parse(exchange.reply.body, limits);
  if (!exchange.reply.ok() && exchange.reply.status < 400) return std::nullopt;
  return document ? std::optional<Json>(*std::move(document)) : std::nullopt;
}

std::string member_of(const Json& document, Json::Id object, std::string_view name) {
  const Json::Id member = document.member(object, name);
  if (member == Json::none) return {};
  if (document.kind(member) == Json::Kind::true_) return "true";
  if (document.kind(member) == Json::Kind::false_) return "false";
  return std::string(document.text(member));
}

/// The member `type` of a problem document (RFC 9457); empty: there is none.
std::string problem_type_of(const Exchange& exchange) {
  const std::optional<Json> document = json_of(exchange);
  return document && document->kind(document->root()) == Json::Kind::object ? member_of(*document, document->root(), "type") : std::string();
}

// ----------------------------------------------------------------------------------------------------------------------------- expiry

constexpr const char* expiry_ids[] = {"expiry.late", "expiry.instance", "expiry.valid", "expiry.problem"};

/// A PUT of another value whose Valid-Until is not worth it: 412, and the value stays.
void check_expired(Context& context, std::string_view id, const std::string& url, const std::string& until, const std::string& other,
                   const std::string& what) {
  Verdicts& v = context.verdicts;
  const Exchange before = context.probe.ask("GET", url, {{"Accept", turtle_first}});
  const std::string type = before.reply.field("Content-Type");
  const Exchange put = Change::write(context, url, other, type, {{"Valid-Until", until}});
  const Exchange after = context.probe.ask("GET", url, {{"Accept", turtle_first}});
  const bool changed = after.reply.ok() && !same_content(before.reply.body, after.reply.body, before.reply.media_type(), url);
  const std::string said = "PUT " + url + " with \"Valid-Until: " + until + "\", " + what + ", ";
  if (changed) (void)Change::write(context, url, before.reply.body, type, context.probe.command_fields());
  if (put.reply.ok()) return v.fail(id, said + "gets " + std::to_string(put.reply.status), &put);
  if (put.reply.status != 412) return v.not_testable(id, said + "gets another response: " + outcome_of(put), &put);
  if (changed) return v.fail(id, said + "gets 412, and the value has changed nevertheless", &put);
  v.pass(id, &put);
  if (const std::string found = problem_type_of(put); found == late_command) v.pass("expiry.problem", &put);
  else v.fail("expiry.problem", said + "gets 412 with the problem type \"" + excerpt(found, 80) + "\", expected " + late_command, &put);
}

void check_expiry(Context& context) {
  Verdicts& v = context.verdicts;
  const Probe& probe = context.probe;
  const auto none = [&](const std::string& why) {
    for (const char* id : expiry_ids) v.otherwise(id, Outcome::not_testable, why);
  };
  if (!probe.with_robot_time) {
    v.not_testable("expiry.clock", "no response has Robot-Time");
    return none("no response has Robot-Time");
  }
  if (!probe.robot_time_fault.empty()) v.fail("expiry.clock", probe.robot_time_fault, &*probe.robot_time_evidence);
  else v.pass("expiry.clock", &*probe.with_robot_time, std::to_string(probe.robot_times) + " responses have it, and it never goes back");
  if (!probe.robot_time) return none("Robot-Time has no valid value");
  for (const std::string& url : context.options.write) {
    if (probe.exhausted()) break;
    const Exchange present = context.probe.ask("GET", url, {{"Accept", turtle_first}});
    const std::vector<std::string> others = Change::other_values(present.reply.body, present.reply.media_type(), url);
    if (!present.reply.ok() || others.empty()) continue;
    RobotTime past = *probe.robot_time, other = past;
    past.ms = past.ms > 0 ? past.ms - 1 : 0;
    for (char& c : other.instance) c = c == '0' ? '1' : '0';
    other.ms += 60'000;
    check_expired(context, "expiry.late", url, past.text(), others.front(), "which is over");
    check_expired(context, "expiry.instance", url, other.text(), others.front(), "of another run");
    const Exchange in_time = Change::write(context, url, present.reply.body, present.reply.field("Content-Type"), probe.command_fields());
    if (in_time.reply.ok()) v.pass("expiry.valid", &in_time);
    else if (in_time.reply.status == 412)
      v.fail("expiry.valid",
             "PUT " + url + " of the present value with \"" + probe.command_fields().front().first + ": " + probe.command_fields().front().second +
                 "\", a minute ahead, gets 412",
             &in_time);
    else v.not_testable("expiry.valid", outcome_of(in_time), &in_time);
    break;
  }
  none(context.options.write.empty() ? "nothing may be written: no resource was named for it" : "no resource that may be written has a number");
}

// -------------------------------------------------------------------------------------------------------------------------- heartbeat

/// The bytes of an event stream, without the framing of chunks.
std::string dechunked(const std::string& bytes) {
  std::string text;
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t end = bytes.find("\r\n", at);
    std::size_t size = 0;
    if (end == std::string::npos || std::from_chars(bytes.data() + at, bytes.data() + end, size, 16).ec != std::errc() || size == 0) break;
    text += bytes.substr(end + 2, size);
    at = std::min(bytes.size(), end + 2 + std::min(size, bytes.size()) + 2);
  }
  return text;
}

/// The data of the events of type heartbeat.
std::vector<std::string> heartbeats_of(const std::string& stream) {
  std::vector<std::string> found;
  std::string type, data;
  std::size_t at = 0;
  while (true) {
    const std::size_t end = stream.find('\n', at);
    if (end == std::string::npos) return found;
    std::string_view line = std::string_view(stream).substr(at, end - at);
    at = end + 1;
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    if (line.empty()) {
      if (type == "heartbeat") found.push_back(data);
      type.clear(), data.clear();
    } else if (const std::size_t colon = line.find(':'); colon != std::string_view::npos) {
      const std::string value(lrt::detail::trim(line.substr(colon + 1)));
      if (line.substr(0, colon) == "event") type = value;
      else if (line.substr(0, colon) == "data") data += value;
    }
  }
}

std::string with_query(const std::string& url, const std::string& query) { return url + (url.find('?') == std::string::npos ? "?" : "&") + query; }

void check_heartbeat(Context& context) {
  Verdicts& v = context.verdicts;
  const auto none = [&](const std::string& why, const Exchange* exchange = nullptr) {
    for (const char* id : {"heartbeat.comes", "heartbeat.refused"}) v.not_testable(id, why, exchange);
  };
  if (!context.options.subscribe) return none("subscriptions are switched off");
  if (!context.probe.robot_time) return none("no response has Robot-Time");
  const auto found = std::find_if(context.resources.begin(), context.resources.end(), [](const Resource& r) { return r.property && r.exists(); });
  const Resource& r = found == context.resources.end() ? context.resources.front() : *found;
  const std::string url = with_query(r.url, "heartbeat=0.5");
  const Result<http::Url> parts = url_of(url);
  if (!parts || context.probe.exhausted()) return none("a limit was reached");
  const std::string bytes =
      "GET " + parts->target + " HTTP/1.1\r\n" + context.probe.own_fields(url) + "Accept: text/event-stream\r\nConnection: close\r\n\r\n";
  Exchange exchange{url, context.probe.shown(url, bytes), {}};
  Result<Connection> connection = context.probe.connect(url);
  if (!connection) return none(connection.error().message);
  (void)connection->write(bytes, context.probe.until());
  std::string& received = connection->received();
  while (received.find("\r\n\r\n") == std::string::npos && connection->receive(context.probe.until())) {}
  const std::size_t end = received.find("\r\n\r\n");
  if (end == std::string::npos) return none("an event stream has no response");
  const std::string header = lrt::detail::lower(received.substr(0, end + 2));
  exchange.reply.version = "HTTP/1.1";
  (void)std::from_chars(header.data() + std::min<std::size_t>(9, header.size()), header.data() + header.size(), exchange.reply.status);
  if (exchange.reply.status != 200 || header.find("text/event-stream") == std::string::npos)
    return none("there is no event stream: " + outcome_of(exchange), &exchange);
  const bool chunked = header.find("transfer-encoding: chunked") != std::string::npos;
  const exchange::Instant until = context.probe.patiently(heartbeat_time);
  std::vector<std::string> beats;
  do {
    const std::string body = received.substr(end + 4);
    beats = heartbeats_of(chunked ? dechunked(body) : body);
    exchange.reply.body = excerpt(body, 300);
  } while (beats.size() < 2 && received.size() < context.options.max_body_bytes && connection->receive(until));
  const auto stamp = [&](std::size_t i) { return RobotTime::parse(beats[i]); };
  if (beats.size() < 2)
    v.fail("heartbeat.comes",
           "GET " + url + " as an event stream: " + std::to_string(beats.size()) + " events of type heartbeat came within " +
               std::to_string(heartbeat_time.count() / 1000) + " s, expected one each half second",
           &exchange);
  else if (!stamp(0) || !stamp(1))
    v.fail("heartbeat.comes",
           "GET " + url + " as an event stream: the data of a heartbeat is \"" + excerpt(stamp(0) ? beats[1] : beats[0], 60) +
               "\", expected a value as that of Robot-Time",
           &exchange);
  else if (stamp(1)->ms < stamp(0)->ms || stamp(0)->instance != stamp(1)->instance || stamp(0)->instance != context.probe.robot_time->instance)
    v.fail("heartbeat.comes",
           "GET " + url + " as an event stream: \"" + beats[0] + "\" is followed by \"" + beats[1] + "\", and Robot-Time was \"" +
               context.probe.robot_time->text() + "\"",
           &exchange);
  else v.pass("heartbeat.comes", &exchange, "\"" + beats[0] + "\", then \"" + beats[1] + "\"");
  const Exchange wrong = context.probe.ask("GET", with_query(r.url, "heartbeat=often"), {{"Accept", "text/event-stream"}});
  if (wrong.reply.status >= 400 && wrong.reply.status < 500) v.pass("heartbeat.refused", &wrong);
  else v.fail("heartbeat.refused", "GET " + wrong.url + ": " + outcome_of(wrong) + ", expected 400", &wrong);
}

// ------------------------------------------------------------------------------------------------------------------------- stop state

struct StopState {
  std::string thing, state;
  const Exchange* source;
};

/// What would be unavailable: what may be commanded below the Thing, besides the release.
std::string unavailable(const Context& context, const StopState& stop, const std::string& release) {
  std::string all;
  for (const Resource& r : context.resources) {
    const bool below = r.url.compare(0, stop.thing.size() + 1, stop.thing + "/") == 0;
    const bool commands = r.action || r.allow.count("PUT") != 0;
    if (below && commands && r.url != release && !r.subscriptions && !r.subscription) all += (all.empty() ? "" : ", ") + r.url;
  }
  return all;
}

void check_refused_while_stopped(Context& context, const StopState& stop) {
  for (const std::string& url : context.options.write) {
    if (url.compare(0, stop.thing.size() + 1, stop.thing + "/") != 0 || context.probe.exhausted()) continue;
    const Exchange present = context.probe.ask("GET", url, {{"Accept", turtle_first}});
    const Exchange put = Change::write(context, url, present.reply.body, present.reply.field("Content-Type"), context.probe.command_fields());
    if (put.reply.ok())
      context.verdicts.fail("stop.refuses",
                            "PUT " + url + " gets " + std::to_string(put.reply.status) + ", and " + stop.state + " says it is stopped; " +
                                "it may be a Property that moves nothing",
                            &put, Certainty::likely);
    else if (put.reply.status == 409 && problem_type_of(put) == stopped_problem) context.verdicts.pass("stop.refuses", &put);
    else if (put.reply.status == 409)
      context.verdicts.fail("stop.refuses",
                            "PUT " + url + " while it is stopped gets 409 with the problem type \"" + excerpt(problem_type_of(put), 80) +
                                "\", expected " + stopped_problem,
                            &put);
    else context.verdicts.not_testable("stop.refuses", outcome_of(put), &put);
  }
}

void check_stop_states(Context& context) {
  Verdicts& v = context.verdicts;
  std::vector<StopState> states;
  for (const Resource& r : context.resources) {
    if (!r.graph || !r.thing) continue;
    for (const rdf::TermView& object : r.graph->objects(rdf::iri(r.url), stop_state))
      if (object.is_iri()) states.push_back({r.url, std::string(object.text), &r.get});
  }
  for (const StopState& stop : states) {
    if (context.probe.exhausted()) break;
    const Exchange exchange = get(context, stop.state, {{"Accept", "application/json"}});
    const std::optional<Json> record = json_of(exchange);
    const std::string said = "GET " + stop.thing + " has lrt:stopState <" + stop.state + ">, and GET of it as JSON: ";
    if (exchange.reply.error || exchange.reply.status == 401 || exchange.reply.status == 403) {
      v.not_testable("stop.state", said + outcome_of(exchange), &exchange);
      continue;
    }
    const std::string stopped = record && record->kind(record->root()) == Json::Kind::object ? member_of(*record, record->root(), "stopped") : "";
    if (stopped != "true" && stopped != "false") {
      v.fail("stop.state", said + outcome_of(exchange) + ", without a boolean member \"stopped\"", &exchange);
      continue;
    }
    const std::string release = member_of(*record, record->root(), "release");
    const std::string list = unavailable(context, stop, release);
    const Result<http::Url> parts = url_of(stop.thing);
    const std::string root = context.options.root.empty() && parts ? parts->origin() + "/" : context.options.root;
    const Exchange overview = get(context, root, {{"Accept", "application/json"}});
    std::string there = "none";
    if (const std::optional<Json> all = json_of(overview)) {
      const Json::Id array = all->kind(all->root()) == Json::Kind::object ? all->member(all->root(), "stopStates") : Json::none;
      if (array != Json::none)
        for (Json::Id i = all->first(array); i != Json::none; i = all->next(i))
          if (member_of(*all, i, "thing") == stop.thing || member_of(*all, i, "state") == stop.state) there = member_of(*all, i, "stopped");
    }
    const Exchange again = get(context, stop.state, {{"Accept", "application/json"}});
    if (there == stopped)
      v.pass("stop.state", &exchange, "while it is stopped, these are unavailable: " + (list.empty() ? "none that was visited" : list));
    else if (again.reply.body != exchange.reply.body) v.not_testable("stop.state", "it changes between two requests", &exchange);
    else
      v.fail("stop.state", "GET " + stop.state + " has \"stopped\": " + stopped + ", and in \"stopStates\" of " + root + " it is " + there,
             &overview);
    context.notes.push_back("while " + stop.thing + " is stopped, these are unavailable: " + (list.empty() ? "none that was visited" : list));
    if (stopped == "true") check_refused_while_stopped(context, stop);
    else v.not_testable("stop.refuses", stop.thing + " is not stopped, and the check stops nothing", &exchange);
  }
  v.otherwise("stop.state", Outcome::not_testable, "no Thing states lrt:stopState");
  v.otherwise("stop.refuses", Outcome::not_testable,
              states.empty() ? "no Thing states lrt:stopState" : "no resource below a stopped Thing may be written");
}

}  // namespace

void check_extensions(Context& context) {
  check_heartbeat(context);
  check_expiry(context);
  check_stop_states(context);
}

}  // namespace lrt::check
