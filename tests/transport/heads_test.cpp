#include "src/transport/port/protocols.hpp"

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "src/base/ascii.hpp"
#include "tests/support/catch.hpp"
#if LRT_HAS_ASIO
#include "src/transport/asio/beast_protocols.hpp"
#endif

using namespace lrt;

namespace {

using Fields = std::vector<std::pair<std::string, std::string>>;

struct Named {
  std::string name;
  std::unique_ptr<transport::Protocols> protocols;
};

std::vector<Named> all_protocols() {
  std::vector<Named> all;
#if LRT_HAS_ASIO
  all.push_back({"asio", std::make_unique<transport::BeastProtocols>()});
#endif
  return all;
}

Fields copied(const std::vector<http::Field>& fields) {
  Fields result;
  for (const auto& field : fields) result.emplace_back(field.name, field.value);
  return result;
}

/// By name, the order of equal names kept.
Fields sorted(const std::vector<http::Field>& fields) {
  const auto lower = [](std::string text) {
    for (char& c : text) c = detail::lower(c);
    return text;
  };
  Fields result = copied(fields);
  std::stable_sort(result.begin(), result.end(), [&](const auto& a, const auto& b) { return lower(a.first) < lower(b.first); });
  return result;
}

/// The dumbest reading of a head that passed check_raw_head().
http::Request plain_reading(std::string_view head) {
  const auto take = [&head](std::string_view until) {
    const auto part = head.substr(0, head.find(until));
    head.remove_prefix(part.size() + until.size());
    return part;
  };
  http::Request request;
  request.method = take(" ");
  request.target = take(" ");
  request.version = take("\r\n") == "HTTP/1.0" ? 10 : 11;
  while (head != "\r\n") {
    const auto name = take(":");
    request.fields.push_back({name, detail::trim(take("\r\n"))});
  }
  return request;
}

/// A parser may refuse what check_head() would; then there is nothing to compare.
void check_reading(transport::Protocols& protocols, const std::string& head) {
  INFO(head);
  REQUIRE_FALSE(http::check_raw_head(head));
  const auto expected = plain_reading(head);
  std::string kept = "what was there before";
  http::Request request;
  request.fields.push_back({"Left", "over"});
  const auto refusal = protocols.read_head(head, kept, request);
  if (refusal) {
    CHECK(http::check_head(expected));
    return;
  }
  CHECK(request.method == expected.method);
  CHECK(request.target == expected.target);
  CHECK(request.version == expected.version);
  CHECK(copied(request.fields) == copied(expected.fields));
  for (const auto& field : request.fields) {  // the views live as long as `head` and `kept`
    const auto is_within = [](std::string_view part, std::string_view whole) {
      return part.data() >= whole.data() && part.data() + part.size() <= whole.data() + whole.size();
    };
    CHECK((is_within(field.name, head) || is_within(field.name, kept)));
    CHECK((field.value.empty() || is_within(field.value, head) || is_within(field.value, kept)));
  }
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
  constexpr std::size_t line = 8000 - 2;  // Limits::line_bytes, without the line's end
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

http::Request parsed_response(std::string_view head) { return plain_reading(head); }  // its three parts are those of a request line

void check_writing(transport::Protocols& protocols, const http::Response& response, bool keep_alive, int version) {
  const std::string_view date = "Sun, 06 Nov 1994 08:49:37 GMT";
  std::string expected;
  http::write_head(expected, response, date, keep_alive, version);
  std::string out = "before";
  protocols.write_head(out, response, date, keep_alive, version);
  INFO(out);
  REQUIRE(out.substr(0, 6) == "before");
  const std::string_view head = std::string_view(out).substr(6);
  CHECK(head.substr(0, head.find("\r\n")) == expected.substr(0, expected.find("\r\n")));
  REQUIRE(head.size() == expected.size());
  REQUIRE(head.substr(head.size() - 4) == "\r\n\r\n");
  CHECK(sorted(parsed_response(head).fields) == sorted(parsed_response(expected).fields));
}

}  // namespace

TEST_CASE("every parser takes a head apart as it stands", "[transport][R0.1]") {
  for (const auto& [name, protocols] : all_protocols()) {
    INFO(name);
    for (const auto& head : odd_heads()) check_reading(*protocols, head);
    for (const auto& head : odd_heads()) check_reading(*protocols, head);  // nothing is left of the one before
  }
}

TEST_CASE("every parser agrees with the others on the heads of the fuzzer", "[transport][R0.1]") {
  std::size_t heads = 0;
  for (const auto& entry : std::filesystem::directory_iterator(LRT_SOURCE_DIR "/tests/fuzz/corpus/head")) {
    std::ifstream file(entry.path(), std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(file), {}};
    const auto end = bytes.find("\r\n\r\n");
    if (end == std::string::npos) continue;
    const auto head = bytes.substr(0, end + 4);
    if (http::check_raw_head(head)) continue;
    ++heads;
    for (const auto& [name, protocols] : all_protocols()) {
      INFO(name << ", " << entry.path());
      check_reading(*protocols, head);
    }
  }
  CHECK(heads >= 8);
}

TEST_CASE("every writer writes the head that http::write_head writes", "[transport][R0.1]") {
  for (const auto& [name, protocols] : all_protocols()) {
    INFO(name);
    for (const int status : {100, 101, 200, 201, 204, 206, 299, 300, 304, 400, 404, 405, 412, 413, 416, 417, 422, 426, 431, 500, 503, 505, 799}) {
      http::Response response;
      response.status = status;
      check_writing(*protocols, response, true, 11);
      check_writing(*protocols, response, false, 11);
      check_writing(*protocols, response, true, 10);
      response.set_body("hello");
      response.close = true;
      check_writing(*protocols, response, true, 11);
    }
    http::Response response;
    response.set_body(std::string(100000, 'x'));
    response.fields.add("Link", "<z>; rel=\"type\"");
    response.fields.add("Content-Type", "text/turtle");
    response.fields.add("Link", "<a>; rel=\"self\"");
    response.fields.add("Link", "<m>; rel=\"up\"; title=\"100%s %n\"");
    response.fields.add("Retry-After", "1");
    response.fields.add("Empty", "");
    response.fields.add("Latin", "\xE4");
    response.fields.add("Long", std::string(10000, 'y'));
    check_writing(*protocols, response, true, 11);
    response.fields.add("Date", "Mon, 07 Nov 1994 08:49:37 GMT");
    response.fields.add("Content-Length", "7");
    response.fields.add("Accept-Ranges", "none");
    check_writing(*protocols, response, true, 10);
    response.status = 404;
    response.fields.remove("Content-Length");
    response.fields.add("Transfer-Encoding", "chunked");
    check_writing(*protocols, response, false, 11);
    std::string head;
    protocols->write_head(head, response, "", true, 11);
    CHECK(head.find("<z>") < head.find("<a>"));
    CHECK(head.find("<a>") < head.find("<m>"));
  }
}

TEST_CASE("a port leaves SIGPIPE as the host has set it", "[transport]") {
  struct sigaction before {};
  struct sigaction mine {};
  mine.sa_handler = SIG_DFL;
  ::sigaction(SIGPIPE, &mine, &before);
  for (const auto& [name, protocols] : all_protocols()) {
    INFO(name);
    CHECK(protocols->accept("dGhlIHNhbXBsZSBub25jZQ==", 1000).accept == "s3pPLMBiTxaQ9kYGzzhZRbK+xOo=");
    struct sigaction after {};
    ::sigaction(SIGPIPE, nullptr, &after);
    CHECK(after.sa_handler == SIG_DFL);
  }
  ::sigaction(SIGPIPE, &before, nullptr);
}
