// SPDX-License-Identifier: Apache-2.0
#include <lrt/http/request_parser.hpp>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "src/http/target.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace std::literals;

namespace {

/// The most simple reading of a header section that is well-formed.
http::Request parse(std::string_view head) {
  http::Request request;
  const auto take = [&head](std::string_view until) {
    const std::string_view part = head.substr(0, head.find(until));
    head.remove_prefix(part.size() + until.size());
    return part;
  };
  request.method = take(" ");
  request.target = take(" ");
  request.version = take("\r\n") == "HTTP/1.0" ? 10 : 11;
  while (head.substr(0, 2) != "\r\n") {
    const std::string_view name = take(":");
    std::string_view value = take("\r\n");
    while (!value.empty() && (value.front() == ' ' || value.front() == '\t')) value.remove_prefix(1);
    while (!value.empty() && (value.back() == ' ' || value.back() == '\t')) value.remove_suffix(1);
    request.fields.push_back({name, value});
  }
  return request;
}

std::optional<http::Refusal> check(std::string_view head) {
  http::Request request;
  http::Framing framing;
  return http::parse_request_header(head, request, framing);
}

std::optional<http::Refusal> check(const http::Request& request) {
  http::Framing framing;
  return http::check_request(request, framing);
}

http::Framing framing_of(http::Request request) {
  request.fields.push_back({"Host", "a"});
  http::Framing framing;
  REQUIRE_FALSE(http::check_request(request, framing));
  return framing;
}

using Fields = std::vector<std::pair<std::string, std::string>>;

Fields copied(const std::vector<http::Field>& fields) {
  Fields result;
  for (const auto& field : fields) result.emplace_back(field.name, field.value);
  return result;
}

/// The parser reads what the simple reading does, as views, or refuses what check_request() refuses of that.
void check_reading(const std::string& head) {
  INFO(head);
  const auto expected = parse(head);
  http::Request request;
  request.fields.push_back({"Left", "over"});
  http::Framing framing;
  if (http::parse_request_header(head, request, framing)) {
    CHECK(check(expected));
    return;
  }
  CHECK(request.method == expected.method);
  CHECK(request.target == expected.target);
  CHECK(request.version == expected.version);
  CHECK(copied(request.fields) == copied(expected.fields));
  const auto is_within = [&](std::string_view part) { return part.data() >= head.data() && part.data() + part.size() <= head.data() + head.size(); };
  for (const auto& field : request.fields) CHECK((is_within(field.name) && is_within(field.value)));
}

std::string head_of(std::string_view line, std::initializer_list<const char*> fields) {
  std::string head(line);
  head += "\r\n";
  for (const auto* field : fields) head.append(field).append("\r\n");
  return head + "\r\n";
}

std::vector<std::string> odd_heads() {
  std::vector<std::string> heads = {
      head_of("GET / HTTP/1.1", {"Host: a"}),
      head_of("GET / HTTP/1.0", {}),
      head_of("GET / HTTP/1.2", {"Host: a"}),
      head_of("GET / HTTP/1.9", {"Host: a", "Connection: keep-alive"}),
      head_of("GET /a%20b%2Fc%zz%u0041%?q=%41&p=a%2Bb+c HTTP/1.1", {"Host: a"}),
      head_of("GET /a?b?c??d=?& HTTP/1.1", {"Host: a", "Referer: /x?y?z"}),
      head_of("GET ? HTTP/1.1", {"Host: a"}),
      head_of("GET http://a:80/b?c HTTP/1.1", {"Host: a:80"}),
      head_of("OPTIONS * HTTP/1.1", {"Host: a"}),
      head_of("CONNECT a:80 HTTP/1.1", {"Host: a:80"}),
      head_of("PRI * HTTP/1.1", {"Host: a"}),
      head_of("PROPFIND / HTTP/1.1", {"Host: a"}),
      head_of("X / HTTP/1.1", {"Host: a"}),
      head_of("M-SEARCH! /x HTTP/1.1", {"Host: a"}),
      head_of("HEAD /a HTTP/1.0", {"Connection: Keep-Alive"}),
      head_of("GET /a HTTP/1.1", {"Host: a", "Range: bytes=0-1, 4-5", "Range: nonsense", "If-Range: \"x\""}),
      head_of("GET /a HTTP/1.1", {"Host: a", "Range: bytes=5-1"}),
      head_of("PUT /a HTTP/1.1", {"Host: a", "Expect: 100-continue", "Content-Length: 3"}),
      head_of("POST /a HTTP/1.1", {"Host: a", "Transfer-Encoding: chunked", "TE: trailers", "Trailer: X"}),
      head_of("POST /a HTTP/1.1", {"Host: a", "Content-Type: multipart/form-data; boundary=x", "Content-Length: 0"}),
      head_of("POST /a HTTP/1.1", {"Host: a", "Content-Encoding: gzip", "Content-Length: 99999999999"}),
      head_of("GET /a HTTP/1.1", {"Host: a", "Connection: close"}),
      head_of("GET /a HTTP/1.1", {"Host: a", "Accept-Encoding: gzip, br", "Accept: */*;q=0.5"}),
      head_of("GET /a HTTP/1.1", {"Host: a", "REMOTE_ADDR: 1.2.3.4", "LOCAL_PORT: 0", "remote_port: 9"}),
      head_of("GET /a HTTP/1.1", {"Host: a", "Empty:", "Spaces: \t ", "EMPTY: ", "Colon: :", "Colons::", "After: x"}),
      head_of("GET /a HTTP/1.1", {"Host:a", "Trimmed:\t  a  b \t", "Tab: a\tb", "Quoted: \"a\\\"b, c\""}),
      head_of("GET /a HTTP/1.1", {"Host: a", "Link: <a>; rel=1", "X: y", "link: <b>; rel=2", "LINK: <c>; rel=3", "link: <a>"}),
      head_of("GET /a HTTP/1.1", {"Host: a", "X: 100%", "Y: %41%u0041%00%0D%0A%", "Z%: %", "If-Match: \"%22\""}),
      head_of("GET /a HTTP/1.1", {"Host: a", "Name: J\xF6rg \xE2\x82\xAC \xFF\x80"}),
      head_of("GET /a HTTP/1.1", {"Host: a", "~: tilde", "~~a: b", "!#$%&'*+-.^_`|~09aZ: every token character"}),
      head_of("GET /a HTTP/1.1", {"Host: a", "Upgrade: websocket", "Connection: keep-alive, Upgrade", "Sec-WebSocket-Version: 13",
                                  "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ=="}),
  };
  constexpr std::size_t line = 8000 - 2;  // without the end of the line
  const std::string begin = "GET /";
  const std::string version = " HTTP/1.1";
  for (const char c : {'a', '%', '?'}) {
    heads.push_back(begin + std::string(line - begin.size() - version.size(), c) + version + "\r\nHost: a\r\n\r\n");
    const std::string fields = "GET / HTTP/1.1\r\nHost: a\r\nLong: " + std::string(line - 6, c) + "\r\nX:" + std::string(line - 2, ' ');
    heads.push_back(fields + "\r\nLast: " + std::string(line - 6, c) + "\r\n\r\n");
  }
  heads.push_back("GET / HTTP/1.1\r\nHost: a\r\n" + std::string(line - 1, 'n') + ":\r\n" + std::string(line - 2, 'm') + ":v\r\n\r\n");
  std::string many = "GET / HTTP/1.1\r\nHost: a\r\n";
  for (int i = 0; i < 300; ++i) many += "Name-" + std::to_string(i * 7919 % 300) + ": value " + std::to_string(i) + "\r\n";
  heads.push_back(many + "\r\n");
  return heads;
}

struct Refused {
  std::string_view head;
  int status;
  std::string_view reason;  ///< a part of it
};

// What two parsers could read differently, and what lrt does not do.
const Refused refusals[] = {
    // request line
    {""sv, 400, "request line: found an empty line"},
    {"\r\n\r\n"sv, 400, "request line: found an empty line at byte 0"},
    {"\nGET / HTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "request line: found an empty line"},
    {" GET / HTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "method: found a space at byte 0"},
    {"\tGET / HTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "method: found a tab at byte 0"},
    {"GET\r\n\r\n"sv, 400, "method: found CR"},
    {"GET"sv, 400, "method: found the end at byte 3"},
    {"get / HTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "method: found 'g' at byte 0"},
    {"GeT / HTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "method: found 'e' at byte 1"},
    {"G(T / HTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "method: found '(' at byte 1"},
    {"GET\t/ HTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "method: found a tab at byte 3"},
    {"GET  / HTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "request target: found a space at byte 4"},
    {"GET /\r\n\r\n"sv, 400, "expected an HTTP version, found the end of the line at byte 5"},
    {"GET / \r\n\r\n"sv, 400, "expected HTTP/1.1 or HTTP/1.0 at byte 6"},
    {"GET /  HTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "expected HTTP/1.1 or HTTP/1.0 at byte 6, found \" HTTP/1.1\""},
    {"GET /\tHTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "request target: found a tab at byte 5"},
    {"GET / HTTP/1.1 \r\nHost: a\r\n\r\n"sv, 400, "request line after the version: found a space at byte 14"},
    {"GET / HTTP/1.1\t\r\nHost: a\r\n\r\n"sv, 400, "request line after the version: found a tab"},
    {"GET / HTTP/1.1\nHost: a\r\n\r\n"sv, 400, "request line after the version: found LF without CR at byte 14"},
    {"GET / HTTP/1.1\rHost: a\r\n\r\n"sv, 400, "request line after the version: found CR without LF at byte 14"},
    {"GET /a b HTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "found \"b HTTP/1.1\""},
    {"GET /a\0b HTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "request target: found NUL at byte 6"},
    {"GET /\x7F HTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "request target: found byte 0x7F at byte 5"},
    {"GET /gr\xC3\xB6 HTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "request target: found byte 0xC3 at byte 7"},
    {"GET /a#b HTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "request target: found '#' at byte 6"},
    {"GET /a\\b HTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "request target: found '\\' at byte 6"},
    {"GET /<a> HTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "request target: found '<' at byte 5"},
    // version
    {"GET / HTTP/2.0\r\nHost: a\r\n\r\n"sv, 505, "expected HTTP/1.1 or HTTP/1.0, found \"HTTP/2.0\""},
    {"PRI * HTTP/2.0\r\n\r\n"sv, 505, "HTTP/2.0"},
    {"GET / HTTP/0.9\r\nHost: a\r\n\r\n"sv, 505, "HTTP/0.9"},
    {"GET / HTTP/3.1\r\nHost: a\r\n\r\n"sv, 505, "HTTP/3.1"},
    {"GET / HTTP/1.12\r\nHost: a\r\n\r\n"sv, 400, "after the version"},
    {"GET / HTTP/1.x\r\nHost: a\r\n\r\n"sv, 400, "found \"HTTP/1.x\""},
    {"GET / HTTP/2\r\nHost: a\r\n\r\n"sv, 400, "found \"HTTP/2\""},
    {"GET / HTTP/1.10\r\nHost: a\r\n\r\n"sv, 400, "version: found '0'"},
    {"GET / HTTP/01.1\r\nHost: a\r\n\r\n"sv, 400, "HTTP/01.1"},
    {"GET / http/1.1\r\nHost: a\r\n\r\n"sv, 400, "http/1.1"},
    {"GET / HTTP/1,1\r\nHost: a\r\n\r\n"sv, 400, "HTTP/1,1"},
    {"GET / HTTPS/1.1\r\nHost: a\r\n\r\n"sv, 400, "HTTPS/1.1"},
    // field lines
    {"GET / HTTP/1.1\r\n Host: a\r\n\r\n"sv, 400, "first field line: found a space at byte 16"},
    {"GET / HTTP/1.1\r\n\tHost: a\r\n\r\n"sv, 400, "first field line: found a tab at byte 16"},
    {"GET / HTTP/1.1\r\nHost: a\r\nX: a\r\n b\r\n\r\n"sv, 400, "obs-fold, RFC 9112 5.2): found a space at byte 31"},
    {"GET / HTTP/1.1\r\nHost: a\r\nX: a\r\n\tb\r\n\r\n"sv, 400, "obs-fold, RFC 9112 5.2): found a tab"},
    {"GET / HTTP/1.1\r\nHost: a\r\n \r\n\r\n"sv, 400, "obs-fold"},
    {"GET / HTTP/1.1\r\nHost : a\r\n\r\n"sv, 400, "field name \"Host\": found a space at byte 20"},
    {"GET / HTTP/1.1\r\nHost\t: a\r\n\r\n"sv, 400, "field name \"Host\": found a tab at byte 20"},
    {"GET / HTTP/1.1\r\n: a\r\nHost: a\r\n\r\n"sv, 400, "field name: found ':' at byte 16"},
    {"GET / HTTP/1.1\r\nHost: a\r\nX Y: a\r\n\r\n"sv, 400, "field name \"X\": found a space"},
    {"GET / HTTP/1.1\r\nHost: a\r\nX(: a\r\n\r\n"sv, 400, "field name \"X\": found '('"},
    {"GET / HTTP/1.1\r\nHost: a\r\nX\xC3: a\r\n\r\n"sv, 400, "field name \"X\": found byte 0xC3"},
    {"GET / HTTP/1.1\r\nHost: a\r\nX\0: a\r\n\r\n"sv, 400, "field name \"X\": found NUL"},
    {"GET / HTTP/1.1\r\nHost: a\r\nX\r\n\r\n"sv, 400, "field name \"X\": found CR"},
    {"GET / HTTP/1.1\r\nHost: a\r\nX: a\0b\r\n\r\n"sv, 400, "value of field \"X\": found NUL at byte 29"},
    {"GET / HTTP/1.1\r\nHost: a\r\nX: a\x01\r\n\r\n"sv, 400, "value of field \"X\": found byte 0x01"},
    {"GET / HTTP/1.1\r\nHost: a\r\nX: a\x7F\r\n\r\n"sv, 400, "value of field \"X\": found byte 0x7F"},
    {"GET / HTTP/1.1\r\nHost: a\r\nX: a\x0B\r\n\r\n"sv, 400, "value of field \"X\": found byte 0x0B"},
    {"GET / HTTP/1.1\r\nHost: a\r\nX: a\rb\r\n\r\n"sv, 400, "value of field \"X\": found CR without LF at byte 29"},
    {"GET / HTTP/1.1\r\nHost: a\r\nX: a\nY: b\r\n\r\n"sv, 400, "value of field \"X\": found LF without CR at byte 29"},
    {"GET / HTTP/1.1\r\nHost: a\r\nX: a\r\r\n\r\n"sv, 400, "value of field \"X\": found CR"},
    {"GET / HTTP/1.1\r\nHost: a\r\nX: 0123456789abcdef0123\x1F"
     "56789abcdef\r\n\r\n"sv,
     400, "value of field \"X\": found byte 0x1F at byte 48"},
    {"GET / HTTP/1.1\r\nHost: a\r\n\n"sv, 400, "field name: found LF"},
    {"GET / HTTP/1.1\r\nHost: a\r\n\r"sv, 400, "field name: found CR"},
    {"GET / HTTP/1.1\r\nHost: a\r\n"sv, 400, "expected an empty line, found the end at byte 25"},
    {"GET / HTTP/1.1\r\nHost: a"sv, 400, "value of field \"Host\": found the end"},
    {"GET / HTTP/1.1\r\nHost: a\r\n\r\nG"sv, 400, "bytes after the empty line, at byte 27"},
    // Host
    {"GET / HTTP/1.1\r\n\r\n"sv, 400, "Host: expected one, found none"},
    {"GET / HTTP/1.1\r\nHost: a\r\nHost: a\r\n\r\n"sv, 400, "Host: expected one, found 2"},
    {"GET / HTTP/1.1\r\nHost: a\r\nhOST: b\r\n\r\n"sv, 400, "Host: expected one, found 2"},
    {"GET / HTTP/1.1\r\nHost:\r\n\r\n"sv, 400, "Host: expected a host and optional port, found \"\""},
    {"GET / HTTP/1.1\r\nHost: \t \r\n\r\n"sv, 400, "found \"\""},
    {"GET / HTTP/1.1\r\nHost: u@a\r\n\r\n"sv, 400, "found \"u@a\""},
    {"GET / HTTP/1.1\r\nHost: a/b\r\n\r\n"sv, 400, "found \"a/b\""},
    {"GET / HTTP/1.1\r\nHost: a,b\r\n\r\n"sv, 400, "found \"a,b\""},
    {"GET / HTTP/1.1\r\nHost: a b\r\n\r\n"sv, 400, "found \"a b\""},
    {"GET / HTTP/1.1\r\nHost: http://a\r\n\r\n"sv, 400, "found \"http://a\""},
    {"GET / HTTP/1.1\r\nHost: a:x\r\n\r\n"sv, 400, "found \"a:x\""},
    {"GET / HTTP/1.1\r\nHost: a:65536\r\n\r\n"sv, 400, "found \"a:65536\""},
    {"GET / HTTP/1.1\r\nHost: a:1:2\r\n\r\n"sv, 400, "found \"a:1:2\""},
    {"GET / HTTP/1.1\r\nHost: :80\r\n\r\n"sv, 400, "found \":80\""},
    {"GET / HTTP/1.1\r\nHost: [::1\r\n\r\n"sv, 400, "found \"[::1\""},
    {"GET / HTTP/1.1\r\nHost: ::1\r\n\r\n"sv, 400, "found \"::1\""},
    {"GET / HTTP/1.1\r\nHost: a%zz\r\n\r\n"sv, 400, "found \"a%zz\""},
    {"GET / HTTP/1.1\r\nHost: a?\r\n\r\n"sv, 400, "found \"a?\""},
    {"GET / HTTP/1.1\r\nHost: gr\xC3\xB6\r\n\r\n"sv, 400, "found \"gr\\xC3\\xB6\""},
    {"GET / HTTP/1.0\r\nHost: a\r\nHost: b\r\n\r\n"sv, 400, "Host: expected one, found 2"},
    {"GET / HTTP/1.0\r\nHost:\r\n\r\n"sv, 400, "Host"},
    {"GET http://a/ HTTP/1.1\r\n\r\n"sv, 400, "Host: expected one, found none"},
    {"GET http://a/ HTTP/1.1\r\nHost: a,b\r\n\r\n"sv, 400, "Host"},
    // target forms
    {"GET * HTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "\"*\" is for OPTIONS only, found method \"GET\""},
    {"OPTIONS *a HTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "request target: expected"},
    {"GET a HTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "request target: expected"},
    {"GET a:80 HTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "request target: expected"},
    {"GET ?a HTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "request target: expected"},
    {"GET ftp://a/ HTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "request target: expected"},
    {"GET http://u@a/ HTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "request target: expected"},
    {"GET http://u:p@a/ HTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "request target: expected"},
    {"GET http:///b HTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "request target: expected"},
    {"GET http://:80/ HTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "request target: expected"},
    {"GET http:/a HTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "request target: expected"},
    {"GET http:// HTTP/1.1\r\nHost: a\r\n\r\n"sv, 400, "request target: expected"},
    {"GET https://a/ HTTP/1.1\r\nHost: a\r\n\r\n"sv, 421, "request target: expected http over this connection"},
    {"GET HTTPS://a:443/x?y HTTP/1.1\r\nHost: a\r\n\r\n"sv, 421, "found \"HTTPS://a:443/x?y\""},
    {"GET https://a/ HTTP/1.1\r\n\r\n"sv, 400, "Host: expected one, found none"},
    // methods
    {"CONNECT a:80 HTTP/1.1\r\nHost: a\r\n\r\n"sv, 501, "found \"CONNECT\""},
    {"TRACE / HTTP/1.1\r\nHost: a\r\n\r\n"sv, 501, "found \"TRACE\""},
    // framing
    {"PUT / HTTP/1.1\r\nHost: a\r\nContent-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\n"sv, 400, "beside Transfer-Encoding"},
    {"PUT / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\ncontent-length: 5\r\n\r\n"sv, 400, "beside Transfer-Encoding"},
    {"PUT / HTTP/1.1\r\nHost: a\r\nContent-Length: 5\r\nContent-Length: 5\r\n\r\n"sv, 400, "at most one, found 2"},
    {"PUT / HTTP/1.1\r\nHost: a\r\nContent-Length: 1\r\nX: 9\r\ncontent-length: 2\r\nContent-Length: 3\r\nContent-Length: 4\r\n\r\n"sv, 400,
     "Content-Length: expected at most one, found 4: \"1\", \"2\", \"3\", ..."},
    {"PUT / HTTP/1.1\r\nHost: a\r\nContent-Length: 5, 5\r\n\r\n"sv, 400, "found \"5, 5\""},
    {"PUT / HTTP/1.1\r\nHost: a\r\nContent-Length:\r\n\r\n"sv, 400, "Content-Length: expected 1 to 19 digits, found \"\""},
    {"PUT / HTTP/1.1\r\nHost: a\r\nContent-Length: +5\r\n\r\n"sv, 400, "found \"+5\""},
    {"PUT / HTTP/1.1\r\nHost: a\r\nContent-Length: -5\r\n\r\n"sv, 400, "found \"-5\""},
    {"PUT / HTTP/1.1\r\nHost: a\r\nContent-Length: 5 5\r\n\r\n"sv, 400, "found \"5 5\""},
    {"PUT / HTTP/1.1\r\nHost: a\r\nContent-Length: 0x5\r\n\r\n"sv, 400, "found \"0x5\""},
    {"PUT / HTTP/1.1\r\nHost: a\r\nContent-Length: 5.0\r\n\r\n"sv, 400, "found \"5.0\""},
    {"PUT / HTTP/1.1\r\nHost: a\r\nContent-Length: 12345678901234567890\r\n\r\n"sv, 400, "1 to 19 digits"},
    {"PUT / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: gzip\r\n\r\n"sv, 501, "exactly \"chunked\", found \"gzip\""},
    {"PUT / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: identity\r\n\r\n"sv, 501, "found \"identity\""},
    {"PUT / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: xchunked\r\n\r\n"sv, 501, "found \"xchunked\""},
    {"PUT / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: gzip, chunked\r\n\r\n"sv, 501, "found \"gzip, chunked\""},
    {"PUT / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: gzip;q=1 ,\tidentity,CHUNKED\r\n\r\n"sv, 501, "CHUNKED\""},
    {"PUT / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: gzip, deflate\r\n\r\n"sv, 400, "found \"gzip, deflate\""},
    {"PUT / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked, gzip\r\n\r\n"sv, 400, "found \"chunked, gzip\""},
    {"PUT / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked, gzip, chunked\r\n\r\n"sv, 400, "found \"chunked, gzip, chunked\""},
    {"PUT / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: gzip, chunked, chunked\r\n\r\n"sv, 400, "found \"gzip, chunked, chunked\""},
    {"PUT / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: gzip, chunked;x=1\r\n\r\n"sv, 400, "found \"gzip, chunked;x=1\""},
    {"PUT / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: g zip, chunked\r\n\r\n"sv, 400, "found \"g zip, chunked\""},
    {"PUT / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: gzip, xchunked\r\n\r\n"sv, 400, "found \"gzip, xchunked\""},
    {"PUT / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: , chunked\r\n\r\n"sv, 400, "found \", chunked\""},
    {"PUT / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: gzip, chunked\r\nTransfer-Encoding: chunked\r\n\r\n"sv, 400,
     "found 2: \"gzip, chunked\", \"chunked\""},
    {"PUT / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked, chunked\r\n\r\n"sv, 400, "found \"chunked, chunked\""},
    {"PUT / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\nTransfer-Encoding: chunked\r\n\r\n"sv, 400, "at most one, found 2"},
    {"PUT / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\nTransfer-Encoding: identity\r\n\r\n"sv, 400, "at most one, found 2"},
    {"PUT / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked;x=1\r\n\r\n"sv, 400, "found \"chunked;x=1\""},
    {"PUT / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked,\r\n\r\n"sv, 400, "found \"chunked,\""},
    {"PUT / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: \"chunked\"\r\n\r\n"sv, 400, "found \"\\x22chunked\\x22\""},
    {"PUT / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding:\r\n\r\n"sv, 400, "found \"\""},
    {"PUT / HTTP/1.0\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n"sv, 400, "HTTP/1.0"},
    {"PUT / HTTP/1.0\r\nHost: a\r\nTransfer-Encoding: gzip\r\n\r\n"sv, 400, "HTTP/1.0"},
    // others
    {"PUT / HTTP/1.1\r\nHost: a\r\nExpect: 200-ok\r\n\r\n"sv, 417, "Expect: expected 100-continue, found \"200-ok\""},
    {"PUT / HTTP/1.1\r\nHost: a\r\nExpect: 100-continue, x\r\n\r\n"sv, 417, "Expect"},
    {"PUT / HTTP/1.1\r\nHost: a\r\nExpect: 100-continue\r\nExpect: x\r\n\r\n"sv, 417, "Expect"},
    {"GET / HTTP/1.1\r\nHost: a\r\nConnection: keep alive\r\n\r\n"sv, 400, "Connection: expected a list of tokens"},
    {"GET / HTTP/1.1\r\nHost: a\r\nConnection: \"close\"\r\n\r\n"sv, 400, "Connection: expected a list of tokens"},
};

const std::string_view accepted[] = {
    "GET / HTTP/1.1\r\nHost: a\r\n\r\n"sv,
    "GET /?a=[b]&c='d';e HTTP/1.1\r\nHost: a\r\n\r\n"sv,
    "GET //a/../%zz HTTP/1.1\r\nHost: a\r\n\r\n"sv,  // escapes and dots are the engine's
    "GET http://a HTTP/1.1\r\nHost: b\r\n\r\n"sv,
    "GET HTTP://a:443/x?y HTTP/1.1\r\nHost: a\r\n\r\n"sv,
    "OPTIONS * HTTP/1.1\r\nHost: a\r\n\r\n"sv,
    "M-SEARCH / HTTP/1.1\r\nHost: a\r\n\r\n"sv,
    "GET / HTTP/1.0\r\n\r\n"sv,
    "GET / HTTP/1.1\r\nhost:a:80\r\n\r\n"sv,
    "GET / HTTP/1.1\r\nHost: \t a.b-c_d:65535 \t \r\n\r\n"sv,
    "GET / HTTP/1.1\r\nHost: [::1]:80\r\n\r\n"sv,
    "GET / HTTP/1.1\r\nHost: a:\r\n\r\n"sv,
    "GET / HTTP/1.1\r\nHost: a\r\nX: a\tb \xC3\xB6 \xFF ~\r\nY:\r\nZ: 0123456789abcdef\t0123456789abcdef\r\n\r\n"sv,
    "PUT / HTTP/1.1\r\nHost: a\r\nContent-Length: 0\r\n\r\n"sv,
    "PUT / HTTP/1.1\r\nHost: a\r\nContent-Length: 9999999999999999999\r\n\r\n"sv,
    "PUT / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: Chunked\r\nTrailer: X\r\n\r\n"sv,
    "PUT / HTTP/1.1\r\nHost: a\r\nContent-Length: 1\r\nExpect: 100-Continue\r\n\r\n"sv,
    "GET / HTTP/1.1\r\nHost: a\r\nConnection: keep-alive, , Upgrade\r\n\r\n"sv,
};

http::Request with(std::vector<http::Field> fields, int version = 11) {
  http::Request request;
  request.method = "PUT";
  request.target = "/";
  request.version = version;
  request.fields = std::move(fields);
  return request;
}

}  // namespace

TEST_CASE("a header section that two parsers could read differently is refused, with what was found and where", "[http][R0.1]") {
  for (const auto& [head, status, reason] : refusals) {
    CAPTURE(head, status);
    const auto refusal = check(head);
    REQUIRE(refusal);
    CHECK(refusal->status == status);
    CHECK_THAT(refusal->reason, Catch::Matchers::ContainsSubstring(std::string(reason)));
    for (const char c : refusal->reason) CHECK((c >= ' ' && c < 0x7F));
  }
}

TEST_CASE("a header section that RFC 9112 allows is accepted", "[http][R0.1]") {
  for (const std::string_view head : accepted) {
    CAPTURE(head);
    const auto refusal = check(head);
    if (refusal) FAIL(refusal->reason);
  }
}

TEST_CASE("a header section is parsed as it stands", "[http][R0.1]") {
  for (const auto& head : odd_heads()) check_reading(head);
}

TEST_CASE("the header sections of the fuzzer are parsed as they stand", "[http][R0.1]") {
  std::size_t accepted_heads = 0;
  for (const auto& entry : std::filesystem::directory_iterator(LRT_SOURCE_DIR "/tests/fuzz/corpus/head")) {
    std::ifstream file(entry.path(), std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(file), {}};
    const auto end = bytes.find("\r\n\r\n");
    if (end == std::string::npos) continue;
    const auto head = bytes.substr(0, end + 4);
    if (check(head)) continue;
    ++accepted_heads;
    check_reading(head);
  }
  CHECK(accepted_heads >= 8);
}

TEST_CASE("no header section is accepted before its last byte", "[http][R0.1]") {
  for (const std::string_view head : accepted) {
    for (std::size_t n = 0; n < head.size(); ++n) CHECK(check(head.substr(0, n)));
  }
}

TEST_CASE("a control character is refused wherever it stands in a header section", "[http][R0.1]") {
  const std::string head = "GET /baxter HTTP/1.1\r\nHost: robot\r\nAccept: text/turtle, */*;q=0.1\r\n\r\n";
  REQUIRE_FALSE(check(head));
  for (int c = 0; c <= 0x7F; c = c == 0x1F ? 0x7F : c + 1) {
    if (c == '\t') continue;
    for (std::size_t at = 0; at < head.size(); ++at) {
      CAPTURE(c, at);
      std::string replaced = head;
      replaced[at] = static_cast<char>(c);
      if (replaced != head) CHECK(check(replaced));
      std::string inserted = head;
      inserted.insert(at, 1, static_cast<char>(c));
      CHECK(check(inserted));
    }
  }
}

TEST_CASE("check_request checks method, target and version of a request that another server has parsed", "[http][R0.1]") {
  http::Request request = with({{"Host", "a"}});
  CHECK_FALSE(check(request));
  request.method = "put";
  CHECK(check(request)->status == 400);
  request.method = "";
  CHECK(check(request)->status == 400);
  request.method = "PUT";
  request.target = "/a\x01";
  CHECK(check(request)->status == 400);
  request.target = "";
  CHECK(check(request)->status == 400);
  request.target = "/";
  request.version = 20;
  CHECK(check(request)->status == 505);
}

TEST_CASE("an absolute target has the scheme of its connection", "[http][R0.1]") {
  http::Request request = with({{"Host", "a"}});
  for (const bool secure : {false, true}) {
    request.secure = secure;
    for (const std::string_view target : {"http://a/", "https://a/", "/"}) {
      CAPTURE(secure, target);
      request.target = target;
      const auto refusal = check(request);
      CHECK(refusal.has_value() == (target != "/" && secure != (target == "https://a/")));
      if (refusal) CHECK(refusal->status == 421);
    }
  }
}

TEST_CASE("framing follows Content-Length, chunked, Expect, Connection and the version", "[http][R0.1]") {
  CHECK(framing_of(with({{"Content-Length", "42"}})).length == 42);
  CHECK(framing_of(with({})).length == 0);
  CHECK_FALSE(framing_of(with({})).chunked);
  CHECK(framing_of(with({{"transfer-encoding", "Chunked"}})).chunked);
  CHECK(framing_of(with({{"Content-Length", "9999999999999999999"}})).length == 9999999999999999999U);

  CHECK(framing_of(with({{"Expect", "100-Continue"}, {"Content-Length", "1"}})).expects_continue);
  CHECK(framing_of(with({{"Expect", "100-continue"}, {"Transfer-Encoding", "chunked"}})).expects_continue);
  CHECK_FALSE(framing_of(with({{"Expect", "100-continue"}, {"Content-Length", "1"}}, 10)).expects_continue);
  CHECK_FALSE(framing_of(with({{"Expect", "100-continue"}, {"Content-Length", "0"}})).expects_continue);

  CHECK(framing_of(with({})).keep_alive);
  CHECK_FALSE(framing_of(with({{"Connection", "Close"}})).keep_alive);
  CHECK_FALSE(framing_of(with({{"Connection", "keep-alive"}, {"Connection", "Upgrade , close"}})).keep_alive);
  CHECK(framing_of(with({{"Connection", "closed"}})).keep_alive);
  CHECK_FALSE(framing_of(with({}, 10)).keep_alive);
  CHECK(framing_of(with({{"Connection", "Keep-Alive"}}, 10)).keep_alive);
  CHECK_FALSE(framing_of(with({{"Connection", "keep-alive, close"}}, 10)).keep_alive);
}

TEST_CASE("a header section is read off the front of bytes that go on, and only when it is whole and accepted", "[http][R0.1]") {
  const std::string header = "GET /a HTTP/1.1\r\nHost: a\r\nAccept: text/turtle\r\nContent-Length: 3\r\n\r\n";
  http::Request request;
  http::Framing framing;
  for (std::size_t size = 0; size < header.size(); ++size) {
    INFO(size);
    CHECK_FALSE(http::parse_leading_header(std::string_view(header).substr(0, size), request, framing));
  }
  for (const std::string rest : {"", "abc", "GET", "\r\n", "\n"}) {
    const std::string bytes = header + rest;
    REQUIRE(http::parse_leading_header(bytes, request, framing) == header.size());
    CHECK(request.target == "/a");
    CHECK(request.fields.size() == 3);
    CHECK(framing.length == 3);
  }
  for (const std::string refused : {"GET /a HTTP/1.1\r\n\r\n", "GET /a HTTP/1.1\nHost: a\r\n\r\n", "GET /a HTTP/2.0\r\nHost: a\r\n\r\n", "\r\n\r\n"})
    CHECK_FALSE(http::parse_leading_header(refused, request, framing));
}

TEST_CASE("a later minor version is served as HTTP/1.1, another major version is not served", "[http][R0.1]") {
  CHECK(http::spoken_version("HTTP/1.0") == 10);
  for (const char digit : "123456789"sv) CHECK(http::spoken_version("HTTP/1."s + digit) == 11);
  for (const std::string_view other : {"", "HTTP/1.", "HTTP/1", "HTTP/0.9", "HTTP/2.0", "HTTP/2", "HTTP/3", "http/1.1", "HTTP/1.10", "HTTP/1.1 ",
                                       " HTTP/1.1", "HTTP/1,1", "HTTP/11", "HTTP/1.x", "HTTP/1.-", "HTTP/1.:", "HTTP/1./", "HTTP/01.1", "ICY/1.1!"}) {
    CAPTURE(other);
    CHECK_FALSE(http::spoken_version(other));
  }
  CHECK_FALSE(http::spoken_version("HTTP/1.\0"sv));
  CHECK_FALSE(http::spoken_version("HTTP/1.\xB2"sv));
}
