// SPDX-License-Identifier: Apache-2.0
#include <lrt/check.hpp>

#include <ifaddrs.h>
#include <net/if.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <iterator>
#include <list>
#include <map>
#include <random>
#include <set>
#include <thread>

#include <lrt/rdf/vocab.hpp>
#include <lrt/server_thing.hpp>

#include "tests/check/faulty_proxy.hpp"
#include "tests/client/robot_host.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folder.hpp"
#include "tests/support/mover.hpp"
#include "tests/support/skip.hpp"
#include "tests/support/tls.hpp"

namespace lrt {
namespace {

using check::Outcome;
using std::chrono::milliseconds;
using Names = std::set<std::string>;
using test::Asked;
using test::Fault;

/// A robot with one of each kind of resource. `moving`: its one Property has another value at each GET.
std::vector<Thing> robot(bool moving) {
  Thing arm{"arm"};
  arm.type(vocab::ros::RevoluteJoint).title("The arm");
  if (moving) {
    arm.property("count", [n = std::int32_t{0}]() mutable { return ++n; });
  } else {
    auto angle = arm.property<double>("angle", unit::degree).between(-90, 90).on_write([](double) {});
    angle.publish(10);
    arm.property("count", [n = std::int32_t{0}]() mutable { return ++n; });
  }
  arm.action("turn", [](double) {}).consumes(rdf::Facets{}.unit(unit::degree).at_least(0).below(360));
  return test::one_thing(std::move(arm));
}

constexpr const char* input =
    "<> <http://vocab.arvida.de/2015/06/vom/vocab#numericalValue> 1.5 ; <http://qudt.org/schema/qudt/hasUnit> <http://qudt.org/vocab/unit/DEG> .";

struct Case {
  Fault fault{};
  bool moving = false;
  bool variants = false;  ///< its values are one of several alternatives
  std::uint32_t address = INADDR_LOOPBACK;
  std::string host = "127.0.0.1";
  std::function<void(check::CheckOptions&, const std::string& url)> options{};
};

check::CheckOptions quick() {
  check::CheckOptions options;
  options.client.limits.response_time = milliseconds(6'000);
  options.message_time = milliseconds(1'500);  // and what the server usually takes in addition
  options.close_time = milliseconds(1'000);
  options.max_resources = 14;
  return options;
}

Result<check::Report> report_of(Case c) {
  test::FaultyProxy proxy(c.address);
  Options server;
  const std::string authority = c.host + ":" + std::to_string(proxy.port());
  server.security.allowed_hosts = {authority, "check.example:80"};
  server.callbacks.allow = {"127.0.0.1"};
  server.callbacks.confirmation = subscription::Confirmation::none;
  test::Mover mover;
  test::RobotHost host(c.variants ? test::one_thing(mover.thing("arm")) : robot(c.moving), {}, server);
  proxy.start(host.server().port(), std::move(c.fault));
  const std::string url = "http://" + authority + "/arm";
  check::CheckOptions options = quick();
  options.callback_address = "127.0.0.1";
  if (!c.moving) options.write = {url + (c.variants ? "/target" : "/angle")};
  options.invoke = {{url + "/actions/turn", input}};
  if (c.variants) options.invoke = {{url + "/actions/go", "<> a </ns/vocabulary#Target> ; </ns/vocabulary#Target/hold> [] ."}};
  if (c.options) c.options(options, url);
  return check::run(url, options);
}

std::set<std::string> failures(const Result<check::Report>& report) {
  if (!report) return {"error: " + report.error().message};
  std::set<std::string> ids;
  for (const check::Finding& f : report->findings)
    if (f.outcome == Outcome::fail) ids.insert(f.id);
  return ids;
}

/// The failures with what was found, for the output of a test.
std::string told(const Result<check::Report>& report) { return report ? check::to_text(*report) : report.error().message; }

// ------------------------------------------------------------------------------------------------------------- the faults, by their check

bool is_thing(const Asked& a) { return a.target == "/arm"; }
bool is_state(const Asked& a) { return a.target == "/arm/state"; }

Fault on_request(std::function<void(std::string&)> change) {
  Fault f;
  f.request = std::move(change);
  return f;
}
Fault on_response(std::function<void(const Asked&, std::string&)> change) {
  Fault f;
  f.response = std::move(change);
  return f;
}
/// The response to that request has another status.
Fault status(std::function<bool(const Asked&)> which, int from, int to) {
  return on_response([which = std::move(which), from, to](const Asked& a, std::string& r) {
    if (which(a) && test::status_of(r) == from) {
      test::set_status(r, to);
      if (to == 204) test::drop_field(r, "Content-Length"), r.resize(r.find("\r\n\r\n") + 4);
      else if (test::field_of(r, "Content-Length").empty() && a.method != "HEAD") test::add_field(r, "Content-Length: 0");
    }
  });
}
Fault without_triples(std::function<bool(const Asked&)> where, std::function<bool(rdf::TermView, rdf::TermView, rdf::TermView)> which) {
  return on_response([where = std::move(where), which = std::move(which)](const Asked& a, std::string& r) {
    if (where(a)) test::strip(a, r, which);
  });
}
/// Changes the graph of a resource; `root` is the URL of the server.
Fault edited(std::function<bool(const Asked&)> where, std::function<void(const std::string& root, const rdf::Graph& from, rdf::Graph& to)> edit) {
  return on_response([where = std::move(where), edit = std::move(edit)](const Asked& a, std::string& r) {
    if (!where(a)) return;
    test::edit_graph(a, r, [&](const rdf::Graph& from, rdf::Graph& to) {
      std::string root;
      for (const rdf::Triple& t : from.triples())
        if (const rdf::TermView subject = from.term(t.subject); root.empty() && subject.text.substr(0, 7) == "http://")
          root = subject.text.substr(0, subject.text.find('/', 7) + 1);
      edit(root, from, to);
    });
  });
}
Fault with_triples(std::function<bool(const Asked&)> where, std::function<void(const std::string& root, rdf::Graph& to)> add) {
  return edited(std::move(where), [add = std::move(add)](const std::string& root, const rdf::Graph& from, rdf::Graph& to) {
    to = from;
    add(root, to);
  });
}
Fault without_predicate(Iri predicate) {
  return without_triples(is_thing, [predicate](rdf::TermView, rdf::TermView p, rdf::TermView) { return p == predicate; });
}
/// Removes the line of a request that begins so.
void drop_line(std::string& request, const std::string& beginning) {
  const std::size_t at = request.find("\r\n" + beginning);
  if (at != std::string::npos) request.erase(at, request.find("\r\n", at + 2) - at);
}
bool to_action(const Asked& a) { return a.method == "POST" && a.target == "/arm/actions/turn"; }

/// Replaces ETags of GET and HEAD on some resources by a constant one, consistently: conditions on it are evaluated, too.
Fault constant_tag(std::function<bool(const Asked&)> where) {
  return on_response([where = std::move(where)](const Asked& a, std::string& r) {
    if (!where(a) || (a.method != "GET" && a.method != "HEAD") || test::field_of(r, "ETag").empty()) return;
    test::set_field(r, "ETag", "\"same\"");
    if (test::field_of(a.header, "If-None-Match").find("\"same\"") != std::string::npos) test::set_empty(r, 304);
  });
}

// ------------------------------------------------------------------------------- what is announced and is not so: one function for each kind

using Add = std::function<void(const char* id, const char* what, Fault fault, bool moving)>;

bool is_head(const Asked& a) { return a.method == "HEAD"; }
bool reads(const Asked& a) { return a.method == "GET" || a.method == "HEAD"; }
/// Changes a field of all responses of a resource.
Fault field(std::function<bool(const Asked&)> where, const char* name, std::function<std::string(const std::string&)> change) {
  return on_response([where = std::move(where), name, change = std::move(change)](const Asked& a, std::string& r) {
    const std::string value = test::field_of(r, name);
    if (!where(a) || value.empty()) return;
    const std::string now = change(value);
    if (now.empty()) test::drop_field(r, name);
    else test::set_field(r, name, now);
  });
}
std::function<bool(const Asked&)> at(std::string target) {
  return [target = std::move(target)](const Asked& a) { return a.target == target; };
}
std::function<std::string(const std::string&)> more(const char* text) {
  return [text](const std::string& value) { return value + text; };
}
std::function<std::string(const std::string&)> without(const char* text) {
  return [text](std::string value) {
    test::replace(value, text, "");
    return value;
  };
}

void announcements(const Add& add) {
  add("methods.announced", "lists PUT where there is none", field(at("/arm/count"), "Allow", more(", PUT")), false);
  add("methods.announced", "lists POST of a container and has none", on_response([](const Asked& a, std::string& r) {
        if (a.method == "POST" && a.target == "/arm/subscriptions" && a.has("Expect:") && a.has("application/x-lrt-check"))
          test::set_status(r, 405), test::set_field(r, "Allow", "GET, HEAD, OPTIONS, POST");
      }),
      false);
  add("methods.refused", "accepts DELETE, which Allow lacks", status([](const Asked& a) { return a.method == "DELETE"; }, 405, 204), false);
  add("methods.refused", "accepts PATCH, which Allow lacks", status([](const Asked& a) { return a.method == "PATCH"; }, 405, 204), false);
  add("options.agrees", "has another Allow in GET than in OPTIONS",
      field([](const Asked& a) { return reads(a) && a.target == "/arm/count"; }, "Allow", more(", PUT")), false);
  add("options.agrees", "has another Allow in 405 than in OPTIONS",
      field([](const Asked& a) { return a.method == "PATCH"; }, "Allow", more(", DELETE")), false);
  add("options.complete", "does not list PUT, which works", field(at("/arm/angle"), "Allow", without(", PUT")), false);
  add("options.complete", "does not list HEAD, which works", field([](const Asked&) { return true; }, "Allow", without("HEAD, ")), false);
  add("options.complete", "does not list DELETE of a subscription",
      field([](const Asked& a) { return a.target.find("/subscriptions/") != std::string::npos; }, "Allow", without(", DELETE")), false);
  add("accept-post.options", "has no Accept-Post in OPTIONS of a container",
      field([](const Asked& a) { return a.method == "OPTIONS"; }, "Accept-Post", [](const std::string&) { return std::string(); }), false);
  add("accept-post.media-types", "lists a media type in Accept-Post that it refuses",
      field(at("/arm/subscriptions"), "Accept-Post", more(", text/csv")), false);
  add("accept-patch.announced", "has Accept-Patch and no PATCH", on_response([](const Asked& a, std::string& r) {
        if (a.method == "OPTIONS" && is_thing(a)) test::add_field(r, "Accept-Patch: application/sparql-update");
      }),
      false);
  add("link.targets", "has a link to a license that is not there", on_response([](const Asked& a, std::string& r) {
        if (is_thing(a)) test::add_field(r, "Link: </nowhere>; rel=\"license\"");
      }),
      false);
  add("link.describedby", "is described by what does not exist", on_response([](const Asked& a, std::string& r) {
        if (is_thing(a)) test::add_field(r, "Link: </nowhere>; rel=\"describedby\"");
      }),
      false);
  add("alternates.get", "has a link to an alternate that is not there", status(at("/arm?accept=application/json"), 200, 404), false);
  add("alternates.get", "has another media type at the link of an alternate",
      on_request([](std::string& q) { test::replace(q, "/arm?accept=application/json ", "/arm?accept=application/n-triples "); }), false);
  add("alternates.bytes", "calls JSON what is none", on_response([](const Asked& a, std::string& r) {
        if (a.target == "/arm?accept=application/json") test::set_body(r, "<html>");
      }),
      false);
  add("alternates.bytes", "calls N-Triples what is none", on_response([](const Asked& a, std::string& r) {
        if (a.target == "/arm?accept=application/n-triples") test::set_body(r, "<urn:x> <urn:y> .");
      }),
      false);
  add("negotiate.listed", "lists in a 406 what it has not", on_response([](const Asked&, std::string& r) {
        if (test::status_of(r) != 406) return;
        std::string body = test::body_of(r);
        test::replace(body, "available are ", "available are text/csv, ");
        test::set_body(r, body);
      }),
      false);
  add("container.members", "lists a member that does not exist",
      with_triples([](const Asked& a) { return a.target == "/" && !a.has("Prefer:"); },
                   [](const std::string& root, rdf::Graph& to) { to.add(rdf::iri(root), vocab::ldp::contains, rdf::iri(root + "nobody")); }),
      false);
  add(
      "prefer.applied", "says it has sent a representation, and has not",
      [] {
        Fault f = on_response([](const Asked& a, std::string& r) {
          if (a.method == "PUT" && test::status_of(r) == 204 && a.has("Prefer:")) test::add_field(r, "Preference-Applied: return=representation");
        });
        f.request = [](std::string& q) {
          if (q.compare(0, 4, "PUT ") == 0) test::replace(q, "Prefer: return=representation", "Prefer: return=minimal");
        };
        return f;
      }(),
      false);
  add(
      "prefer.applied", "says it has left members out, and has not",
      [] {
        Fault f = on_response([](const Asked& a, std::string& r) {
          if (a.method == "GET" && test::status_of(r) == 200 && a.has("Prefer:")) test::set_field(r, "Preference-Applied", "return=representation");
        });
        f.request = [](std::string& q) { test::replace(q, "#PreferMinimalContainer", "#PreferNothing"); };
        return f;
      }(),
      false);
}

/// Adds Last-Modified to a resource, and evaluates If-Modified-Since by comparing for equality.
Fault last_modified(std::string target, std::string date, bool evaluates) {
  return on_response([target = std::move(target), date = std::move(date), evaluates](const Asked& a, std::string& r) {
    if (!reads(a) || a.target != target || test::status_of(r) != 200) return;
    test::add_field(r, "Last-Modified: " + date);
    if (evaluates && test::field_of(a.header, "If-Modified-Since") == date) test::set_empty(r, 304);
  });
}

void caching(const Add& add) {
  add("head.length", "has another Content-Length in HEAD",
      field([](const Asked& a) { return is_head(a) && is_thing(a); }, "Content-Length", more("0")), false);
  add("head.fields", "has another Content-Type in HEAD", field(is_head, "Content-Type", [](const std::string&) { return "text/plain"; }), false);
  add("head.fields", "has no Link in HEAD", field(is_head, "Link", [](const std::string&) { return std::string(); }), false);
  add("etag.304-fields", "has no Vary in 304", on_response([](const Asked&, std::string& r) {
        if (test::status_of(r) == 304) test::drop_field(r, "Vary");
      }),
      false);
  add("etag.304-false", "has 304 for each If-None-Match", on_response([](const Asked& a, std::string& r) {
        if (a.has("If-None-Match: ") && test::status_of(r) == 200) test::set_empty(r, 304);
      }),
      false);
  {
    auto tags = std::make_shared<Names>();  // those that were sent
    add("etag.304-false", "has 304 for a former tag", on_response([tags](const Asked& a, std::string& r) {
          if (a.method != "GET" || a.target != "/arm/angle" || test::status_of(r) != 200) return;
          if (tags->count(test::field_of(a.header, "If-None-Match")) != 0) test::set_empty(r, 304);
          tags->insert(test::field_of(r, "ETag"));
        }),
        false);
  }
  add("etag.list", "takes a list of tags for one tag", on_request([](std::string& q) {
        if (const std::string tags = test::field_of(q, "If-None-Match"); tags.find(", ") != std::string::npos)
          test::set_field(q, "If-None-Match", tags.substr(0, tags.find(", ")));
      }),
      false);
  {
    auto kept = std::make_shared<std::string>();
    add("etag.changes", "keeps its tag when it is written", on_response([kept](const Asked& a, std::string& r) {
          if (a.target != "/arm/angle" || !reads(a) || a.has("Accept:") || test::field_of(r, "ETag").empty()) return;
          if (kept->empty()) *kept = test::field_of(r, "ETag");
          test::set_field(r, "ETag", *kept);
        }),
        false);
  }
  add("date.syntax", "has a Date in the format of RFC 850",
      field([](const Asked&) { return true; }, "Date", [](const std::string&) { return "Sunday, 06-Nov-94 08:49:37 GMT"; }), false);
  {
    auto hour = std::make_shared<std::atomic<int>>(23);
    add("date.moves", "has a Date that goes back", on_response([hour](const Asked&, std::string& r) {
          std::string date = test::field_of(r, "Date");
          if (date.empty()) return;
          const std::string h = std::to_string(std::max(0, (*hour)--));
          test::set_field(r, "Date", date.replace(17, 2, h.size() < 2 ? "0" + h : h));
        }),
        false);
  }
  add("date.clock", "has a wrong clock",
      field([](const Asked&) { return true; }, "Date", [](std::string date) { return date.replace(12, 4, "2019"); }), false);
  add("modified.future", "was modified in the future", last_modified("/arm", "Fri, 01 Jan 2100 00:00:00 GMT", true), false);
  add("modified.changes", "was not modified, and has changed", last_modified("/arm/count", "Wed, 01 Jan 2020 00:00:00 GMT", true), false);
  add("modified.condition", "ignores If-Modified-Since", last_modified("/arm", "Wed, 01 Jan 2020 00:00:00 GMT", false), false);
  add("modified.condition", "has 304 for each If-Modified-Since", on_response([](const Asked& a, std::string& r) {
        if (!reads(a) || !is_thing(a) || test::status_of(r) != 200) return;
        test::add_field(r, "Last-Modified: Wed, 01 Jan 2020 00:00:00 GMT");
        if (a.has("If-Modified-Since:")) test::set_empty(r, 304);
      }),
      false);
  const auto modified = [](const char* when) {
    return edited(at("/arm/count"), [when](const std::string& root, const rdf::Graph& from, rdf::Graph& to) {
      for (const rdf::Triple& t : from.triples())
        if (from.term(t.predicate) != rdf::TermView(vocab::dcterms::modified))
          to.add(from.term(t.subject), from.term(t.predicate), from.term(t.object));
      to.add(rdf::iri(root + "arm/count"), vocab::dcterms::modified, rdf::literal(when, vocab::xsd::dateTime));
    });
  };
  add("modified.triple", "has a dcterms:modified that stays when the value changes", modified("2020-01-01T00:00:00Z"), false);
  add("modified.triple", "has a dcterms:modified in the future", modified("2100-01-01T00:00:00Z"), false);
  add("range.announced", "announces ranges and ignores them", on_request([](std::string& q) { drop_line(q, "Range:"); }), false);
  const auto part = [](const Asked&, const std::string& r) { return test::status_of(r) == 206; };
  add("range.bytes", "sends other bytes than of the range", on_response([part](const Asked& a, std::string& r) {
        if (part(a, r)) r.back() = static_cast<char>(r.back() ^ 1);
      }),
      false);
  add("range.bytes", "says another range than it sends", on_response([part](const Asked& a, std::string& r) {
        if (part(a, r)) test::set_field(r, "Content-Range", "bytes 0-2/9");
      }),
      false);
  add("range.if-range", "ignores If-Range", on_request([](std::string& q) { drop_line(q, "If-Range:"); }), false);
  add("range.unsatisfiable", "has no length in 416", on_response([](const Asked&, std::string& r) {
        if (test::status_of(r) == 416) test::drop_field(r, "Content-Range");
      }),
      false);
}

/// A proxy whose callbacks are relayed.
Fault relayed(test::CallbackRelay::ChangeFunction change) {
  auto relay = std::make_shared<test::CallbackRelay>(std::move(change));
  Fault f;
  f.request = [relay](std::string& q) { relay->rewrite_request(q); };
  f.response = [relay](const Asked&, std::string& r) { relay->rewrite_response(r); };
  return f;
}

void subscriptions(const Add& add, const std::function<void()>& hurried) {
  add("container.created", "does not list a new subscription",
      without_triples(at("/arm/subscriptions"), [](rdf::TermView, rdf::TermView p, rdf::TermView) { return p == vocab::ldp::contains; }), false);
  {
    auto deleted = std::make_shared<std::string>();
    add("container.removed", "lists a subscription that was deleted", on_response([deleted](const Asked& a, std::string& r) {
          if (a.method == "DELETE" && test::status_of(r) == 204) *deleted = a.target;
          if (a.target == "/arm/subscriptions" && !deleted->empty())
            test::edit_graph(a, r, [&](const rdf::Graph& from, rdf::Graph& to) {
              to = from;
              for (const rdf::TermView& c : from.subjects(vocab::rdf_::type, vocab::ldp::Container)) {
                const std::string url(c.text);
                to.add(c, vocab::ldp::contains, rdf::iri(url.substr(0, url.find('/', 7)) + *deleted));
              }
            });
        }),
        false);
  }
  add("callback.delivered", "calls back once and then never", relayed([](std::size_t n, std::string&, std::string&) { return n == 0; }), false);
  hurried();
  add("callback.content", "calls back with empty bodies", relayed([](std::size_t, std::string&, std::string& body) {
        body.clear();
        return true;
      }),
      false);
  hurried();
  {
    auto first = std::make_shared<std::string>();
    add("callback.content", "calls back with the former content", relayed([first](std::size_t n, std::string&, std::string& body) {
          if (n == 0) *first = body;
          else body = *first;
          return true;
        }),
        false);
    hurried();
  }
  add("callback.media-type", "changes the media type of callbacks after the first", relayed([](std::size_t n, std::string& header, std::string&) {
        if (n > 0) test::set_field(header, "Content-Type", "text/plain");
        return true;
      }),
      false);
  {
    auto ended = std::make_shared<std::string>();
    Fault f;
    f.request = [ended](std::string& q) {
      if (q.compare(0, 7, "DELETE ") != 0 || q.find("/subscriptions/") == std::string::npos) return;
      *ended = q.substr(7, q.find(' ', 7) - 7);
      test::replace(q, "DELETE ", "OPTIONS ");
    };
    f.response = [ended](const Asked& a, std::string& r) {
      if (ended->empty()) return;
      if (a.target == *ended && a.method == "GET") test::set_status(r, 404);
      if (a.target == "/arm/subscriptions")
        test::strip(a, r, [](rdf::TermView, rdf::TermView p, rdf::TermView) { return p == vocab::ldp::contains; }), test::drop_field(r, "ETag");
    };
    add("callback.ends", "calls back after the end", std::move(f), false);
  }
}

// ------------------------------------------------------------------------------------------------- a server with what other versions have

/// What stands in for a server with expiry, heartbeat and a stop state. Each member that is set breaks one of its promises.
struct Newer {
  bool late = false, instance = false, valid = false, problem = false, clock = false, beat = false, refused = false, state = false, refuses = false;
  bool stopped = false;
  bool heartbeats = true;
};

constexpr const char* instance = "00112233aabbccdd";

Fault newer(Newer w) {
  auto ms = std::make_shared<std::atomic<long>>(1'000'000);
  Fault f;
  f.request = [w, ms](std::string& q) {
    const std::string until = test::field_of(q, "Valid-Until");
    const bool other = until.compare(0, 16, instance) != 0, late = !other && std::strtol(until.c_str() + 17, nullptr, 10) <= *ms;
    // The server behind it refuses what has a false condition.
    if (!until.empty() && (w.valid || (other ? !w.instance : late && !w.late))) test::set_field(q, "If-Match", "\"late\"");
    test::drop_field(q, "Valid-Until");  // the server behind it has another time
    if (q.find("heartbeat=") != std::string::npos && q.find("text/event-stream") != std::string::npos) drop_line(q, "Accept:");
    if (const std::size_t at = q.find("?heartbeat="); at < q.find("\r\n")) q.erase(at, q.find(' ', at) - at);
    test::replace(q, "/arm/stopped ", "/arm/count ");  // what it is besides its content in JSON
  };
  f.response = [w, ms](const Asked& a, std::string& r) {
    const std::string origin = "http://" + test::field_of(a.header, "Host");
    const auto json = [&r](int status, const std::string& body) {
      test::set_status(r, status);
      test::set_body(r, body);
      test::drop_field(r, "ETag");
      test::set_field(r, "Content-Type", status == 200 ? "application/json" : "application/problem+json");
    };
    if (test::status_of(r) == 412 && a.has("Valid-Until:") && a.has("If-Match: \"late\"") == false && !w.problem)
      json(412, R"({"type":"https://w3id.org/lrt/ns#LateCommand","status":412})");
    if (w.stopped && !w.refuses && a.method == "PUT" && a.target == "/arm/angle" && !a.has("Expect:"))
      json(409, R"({"type":"https://w3id.org/lrt/ns#Stopped","status":409})");
    if (is_thing(a))
      test::edit_graph(a, r, [&](const rdf::Graph& from, rdf::Graph& to) {
        to = from;
        for (const char* link : {"https://w3id.org/lrt/ns#stopState", "https://hybr-it-projekt.de/ns/hybr-it#property"})
          to.add(rdf::iri(origin + "/arm"), rdf::iri(link), rdf::iri(origin + "/arm/stopped"));
        for (const char* type : {"https://w3id.org/lrt/ns#StopState", "https://hybr-it-projekt.de/ns/hybr-it#Property"})
          to.add(rdf::iri(origin + "/arm/stopped"), rdf::iri("http://www.w3.org/1999/02/22-rdf-syntax-ns#type"), rdf::iri(type));
      });
    if (a.target == "/arm" && test::status_of(r) == 200) test::add_field(r, "Link: <" + origin + "/arm/stopped>; rel=\"related\"");
    const std::string is = w.stopped ? "true" : "false";
    if (a.target == "/arm/stopped" && a.method == "GET" && a.has("Accept: application/json"))
      json(200, "{\"stopped\": " + is + ", \"release\": \"" + origin + "/arm/actions/release\"}");
    if (a.target == "/" && a.has("Accept: application/json"))
      json(200, R"({"stopStates": [{"thing": ")" + origin + R"(/arm", "state": ")" + origin + R"(/arm/stopped", "stopped": )" +
                    (w.state ? (w.stopped ? "false" : "true") : is) + "}]}");
    if (a.target.find("?heartbeat=often") != std::string::npos && !w.refused) test::set_status(r, 400);
    if (a.target.find("?heartbeat=0.5") != std::string::npos) {
      r = "HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\nConnection: close\r\n\r\n: begin\n\n";
      for (int i = 0; i < (w.beat ? 1 : 2); ++i) r += "event: heartbeat\ndata: " + std::string(instance) + "/" + std::to_string(++*ms) + "\n\n";
    } else if (test::status_of(r) != 101) {
      test::set_field(r, "Robot-Time", std::string(instance) + "/" + std::to_string(w.clock ? --*ms : ++*ms));
    }
  };
  f.closes = [](const Asked& a) { return a.target.find("heartbeat=0.5") != std::string::npos; };
  return f;
}

void extensions(const Add& add) {
  const auto broken = [&add](const char* id, const char* what, bool Newer::*member, bool stopped = false) {
    Newer w;
    w.*member = true;
    w.stopped = stopped;
    add(id, what, newer(w), false);
  };
  broken("expiry.late", "carries a late command out", &Newer::late);
  broken("expiry.instance", "carries a command for another run out", &Newer::instance);
  broken("expiry.valid", "refuses commands in time", &Newer::valid);
  broken("expiry.problem", "does not say that a command is late", &Newer::problem);
  broken("expiry.clock", "has a Robot-Time that goes back", &Newer::clock);
  broken("heartbeat.comes", "sends one heartbeat and then none", &Newer::beat);
  broken("heartbeat.refused", "takes any word for a heartbeat", &Newer::refused);
  broken("stop.state", "says in one place that it is stopped, in another not", &Newer::state);
  broken("stop.refuses", "moves while it is stopped", &Newer::refuses, true);
}

struct Broken {
  const char* id;  ///< of the finding, the only one
  const char* what;
  Case server;
  Names also{};  ///< findings that may follow from it: what one document lacks, the merged graph may lack, too
};

/// Values of which several alternatives, or none, are accepted.
void alternatives(std::vector<Broken>& all) {
  const auto add = [&all](const char* id, const char* what, Fault fault) {
    Case c;
    c.fault = std::move(fault);
    c.variants = true;
    c.options = [](check::CheckOptions& o, const std::string&) { o.subscribe = false; };
    all.push_back({id, what, std::move(c), {}});
  };
  const auto everywhere = [](const Asked&) { return true; };
  add("blueprint.alternatives", "has a shape of alternatives that do not exclude each other",
      edited(everywhere, [](const std::string&, const rdf::Graph& from, rdf::Graph& to) {
        for (const rdf::Triple& t : from.triples())
          to.add(from.term(t.subject), from.term(t.predicate) == vocab::sh::xone ? rdf::TermView(vocab::sh::or_) : from.term(t.predicate),
                 from.term(t.object));
      }));
  add("blueprint.alternatives", "has a shape that says nothing of what its JSON has as alternatives",
      without_triples(everywhere, [](rdf::TermView, rdf::TermView p, rdf::TermView) { return p == vocab::sh::xone; }));
  add("blueprint.alternatives", "has a shape whose alternatives exclude each other by their content only",
      edited(everywhere, [](const std::string&, const rdf::Graph& from, rdf::Graph& to) {
        // What an alternative must be is said where it is required, and not beside it.
        const auto xone = from.find(vocab::sh::xone);
        const auto is_place = [&](rdf::TermId shape) {
          const auto path = from.object(from.term(shape), vocab::sh::path);
          return path && path->text.size() > 7 && path->text.substr(path->text.size() - 7) == "/moveTo";
        };
        const auto has_alternatives = [&](rdf::TermId shape) { return xone && !from.match(shape, *xone, std::nullopt).empty(); };
        for (const rdf::Triple& t : from.triples()) {
          const bool is_beside = from.term(t.predicate) == vocab::sh::property && is_place(t.object) && has_alternatives(t.subject);
          if (!is_beside) to.add(from.term(t.subject), from.term(t.predicate), from.term(t.object));
          const bool is_required =
              from.term(t.predicate) == vocab::sh::path && is_place(t.subject) && from.object(from.term(t.subject), vocab::sh::minCount).has_value();
          if (is_required) to.add(from.term(t.subject), vocab::sh::nodeKind, vocab::sh::BlankNodeOrIRI);
        }
      }));
  /// Requests with that method whose body is of that kind get 204 instead of 422.
  const auto accepts = [](std::string method, std::function<bool(const std::string& request)> is_wrong) {
    auto wrong = std::make_shared<std::atomic<bool>>(false);
    Fault f;
    f.request = [=](std::string& q) { *wrong = q.compare(0, method.size() + 1, method + " ") == 0 && is_wrong(q); };
    f.response = [=](const Asked& a, std::string& r) {
      if (*wrong && a.method == method && test::status_of(r) == 422) test::set_empty(r, 204);
    };
    return f;
  };
  const auto has = [](const std::string& q, const char* tag) { return q.find("Target/" + std::string(tag)) != std::string::npos; };
  const auto both = [has](const std::string& q) { return has(q, "grip") && (has(q, "moveTo") || has(q, "hold")); };
  const auto several = [has](const std::string& q) { return has(q, "moveTo") && has(q, "hold"); };
  const auto none = [has](const std::string& q) {
    return q.find("#Target") != std::string::npos && !has(q, "moveTo") && !has(q, "grip") && !has(q, "height") && !has(q, "hold");
  };
  add("write.alternatives", "accepts a value with two alternatives", accepts("PUT", both));
  add("write.alternatives", "accepts a value without an alternative", accepts("PUT", none));
  add("invoke.alternatives", "accepts an input with two alternatives", accepts("POST", several));
  add("invoke.alternatives", "accepts an input without an alternative", accepts("POST", none));
}

std::vector<Broken> broken_servers() {
  std::vector<Broken> all;
  const auto add = [&all](const char* id, const char* what, Fault fault, bool moving = false) {
    Case c;
    c.fault = std::move(fault);
    c.moving = moving;
    all.push_back({id, what, std::move(c), {}});
  };
  /// Waits less for what does not come.
  const auto hurried = [&all] {
    all.back().server.options = [](check::CheckOptions& o, const std::string&) {
      o.client.limits.response_time = milliseconds(1'500);
      o.message_time = milliseconds(400);
      o.close_time = milliseconds(400);
    };
  };
  const Names merged = {"merge.conforms", "merge.entailment"};
  // ---- R0.1
  add("http.version", "says HTTP/1.0", on_response([](const Asked&, std::string& r) { r[7] = '0'; }));
  add("http.date", "has no Date", on_response([](const Asked&, std::string& r) { test::drop_field(r, "Date"); }));
  const auto wrong_length = [](int by) {
    return on_response([by](const Asked& a, std::string& r) {
      if (a.method == "GET" && test::status_of(r) == 200 && a.has("Connection: close")) {
        const long length = std::strtol(test::field_of(r, "Content-Length").c_str(), nullptr, 10);
        std::string body = test::body_of(r);
        test::set_body(r, body);
        test::set_field(r, "Content-Length", std::to_string(length + by));
      }
    });
  };
  add("http.framing", "says a length that is too small", wrong_length(-1));
  add("http.framing", "says a length that is too large", wrong_length(1));
  add("http.framing", "has Content-Length and Transfer-Encoding", on_response([](const Asked& a, std::string& r) {
        if (a.method != "GET" || test::status_of(r) != 200 || !a.has("Connection: close") || a.has("HTTP/1.0") || a.has("text/event-stream")) return;
        const std::string body = test::body_of(r);
        char size[32];
        std::snprintf(size, sizeof size, "%zx\r\n", body.size());
        test::add_field(r, "Transfer-Encoding: chunked");
        r.resize(r.find("\r\n\r\n") + 4);
        r += size + body + "\r\n0\r\n\r\n";
      }));
  add("http.head", "answers HEAD with a body", on_response([](const Asked& a, std::string& r) {
        if (a.method == "HEAD") r += "body";
      }));
  add("http.head", "does not know HEAD", status([](const Asked& a) { return a.method == "HEAD"; }, 200, 405));
  add("http.bodiless", "has Content-Length in a 204", on_response([](const Asked& a, std::string& r) {
        if (test::status_of(r) == 204 && a.method == "OPTIONS") test::add_field(r, "Content-Length: 0");
      }));
  add("http.bodiless", "sends a body with 304", on_response([](const Asked&, std::string& r) {
        if (test::status_of(r) == 304) r += "body";
      }));
  add("http.close", "does not close", on_request([](std::string& q) {
        if (q.find(" HTTP/1.0") == std::string::npos && q.find("Upgrade") == std::string::npos)
          test::replace(q, "Connection: close", "Connection: keep-alive");
      }));
  hurried();
  {
    Fault f;
    f.closes = [](const Asked&) { return true; };
    f.response = [](const Asked& a, std::string& r) {
      if (a.header.find("Connection: close") == std::string::npos && test::status_of(r) != 101 &&
          test::field_of(r, "Connection").find("close") == std::string::npos)
        test::set_field(r, "Connection", "close");
    };
    f.closes = [](const Asked& a) { return !a.has("Upgrade: websocket"); };
    add("http.persistent", "closes after each response", f);
  }
  {
    auto held = std::make_shared<std::string>();
    add("http.pipelining", "answers out of order", on_response([held](const Asked& a, std::string& r) {
          if (a.count != 3) return;
          if (a.index == 0) held->swap(r), r.clear();
          else if (a.index == 1) r += *held, held->clear();
        }));
  }
  add("http.chunked-request", "does not read chunked bodies", on_request([](std::string& q) {
        if (q.find("3\r\nabc") != std::string::npos) test::replace(q, "Transfer-Encoding: chunked\r\n\r\n", "\r\nX");
      }));
  add("http.expect", "waits for the body in spite of Expect", on_request([](std::string& q) {
        if (q.find("Expect: 100-continue") != std::string::npos) q.clear();
      }));
  hurried();
  add("http.version-1.0", "sends chunks to HTTP/1.0", on_response([](const Asked& a, std::string& r) {
        if (!a.has(" HTTP/1.0")) return;
        test::drop_field(r, "Content-Length");
        test::add_field(r, "Transfer-Encoding: chunked");
      }));
  add("http.host-missing", "accepts a request without Host", on_request([](std::string& q) {
        if (q.find("HTTP/1.1\r\nConnection: close") != std::string::npos) test::replace(q, "HTTP/1.1\r\n", "HTTP/1.1\r\nHost: check.example\r\n");
      }));
  add("http.host-repeated", "accepts two Hosts", on_request([](std::string& q) {
        const std::size_t first = q.find("\r\nHost: "), second = q.find("\r\nHost: ", first + 2);
        if (second < q.find("\r\n\r\n")) q.erase(second, q.find("\r\n", second + 2) - second);
      }));
  add("http.host-invalid", "accepts an invalid Host",
      on_request([](std::string& q) { test::replace(q, "Host: lrt check\r\n", "Host: check.example\r\n"); }));
  add("http.two-lengths", "takes the first of two lengths", on_request([](std::string& q) {
        const std::size_t first = q.find("Content-Length: 0\r\nContent-Length: ");
        if (first != std::string::npos) q.erase(first + 19, q.find("\r\n", first + 19) + 2 - first - 19);
      }));
  hurried();
  add("http.invalid-length", "accepts a length that is no number",
      on_request([](std::string& q) { test::replace(q, "Content-Length: 3x", "Content-Length: 3"); }));
  hurried();
  add("http.length-and-chunked", "reads on behind the chunks", on_request([](std::string& q) {
        const std::size_t at = q.find("\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\nGET ");
        if (at != std::string::npos && q.find("Content-Length: ") < at) drop_line(q, "Content-Length: ");
      }));
  hurried();
  add("http.chunked-not-last", "accepts another last coding", on_request([](std::string& q) { test::replace(q, "chunked, gzip", "chunked"); }));
  hurried();
  add("http.invalid-chunk", "reads on behind an invalid chunk",
      on_request([](std::string& q) { test::replace(q, "\r\n\r\nzz\r\n", "\r\n\r\n0\r\n\r\n"); }));
  hurried();
  add("http.unknown-coding", "ignores an unknown coding", on_request([](std::string& q) { drop_line(q, "Transfer-Encoding: lrt-check"); }));
  add("http.space-before-colon", "accepts a space before the colon",
      on_request([](std::string& q) { test::replace(q, "Lrt-Check :", "Lrt-Check:"); }));
  add("http.request-line", "accepts an invalid request line", on_request([](std::string& q) { test::replace(q, " lrt check HTTP", " HTTP"); }));
  add("http.unknown-method", "accepts any method", on_request([](std::string& q) { test::replace(q, "LRTCHECK ", "GET "); }));
  {
    auto is_long = [](const Asked& a) { return a.target.size() > 10'000; };
    add("http.long-target", "fails with a long target", status(is_long, 414, 500));
    auto gone = std::make_shared<std::atomic<bool>>(false);
    add("http.alive", "fails after a long target", on_response([gone, is_long](const Asked& a, std::string& r) {
          if (is_long(a)) *gone = true;
          else if (*gone && test::status_of(r) == 200) test::set_status(r, 503);
        }));
  }
  // ---- R0.2 to R0.8
  add("uri.get", "links to what does not exist", on_response([](const Asked& a, std::string& r) {
        if (is_thing(a)) test::add_field(r, "Link: </nowhere>; rel=\"related\"");
      }));
  add("uri.named", "names a property by a blank node", on_response([](const Asked& a, std::string& r) {
        if (!is_thing(a)) return;
        test::edit_graph(a, r, [](const rdf::Graph& from, rdf::Graph& to) {
          to = from;
          for (const rdf::Triple& t : from.triples())
            if (from.term(t.predicate) == vocab::hybrit::action) to.add(from.term(t.subject), vocab::hybrit::property, rdf::blank("unnamed"));
        });
      }));
  all.back().also = merged;
  add("root.get", "has no root", status([](const Asked& a) { return a.target == "/"; }, 200, 404));
  add("methods.refused", "accepts what Allow lacks", status([](const Asked& a) { return a.method == "PUT" && a.target != "/arm/angle"; }, 405, 204));
  add("methods.allow-of-405", "has no Allow in 405", on_response([](const Asked&, std::string& r) {
        if (test::status_of(r) == 405) test::drop_field(r, "Allow");
      }));
  const auto unknown = [](const Asked& a) { return a.target.find("/arm/lrt-check-") == 0; };
  add("status.not-found", "has 200 for everything", status(unknown, 404, 200));
  add("status.blame", "has 500 for what does not exist", status(unknown, 404, 500));
  const auto put = [](const Asked& a) { return a.method == "PUT" && a.target == "/arm/angle"; };
  add("write.put", "refuses PUT although it is allowed", status(put, 204, 405));
  hurried();
  add("write.no-content", "has 200 for PUT without a reason", status(put, 204, 200));
  add("write.media-type", "accepts any media type", status(put, 415, 204));
  add("write.bad-rdf", "has 500 for invalid RDF", status(put, 400, 500));
  add("write.bad-rdf", "accepts invalid RDF", status(put, 400, 204));
  add("write.shape", "accepts what violates the shape", status(put, 422, 204));
  add("write.if-match", "ignores If-Match", status([put](const Asked& a) { return put(a) && a.has("If-Match:"); }, 412, 204));
  {
    auto changed = std::make_shared<int>(0);
    add("write.unchanged", "changes with a refused body", on_response([changed](const Asked& a, std::string& r) {
          if (a.method == "PUT" && a.has("application/x-lrt-check") && a.target == "/arm/angle") *changed = 1;
          if (a.method == "GET" && a.target == "/arm/angle" && *changed == 1)
            test::set_body(r, test::body_of(r) + "<urn:x> <urn:y> 1 .\n"), test::set_field(r, "ETag", "\"once\""), *changed = 2;
        }));
  }
  add("invoke.post", "fails with a valid input", status(to_action, 204, 500));
  add("invoke.no-content", "has an empty 200 for POST", status(to_action, 204, 200));
  add("post.location", "has no Location", on_response([](const Asked& a, std::string& r) {
        if (to_action(a)) test::drop_field(r, "Location");
      }));
  add("post.location-get", "names what does not exist in Location", on_response([](const Asked& a, std::string& r) {
        if (to_action(a) && test::status_of(r) == 204) test::set_field(r, "Location", "/nowhere");
      }));
  add("invoke.bad-rdf", "has success for a POST of invalid RDF", status(to_action, 400, 204));
  add("invoke.shape", "has success for a POST that violates the shape", status(to_action, 422, 200));
  // ---- R0.9 to R0.11
  add("link.related", "has no Link", on_response([](const Asked& a, std::string& r) {
        if (is_thing(a)) test::drop_field(r, "Link");
      }));
  add("options.success", "does not know OPTIONS", status([](const Asked& a) { return a.method == "OPTIONS"; }, 204, 405));
  add("options.allow", "has no Allow", on_response([](const Asked& a, std::string& r) {
        if (a.method == "OPTIONS") test::drop_field(r, "Allow");
      }));
  add("etag.get", "has no ETag", on_response([](const Asked&, std::string& r) { test::drop_field(r, "ETag"); }));
  add("etag.head", "has no ETag in HEAD", on_response([](const Asked& a, std::string& r) {
        if (a.method == "HEAD") test::drop_field(r, "ETag");
      }));
  add("etag.head", "has another ETag in HEAD", on_response([](const Asked& a, std::string& r) {
        if (a.method == "HEAD" && is_thing(a)) test::set_field(r, "ETag", "\"other\"");
      }));
  {
    Fault f;
    f.response = [](const Asked&, std::string& r) {
      std::string tag = test::field_of(r, "ETag");
      if (tag.size() > 2) test::set_field(r, "ETag", tag.substr(1, tag.size() - 2));
    };
    f.request = [](std::string& q) {
      for (const char* name : {"If-None-Match", "If-Match"})
        if (const std::string tag = test::field_of(q, name); !tag.empty() && tag[0] != '"') test::set_field(q, name, "\"" + tag + "\"");
    };
    add("etag.syntax", "has a tag without quotes", f);
  }
  add("etag.changes", "has an ETag that does not change", constant_tag([](const Asked& a) { return a.target == "/arm/count"; }));
  {
    auto n = std::make_shared<std::atomic<int>>(0);
    add("etag.stable", "has an ETag that always changes", on_response([n](const Asked& a, std::string& r) {
          if (a.target != "/arm/angle" && !test::field_of(r, "ETag").empty()) test::set_field(r, "ETag", "\"" + std::to_string(++*n) + "\"");
        }));
  }
  add("etag.media-types", "has one ETag for all media types", constant_tag(is_thing));
  add("etag.304", "ignores If-None-Match", on_request([](std::string& q) { drop_line(q, "If-None-Match"); }));
  add("etag.304-tag", "has no ETag in 304", on_response([](const Asked&, std::string& r) {
        if (test::status_of(r) == 304) test::drop_field(r, "ETag");
      }));
  const auto frames_to_client = [](std::function<void(std::string&)> change) {
    Fault f;
    f.to_client = std::move(change);
    return f;
  };
  const auto frames_to_server = [](unsigned opcode) {
    Fault f;
    f.to_server = [opcode](std::string& bytes) {
      if (!bytes.empty() && (static_cast<unsigned char>(bytes[0]) & 15U) == opcode) bytes.clear();
    };
    return f;
  };
  // ---- R0.12 to R0.17
  add("ws.handshake", "ignores Upgrade: websocket", on_request([](std::string& q) { test::replace(q, "Upgrade: websocket", "Upgrade: nothing"); }));
  add("ws.handshake", "closes each WebSocket at once", frames_to_client([](std::string& bytes) { bytes.append("\x88\x02\x03\xE8", 4); }));
  add("ws.accept", "has a wrong Sec-WebSocket-Accept", on_response([](const Asked&, std::string& r) {
        if (test::status_of(r) == 101) test::set_field(r, "Sec-WebSocket-Accept", "bHJ0IGNoZWNrIGxydCBjaGVjayEh");
      }));
  add("ws.fields", "agrees on an extension that was not offered", on_response([](const Asked&, std::string& r) {
        if (test::status_of(r) == 101) test::add_field(r, "Sec-WebSocket-Extensions: permessage-deflate");
      }));
  /// Changes what comes with the n-th message, from 0.
  const auto messages = [frames_to_client](std::function<void(std::size_t n, std::string & bytes)> change) {
    return frames_to_client([change = std::move(change), n = std::make_shared<std::atomic<std::size_t>>(0)](std::string& bytes) {
      if (!bytes.empty() && (static_cast<unsigned char>(bytes[0]) & 8U) == 0) change((*n)++, bytes);
    });
  };
  add("ws.frames", "sets a reserved bit", frames_to_client([](std::string& bytes) { bytes[0] = static_cast<char>(bytes[0] | 0x40); }));
  add("ws.ping", "does not answer pings", frames_to_server(9));
  hurried();
  add("ws.close", "does not answer a close", frames_to_server(8));
  hurried();
  add("ws.version", "does not say which version it supports", on_response([](const Asked&, std::string& r) {
        if (test::status_of(r) == 426) test::drop_field(r, "Sec-WebSocket-Version");
      }));
  add("ws.first-message", "sends no first message", messages([](std::size_t n, std::string& bytes) {
        if (n == 0) bytes.clear();
      }));
  hurried();
  add("ws.notified", "sends one message and then none", messages([](std::size_t n, std::string& bytes) {
        if (n > 0) bytes.clear();
      }));
  hurried();
  add("ws.notified", "sends one message more and then none", messages([](std::size_t n, std::string& bytes) {
        if (n > 1) bytes.clear();
      }));
  hurried();
  add("ws.content", "sends empty messages", messages([](std::size_t n, std::string& bytes) {
        if (n > 0) bytes.assign("\x81\x00", 2);
      }));
  hurried();
  {
    auto first = std::make_shared<std::string>();
    add("ws.content", "sends the former content again", messages([first](std::size_t n, std::string& bytes) {
          if (n == 0) *first = bytes;
          else bytes = *first;
        }));
    hurried();
  }
  add("ws.content", "sends another value than GET", messages([](std::size_t n, std::string& bytes) {
        if (n > 0) test::replace(bytes, "XMLSchema#double", "XMLSchema#decima");
      }));
  hurried();
  add("ws.media-type", "ignores Accept of a handshake", on_request([](std::string& q) {
        if (q.find("Upgrade: websocket") != std::string::npos) drop_line(q, "Accept:");
      }));
  add("callback.created", "ignores Upgrade: callback", on_request([](std::string& q) { drop_line(q, "Upgrade: callback"); }));
  hurried();
  add("callback.requires-uri", "ignores Upgrade: callback without Callback", on_request([](std::string& q) {
        if (q.find("\r\nCallback:") == std::string::npos) drop_line(q, "Upgrade: callback");
      }));
  add("callback.delivered", "never calls back", on_request([](std::string& q) {
        if (q.find("\r\nCallback:") != std::string::npos) test::set_field(q, "Callback", "http://127.0.0.1:1/");
      }),
      true);
  all.back().also = {"subscription.described"};  // its URL is another one
  hurried();
  add("callback.media-type", "calls back in the wrong media type", on_request([](std::string& q) {
        if (q.find("\r\nCallback:") != std::string::npos) drop_line(q, "Accept:");
      }));
  add("callback.cancel", "does not cancel", on_request([](std::string& q) {
        if (q.compare(0, 7, "DELETE ") == 0 && q.find("/subscriptions/") != std::string::npos) test::replace(q, "DELETE ", "GET ");
      }));
  // ---- R1
  add("rdf.turtle", "has N-Triples by default", on_request([](std::string& q) {
        if ((q.compare(0, 4, "GET ") == 0 || q.compare(0, 5, "HEAD ") == 0) && q.find("\r\nAccept:") == std::string::npos &&
            q.find("Upgrade: callback") == std::string::npos)
          test::replace(q, "\r\n", "\r\nAccept: application/n-triples\r\n");
      }));
  add("rdf.accept-turtle", "has no Turtle for Accept", on_request([](std::string& q) {
        if (q.find("\r\nAccept: text/turtle\r\n") != std::string::npos) test::set_field(q, "Accept", "application/n-triples");
      }));
  add("rdf.valid", "has invalid Turtle", on_response([](const Asked& a, std::string& r) {
        if (a.has("\r\nAccept: text/turtle\r\n") && is_thing(a)) test::set_body(r, test::body_of(r) + "<urn:x> <urn:y> .");
      }));
  add("negotiate.accept", "ignores Accept", on_request([](std::string& q) { drop_line(q, "Accept:"); }));
  add("negotiate.quality", "ignores q-values", on_request([](std::string& q) {
        if (q.find("q=0.9") != std::string::npos && q.find("q=0.2") != std::string::npos) test::set_field(q, "Accept", "text/turtle");
      }));
  add("negotiate.vary", "has no Vary", on_response([](const Asked&, std::string& r) { test::drop_field(r, "Vary"); }));
  add("negotiate.not-acceptable", "has no 406", on_request([](std::string& q) { drop_line(q, "Accept: application/x-lrt-check"); }));
  add("rdf.type", "has no rdf:type", without_triples(is_thing, [](rdf::TermView s, rdf::TermView p, rdf::TermView) {
        return p == vocab::rdf_::type && s.text.substr(s.text.size() - 4) == "/arm";
      }));
  all.back().also = merged;
  add("rdf.vocabularies", "uses no standard vocabulary", without_triples(is_thing, [](rdf::TermView, rdf::TermView p, rdf::TermView) {
        return p != vocab::rdf_::type && (p.text.substr(0, 17) == "http://www.w3.org" || p.text.substr(0, 19) == "http://purl.org/dc/");
      }));
  all.back().also = merged;
  add("rdf.vocabularies", "has an own term for the title", with_triples(is_thing, [](const std::string& root, rdf::Graph& to) {
        to.add(rdf::iri(root + "arm"), rdf::iri(root + "ns/vocabulary#title"), rdf::literal("The arm"));
      }));
  add("subscriptions.triple", "has no hybrit:subscriptions", without_predicate(vocab::hybrit::subscriptions));
  all.back().also = merged;
  add("subscription.described", "does not say what a subscription is of",
      without_triples(
          [](const Asked& a) { return a.target.find("/arm/subscriptions/") == 0 || a.target.find("/subscriptions/") != std::string::npos; },
          [](rdf::TermView, rdf::TermView p, rdf::TermView) { return p == vocab::hybrit::onResource; }));
  add("subscriptions.container", "has Subscriptions that are no container", on_response([](const Asked& a, std::string& r) {
        if (a.target != "/arm/subscriptions") return;
        test::strip(a, r, [](rdf::TermView, rdf::TermView p, rdf::TermView) { return p == vocab::rdf_::type; });
        test::drop_field(r, "Link");
      }));
  all.back().also = merged;
  add("property.triples", "has no hybrit:property", without_predicate(vocab::hybrit::property));
  all.back().also = merged;
  add("action.triples", "has no hybrit:action", without_predicate(vocab::hybrit::action));
  all.back().also = merged;
  add("action.described", "has no binding of an action",
      without_triples([](const Asked& a) { return a.target == "/arm/actions/turn"; },
                      [](rdf::TermView, rdf::TermView p, rdf::TermView) { return p == vocab::hybrit::binding; }));
  add("action.described", "has a binding that is not allowed",
      edited([](const Asked& a) { return a.target == "/arm/actions/turn"; },
             [](const std::string& root, const rdf::Graph& from, rdf::Graph& to) {
               for (const rdf::Triple& t : from.triples())
                 to.add(from.term(t.subject), from.term(t.predicate),
                        from.term(t.predicate) == vocab::http_core::requestURI ? rdf::iri(root + "arm/state") : from.term(t.object));
             }));
  add("blueprint.triple", "has no hybrit:blueprint", without_predicate(vocab::hybrit::blueprint));
  all.back().also = merged;
  const auto is_root = [](const Asked& a) { return a.target == "/"; };
  add("blueprint.targets", "has a shape for a class of others",
      with_triples([](const Asked& a) { return a.target.find("/blueprints/") == 0; },
                   [](const std::string&, rdf::Graph& to) {
                     to.add(rdf::iri("urn:shape"), vocab::rdf_::type, vocab::sh::NodeShape);
                     to.add(rdf::iri("urn:shape"), vocab::sh::targetClass, rdf::iri("http://example.org/Nothing"));
                   }));
  add("merge.conforms", "says another value in another document", with_triples(is_root, [](const std::string& root, rdf::Graph& to) {
        to.add(rdf::iri(root + "arm/angle"), vocab::vom::numericalValue, rdf::literal("1000", vocab::xsd::double_));
      }));
  add("merge.doubles", "describes a part by a blank node in two documents",
      with_triples([is_root](const Asked& a) { return is_root(a) || is_thing(a); },
                   [](const std::string& root, rdf::Graph& to) {
                     to.add(rdf::iri(root + "arm"), rdf::iri("http://example.org/mount"), rdf::blank("mount"));
                     to.add(rdf::blank("mount"), rdf::iri("http://example.org/height"), rdf::literal("0.5", vocab::xsd::decimal));
                   }));
  add("merge.entailment", "has a domain whose class is not stated", with_triples(is_root, [](const std::string& root, rdf::Graph& to) {
        to.add(vocab::hybrit::subscriptions, vocab::rdfs::domain, rdf::iri(root + "ns/vocabulary#Machine"));
      }));
  add("blueprint.shapes", "has a Blueprint that is ill-formed", on_response([](const Asked& a, std::string& r) {
        if (a.target.find("lueprint") == std::string::npos) return;
        test::edit_graph(a, r, [](const rdf::Graph& from, rdf::Graph& to) {
          to = from;
          to.add(rdf::iri("urn:shape"), vocab::rdf_::type, vocab::sh::NodeShape);
          to.add(rdf::iri("urn:shape"), rdf::iri("http://www.w3.org/ns/shacl#nodeKind"), rdf::literal("no kind"));
        });
      }));
  add("blueprint.conforms", "does not conform to its Blueprint",
      without_triples(is_state, [](rdf::TermView, rdf::TermView p, rdf::TermView) { return p == vocab::vom::numericalValue; }));
  add("http.slow", "takes its time", on_response([](const Asked&, std::string&) { std::this_thread::sleep_for(milliseconds(3)); }));
  all.back().server.options = [](check::CheckOptions& o, const std::string&) { o.slow_time = milliseconds(1); };
  announcements(add);
  alternatives(all);
  caching(add);
  subscriptions(add, hurried);
  extensions(add);
  return all;
}

TEST_CASE("a server of lrt fulfils what can be checked", "[check]") {
  for (const bool moving : {false, true}) {
    INFO("moving: " << moving);
    Case c;
    c.moving = moving;
    const Result<check::Report> report = report_of(std::move(c));
    INFO(told(report));
    CHECK(failures(report).empty());
    CHECK(check::exit_status(report, true) == 0);
    REQUIRE(report);
    CHECK(report->is_robotic_thing);
    CHECK(report->is_linked_robotic_thing);
    CHECK(report->notes.empty());
    // Nothing is left out by mistake: what was not tested has a reason.
    for (const check::Finding& f : report->findings) {
      INFO(f.id << ": " << f.detail);
      // What lrt has not, or not yet; and a Date with whole seconds, which need not move within a fast check.
      const Names none = {"tls.https",          "status.500",         "date.moves",         "accept-patch.announced",
                          "modified.future",    "modified.changes",   "modified.condition", "blueprint.alternatives",
                          "write.alternatives", "invoke.alternatives"};
      const bool extension = f.requirements.front() == "lrt";
      if (!moving) CHECK((f.outcome == Outcome::pass || extension || none.count(f.id) == 1));
    }
  }
}

/// The reports of all, in their order. A check mostly waits, so several run at a time.
std::vector<Result<check::Report>> reports_of(std::vector<Broken>& all) {
  constexpr std::size_t at_a_time = 5;
  std::vector<Result<check::Report>> reports(all.size(), unexpected(Errc::timed_out, "not run"));
  std::atomic<std::size_t> next{0};
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < at_a_time; ++t)
    threads.emplace_back([&] {
      for (std::size_t i = next++; i < all.size(); i = next++) reports[i] = report_of(std::move(all[i].server));
    });
  for (std::thread& t : threads) t.join();
  return reports;
}

TEST_CASE("a robot whose values are one of several alternatives has no fault", "[check]") {
  Case c;
  c.variants = true;
  const Result<check::Report> report = report_of(std::move(c));
  INFO(told(report));
  CHECK(failures(report).empty());
  REQUIRE(report);
  for (const char* id : {"blueprint.alternatives", "write.alternatives", "invoke.alternatives", "blueprint.conforms", "write.put", "invoke.post"}) {
    INFO(id);
    CHECK(report->find(id)->outcome == Outcome::pass);
  }
}

TEST_CASE("each broken server has exactly its fault", "[check]") {
  std::vector<Broken> all = broken_servers();
  const std::vector<Result<check::Report>> reports = reports_of(all);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::string id = all[i].id;
    const Result<check::Report>& report = reports[i];
    INFO(id << ": a server that " << all[i].what);
    INFO(told(report));
    Names others = failures(report);
    CHECK(others.erase(id) == 1);
    for (const std::string& also : all[i].also) others.erase(also);
    if (id != "http.slow") others.erase("http.slow");  // on a machine with much else to do every server is slow
    CHECK(others == Names{});
    const check::Finding* found = report ? report->find(id) : nullptr;
    CHECK((found != nullptr && !found->evidence.empty() && !found->detail.empty()));
    if (!found || found->evidence.empty()) continue;
    // It names the exchange: URL, method or message, status or why there is none.
    const check::Evidence& evidence = found->evidence.front();
    CHECK(evidence.url.compare(0, 7, "http://") == 0);
    CHECK((evidence.sent.find(" HTTP/1.") != std::string::npos || id == "http.long-target"));
    CHECK((evidence.received.compare(0, 7, "HTTP/1.") == 0 || evidence.received.compare(0, 12, "no response:") == 0));
    CHECK(check::exit_status(report) == (found->level == check::Level::must ? 1 : 0));
    if (failures(report).size() == 1) CHECK(check::exit_status(report, true) == (found->level == check::Level::may ? 0 : 1));
  }
}

TEST_CASE("a change without a message fails, and so does the missing first message", "[check][R0.15]") {
  Case c;
  c.moving = true;
  c.options = [](check::CheckOptions& o, const std::string&) { o.message_time = milliseconds(400); };
  c.fault.to_client = [](std::string& bytes) {
    if (!bytes.empty() && (static_cast<unsigned char>(bytes[0]) & 8U) == 0) bytes.clear();
  };
  const Result<check::Report> report = report_of(std::move(c));
  INFO(told(report));
  CHECK(failures(report) == Names{"ws.notified", "ws.first-message"});
}

TEST_CASE("a slow server is reported as slow, and as nothing else", "[check]") {
  Result<check::Report> report = unexpected(Errc::timed_out, "not run");
  // A machine that stops for a moment lets the first request time out, without which there is no report.
  for (int i = 0; i < 10 && !report && report.error().code == Errc::timed_out; ++i) {
    Case c;
    c.fault.response = [](const Asked&, std::string&) { std::this_thread::sleep_for(milliseconds(100)); };
    c.fault.to_client = [](std::string&) { std::this_thread::sleep_for(milliseconds(100)); };
    c.options = [](check::CheckOptions& o, const std::string&) {
      o.slow_time = milliseconds(80);
      o.client.limits.response_time = milliseconds(350);  // so that its responses are late now and then
      o.message_time = o.close_time = milliseconds(20);
      o.max_resources = 3;
      o.total_time = milliseconds(9'000);
    };
    report = report_of(std::move(c));
  }
  INFO(told(report));
  CHECK(failures(report) == Names{"http.slow"});
  REQUIRE(report);
  CHECK(report->find("http.slow")->detail.find("a response usually takes 0.") == 0);
  CHECK(report->find("http.slow")->detail.find(" s; the slowest, to ") != std::string::npos);
  CHECK(check::exit_status(report, true) == 0);
}

TEST_CASE("progress is told from the first request on", "[check]") {
  std::size_t calls = 0;
  std::string first;
  Case c;
  c.options = [&](check::CheckOptions& o, const std::string&) {
    o.progress = [&](const check::Progress& now) {
      if (++calls == 1) first = now.url;
      CHECK(now.requests == calls);
    };
  };
  const Result<check::Report> report = report_of(std::move(c));
  REQUIRE(report);
  CHECK(report->requests == calls);
  CHECK(first == report->url);
}

TEST_CASE("a server that keeps what it announces beside the paper passes, and one that announces nothing is not testable", "[check]") {
  const char* const extensions[] = {"expiry.clock",   "expiry.late",     "expiry.instance",   "expiry.valid",
                                    "expiry.problem", "heartbeat.comes", "heartbeat.refused", "stop.state"};
  for (const bool stopped : {false, true}) {
    INFO("stopped: " << stopped);
    Case c;
    Newer w;
    w.stopped = stopped;
    c.fault = newer(w);
    c.options = [&](check::CheckOptions& o, const std::string&) { o.message_time = milliseconds(300); };
    const Result<check::Report> report = report_of(std::move(c));
    INFO(told(report));
    CHECK(failures(report).empty());
    REQUIRE(report);
    for (const char* id : extensions)
      if (!stopped || std::string(id).find("expiry.") != 0 || std::string(id) == "expiry.clock") {
        INFO(id << ": " << report->find(id)->detail);
        CHECK(report->find(id)->outcome == Outcome::pass);
      }
    CHECK(report->find("stop.refuses")->outcome == (stopped ? Outcome::pass : Outcome::not_testable));
    // What a stop would make unavailable is listed.
    REQUIRE(report->notes.size() == 1);
    CHECK(report->notes.front().find("/arm is stopped, these are unavailable: ") != std::string::npos);
    CHECK(report->notes.front().find("/arm/angle") != std::string::npos);
    CHECK(report->notes.front().find("/arm/actions/turn") != std::string::npos);
  }
  Case c;  // as a server that is not of lrt: no time, no heartbeats
  c.fault.response = [](const Asked&, std::string& r) { test::drop_field(r, "Robot-Time"); };
  const Result<check::Report> report = report_of(std::move(c));
  REQUIRE(report);
  for (const char* id : extensions) CHECK(report->find(id)->outcome == Outcome::not_testable);
}

TEST_CASE("every check has a broken server", "[check]") {
  Names tested = {"tls.https"};  // in a case of its own
  for (const Broken& broken : broken_servers()) tested.insert(broken.id);
  // They cannot fail: without GET there is no report, and the others only tell what was seen.
  const Names cannot_fail = {"methods.get", "status.bad-request", "status.500", "metadata"};
  Case c;
  const Result<check::Report> report = report_of(std::move(c));
  REQUIRE(report);
  for (const check::Finding& f : report->findings) {
    INFO(f.id);
    CHECK(tested.count(f.id) + cannot_fail.count(f.id) == 1);
  }
  CHECK(broken_servers().size() >= 150);
  CHECK(tested.size() + cannot_fail.size() == report->findings.size());
  // And a line in the table of the documentation, with its requirements and level.
  std::ifstream in(LRT_SOURCE_DIR "/docs/check.md");
  const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  std::size_t lines = 0;
  for (std::size_t at = text.find("\n| `"); at != std::string::npos; at = text.find("\n| `", at + 1)) ++lines;
  CHECK(lines >= report->findings.size());
  for (const check::Finding& f : report->findings) {
    std::string requirements;
    for (const std::string& r : f.requirements) requirements += (requirements.empty() ? "" : ", ") + r;
    INFO(f.id);
    CHECK(text.find("| `" + f.id + "` | " + requirements + " | " + std::string(to_string(f.level)) + " | " + f.title + " | " + f.references + " |") !=
          std::string::npos);
  }
}

// ------------------------------------------------------------------------------------------------------------- what is not a fault

TEST_CASE("what the paper does not ask for is no fault: the authors' later server", "[check][R0.16]") {
  Case c;
  c.moving = true;  // it sends changes, and nothing at the beginning
  c.fault.response = [](const Asked& a, std::string& r) {
    if (test::status_of(r) == 201 && a.method == "GET") {  // 200 with the description of the subscription
      test::set_status(r, 200);
      test::drop_field(r, "Location");
      test::drop_field(r, "Content-Location");
      std::string body = test::body_of(r);
      while (test::replace(body, "hybr-it#callbackURL", "hybr-it#callbackUrl")) {}
      test::set_body(r, body);
    }
    if ((a.method == "GET" || a.method == "HEAD") && test::status_of(r) != 101) test::drop_field(r, "Upgrade");  // does not announce it
  };
  const Result<check::Report> report = report_of(std::move(c));
  INFO(told(report));
  CHECK(failures(report).empty());
  REQUIRE(report);
  CHECK(report->find("callback.created")->outcome == Outcome::pass);
  CHECK(report->find("callback.delivered")->outcome == Outcome::pass);
  CHECK(report->find("callback.cancel")->outcome == Outcome::pass);
  CHECK(report->notes.empty());
}

TEST_CASE("a server with Turtle alone, weak tags and no callbacks by policy has no must that fails", "[check]") {
  Case c;
  c.fault.request = [](std::string& q) {
    const std::string accept = test::field_of(q, "Accept");
    if (!accept.empty() && accept.find("x-lrt-check") == std::string::npos)
      test::set_field(q, "Accept", accept.find("text/turtle") == std::string::npos ? "application/x-lrt-check" : "text/turtle");
    for (const char* name : {"If-None-Match", "If-Match"})
      if (const std::string tag = test::field_of(q, name); tag.compare(0, 2, "W/") == 0) test::set_field(q, name, tag.substr(2));
  };
  c.fault.response = [](const Asked& a, std::string& r) {
    if (const std::string tag = test::field_of(r, "ETag"); !tag.empty()) test::set_field(r, "ETag", "W/" + tag);
    test::drop_field(r, "Vary");
    if (a.has("Upgrade: callback"))
      r = "HTTP/1.1 403 Forbidden\r\nDate: " + test::field_of(r, "Date") + "\r\nContent-Length: 0\r\nConnection: close\r\n\r\n";
    if (test::status_of(r) == 406) test::set_body(r, "available is text/turtle");
    const std::string links = test::field_of(r, "Link");
    std::string kept;
    for (std::size_t at = 0; at < links.size();) {
      const std::size_t end = std::min(links.find(", <", at), links.size());
      if (const std::string link = links.substr(at, end - at); link.find("alternate") == std::string::npos) kept += (kept.empty() ? "" : ", ") + link;
      at = end + 2;
    }
    if (!links.empty()) test::set_field(r, "Link", kept);
  };
  const Result<check::Report> report = report_of(std::move(c));
  INFO(told(report));
  CHECK(failures(report).empty());
  CHECK(report->find("callback.created")->outcome == Outcome::not_testable);
  CHECK(report->find("negotiate.accept")->outcome == Outcome::not_applicable);
}

TEST_CASE("what cannot be run is an error with its reason", "[check]") {
  test::RobotHost host(robot(false));
  const auto error_of = [](const Result<check::Report>& report) {
    REQUIRE_FALSE(report);
    CHECK(check::exit_status(report) == 2);
    return report.error();
  };
  CHECK(error_of(check::run("robot", quick())).code == Errc::expected_iri);
  CHECK(error_of(check::run("ftp://127.0.0.1/", quick())).code == Errc::expected_iri);
  CHECK(error_of(check::run(host.url() + "nowhere", quick())).message.find("404") != std::string::npos);
  check::CheckOptions elsewhere = quick();
  elsewhere.write = {"http://127.0.0.1:1/x"};
  CHECK(error_of(check::run(host.url() + "arm", elsewhere)).code == Errc::invalid_option);
  check::CheckOptions no_token = quick();
  no_token.client.identity.token = "a b";
  CHECK(error_of(check::run(host.url() + "arm", no_token)).code == Errc::invalid_option);
  std::uint16_t closed = 0;
  {
    const test::Listener listener;
    closed = listener.port();
  }
  CHECK_FALSE(error_of(check::run("http://127.0.0.1:" + std::to_string(closed) + "/", quick())).message.empty());
}

TEST_CASE("a server that wants credentials is checked with a token, which the evidence does not show", "[check]") {
  const test::Folder folder;
  const std::string tokens = folder / "tokens";
  std::ofstream(tokens) << "tester operator secret-of-the-test-1234567890\n";
  Options server;
  server.security.token_file = tokens;
  test::RobotHost host(robot(false), {}, server);
  const Result<check::Report> without = check::run(host.url() + "arm", quick());
  REQUIRE_FALSE(without);
  CHECK(without.error().message.find("401") != std::string::npos);
  check::CheckOptions options = quick();
  options.client.identity.token = "secret-of-the-test-1234567890";
  const Result<check::Report> report = check::run(host.url() + "arm", options);
  INFO(told(report));
  CHECK(failures(report).empty());
  REQUIRE(report);
  for (const std::string& text : {check::to_text(*report, {false, true}), check::to_json(*report), check::to_earl(*report)}) {
    CHECK(text.find("secret-of-the-test") == std::string::npos);
    CHECK(text.find("Authorization: (left out)") != std::string::npos);
  }
}

TEST_CASE("nothing is changed unless resources are named", "[check]") {
  std::atomic<int> writes{0}, calls{0};
  Thing arm{"arm"};
  auto angle = arm.property<double>("angle").on_write([&writes](double) { ++writes; });
  angle.publish(1);
  arm.action("turn", [&calls](double) { ++calls; });
  arm.action("home", [&calls] { ++calls; });
  arm.action("halt", [&calls] { ++calls; }).stop();
  Options server;
  server.callbacks.allow = {"127.0.0.1"};
  test::RobotHost host(test::one_thing(std::move(arm)), {}, server);
  check::CheckOptions options = quick();
  options.message_time = milliseconds(300);  // nothing changes, so that it is waited for in vain
  const Result<check::Report> report = check::run(host.url() + "arm", options);
  INFO(told(report));
  CHECK(failures(report).empty());
  CHECK(report->find("ws.notified")->outcome == Outcome::not_testable);
  CHECK(report->find("callback.delivered")->outcome == Outcome::not_testable);
  CHECK(report->find("callback.content")->detail.find("--write") != std::string::npos);
  CHECK(writes == 0);
  CHECK(calls == 0);
  // Subscriptions are ended: the container is empty again.
  CHECK(report->find("callback.created")->outcome == Outcome::pass);
  CHECK(host.server().counters().callbacks == 0);
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (host.server().counters().websockets != 0 && std::chrono::steady_clock::now() < end) std::this_thread::yield();
  CHECK(host.server().counters().websockets == 0);
}

TEST_CASE("the root of a server that is mounted below a path is found above the URL", "[check][R0.4]") {
  Case c;
  c.fault.response = [](const Asked& a, std::string& r) {
    if (a.target == "/") test::set_status(r, 404);
  };
  c.options = [](check::CheckOptions& o, const std::string& url) { o.root = url; };
  const Result<check::Report> report = report_of(std::move(c));
  INFO(told(report));
  CHECK(failures(report).empty());
}

// ---------------------------------------------------------------------------------------------------------------------------------- TLS

TEST_CASE("plain HTTP to another address than loopback is a missing should, and TLS passes", "[check][R0.2]") {
  ifaddrs* all = nullptr;
  REQUIRE(::getifaddrs(&all) == 0);
  std::string address;
  for (const ifaddrs* i = all; i != nullptr; i = i->ifa_next) {
    char text[INET_ADDRSTRLEN];
    if (i->ifa_addr != nullptr && i->ifa_addr->sa_family == AF_INET && (i->ifa_flags & IFF_LOOPBACK) == 0 &&
        ::inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(i->ifa_addr)->sin_addr, text, sizeof text) != nullptr)
      address = text;
  }
  ::freeifaddrs(all);
  if (address.empty()) {
    test::print_skip("this machine has no address besides loopback: one half is left out");
  } else {
    Case c;
    c.address = INADDR_ANY;
    c.host = address;
    const Result<check::Report> report = report_of(std::move(c));
    INFO(told(report));
    CHECK(failures(report) == Names{"tls.https"});
    CHECK(check::exit_status(report) == 0);
    CHECK(check::exit_status(report, true) == 1);
  }
  const test::TlsFolder folder;
  const test::Certificate authority = test::make_certificate({"authority", {}, -3600, 3600, true}),
                          own = test::make_certificate({"robot", "IP:127.0.0.1"}, &authority);
  Options server;
  server.security.tls = transport::TlsOptions{folder.put("server.pem", {&own}), folder.put_key("server-key.pem", own), {}, false};
  test::RobotHost host(robot(false), {}, server);
  check::CheckOptions options = quick();
  options.client.ca_file = folder.put("ca.pem", {&authority});
  const Result<check::Report> report = check::run(host.url() + "arm", options);
  INFO(told(report));
  CHECK(failures(report).empty());
  REQUIRE(report);
  CHECK(report->find("tls.https")->outcome == Outcome::pass);
  CHECK(report->find("ws.ping")->outcome == Outcome::pass);
  const Result<check::Report> untrusted = check::run(host.url() + "arm", quick());
  CHECK_FALSE(untrusted);
}

// -------------------------------------------------------------------------------------------------------------------------- formats

TEST_CASE("a report is text, JSON and EARL with the same verdicts", "[check]") {
  Case c;
  c.fault = on_response([](const Asked& a, std::string& r) {
    if (a.method == "HEAD") test::drop_field(r, "ETag");
    test::add_field(r, "Server: \"quoted\" \\ caf\xE9");  // what JSON, Turtle and UTF-8 do not take as it is
  });
  const Result<check::Report> report = report_of(std::move(c));
  REQUIRE(report);
  const std::string text = check::to_text(*report), json = check::to_json(*report), earl = check::to_earl(*report);
  CHECK(text.find("FAIL etag.head (R0.11)") != std::string::npos);
  CHECK(text.find("    > HEAD /arm HTTP/1.1") != std::string::npos);
  CHECK(text.find("R0.11 FAIL") != std::string::npos);
  CHECK(text.find('\x1B') == std::string::npos);
  CHECK(check::to_text(*report, {true, false}).find("\x1B[31mFAIL\x1B[0m") != std::string::npos);
  CHECK(json.find(R"("id": "etag.head", "requirements": ["R0.11"], "level": "must", "outcome": "fail", "certainty": "certain")") !=
        std::string::npos);
  CHECK(json.find(R"("product": "\"quoted\" \\ caf?")") != std::string::npos);
  const Result<rdf::Graph> graph = rdf::read(earl, rdf::Syntax::turtle, {});
  REQUIRE(graph);
  const auto named = [](std::string_view name) { return rdf::Term(rdf::iri("http://www.w3.org/ns/earl#" + std::string(name))); };
  CHECK(graph->subjects(vocab::rdf_::type, named("Assertion")).size() == report->findings.size());
  CHECK(graph->subjects(named("outcome"), named("failed")).size() == 1);
  std::size_t passed = 0;
  for (const check::Finding& f : report->findings) passed += f.outcome == Outcome::pass ? 1 : 0;
  CHECK(graph->subjects(named("outcome"), named("passed")).size() == passed);
  const auto assertion = graph->subjects(named("test"), rdf::iri("https://w3id.org/lrt/check#etag.head"));
  REQUIRE(assertion.size() == 1);
  const auto result = graph->object(assertion.front(), named("result"));
  REQUIRE(result);
  CHECK(graph->object(*result, named("outcome")) == named("failed").view());
}

// -------------------------------------------------------------------------------------------------------------------------- hostile servers

/// Answers each connection by a function, which gets the first bytes of the client, and ends it.
class ScriptedServer {
 public:
  using Script = std::function<void(int connection, const std::string& request, const std::atomic<bool>& ended)>;
  explicit ScriptedServer(Script script) : script_(std::move(script)), thread_([this] { run(); }) {}
  ~ScriptedServer() {
    ended_ = true;
    thread_.join();
    for (std::thread& t : connections_) t.join();
  }
  ScriptedServer(const ScriptedServer&) = delete;
  ScriptedServer& operator=(const ScriptedServer&) = delete;
  std::string url() const { return "http://127.0.0.1:" + std::to_string(listener_.port()) + "/"; }

 private:
  void run() {
    while (!ended_) {
      const int connection = listener_.accept(5);
      if (connection < 0) continue;
      connections_.emplace_back([this, connection] {
        char buffer[64 * 1024];
        pollfd item{connection, POLLIN, 0};
        while (!ended_ && ::poll(&item, 1, 5) <= 0) {}
        const auto n = ::recv(connection, buffer, sizeof buffer, MSG_DONTWAIT);
        script_(connection, n > 0 ? std::string(buffer, static_cast<std::size_t>(n)) : std::string(), ended_);
        ::close(connection);
      });
    }
  }
  test::Listener listener_;
  Script script_;
  std::atomic<bool> ended_{false};
  std::list<std::thread> connections_;
  std::thread thread_;
};

bool put(int connection, const std::string& bytes) {
  return ::send(connection, bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
}

/// A complete response; what may be wrong is added by a script.
std::string response(const std::string& fields, const std::string& body) {
  return "HTTP/1.1 200 OK\r\nContent-Length: " + std::to_string(body.size()) + "\r\n" + fields + "\r\n" + body;
}

// ------------------------------------------------------------------------------------------------------------- merged documents

/// A server of documents in Turtle. Of "{n}" in a document each response has another number.
class DocumentServer {
 public:
  explicit DocumentServer(std::map<std::string, std::string> documents)
      : documents_(std::move(documents)), server_([this](int c, const std::string& request, const std::atomic<bool>&) {
          const std::size_t begin = request.find(' ') + 1;
          const auto found = documents_.find(request.substr(begin, request.find(' ', begin) - begin));
          if (found == documents_.end()) {
            put(c, "HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n");
            return;
          }
          std::string body = prefixes + found->second;
          if (const std::size_t at = body.find("{n}"); at != std::string::npos) body.replace(at, 3, std::to_string(++number_));
          const bool is_options = request.compare(0, 8, "OPTIONS ") == 0;
          put(c, response("Content-Type: text/turtle\r\n" + std::string(is_options ? "Allow: GET, OPTIONS, POST\r\n" : ""), body));
        }) {}
  std::string url() const { return server_.url(); }
  /// The check, without all that has nothing to do with documents.
  Result<check::Report> report(const std::function<void(check::CheckOptions&)>& change = {}) const {
    check::CheckOptions options = quick();
    options.subscribe = false;
    options.close_time = milliseconds(50);
    if (change) change(options);
    return check::run(url() + "arm", options);
  }

 private:
  inline static const std::string prefixes =
      "@prefix hybrit: <https://hybr-it-projekt.de/ns/hybr-it#> . @prefix sh: <http://www.w3.org/ns/shacl#> . @prefix rdfs: "
      "<http://www.w3.org/2000/01/rdf-schema#> . @prefix dcterms: <http://purl.org/dc/terms/> . @prefix ex: <http://example.org/> . @prefix http: "
      "<http://www.w3.org/2011/http#> . @prefix m: <http://www.w3.org/2011/http-methods#> .\n";
  std::map<std::string, std::string> documents_;
  std::atomic<unsigned> number_{0};
  ScriptedServer server_;
};

/// A server whose documents are right when they are merged.
std::map<std::string, std::string> good_documents() {
  return {
      {"/", "</> rdfs:seeAlso </arm>, </terms> . </arm> a hybrit:RoboticThing ."},
      {"/arm",
       "<> a hybrit:RoboticThing, </kinds/Arm-1a2b3c4d> ; dcterms:title \"arm\" ; hybrit:blueprint </kinds/Arm-1a2b3c4d> ; hybrit:property "
       "<arm/pose> ; hybrit:action <arm/go> ; rdfs:seeAlso <arm/state> . <arm/go> a hybrit:Action ."},
      {"/arm/state", "</arm> hybrit:property <pose> . <pose> a hybrit:Property ; ex:list () ; ex:at <pose#at> ; ex:count {n} . <pose#at> ex:x 1 ."},
      {"/arm/pose", "<> a hybrit:Property ; ex:at <#at> ; ex:count {n} . <#at> ex:x 1 ."},
      {"/arm/go",
       "<> a hybrit:Action ; hybrit:consumes </kinds/Arm-1a2b3c4d#go> ; hybrit:binding <#post> . <#post> http:mthd m:POST ; "
       "http:requestURI <> ."},
      {"/kinds/Arm-1a2b3c4d",
       "<> a sh:NodeShape, rdfs:Class ; rdfs:label \"Arm\" ; sh:property <#_1>, <#_2> . <#_1> sh:path dcterms:title ; sh:minCount "
       "1 ; sh:maxCount 1 . <#_2> sh:path hybrit:property ; sh:node <#pose> . <#pose> a sh:NodeShape ; sh:property <#_3>, "
       "<#_4> . <#_3> sh:path ex:at ; sh:maxCount 1 . <#_4> sh:path ex:count ; sh:maxCount 1 . <#go> a sh:NodeShape ."},
      {"/terms",
       "hybrit:property rdfs:range hybrit:Property . hybrit:RoboticThing rdfs:subClassOf ex:Machine . ex:list "
       "rdfs:range <http://www.w3.org/1999/02/22-rdf-syntax-ns#List> ."}};
}

const char* const merging[] = {"merge.conforms", "merge.doubles", "merge.entailment", "blueprint.targets", "action.described"};

TEST_CASE("documents are judged after merging, with values of different moments", "[check][R1.7][R1.9][R1.10][R1.11]") {
  const Result<check::Report> report = DocumentServer(good_documents()).report();
  INFO(told(report));
  REQUIRE(report);
  for (const char* id : merging) {
    INFO(id << ": " << report->find(id)->detail);
    CHECK(report->find(id)->outcome == Outcome::pass);
    CHECK(report->find(id)->results.empty());
  }
  CHECK(report->find("merge.conforms")->detail.find("of 7 documents") != std::string::npos);
}

TEST_CASE("what merged documents have wrong is named with its node, shape and documents", "[check][R1.7][R1.9][R1.10][R1.11]") {
  struct Planted {
    const char *what, *document, *more, *id, *node, *other, *where;
  };
  for (const Planted& f : std::initializer_list<Planted>{
           {"a second title", "/", "</arm> dcterms:title \"The arm\" .", "merge.conforms", "/arm>", "/kinds/Arm-1a2b3c4d#_1>", "/>"},
           {"a second node of a value", "/arm/state", "<pose> ex:at [ ex:x 1 ] .", "merge.conforms", "/arm/pose>", "/kinds/Arm-1a2b3c4d",
            "/arm/state>"},
           {"a part by a blank node in two documents", "/arm", "<arm/pose> ex:tool [ ex:list ( 1 [ ex:y 2 ] ) ] .", "merge.doubles", "/arm/pose>",
            "http://example.org/tool>", "/arm/pose>"},
           {"a domain whose class is not stated", "/terms", "ex:at rdfs:domain ex:Placed .", "merge.entailment", "/arm/pose>",
            "http://example.org/Placed>", "/arm/pose>"},
           {"a range over a predicate above", "/terms", "ex:at rdfs:subPropertyOf ex:near . ex:near rdfs:range ex:Place .", "merge.entailment",
            "/arm/pose#at>", "http://example.org/Place>", "/arm/pose>"},
           {"a class above that of a domain", "/terms",
            "ex:at rdfs:domain hybrit:Property . ex:x rdfs:domain ex:Placed . ex:Placed rdfs:subClassOf ex:Object .", "merge.entailment",
            "/arm/pose#at>", "http://example.org/Object>", "/arm/pose>"},
           {"a shape for a class of others", "/kinds/Arm-1a2b3c4d", "<#pose> sh:targetClass ex:Pose .", "blueprint.targets", "#pose>",
            "http://example.org/Pose>", "/kinds/Arm-1a2b3c4d>"},
           {"a shape for subjects of a predicate of others", "/arm/go", "<#in> a sh:NodeShape ; sh:targetSubjectsOf ex:at .", "blueprint.targets",
            "/arm/go#in>", "http://example.org/at>", "/arm/go>"},
           {"an input that nothing describes", "/arm/go", "<> hybrit:consumes <#nothing> .", "action.described", "/arm/go>", "#nothing>",
            "/arm/go>"}}) {
    DYNAMIC_SECTION(f.what) {
      std::map<std::string, std::string> documents = good_documents();
      documents[f.document] += std::string(" ") + f.more;
      if (f.id == std::string("merge.doubles")) documents["/arm/pose"] += std::string(" </arm/pose> ex:tool [ ex:list ( 1 [ ex:y 2 ] ) ] .");
      const Result<check::Report> report = DocumentServer(documents).report();
      INFO(told(report));
      REQUIRE(report);
      for (const char* id : merging) {
        INFO(id);
        CHECK(report->find(id)->outcome == (id == std::string(f.id) ? Outcome::fail : Outcome::pass));
      }
      const check::Finding& finding = *report->find(f.id);
      std::string all;
      for (const std::string& line : finding.results) all += line + "\n";
      INFO(all);
      CHECK(finding.failed == finding.results.size());
      for (const char* text : {f.node, f.other, f.where}) CHECK(all.find(text) != std::string::npos);
      CHECK(finding.evidence.size() == 1);
      for (const std::string& text : {check::to_text(*report), check::to_json(*report)})
        for (const std::string& line : finding.results) CHECK((text.find(line) != std::string::npos || line.find('"') != std::string::npos));
      CHECK(check::exit_status(report, true) == 1);
    }
  }
}

TEST_CASE("the merged documents have limits, and a limit that was reached is told", "[check]") {
  std::map<std::string, std::string> many = good_documents();
  many["/"] += " </> rdfs:seeAlso </d0> .";
  for (int i = 0; i < 30; ++i) many["/d" + std::to_string(i)] = "<> rdfs:seeAlso </d" + std::to_string(i + 1) + ">, ex:a, ex:b .";
  const DocumentServer server(many);
  const auto notes = [&](const std::function<void(check::CheckOptions&)>& change) {
    const Result<check::Report> report = server.report(change);
    REQUIRE(report);
    std::string all;
    for (const std::string& note : report->notes) all += note + "\n";
    return all;
  };
  CHECK(notes([](check::CheckOptions& o) { o.max_resources = 50, o.max_objects = 50; }) == "");
  CHECK(notes([](check::CheckOptions& o) { o.max_merged_documents = 5; }).find("max_merged_documents (5) was reached, and 5 ") != std::string::npos);
  CHECK(notes([](check::CheckOptions& o) { o.max_merged_triples = 40; }).find("max_merged_triples (40)") != std::string::npos);
  CHECK(notes([](check::CheckOptions& o) { o.merge_time = milliseconds(0); }).find("merge_time [ms] (0)") != std::string::npos);
  const Result<check::Report> short_of_steps = server.report([](check::CheckOptions& o) { o.max_merged_steps = 1; });
  REQUIRE(short_of_steps);
  CHECK(short_of_steps->find("merge.conforms")->outcome == Outcome::not_testable);
  std::map<std::string, std::string> doubles = good_documents();
  for (const char* document : {"/arm", "/arm/pose"})
    for (int i = 0; i < 5; ++i) doubles[document] += " </arm/pose> ex:p" + std::to_string(i) + " [ ex:y 2 ] .";
  const Result<check::Report> short_of_lines = DocumentServer(doubles).report([](check::CheckOptions& o) { o.max_results = 2; });
  REQUIRE(short_of_lines);
  CHECK(short_of_lines->find("merge.doubles")->results.size() == 2);
  CHECK(short_of_lines->find("merge.doubles")->failed == 5);
}

TEST_CASE("one term of a standard vocabulary does not fulfil R1.5", "[check][R1.5]") {
  const auto outcome = [](const std::string& thing) {
    const Result<check::Report> report = DocumentServer({{"/arm", thing}}).report();
    INFO(told(report));
    REQUIRE(report);
    return report->find("rdf.vocabularies")->outcome;
  };
  CHECK(outcome("<> a hybrit:RoboticThing ; ex:angle 1 .") == Outcome::fail);
  CHECK(outcome("<> a hybrit:RoboticThing ; dcterms:title \"arm\" .") == Outcome::fail);
  CHECK(outcome("<> a hybrit:RoboticThing ; dcterms:title \"arm\" ; dcterms:description \"an arm\" .") == Outcome::fail);
  CHECK(outcome("<> a hybrit:RoboticThing ; dcterms:title \"arm\" ; dcterms:description \"an arm\" ; rdfs:seeAlso </> .") == Outcome::pass);
  CHECK(outcome("<> a hybrit:RoboticThing ; dcterms:title \"arm\" ; </terms#description> \"an arm\" ; rdfs:seeAlso </> ; dcterms:created 1 .") ==
        Outcome::fail);
}

TEST_CASE("R0.6 is not fulfilled by the statuses that were seen alone", "[check][R0.6]") {
  Case c;
  const Result<check::Report> report = report_of(std::move(c));
  REQUIRE(report);
  CHECK(report->find("status.bad-request")->outcome == Outcome::pass);
  for (const check::Requirement& r : report->requirements) {
    if (r.id != "R0.6") continue;
    CHECK(r.outcome == Outcome::not_testable);
    CHECK(r.reason.find("status.500: no request makes a server fail") == 0);
  }
  CHECK(report->is_robotic_thing);
  CHECK(check::to_text(*report).find("R0.6  not testable   status codes 200, 400, 500: status.500") != std::string::npos);
}

TEST_CASE("a hostile server cannot keep the check beyond its limits", "[check]") {
  const std::string turtle = "Content-Type: text/turtle\r\n";
  const std::string thing = "<> a <urn:T> ; <https://hybr-it-projekt.de/ns/hybr-it#property> <p> .";
  std::atomic<unsigned> number{0};
  const std::vector<std::pair<const char*, ScriptedServer::Script>> scripts = {
      {"says nothing",
       [](int c, const std::string&, const std::atomic<bool>& ended) {
         char b = 0;
         while (!ended && ::recv(c, &b, 1, 0) > 0) {}
       }},
      {"ends at once", [](int, const std::string&, const std::atomic<bool>&) {}},
      {"sends random bytes",
       [&](int c, const std::string&, const std::atomic<bool>&) {
         std::mt19937 random(++number);
         std::string bytes(random() % 5'000, ' ');
         for (char& b : bytes) b = static_cast<char>(random());
         put(c, bytes);
       }},
      {"sends random bytes after a status line",
       [&](int c, const std::string&, const std::atomic<bool>&) {
         std::mt19937 random(++number);
         std::string bytes(random() % 5'000, ' ');
         for (char& b : bytes) b = static_cast<char>(random());
         put(c, "HTTP/1.1 200 OK\r\n" + turtle + "\r\n" + bytes);
       }},
      {"sends a header section without end",
       [](int c, const std::string&, const std::atomic<bool>& ended) {
         put(c, "HTTP/1.1 200 OK\r\n");
         while (!ended && put(c, "X: " + std::string(1'000, 'x') + "\r\n")) {}
       }},
      {"sends a body without end",
       [&](int c, const std::string&, const std::atomic<bool>& ended) {
         put(c, "HTTP/1.1 200 OK\r\n" + turtle + "\r\n");
         while (!ended && put(c, "<urn:a> <urn:b> <urn:c" + std::to_string(++number) + "> .\n" + std::string(1'000, ' '))) {}
       }},
      {"sends chunks without end",
       [&](int c, const std::string&, const std::atomic<bool>& ended) {
         put(c, "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n" + turtle + "\r\n");
         while (!ended && put(c, "400\r\n" + std::string(1'024, ' ') + "\r\n")) {}
       }},
      {"states a chunk of the largest size",
       [&](int c, const std::string&, const std::atomic<bool>&) {
         put(c, "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\nffffffffffffffff\r\nabc");
       }},
      {"states the largest length",
       [&](int c, const std::string&, const std::atomic<bool>&) { put(c, "HTTP/1.1 200 OK\r\nContent-Length: 18446744073709551615\r\n\r\nabc"); }},
      {"sends interim responses without end",
       [](int c, const std::string&, const std::atomic<bool>& ended) {
         while (!ended && put(c, "HTTP/1.1 100 Continue\r\n\r\n")) {}
       }},
      {"cuts its responses off",
       [&](int c, const std::string&, const std::atomic<bool>&) {
         const std::string whole = response(turtle + "ETag: \"1\"\r\n", thing);
         put(c, whole.substr(0, ++number * 7 % whole.size()));
       }},
      {"redirects to itself",
       [](int c, const std::string&, const std::atomic<bool>&) { put(c, "HTTP/1.1 302 Found\r\nLocation: /\r\nContent-Length: 0\r\n\r\n"); }},
      {"has resources without end",
       [&](int c, const std::string&, const std::atomic<bool>&) {
         std::string links;
         for (int i = 0; i < 20; ++i)
           links +=
               "Link: </n" + std::to_string(++number) + ">; rel=\"related\"\r\nLink: </m" + std::to_string(number.load()) + ">; rel=\"next\"\r\n";
         put(c, response(turtle + links, thing));
       }},
      {"claims everything and sends frames of random bytes",
       [&](int c, const std::string& q, const std::atomic<bool>&) {
         std::mt19937 random(++number);
         if (q.find("Upgrade: websocket") == std::string::npos) {
           put(c, response(turtle + "Location: /s\r\nUpgrade: websocket, callback\r\n", thing));
           return;
         }
         put(c, "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\r\n");
         for (int i = 0; i < 100; ++i) {
           const std::string frame{static_cast<char>(random()), static_cast<char>(random()), static_cast<char>(random())};
           if (!put(c, frame)) return;
         }
       }},
      {"sends pings without end",
       [&](int c, const std::string& q, const std::atomic<bool>& ended) {
         if (q.find("Upgrade: websocket") == std::string::npos) {
           put(c, response(turtle, thing));
           return;
         }
         put(c, "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\r\n");
         char buffer[4'096];
         while (!ended && put(c, std::string("\x89\x00", 2))) (void)::recv(c, buffer, sizeof buffer, MSG_DONTWAIT);
       }},
  };
  for (const auto& [what, script] : scripts) {
    DYNAMIC_SECTION("a server that " << what) {
      ScriptedServer server(script);
      check::CheckOptions options = quick();
      options.client.limits.response_time = milliseconds(150);
      options.message_time = options.close_time = milliseconds(100);
      options.total_time = milliseconds(1'500);
      options.max_requests = 200;
      options.max_body_bytes = 100'000;
      const Result<check::Report> report = check::run(server.url(), options);
      if (!report) {
        CHECK_FALSE(report.error().message.empty());
        continue;
      }
      CHECK(report->requests <= options.max_requests);
      CHECK(report->resources.size() <= options.max_resources);
      CHECK(check::exit_status(report) == 1);
      CHECK(rdf::read(check::to_earl(*report), rdf::Syntax::turtle, {}).has_value());
      for (const check::Finding& f : report->findings)
        for (const check::Evidence& e : f.evidence) CHECK(e.sent.size() + e.received.size() < 20'000);
    }
  }
}

}  // namespace
}  // namespace lrt
