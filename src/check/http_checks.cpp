// SPDX-License-Identifier: Apache-2.0
// R0.1 and R0.2: what the bytes of a connection show.

#include <algorithm>
#include <cstdio>

#include "src/base/ascii.hpp"
#include "src/base/resolve.hpp"
#include "src/check/survey.hpp"

namespace lrt::check {
namespace {

constexpr const char* hidden_target = "/lrt-check-hidden-request";

/// The pieces of the requests that are sent to one URL.
struct Target {
  std::string url, path, own;  ///< `own`: Host and the identity, with line ends

  std::string line(const std::string& method, const char* version = "HTTP/1.1") const { return method + " " + path + " " + version + "\r\n"; }
};

/// All responses on one connection after bytes were sent, until it ends or `count` are there.
struct Conversation {
  Exchange exchange;  ///< the first response
  std::vector<Reply> replies;
  bool ended = false;
};

Conversation converse(Context& context, const std::string& url, const std::string& bytes, const std::vector<std::string>& methods,
                      bool wait_for_end) {
  Conversation found;
  found.exchange = {url, context.probe.shown(url, bytes), {}};
  Result<Connection> connection = context.probe.connect(url);
  if (!connection) {
    found.exchange.reply.error = connection.error();
    return found;
  }
  (void)connection->write(bytes, context.probe.until());
  for (const std::string& method : methods) {
    // Bytes after the first response must not be the response to a hidden request.
    const exchange::Instant until =
        found.replies.empty() || !wait_for_end ? context.probe.until() : context.probe.patiently(context.options.close_time);
    Reply reply = connection->read(method, until, false, context.options.close_time);
    if (found.replies.empty()) found.exchange.reply = reply;
    if (reply.error) break;
    context.probe.statuses.push_back(reply.status);
    found.replies.push_back(std::move(reply));
    if (!found.replies.back().framing_fault.empty() || found.replies.back().truncated) break;
  }
  found.ended = wait_for_end ? connection->ends(context.probe.patiently(context.options.close_time)) : connection->ended();
  return found;
}

/// A request that must be refused. 4xx and 501 refuse it, and so does the end of the connection without a response; `wanted` is what the RFC names.
void refused(Context& context, std::string_view id, const Target& target, const std::string& bytes, const std::string& wanted,
             bool repeated_request = false) {
  if (context.probe.exhausted()) return;
  const Conversation said = converse(context, target.url, bytes, {"GET", "GET"}, true);
  const Exchange& exchange = said.exchange;
  const Reply& reply = exchange.reply;
  if (!reply.error) context.bad_requests.push_back(exchange);
  if (reply.error && reply.error->code == Errc::closed) {
    context.verdicts.pass(id, &exchange, "the connection is closed without a response; " + wanted + " would tell the client why");
  } else if (reply.error) {
    context.verdicts.not_testable(id, "there is no response: " + reply.error->message, &exchange);
  } else if (said.replies.size() > 1 && repeated_request) {
    context.verdicts.fail(id, "the server has read a second request where others read a body: " + std::to_string(said.replies.size()) + " responses",
                          &exchange);
  } else if (reply.status >= 400 && reply.status != 500) {
    context.verdicts.pass(id, &exchange,
                          std::to_string(reply.status) == wanted ? "" : "refused with " + std::to_string(reply.status) + " instead of " + wanted);
  } else {
    context.verdicts.fail(id, "the response is " + std::to_string(reply.status) + ", expected " + wanted, &exchange);
  }
}

void check_refusals(Context& context, const Target& t) {
  const std::string get = t.line("GET");
  const std::size_t end = t.own.find("\r\n");
  const std::string host = t.own.substr(0, end + 2), rest = t.own.substr(end + 2);
  const std::string hidden = "GET " + std::string(hidden_target) + " HTTP/1.1\r\n" + host + "\r\n";
  refused(context, "http.host-missing", t, get + rest + "Connection: close\r\n\r\n", "400");
  refused(context, "http.host-repeated", t, get + host + host + rest + "Connection: close\r\n\r\n", "400");
  refused(context, "http.host-invalid", t, get + "Host: lrt check\r\n" + rest + "Connection: close\r\n\r\n", "400");
  refused(context, "http.two-lengths", t, get + t.own + "Content-Length: 0\r\nContent-Length: " + std::to_string(hidden.size()) + "\r\n\r\n" + hidden,
          "400", true);
  refused(context, "http.invalid-length", t, get + t.own + "Content-Length: 3x\r\n\r\nabc", "400");
  refused(context, "http.chunked-not-last", t, get + t.own + "Transfer-Encoding: chunked, gzip\r\n\r\n0\r\n\r\n", "400");
  refused(context, "http.unknown-coding", t, get + t.own + "Transfer-Encoding: lrt-check\r\nConnection: close\r\n\r\n", "501");
  refused(context, "http.space-before-colon", t, get + t.own + "Lrt-Check : 1\r\nConnection: close\r\n\r\n", "400");
  refused(context, "http.request-line", t, "GET " + t.path + " lrt check HTTP/1.1\r\n" + t.own + "Connection: close\r\n\r\n", "400");
  refused(context, "http.unknown-method", t, t.line("LRTCHECK") + t.own + "Connection: close\r\n\r\n", "501");

  if (!context.probe.exhausted()) {
    const std::string bytes =
        get + t.own + "Content-Length: " + std::to_string(5 + hidden.size()) + "\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n" + hidden;
    const Conversation said = converse(context, t.url, bytes, {"GET", "GET"}, true);
    const Reply& reply = said.exchange.reply;
    if (said.replies.size() > 1)
      context.verdicts.fail("http.length-and-chunked",
                            "what follows the chunks is answered as a request of its own; an intermediary may have read it as a body",
                            &said.exchange);
    else if (reply.error && reply.error->code != Errc::closed)
      context.verdicts.not_testable("http.length-and-chunked", outcome_of(said.exchange), &said.exchange);
    else if (!reply.error && !said.ended)
      context.verdicts.fail("http.length-and-chunked", "the connection stays open after the response", &said.exchange);
    else context.verdicts.pass("http.length-and-chunked", &said.exchange);
    if (!reply.error && reply.status >= 400) context.bad_requests.push_back(said.exchange);
  }
  if (!context.probe.exhausted()) {
    const Conversation said = converse(context, t.url, get + t.own + "Transfer-Encoding: chunked\r\n\r\nzz\r\n" + hidden, {"GET", "GET"}, true);
    const Reply& reply = said.exchange.reply;
    const bool read_on = said.replies.size() > 1 && said.replies[1].status != 400;
    if (read_on) context.verdicts.fail("http.invalid-chunk", "bytes after an invalid chunk size are answered as a request", &said.exchange);
    else if (reply.error && reply.error->code != Errc::closed)
      context.verdicts.not_testable("http.invalid-chunk", outcome_of(said.exchange), &said.exchange);
    else context.verdicts.pass("http.invalid-chunk", &said.exchange);
    if (!reply.error && reply.status >= 400) context.bad_requests.push_back(said.exchange);
  }
  if (!context.probe.exhausted()) {
    const Exchange exchange = context.probe.raw(t.url, "GET /" + std::string(20'000, 'a') + " HTTP/1.1\r\n" + t.own + "Connection: close\r\n\r\n");
    const Reply& reply = exchange.reply;
    if (reply.error)
      context.verdicts.fail_silent("http.long-target", "a target of 20,000 bytes has no response: " + reply.error->message, exchange,
                                   context.probe.is_fast());
    else if (reply.status >= 500 && reply.status != 501)
      context.verdicts.fail("http.long-target", "a target of 20,000 bytes gets " + std::to_string(reply.status), &exchange);
    else context.verdicts.pass("http.long-target", &exchange);
  }
}

void check_connections(Context& context, const Target& t) {
  const std::string get = t.line("GET") + t.own + "\r\n";
  const std::string unknown = "GET " + std::string(hidden_target) + " HTTP/1.1\r\n" + t.own + "\r\n";
  bool persistent = false;
  if (!context.probe.exhausted()) {
    Result<Connection> connection = context.probe.connect(t.url);
    Exchange exchange{t.url, context.probe.shown(t.url, get), {}};
    if (!connection) {
      exchange.reply.error = connection.error();
    } else {
      (void)connection->write(get, context.probe.until());
      exchange.reply = connection->read("GET", context.probe.until(), false, context.options.close_time);
    }
    if (exchange.reply.error || exchange.reply.truncated || !exchange.reply.framing_fault.empty()) {
      context.verdicts.not_testable("http.persistent", "the first response is not complete", &exchange);
    } else if (exchange.reply.version == "HTTP/1.0") {
      context.verdicts.not_testable("http.persistent", "the server speaks HTTP/1.0", &exchange);
    } else {
      (void)connection->write(get, context.probe.until());
      const Reply second = connection->read("GET", context.probe.until(), false, context.options.close_time);
      persistent = !second.error;
      if (persistent) context.verdicts.pass("http.persistent", &exchange);
      else {
        exchange.reply.error = second.error;
        context.verdicts.fail_silent("http.persistent", "the second request on a connection has no response: " + second.error->message, exchange,
                                     context.probe.is_fast());
      }
    }
  }
  const char* const none = "the server closes the connection after each response";
  if (!persistent) {
    context.verdicts.not_testable("http.pipelining", none);
    context.verdicts.not_testable("http.chunked-request", none);
  } else if (!context.probe.exhausted()) {
    const Conversation said = converse(context, t.url, get + unknown + get, {"GET", "GET", "GET"}, false);
    const Exchange alone = context.probe.raw(t.url, unknown);
    const int first = context.resources.front().get.reply.status;
    const bool announced =
        !said.replies.empty() && lrt::detail::lower(said.replies.back().fields.joined("Connection")).find("close") != std::string::npos;
    if (said.replies.size() < 3 && announced)
      context.verdicts.not_testable("http.pipelining", "the server ends the connection, as it says, before it has answered all", &said.exchange);
    else if (said.replies.size() < 3 && !context.probe.is_fast())
      context.verdicts.not_testable("http.pipelining", "not all responses came in time, and the server is slow", &said.exchange);
    else if (said.replies.size() < 3)
      context.verdicts.fail("http.pipelining", "of three requests that were sent at once " + std::to_string(said.replies.size()) + " have a response",
                            &said.exchange);
    else if (alone.reply.error || alone.reply.status == first)
      context.verdicts.not_testable("http.pipelining", "the order cannot be seen: an unknown URI has the status of a known one");
    else if (said.replies[0].status != first || said.replies[1].status != alone.reply.status || said.replies[2].status != first)
      context.verdicts.fail("http.pipelining",
                            "expected the statuses " + std::to_string(first) + ", " + std::to_string(alone.reply.status) + ", " +
                                std::to_string(first) + ", found " + std::to_string(said.replies[0].status) + ", " +
                                std::to_string(said.replies[1].status) + ", " + std::to_string(said.replies[2].status),
                            &said.exchange);
    else context.verdicts.pass("http.pipelining", &said.exchange);

    const std::string chunked = t.line("GET") + t.own + "Transfer-Encoding: chunked\r\n\r\n3\r\nabc\r\n0\r\nLrt-Check: 1\r\n\r\n" + unknown;
    const Conversation with_body = converse(context, t.url, chunked, {"GET", "GET"}, false);
    const Reply& reply = with_body.exchange.reply;
    if (reply.error && reply.error->code == Errc::closed)
      context.verdicts.not_testable("http.chunked-request", "a GET with a body is refused by closing the connection", &with_body.exchange);
    else if (reply.error)
      context.verdicts.fail_silent("http.chunked-request", "a request with a chunked body has no response: " + reply.error->message,
                                   with_body.exchange, context.probe.is_fast());
    else if (reply.status == 501) context.verdicts.fail("http.chunked-request", "the chunked coding is not implemented", &with_body.exchange);
    else if (reply.status >= 400)
      context.verdicts.not_testable("http.chunked-request", "a GET with a body is refused with " + std::to_string(reply.status), &with_body.exchange);
    else if (with_body.replies.size() == 2 && !alone.reply.error && with_body.replies[1].status != alone.reply.status)
      context.verdicts.fail("http.chunked-request",
                            "the request after the chunked body gets " + std::to_string(with_body.replies[1].status) + ", expected " +
                                std::to_string(alone.reply.status) + ": the body was not read",
                            &with_body.exchange);
    else context.verdicts.pass("http.chunked-request", &with_body.exchange);
  }
  if (!context.probe.exhausted()) {  // the body is never sent, so that the request has no effect
    const Exchange exchange = context.probe.ask_without_body("PUT", url_of(t.url)->origin() + hidden_target,
                                                             {{"Content-Type", "application/x-lrt-check"}, {"If-Match", "\"lrt-check\""}});
    if (exchange.reply.error)
      context.verdicts.fail_silent("http.expect", "there is neither 100 nor a final response before the body: " + exchange.reply.error->message,
                                   exchange, context.probe.is_fast());
    else context.verdicts.pass("http.expect", &exchange);
  }
  if (!context.probe.exhausted()) {
    const Conversation said = converse(context, t.url, t.line("GET", "HTTP/1.0") + t.own + "\r\n", {"GET"}, true);
    const Reply& reply = said.exchange.reply;
    if (reply.error)
      context.verdicts.fail_silent("http.version-1.0", "there is no response: " + reply.error->message, said.exchange, context.probe.is_fast());
    else if (reply.status == 505 || reply.status == 426) context.verdicts.pass("http.version-1.0", &said.exchange, "HTTP/1.0 is refused");
    else if (reply.fields.find("Transfer-Encoding"))
      context.verdicts.fail("http.version-1.0", "the response to HTTP/1.0 has Transfer-Encoding", &said.exchange);
    else if (!said.ended) context.verdicts.fail("http.version-1.0", "the connection of HTTP/1.0 stays open", &said.exchange);
    else context.verdicts.pass("http.version-1.0", &said.exchange);
  }
}

std::string seconds_text(std::chrono::milliseconds time) {
  char text[32];
  std::snprintf(text, sizeof text, time.count() < 100 ? "%.3f s" : "%.1f s", static_cast<double>(time.count()) / 1000);
  return text;
}

/// A slow server is no wrong one: this is the finding for it.
void check_time(Context& context) {
  const Probe& probe = context.probe;
  if (!probe.slowest) return context.verdicts.not_testable("http.slow", "there was no response");
  const std::string line = probe.slowest->sent.substr(0, probe.slowest->sent.find("\r\n"));
  const std::string times = "a response usually takes " + seconds_text(probe.usual_time()) + "; the slowest, to " + excerpt(line, 100) + ", took " +
                            seconds_text(probe.slowest->reply.took);
  if (probe.timed_out > 0)
    context.verdicts.fail("http.slow",
                          times + "; " + std::to_string(probe.timed_out) + " requests had no response within " +
                              seconds_text(context.options.client.limits.response_time) + ", the first of them " +
                              excerpt(probe.first_timed_out->sent.substr(0, probe.first_timed_out->sent.find("\r\n")), 100),
                          &*probe.slowest);
  else if (probe.usual_time() > context.options.slow_time) context.verdicts.fail("http.slow", times, &*probe.slowest);
  else context.verdicts.pass("http.slow", &*probe.slowest, times);
}

/// Checks of all responses to ordinary requests.
void check_responses(Context& context) {
  const Probe& probe = context.probe;
  const Exchange& first = context.resources.front().get;
  const auto judge = [&](std::string_view id, const std::vector<Exchange>& faults, const std::string& detail) {
    for (const Exchange& exchange : faults) context.verdicts.fail(id, detail, &exchange);
    if (faults.empty()) context.verdicts.pass(id, &first);
  };
  judge("http.version", probe.of_another_version,
        probe.of_another_version.empty() ? "" : "the response is " + probe.of_another_version.front().reply.version);
  for (const Exchange& exchange : probe.without_date)
    context.verdicts.fail("http.date", "there is no Date; only a server without a clock may leave it out", &exchange, Certainty::likely);
  if (probe.without_date.empty()) context.verdicts.pass("http.date", &first);
  judge("http.framing", probe.framing_faults, probe.framing_faults.empty() ? "" : probe.framing_faults.front().reply.framing_fault);
  judge("http.close", probe.not_closed, "the connection stays open after a response to `Connection: close`");
  for (const Exchange& exchange : probe.bodies_of_head) context.verdicts.fail("http.head", "the response to HEAD has a body", &exchange);
  if (probe.bodiless == 0) context.verdicts.not_applicable("http.bodiless", "there was no 204 and no 304");
  else
    for (const Exchange& exchange : probe.bodies_where_none_may_be)
      context.verdicts.fail("http.bodiless", exchange.reply.forbidden_length ? "a 204 states a length" : "bytes follow the header section",
                            &exchange);
  if (probe.bodiless > 0 && probe.bodies_where_none_may_be.empty()) context.verdicts.pass("http.bodiless", &*probe.first_bodiless);
}

void check_tls(Context& context, const http::Url& url) {
  const Exchange& first = context.resources.front().get;
  std::string host = url.host;
  if (host.size() > 2 && host.front() == '[') host = host.substr(1, host.size() - 2);
  if (url.secure) context.verdicts.pass("tls.https", &first, "the certificate is valid for this host");
  else if (host == "localhost" || host.compare(0, 4, "127.") == 0 || host == "::1")
    context.verdicts.not_applicable("tls.https", "the server was asked on a loopback address, which other machines cannot reach");
  else
    context.verdicts.fail("tls.https", "the connection is plain HTTP; another protection, such as a private network, cannot be seen", &first,
                          Certainty::likely);
}

/// Checks the responses to all invalid requests, of any check.
void check_blame(Context& context) {
  for (const Exchange& exchange : context.bad_requests) {
    const int status = exchange.reply.status;
    if (status >= 500 && status != 501 && status != 503 && status != 505)
      context.verdicts.fail("status.blame", "a wrong request gets " + std::to_string(status), &exchange);
    else if (status >= 400) context.verdicts.pass("status.blame", &exchange);
  }
  const auto bad = std::find_if(context.bad_requests.begin(), context.bad_requests.end(), [](const Exchange& e) { return e.reply.status == 400; });
  if (bad != context.bad_requests.end()) context.verdicts.pass("status.bad-request", &*bad);
  else context.verdicts.not_testable("status.bad-request", "no request of this check got 400");
  const auto& statuses = context.probe.statuses;
  if (std::find(statuses.begin(), statuses.end(), 500) != statuses.end()) context.verdicts.pass("status.500", nullptr, "a response was 500");
  else context.verdicts.not_testable("status.500", "no request makes a server fail that does not want to");
}

}  // namespace

void check_http(Context& context) {
  const Result<http::Url> parts = url_of(context.url);
  if (!parts) return;
  const Target target{context.url, parts->target, context.probe.own_fields(context.url)};
  check_tls(context, *parts);
  check_connections(context, target);
  check_refusals(context, target);
  check_blame(context);
  if (!context.probe.exhausted()) {
    const Exchange exchange = context.probe.ask("GET", context.url);
    if (exchange.reply.error)
      context.verdicts.fail_silent("http.alive", "after the checks, " + outcome_of(exchange), exchange, context.probe.is_fast());
    else if (exchange.reply.status != context.resources.front().get.reply.status)
      context.verdicts.fail("http.alive", "the checked URL now gets " + std::to_string(exchange.reply.status), &exchange, Certainty::likely);
    else context.verdicts.pass("http.alive", &exchange);
  }
  check_responses(context);
  check_time(context);
}

}  // namespace lrt::check
