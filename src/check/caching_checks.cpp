// SPDX-License-Identifier: Apache-2.0
// R0.11 and what else caches rely on: entity tags, conditions, HEAD, ranges, dates.

#include <algorithm>
#include <cstdlib>

#include <lrt/rdf/vocab.hpp>

#include "src/base/ascii.hpp"
#include "src/check/survey.hpp"

namespace lrt::check {
namespace {

using lrt::detail::iequals_ascii;
using lrt::detail::lower;
using lrt::detail::trim;

constexpr std::size_t max_ranges = 2;      // resources whose parts are asked for
constexpr long long tolerated = 300;       // seconds between the clocks of two machines
constexpr double future_tolerated = 2;     // seconds that dcterms:modified may be after a Date, which has whole seconds
constexpr std::chrono::seconds enough{3};  // after which a Date with whole seconds must have moved

bool is_weak(const std::string& tag) { return tag.compare(0, 2, "W/") == 0; }

bool is_entity_tag(std::string_view tag) {
  if (tag.substr(0, 2) == "W/") tag.remove_prefix(2);
  if (tag.size() < 2 || tag.front() != '"' || tag.back() != '"') return false;
  tag = tag.substr(1, tag.size() - 2);
  return std::all_of(tag.begin(), tag.end(), [](char c) { return c == 0x21 || (static_cast<unsigned char>(c) >= 0x23 && c != 0x7F); });
}

/// Whether two responses have the same bytes of the same media type.
bool is_same(const Exchange& a, const Exchange& b) { return a.reply.body == b.reply.body && a.reply.media_type() == b.reply.media_type(); }

/// The members of a field that is a list, sorted, so that their order has no meaning.
std::vector<std::string> members(const std::string& value) {
  std::vector<std::string> all;
  std::string one;
  bool quoted = false;
  for (const char c : value + ",") {
    if (c == '"') quoted = !quoted;
    if (c != ',' || quoted) {
      one += c;
      continue;
    }
    if (const std::string_view member = trim(one); !member.empty()) all.emplace_back(member);
    one.clear();
  }
  std::sort(all.begin(), all.end());
  return all;
}

// ------------------------------------------------------------------------------------------------------------------------------- HEAD

/// `before` and `after` are GETs around the HEAD.
void check_head(Context& context, const Resource& r, const Exchange& head, const Exchange& after) {
  Verdicts& verdicts = context.verdicts;
  const Reply& before = r.get.reply;
  if (!head.reply.ok() || !after.reply.ok() || !before.framing_fault.empty() || before.truncated) return;
  if (const std::string length = head.reply.field("Content-Length"); length.empty()) {
    verdicts.not_applicable("head.length", "HEAD has no Content-Length, which is permitted");
  } else if (!is_same(r.get, after)) {
    verdicts.not_testable("head.length", r.url + " changes between two requests");
  } else if (length != std::to_string(before.body.size())) {
    verdicts.fail(
        "head.length",
        "HEAD " + r.url + ": Content-Length is " + length + ", and GET before and after it has " + std::to_string(before.body.size()) + " bytes",
        &head);
  } else {
    verdicts.pass("head.length", &head);
  }
  for (const char* name : {"Content-Type", "Vary", "Allow", "Link", "Accept-Ranges", "Accept-Post", "Accept-Patch", "Last-Modified"}) {
    const std::string of_get = before.fields.joined(name), of_head = head.reply.fields.joined(name);
    if (of_get.empty() || of_get != after.reply.fields.joined(name)) continue;  // it changes, or is not there
    if (of_head.empty())
      return verdicts.fail("head.fields", "HEAD " + r.url + " has no " + name + ", and GET has \"" + excerpt(of_get, 80) + "\"", &head,
                           Certainty::likely);
    if (members(of_get) != members(of_head))
      return verdicts.fail("head.fields",
                           "HEAD " + r.url + ": " + name + " is \"" + excerpt(of_head, 80) + "\", and of GET \"" + excerpt(of_get, 80) + "\"", &head);
  }
  verdicts.pass("head.fields", &head);
}

// ------------------------------------------------------------------------------------------------------------------------- conditions

/// The fields that a 304 has if a 200 would have them.
void check_not_modified_fields(Context& context, const Exchange& full, const Exchange& conditional) {
  for (const char* name : {"Vary", "Cache-Control", "Content-Location", "Expires"}) {
    const std::string there = full.reply.fields.joined(name);
    if (there.empty()) continue;
    const std::string here = conditional.reply.fields.joined(name);
    if (here.empty())
      return context.verdicts.fail("etag.304-fields",
                                   "GET " + full.url + " has \"" + name + ": " + excerpt(there, 80) + "\", and its 304 has no " + name, &conditional);
    if (!iequals_ascii(name, "Expires") && members(lower(here)) != members(lower(there)))
      return context.verdicts.fail("etag.304-fields",
                                   "GET " + full.url + " has \"" + name + ": " + excerpt(there, 80) + "\", and its 304 \"" + excerpt(here, 80) + "\"",
                                   &conditional);
  }
  context.verdicts.pass("etag.304-fields", &conditional);
}

void check_conditions(Context& context, const Resource& r, const Exchange& again, const std::string& before, const std::string& tag) {
  Verdicts& verdicts = context.verdicts;
  const Exchange conditional = context.probe.ask("GET", r.url, {{"If-None-Match", tag}});
  if (conditional.reply.status == 304) {
    verdicts.pass("etag.304", &conditional);
    if (conditional.reply.fields.find("ETag")) verdicts.pass("etag.304-tag", &conditional);
    else verdicts.fail("etag.304-tag", r.url + ": the 304 has no ETag", &conditional);
    check_not_modified_fields(context, again, conditional);
    const Exchange list =
        is_entity_tag(tag) ? context.probe.ask("GET", r.url, {{"If-None-Match", std::string(never_a_tag) + ", " + tag}}) : conditional;
    if (list.reply.status == 304) verdicts.pass("etag.list", &list);
    else if (list.reply.ok() && list.reply.field("ETag") == tag)
      verdicts.fail("etag.list", r.url + ": the second tag of the list is the present one, and the response is " + std::to_string(list.reply.status),
                    &list);
    else if (!list.reply.ok()) verdicts.fail("etag.list", r.url + ": " + outcome_of(list), &list);
  } else if (conditional.reply.ok() && conditional.reply.field("ETag") == tag) {
    verdicts.fail("etag.304", r.url + ": the tag is still " + tag + ", and the response is " + std::to_string(conditional.reply.status),
                  &conditional);
  } else if (!conditional.reply.ok()) {
    verdicts.fail("etag.304", r.url + ": " + outcome_of(conditional), &conditional);
  } else {
    verdicts.not_testable("etag.304", "the representation changes between two requests", &conditional);
  }
  check_former_tag(context, r.url, is_same(r.get, again) || before == tag ? std::string() : before, r.get);
}

void check_ranges(Context& context, const Resource& r, const Exchange& full) {
  Verdicts& verdicts = context.verdicts;
  const std::string& body = full.reply.body;
  const std::string tag = full.reply.field("ETag"), size = std::to_string(body.size());
  const Exchange part = context.probe.ask("GET", r.url, {{"Range", "bytes=1-3"}});
  if (part.reply.ok() && part.reply.field("ETag") != tag)
    return verdicts.not_testable("range.bytes", "the representation changes between two requests", &part);
  if (part.reply.status == 206) {
    verdicts.pass("range.announced", &part);
    const std::string range = part.reply.field("Content-Range");
    if (lower(range) != "bytes 1-3/" + size && lower(range) != "bytes 1-3/*")
      verdicts.fail("range.bytes",
                    "GET " + r.url + ", Range: bytes=1-3: Content-Range is \"" + excerpt(range, 60) + "\", expected \"bytes 1-3/" + size + "\"",
                    &part);
    else if (part.reply.body != body.substr(1, 3))
      verdicts.fail("range.bytes",
                    "GET " + r.url + ", Range: bytes=1-3: the 206 has \"" + excerpt(part.reply.body, 40) + "\", and the whole has \"" +
                        excerpt(body.substr(1, 3), 40) + "\" there",
                    &part);
    else verdicts.pass("range.bytes", &part);
  } else if (part.reply.status == 200) {
    return verdicts.fail("range.announced",
                         "GET " + r.url + " has Accept-Ranges: bytes, and with Range: bytes=1-3 it responds 200 with " +
                             std::to_string(part.reply.body.size()) + " bytes",
                         &part);
  } else {
    return verdicts.fail("range.announced", "GET " + r.url + " has Accept-Ranges: bytes, and with Range: bytes=1-3 " + outcome_of(part), &part);
  }
  const Exchange other = context.probe.ask("GET", r.url, {{"Range", "bytes=1-3"}, {"If-Range", never_a_tag}});
  if (other.reply.status == 206)
    verdicts.fail("range.if-range", "GET " + r.url + ": If-Range names another tag, and the response is a part (206)", &other);
  else if (other.reply.status == 200) verdicts.pass("range.if-range", &other);
  else verdicts.not_testable("range.if-range", outcome_of(other), &other);
  const Exchange beyond = context.probe.ask("GET", r.url, {{"Range", "bytes=" + std::to_string(body.size() + 100'000) + "-"}});
  if (beyond.reply.status == 206)
    verdicts.fail("range.unsatisfiable",
                  "GET " + r.url + ": a range behind the end gets 206 with " + std::to_string(beyond.reply.body.size()) + " bytes", &beyond);
  else if (beyond.reply.status == 416 && lower(beyond.reply.field("Content-Range")).compare(0, 8, "bytes */") != 0)
    verdicts.fail("range.unsatisfiable", "GET " + r.url + ": the 416 has no Content-Range with the length", &beyond);
  else if (beyond.reply.status == 416 || beyond.reply.status == 200) verdicts.pass("range.unsatisfiable", &beyond);
  else verdicts.fail("range.unsatisfiable", "GET " + r.url + ": a range behind the end: " + outcome_of(beyond), &beyond);
}

void check_modified_since(Context& context, const Resource& r, const Exchange& again) {
  const std::string date = again.reply.field("Last-Modified");
  if (date.empty() || !http_seconds(date) || context.verdicts.failed("modified.condition")) return;
  const Exchange same = context.probe.ask("GET", r.url, {{"If-Modified-Since", date}});
  const Exchange old = context.probe.ask("GET", r.url, {{"If-Modified-Since", "Thu, 01 Jan 1970 00:00:00 GMT"}});
  if (old.reply.status == 304 && *http_seconds(date) > 0)
    context.verdicts.fail("modified.condition", "GET " + r.url + ": Last-Modified is " + date + ", and If-Modified-Since of 1970 gets 304", &old);
  else if (same.reply.status == 304) context.verdicts.pass("modified.condition", &same);
  else if (same.reply.ok() && same.reply.field("Last-Modified") == date)
    context.verdicts.fail(
        "modified.condition",
        "GET " + r.url + ": Last-Modified is still " + date + ", and If-Modified-Since with it gets " + std::to_string(same.reply.status), &same);
  else context.verdicts.not_testable("modified.condition", "the representation changes between two requests", &same);
}

// ------------------------------------------------------------------------------------------------------------------ the time of a value

/// Seconds of an xsd:dateTime with a time zone, of this century and the ones beside it.
std::optional<double> seconds_of(std::string_view text) {
  if (text.size() < 20 || text[4] != '-' || text[7] != '-' || text[10] != 'T') return std::nullopt;
  constexpr const char* months = "JanFebMarAprMayJunJulAugSepOctNovDec";
  const int month = std::atoi(std::string(text.substr(5, 2)).c_str());
  if (month < 1 || month > 12) return std::nullopt;
  // The same parts in the order of an HTTP date, whose day of the week is not looked at.
  const std::string date = "Mon, " + std::string(text.substr(8, 2)) + " " + std::string(months + 3 * (month - 1), 3) + " " +
                           std::string(text.substr(0, 4)) + " " + std::string(text.substr(11, 8)) + " GMT";
  const std::optional<long long> whole = http_seconds(date);
  if (!whole) return std::nullopt;
  std::size_t at = 19;
  double fraction = 0, digit = 0.1;
  if (text[at] == '.')
    for (++at; at < text.size() && text[at] >= '0' && text[at] <= '9'; ++at, digit /= 10) fraction += digit * (text[at] - '0');
  const std::string_view zone = text.substr(at);
  if (zone == "Z") return static_cast<double>(*whole) + fraction;
  if (zone.size() != 6 || (zone[0] != '+' && zone[0] != '-')) return std::nullopt;
  const int offset = 3600 * std::atoi(std::string(zone.substr(1, 2)).c_str()) + 60 * std::atoi(std::string(zone.substr(4, 2)).c_str());
  return static_cast<double>(*whole) + fraction - (zone[0] == '-' ? -offset : offset);
}

/// The literals that a resource has itself, without the time of its change.
std::set<std::string> literals_of(const rdf::Graph& graph, const std::string& url) {
  std::set<std::string> all;
  const rdf::TermView subject = rdf::iri(url);
  for (const rdf::Triple& t : graph.match(&subject, nullptr, nullptr))
    if (const rdf::TermView object = graph.term(t.object); object.is_literal() && graph.term(t.predicate) != rdf::TermView(vocab::dcterms::modified))
      all.insert(rdf::to_string(graph.term(t.predicate)) + " " + rdf::to_string(object));
  return all;
}

void check_modified_triple(Context& context, const Resource& r, const Exchange& again) {
  if (!r.graph || !r.property || context.verdicts.failed("modified.triple")) return;
  const std::optional<rdf::Graph> later = graph_of(context, again);
  const auto of = [&r](const rdf::Graph& graph) {
    const std::optional<rdf::TermView> object = graph.object(rdf::iri(r.url), vocab::dcterms::modified);
    return object ? std::string(object->text) : std::string();
  };
  if (!later || of(*later).empty()) return;
  const std::string first = of(*r.graph), second = of(*later);
  const std::optional<double> a = seconds_of(first), b = seconds_of(second);
  if (!b) return context.verdicts.not_testable("modified.triple", "\"" + excerpt(second, 60) + "\" has no time zone", &again);
  const std::optional<long long> date = http_seconds(again.reply.field("Date"));
  const double here = std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
  if (date && *b > std::max(static_cast<double>(*date), here) + future_tolerated)  // if Date is wrong, date.clock tells
    return context.verdicts.fail(
        "modified.triple", "GET " + r.url + ": dcterms:modified is " + second + ", after the Date of its response, " + again.reply.field("Date"),
        &again);
  if (a && *b < *a)
    return context.verdicts.fail("modified.triple", "GET " + r.url + ": dcterms:modified goes back from " + first + " to " + second, &again);
  if (!first.empty() && first == second && literals_of(*r.graph, r.url) != literals_of(*later, r.url))
    return context.verdicts.fail("modified.triple", "GET " + r.url + ": the value has changed, and dcterms:modified is still " + second, &again);
  context.verdicts.pass("modified.triple", &again);
}

void check_resource(Context& context, Resource& r, std::size_t& ranges) {
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
  r.changes = !is_same(r.get, again);
  check_head(context, r, head, again);
  check_modified_since(context, r, again);
  check_modified_triple(context, r, again);
  const std::string after = again.reply.field("ETag");
  if (lower(again.reply.field("Accept-Ranges")) == "bytes" && again.reply.body.size() > 4 && !after.empty() && !r.changes && ranges < max_ranges &&
      again.reply.framing_fault.empty()) {
    ++ranges;
    check_ranges(context, r, again);
  }
  if (before.empty() || after.empty()) {
    verdicts.fail("etag.get", r.url + ": there is no ETag", before.empty() ? &r.get : &again);
    for (const char* id : {"etag.head", "etag.syntax", "etag.changes", "etag.stable", "etag.media-types", "etag.304", "etag.304-tag",
                           "etag.304-fields", "etag.304-false", "etag.list"})
      verdicts.not_applicable(id, "GET has no ETag");
    return;
  }
  r.etag = after;
  verdicts.pass("etag.get", &again);
  if (is_entity_tag(after)) verdicts.pass("etag.syntax", &again);
  else verdicts.fail("etag.syntax", "\"" + excerpt(after, 60) + "\" is no entity tag", &again);
  if (r.changes && (before != after || is_weak(before))) verdicts.pass("etag.changes", &again);
  if (!r.changes && (before == after || is_weak(before) != is_weak(after))) verdicts.pass("etag.stable", &again);

  const std::string of_head = head.reply.field("ETag");
  if (head.reply.ok()) {
    if (of_head.empty()) verdicts.fail("etag.head", r.url + ": the response to HEAD has no ETag", &head);
    else if (before == after && of_head != before)
      verdicts.fail("etag.head", r.url + ": HEAD has " + of_head + ", GET before and after it " + before, &head);
    else verdicts.pass("etag.head", &head);
  } else {
    verdicts.not_applicable("etag.head", "HEAD has no success");
  }
  check_conditions(context, r, again, before, after);
}

}  // namespace

void check_former_tag(Context& context, const std::string& url, const std::string& former, const Exchange& then) {
  const Exchange exchange = context.probe.ask("GET", url, {{"If-None-Match", former.empty() ? never_a_tag : former}});
  if (exchange.reply.ok()) return context.verdicts.pass("etag.304-false", &exchange);
  if (exchange.reply.status != 304) return context.verdicts.not_testable("etag.304-false", outcome_of(exchange), &exchange);
  const Exchange now = context.probe.ask("GET", url);
  if (!former.empty() && is_same(then, now))
    return context.verdicts.not_testable("etag.304-false", url + " has the former representation again", &exchange);
  context.verdicts.fail("etag.304-false",
                        former.empty()
                            ? "GET " + url + ": If-None-Match has a tag that no response had, and the response is 304"
                            : "GET " + url + ": the representation has changed since the tag " + former + ", and If-None-Match with it gets 304",
                        &exchange);
}

void check_caching(Context& context) {
  std::size_t ranges = 0;
  for (Resource* r : context.sample())
    if (!context.probe.exhausted()) check_resource(context, *r, ranges);
  for (const char* id : {"range.announced", "range.bytes", "range.if-range", "range.unsatisfiable"})
    context.verdicts.otherwise(id, Outcome::not_applicable, "no resource with an ETag and a constant representation has Accept-Ranges: bytes");
  context.verdicts.otherwise("modified.condition", Outcome::not_applicable, "no response has Last-Modified");
  context.verdicts.otherwise("modified.triple", Outcome::not_applicable, "no Property has dcterms:modified");
  for (const char* id : {"etag.304-tag", "etag.304-fields", "etag.list", "etag.304-false", "head.length", "head.fields"})
    context.verdicts.otherwise(id, Outcome::not_testable, "no two responses show it");
}

/// What all responses of the check say together.
void check_moments(Context& context) {
  Verdicts& verdicts = context.verdicts;
  const Probe& probe = context.probe;
  for (const Pair& pair : probe.tag_stays)
    verdicts.fail("etag.changes", "GET " + pair.after.url + ": two representations that differ have the tag " + pair.after.reply.field("ETag"),
                  &pair.after);
  for (const Pair& pair : probe.tag_moves)
    verdicts.fail(
        "etag.stable",
        "GET " + pair.after.url + ": the same bytes have the tags " + pair.before.reply.field("ETag") + " and " + pair.after.reply.field("ETag"),
        &pair.after);
  if (probe.changed_tag) verdicts.pass("etag.changes", &*probe.changed_tag);
  for (const char* id : {"etag.changes", "etag.stable"}) verdicts.otherwise(id, Outcome::not_testable, "no two responses show it");

  for (const Exchange& exchange : probe.invalid_dates)
    verdicts.fail("date.syntax",
                  "GET " + exchange.url + ": Date is \"" + excerpt(exchange.reply.field("Date"), 60) + "\", Last-Modified is \"" +
                      excerpt(exchange.reply.field("Last-Modified"), 60) + "\"; expected \"Sun, 06 Nov 1994 08:49:37 GMT\"",
                  &exchange);
  if (!probe.first_dated) {
    for (const char* id : {"date.syntax", "date.moves", "date.clock", "modified.future", "modified.changes"})
      verdicts.otherwise(id, Outcome::not_testable, "no response has a Date in the format of HTTP");
    return;
  }
  const Exchange& first = *probe.first_dated;
  if (probe.invalid_dates.empty()) verdicts.pass("date.syntax", &first);
  const long long moved = *http_seconds(probe.last_dated->reply.field("Date")) - *http_seconds(first.reply.field("Date"));
  if (probe.date_back)
    verdicts.fail("date.moves",
                  "Date goes back from " + probe.date_back->before.reply.field("Date") + " to " + probe.date_back->after.reply.field("Date"),
                  &probe.date_back->after);
  else if (moved > 0) verdicts.pass("date.moves", &first);
  else if (probe.dated_for < enough) verdicts.not_testable("date.moves", "the check was over within a second or two");
  else
    verdicts.fail("date.moves",
                  "Date was " + first.reply.field("Date") + ", and after " + std::to_string(probe.dated_for.count()) + " s it is the same",
                  &*probe.last_dated);
  if (probe.date_back) verdicts.not_testable("date.clock", "Date goes back");
  else if (std::llabs(probe.date_offset_first) <= tolerated) verdicts.pass("date.clock", &first);
  else
    verdicts.fail("date.clock",
                  "Date is " + std::to_string(std::llabs(probe.date_offset_first)) + " s " + (probe.date_offset_first < 0 ? "before" : "after") +
                      " the clock of the checking machine, which may be the wrong one",
                  &first, Certainty::likely);
  for (const Exchange& exchange : probe.modified_later)
    verdicts.fail(
        "modified.future",
        "GET " + exchange.url + ": Last-Modified, " + exchange.reply.field("Last-Modified") + ", is after Date, " + exchange.reply.field("Date"),
        &exchange);
  if (probe.modified_later.empty() && probe.has_last_modified) verdicts.pass("modified.future", &*probe.has_last_modified);
  if (probe.last_modified_back)
    verdicts.fail("modified.changes",
                  "GET " + probe.last_modified_back->after.url + ": the representation has changed since " +
                      probe.last_modified_back->before.reply.field("Date") + ", and Last-Modified is " +
                      probe.last_modified_back->after.reply.field("Last-Modified"),
                  &probe.last_modified_back->after);
  else if (probe.last_modified_moves) verdicts.pass("modified.changes", &*probe.last_modified_moves);
  verdicts.otherwise("modified.future", Outcome::not_applicable, "no response has Last-Modified");
  verdicts.otherwise("modified.changes", Outcome::not_applicable, "no response with Last-Modified has changed");
}

}  // namespace lrt::check
