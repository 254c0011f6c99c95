// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <httplib.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <lrt/http/date.hpp>
#include <lrt/http/message.hpp>
#include <lrt/http/problem.hpp>
#include <lrt/http/request_parser.hpp>
#include <lrt/served.hpp>
#include <lrt/server.hpp>
#include <lrt/transport/transport.hpp>

namespace lrt {
inline namespace v0 {

/// Limits of what a mounted server uses of its host. The host's own settings (connections, times, payload length) apply
/// as well.
struct MountOptions {
  std::size_t max_body_bytes = transport::Limits().max_body_bytes;  ///< of a request's body; more: 413
  /// Event streams at a time; more: 503. Each one occupies one of the host's threads, and cpp-httplib has eight by
  /// default.
  std::size_t max_event_streams = 4;
  std::chrono::milliseconds ping_interval{15'000};  ///< an event stream gets a comment after this time without an event
  /// The host's own post-routing handler, if it has one: mount() takes the place that cpp-httplib has for it. Of several
  /// mounts in one host the last one has it.
  httplib::Server::Handler post_routing{};
};

}  // namespace v0
}  // namespace lrt

namespace lrt::detail {
inline namespace v0 {

/// The last response of lrt on this thread, as it was before the host's error handler, which cpp-httplib calls for each status from 400 and which usually sets
/// a body.
struct Report {
  const httplib::Response* response = nullptr;
  int status = 0;
  httplib::Headers fields;
  std::optional<std::size_t> length;  ///< of the body; nullopt: HEAD

  static Report& of_this_thread() {
    static thread_local Report report;
    return report;
  }
  /// Puts back what the handler has replaced. Fields that it or cpp-httplib has added stay.
  static void restore(httplib::Response& to) {
    Report& report = of_this_thread();
    if (std::exchange(report.response, nullptr) != &to || report.status < 400) return;
    if (to.body.empty() && to.status == report.status) return;  // no handler has set anything
    to.body.clear();
    to.status = report.status;
    for (const char* const name : {"Content-Type", "Content-Encoding", "Content-Length"}) to.headers.erase(name);
    for (const auto& field : report.fields) to.headers.erase(field.first);
    to.headers.insert(report.fields.begin(), report.fields.end());
    if (report.length) to.set_header("Content-Length", std::to_string(*report.length));
  }
};

class Mount {
 public:
  Mount(Server& server, std::string prefix, MountOptions options) : server_(server), prefix_(std::move(prefix)), options_(options) {}

  /// A regular expression for the decoded path of cpp-httplib. The target may be in absolute-form.
  std::string pattern() const {
    std::string text = "(?:[Hh][Tt][Tt][Pp][Ss]?:/[/][^/]*)?";
    for (const char c : prefix_) {
      const bool is_plain = (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '/';
      text += is_plain ? std::string(1, c) : std::string("[") + c + "]";
    }
    return text + (prefix_.empty() ? "(?:[/][\\s\\S]*|[*])?" : "(?:[/][\\s\\S]*)?");
  }

  /// @param reader  nullptr: cpp-httplib has read the body
  void serve(const httplib::Request& from, httplib::Response& to, const httplib::ContentReader* reader) {
    // cpp-httplib has parsed Range and would apply it to whatever is sent, an error or a part included. The server applies it.
    const_cast<httplib::Request&>(from).ranges.clear();

    http::Request request;
    request.method = from.method;
    request.version = from.version == "HTTP/1.0" ? 10 : 11;
    request.peer = from.remote_addr;
    request.mount = prefix_;
    request.local_port = static_cast<std::uint16_t>(from.local_port);
    request.can_stream = from.method == "GET";
#if defined(CPPHTTPLIB_OPENSSL_SUPPORT) || defined(CPPHTTPLIB_SSL_ENABLED)
    request.secure = from.ssl != nullptr;
#endif
    const std::optional<std::string> target = without_prefix(from.target);
    if (!target) return respond(from, to, problem(404, "nothing lives at this path"));
    request.target = *target;
    for (const auto& [name, value] : from.headers)
      if (!is_added_by_httplib(name)) request.fields.push_back({name, value});

    http::Framing framing;
    if (auto refusal = check(request, framing)) return respond(from, to, problem(refusal->status, std::move(refusal->reason)));
    const bool has_content = framing.chunked || framing.length > 0;
    const bool unread = has_content && !may_have_content(from.method);  // some releases leave it on the connection
    request.fields.erase(std::remove_if(request.fields.begin(), request.fields.end(),
                                        [](const http::Field& field) {
                                          return http::iequals(field.name, "Content-Length") || http::iequals(field.name, "Transfer-Encoding");
                                        }),
                         request.fields.end());
    std::string body;
    if (has_content && !unread) {
      if (auto refusal = read(from, to, request, framing, reader, body)) return respond(from, to, *std::move(refusal));
      request.body = reader ? std::string_view(body) : std::string_view(from.body);
    }

    Served served = server_.serve(request);
    served.response.close = served.response.close || unread;
    if (served.events) stream(from, to, std::move(served));
    else respond(from, to, std::move(served.response));
  }

 private:
  using SteadyClock = std::chrono::steady_clock;
  /// The longest time by which an open event stream can delay the end of the host's server.
  static constexpr std::chrono::milliseconds longest_wait{200};
  /// Size of the body of a refused request that is read and discarded, so that its connection can be kept.
  static constexpr std::size_t max_discarded_body_bytes = 16 * 1024;

  /// An open event stream.
  struct Stream {
    Stream(std::shared_ptr<std::atomic<std::size_t>> open, EventSource source) : count(std::move(open)), events(std::move(source)) {}
    ~Stream() { --*count; }
    Stream(const Stream&) = delete;
    Stream& operator=(const Stream&) = delete;

    std::shared_ptr<std::atomic<std::size_t>> count;
    EventSource events;
    SteadyClock::time_point written = SteadyClock::now();
  };

  /// Fields that cpp-httplib adds to requests.
  static bool is_added_by_httplib(std::string_view name) {
    return name == "REMOTE_ADDR" || name == "REMOTE_PORT" || name == "LOCAL_ADDR" || name == "LOCAL_PORT";
  }
  static bool may_have_content(std::string_view method) { return method == "POST" || method == "PUT" || method == "PATCH" || method == "DELETE"; }

  /// The target as it was received, without the prefix. The prefix may contain percent escapes (RFC 3986 6.2.2.2).
  std::optional<std::string> without_prefix(const std::string& target) const {
    if (prefix_.empty() || target.empty()) return target;
    std::size_t begin = 0;
    if (target[0] != '/') {
      const std::size_t authority = target.find("://");
      begin = authority == std::string::npos ? target.size() : std::min(target.find_first_of("/?", authority + 3), target.size());
    }
    std::size_t at = begin;
    for (const char expected : prefix_) {
      if (at >= target.size()) return std::nullopt;
      char found = target[at++];
      if (found == '%' && target.size() - at >= 2) {
        const int high = hex(target[at]), low = hex(target[at + 1]);
        if (high < 0 || low < 0) return std::nullopt;
        found = static_cast<char>(high * 16 + low);
        at += 2;
      }
      if (found != expected) return std::nullopt;
    }
    const bool ends = at == target.size() || target[at] == '?';
    if (!ends && target[at] != '/') return std::nullopt;
    return target.substr(0, begin) + (ends ? "/" : "") + target.substr(at);
  }
  static int hex(char c) { return c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1; }

  static std::optional<http::Refusal> check(const http::Request& request, http::Framing& framing) {
    // Some releases of cpp-httplib decode percent escapes in values, which may contain any byte then.
    for (const http::Field& field : request.fields)
      for (const char c : field.value)
        if ((static_cast<unsigned char>(c) < 0x20 && c != '\t') || c == 0x7f) return http::Refusal{400, "a field value has a control character"};
    return http::check_request(request, framing);
  }

  std::optional<http::Response> read(const httplib::Request& from, const httplib::Response& to, http::Request& request, const http::Framing& framing,
                                     const httplib::ContentReader* reader, std::string& body) const {
    // cpp-httplib would decode these, the one into its own files, the other into what the fields do not describe.
    if (from.is_multipart_form_data()) return problem(415, "Content-Type: multipart/form-data is not supported");
    if (const auto coding = request.find("Content-Encoding"); coding && !http::iequals(*coding, "identity")) {
      http::Response response = problem(415, "Content-Encoding: expected identity, found \"" + std::string(*coding) + "\"");
      response.fields.add("Accept-Encoding", "identity");
      return response;
    }
    std::size_t max_bytes = options_.max_body_bytes;
    const auto too_large = [&max_bytes] { return problem(413, "the body has more than " + std::to_string(max_bytes) + " bytes"); };
    if (framing.length > max_bytes || from.body.size() > max_bytes) return too_large();
    // Some releases do not read the body of such a request.
    if (framing.chunked && from.method == "DELETE") return problem(411, "Content-Length: expected one");
    if (!reader) return std::nullopt;
    engine::HeaderVerdict verdict = server_.judge_header(request, framing.chunked ? std::nullopt : std::optional(framing.length));
    if (verdict.response) {
      const bool is_short = !framing.chunked && !framing.expects_continue && framing.length <= max_discarded_body_bytes;
      const bool discarded = is_short && (*reader)([](const char*, std::size_t) { return true; });
      verdict.response->close = verdict.response->close || !discarded;
      return std::move(verdict.response);
    }
    request.judged = std::move(verdict.judged);
    max_bytes = std::min(max_bytes, verdict.max_body_bytes);
    bool is_too_large = false;
    const bool complete = (*reader)([&](const char* data, std::size_t size) {
      is_too_large = size > max_bytes - body.size();
      if (!is_too_large) body.append(data, size);
      return !is_too_large;
    });
    if (is_too_large) return too_large();
    if (!complete) return problem(to.status == 413 ? 413 : 400, "the body is longer than the host allows, or incomplete");
    return std::nullopt;
  }

  /// For a request whose body may have unread bytes on the connection: the connection is closed.
  static http::Response problem(int status, std::string detail) {
    http::Response response;
    http::set_problem(response, {status, std::move(detail)});
    response.close = true;
    return response;
  }

  static void respond(const httplib::Request& from, httplib::Response& to, http::Response response) {
    const std::string content_type = put_fields(response, to);
    const bool close = response.close;
    const std::shared_ptr<const std::string> body = std::move(response.body);
    if (body && !body->empty() && http::may_have_body(response.status)) {
      // Not `to.body`: cpp-httplib may compress that, under the entity tag of what it was.
      to.set_content_provider(body->size(), content_type, [body, close](std::size_t offset, std::size_t length, httplib::DataSink& sink) {
        return sink.write(body->data() + offset, length) && !close;  // false: cpp-httplib closes the connection
      });
    } else if (close && from.method != "HEAD") {
      to.set_content_provider(content_type, [](std::size_t, httplib::DataSink&) { return false; });
    } else if (!content_type.empty()) {
      to.set_header("Content-Type", content_type);
    }
    if (response.status < 400) return;
    const std::size_t length = body ? body->size() : 0;
    Report::of_this_thread() = {&to, response.status, to.headers, from.method == "HEAD" ? std::nullopt : std::optional(length)};
  }

  void stream(const httplib::Request& from, httplib::Response& to, Served served) {
    if (++*streams_ > options_.max_event_streams) {
      --*streams_;
      http::Response response = problem(503, "there are too many event streams");
      response.fields.add("Retry-After", "1");
      return respond(from, to, std::move(response));
    }
    const auto stream = std::make_shared<Stream>(streams_, std::move(*served.events));
    const bool chunked = from.version != "HTTP/1.0";
    served.response.close = !chunked;  // the end of the connection is the end of the stream
    const auto provide = [stream, chunked, ping_interval = options_.ping_interval](std::size_t, httplib::DataSink& sink) {
      const auto write = [&](std::string_view bytes) {
        stream->written = SteadyClock::now();
        return sink.write(bytes.data(), bytes.size());
      };
      if (sink.is_writable && !sink.is_writable()) return false;  // the client has disconnected
      const EventSource::Event event = stream->events.next(std::min(longest_wait, ping_interval));
      if (event.bytes) return write(*event.bytes);
      if (event.end) {
        if (chunked) sink.done();
        return chunked;
      }
      return SteadyClock::now() - stream->written < ping_interval || write(":\n\n");
    };
    const std::string content_type = put_fields(served.response, to);
    if (chunked) to.set_chunked_content_provider(content_type, provide);
    else to.set_content_provider(content_type, provide);
  }

  /// Sets status and fields. Fields of the server replace the host's defaults.
  /// @return  the Content-Type, which is not set: each way to send a body sets it
  static std::string put_fields(const http::Response& response, httplib::Response& to) {
    to.status = response.status;
    const std::vector<http::Field> fields = response.fields.list();
    for (const http::Field& field : fields) to.headers.erase(std::string(field.name));
    std::string content_type;
    for (const http::Field& field : fields) {
      if (http::iequals(field.name, "Content-Type")) content_type = field.value;
      else if (!http::iequals(field.name, "Content-Length")) to.set_header(std::string(field.name), std::string(field.value));
    }
    if (to.headers.find("Date") == to.headers.end()) to.set_header("Date", http::to_http_date(std::chrono::system_clock::now()));
    // RFC 9110 7.8: a response with Upgrade names it in Connection.
    if (to.headers.find("Upgrade") != to.headers.end()) to.set_header("Connection", response.close ? "close, Upgrade" : "Upgrade");
    if (response.close && to.headers.find("Connection") == to.headers.end()) to.set_header("Connection", "close");
    return content_type;
  }

  Server& server_;
  const std::string prefix_;
  const MountOptions options_;
  const std::shared_ptr<std::atomic<std::size_t>> streams_ = std::make_shared<std::atomic<std::size_t>>(0);
};

}  // namespace v0
}  // namespace lrt::detail

namespace lrt {
inline namespace v0 {

/// Mounts a server's Things into a host's cpp-httplib server (0.11.4 or later), below a prefix. With the prefix
/// `/robot`, `/robot` is the server's root, and its representations have the base `http://HOST/robot`. The host keeps
/// its threads, TLS and other routes. Its default fields and handlers apply to these responses, too. Its error handler
/// may log a response of lrt and add fields: the client gets status, fields and body of lrt, whatever the handler sets.
/// For that mount() sets the post-routing handler of http_server. A host that has one passes it as
/// MountOptions::post_routing; if it calls set_post_routing_handler() after mount(), its error handler replaces the
/// reports of lrt.
///
/// Below a prefix the server gets every request. Without a prefix the host's routes precede if they were added before;
/// then a POST, PUT or PATCH without Content-Length waits for the host's read timeout with some releases (0.11).
///
/// Below a prefix the server judges a request by its header section before its body is read
/// (engine::Handler::judge_header()). Without a prefix cpp-httplib reads the body first, up to its own limit. The host
/// sends `100 Continue` before that, unless set_expect_100_continue_handler() was called. Each body occupies a thread
/// of the host, so the number of threads limits the memory.
///
/// Newer releases of cpp-httplib (seen with 0.18.7) read the body of a GET before they call lrt. If the body does not
/// come within the read timeout, they respond 400 and keep the connection: later bytes of that body are parsed as the
/// next request. Behind a reverse proxy that shares connections between clients, call
/// `http_server.set_keep_alive_max_count(1)`.
///
/// A request must name in Host the host server's port on this machine, or with that port one of
/// Security::allowed_hosts, or the host of Listen::public_base. There are no WebSockets; clients make web callbacks by
/// POST or GET with `Upgrade: callback` as elsewhere. http::Request::client_certificate is empty. A waiting request and
/// each event stream occupy one of the host's threads.
///
/// For a server without a port of its own set `options.listen.transport = lrt::transport::no_network`.
///
/// @param http_server  must not listen yet
/// @param server       must not be moved, and must exist until http_server has stopped listening; it may be stopped
///                     before
/// @param prefix       a path without percent escapes, "/robot"; empty or "/": all paths
/// @par Threads  Set-up: one thread at a time, before http_server listens. Afterwards the host's threads serve
///               requests, many at once, as Server::serve().
/// @par Time     A request occupies its thread of the host as long as Server::serve(); an event stream, until it ends.
/// @par Implements     R0.3-R0.11, R1.1-R1.12 as far as there is no WebSocket
inline void mount(httplib::Server& http_server, Server& server, std::string prefix = {}, MountOptions options = {}) {
  while (!prefix.empty() && prefix.back() == '/') prefix.pop_back();
  const bool is_root = prefix.empty();
  auto of_host = std::move(options.post_routing);
  const auto mounted = std::make_shared<detail::Mount>(server, std::move(prefix), options);
  const std::string pattern = mounted->pattern();
  http_server.set_post_routing_handler([of_host = std::move(of_host)](const httplib::Request& from, httplib::Response& to) {
    detail::Report::restore(to);
    if (of_host) of_host(from, to);
  });
  const auto without_reader = [mounted](const httplib::Request& from, httplib::Response& to) { mounted->serve(from, to, nullptr); };
  const auto with_reader = [mounted](const httplib::Request& from, httplib::Response& to, const httplib::ContentReader& reader) {
    mounted->serve(from, to, &reader);
  };
  http_server.Get(pattern, without_reader);
  http_server.Options(pattern, without_reader);
  if (is_root) {
    // cpp-httplib prefers all handlers with a reader to those without, the host's.
    http_server.Post(pattern, without_reader).Put(pattern, without_reader).Patch(pattern, without_reader).Delete(pattern, without_reader);
  } else {
    http_server.Post(pattern, with_reader).Put(pattern, with_reader).Patch(pattern, with_reader).Delete(pattern, with_reader);
  }
}

}  // namespace v0
}  // namespace lrt
