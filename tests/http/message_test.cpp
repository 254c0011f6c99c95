// SPDX-License-Identifier: Apache-2.0
#include <lrt/http/message.hpp>

#include "tests/support/catch.hpp"

using namespace lrt;

namespace {
const char* date = "Sun, 06 Nov 1994 08:49:37 GMT";

std::string head(const http::Response& response, bool keep_alive = true, int version = 11) {
  std::string out;
  http::write_response_header(out, response, date, keep_alive, version);
  return out;
}
}  // namespace

TEST_CASE("request fields are found by name whatever its case", "[http]") {
  http::Request request;
  request.fields = {{"Accept", "a"}, {"X", "1"}, {"accept", "b"}};
  CHECK(request.find("ACCEPT") == std::string_view("a"));
  CHECK_FALSE(request.find("Accep"));
  CHECK(request.joined("accept") == "a, b");
  CHECK(request.joined("none").empty());
  CHECK(request.count("Accept") == 2);
  CHECK_FALSE(http::iequals("[", "{"));
  CHECK_FALSE(http::iequals("\xC3", "\xE3"));
}

TEST_CASE("response fields are kept as the lines that go on the wire", "[http]") {
  http::Fields fields;
  fields.add("ETag", "\"a\"");
  fields.add("Vary", " Accept ");
  fields.add("vary", "Origin");
  CHECK(fields.block() == "ETag: \"a\"\r\nVary: Accept\r\nvary: Origin\r\n");
  CHECK(fields.find("VARY") == std::string_view("Accept"));
  CHECK(fields.joined("Vary") == "Accept, Origin");
  CHECK(fields.list().size() == 3);
  fields.set("Vary", "*");
  CHECK(fields.block() == "ETag: \"a\"\r\nVary: *\r\n");
  fields.set("ETag", *fields.find("ETag"));
  CHECK(fields.joined("ETag") == "\"a\"");
  fields.remove("etag");
  CHECK(fields.block() == "Vary: *\r\n");
  http::Fields more;
  more.add("Empty", "");
  fields.append(more);
  CHECK(fields.find("Empty") == std::string_view());
  CHECK_FALSE(fields.find("Emp"));
}

TEST_CASE("copies of shared fields have the same bytes in memory until one of them is changed", "[http]") {
  using Known = http::Fields::Known;
  http::Fields fields;
  fields.add("etag", "\"a\"");
  fields.add("UPGRADE", "websocket");
  fields.share();
  http::Fields same = fields, changed = fields, less = fields, more;
  CHECK(same.block().data() == fields.block().data());
  CHECK(same.has(Known::upgrade));
  changed.add("Date", "now");
  CHECK(changed.block() == "etag: \"a\"\r\nUPGRADE: websocket\r\nDate: now\r\n");
  CHECK(changed.has(Known::date));
  CHECK_FALSE(fields.has(Known::date));
  less.remove("None");
  CHECK(less.block().data() == fields.block().data());
  less.remove("upgrade");
  CHECK(less.block() == "etag: \"a\"\r\n");
  CHECK_FALSE(less.has(Known::upgrade));
  more.append(changed);
  CHECK((more.has(Known::date) && more.has(Known::upgrade) && !more.has(Known::content_length)));
  same = {};
  CHECK(fields.block() == "etag: \"a\"\r\nUPGRADE: websocket\r\n");
}

TEST_CASE("nothing in a value can start another field", "[http][R0.1]") {
  http::Fields fields;
  fields.add("Location", "/a\r\nSet-Cookie: x\r\n\r\n<html>");
  fields.add("X", std::string_view("a\0\x01\x7F\tb\n", 7));
  CHECK(fields.block() == "Location: /a  Set-Cookie: x    <html>\r\nX: a   \tb \r\n");
  CHECK(fields.list().size() == 2);
}

TEST_CASE("a header section has Date and Content-Length, for HEAD the length that GET would have", "[http][R0.1]") {
  http::Response response;
  response.fields.add("ETag", "\"a\"");
  response.set_body("12345");
  CHECK(head(response) == "HTTP/1.1 200 OK\r\nDate: Sun, 06 Nov 1994 08:49:37 GMT\r\nContent-Length: 5\r\nETag: \"a\"\r\n\r\n");
  response.body.reset();
  response.fields.add("Content-Length", "5");
  CHECK(head(response) == "HTTP/1.1 200 OK\r\nDate: Sun, 06 Nov 1994 08:49:37 GMT\r\nETag: \"a\"\r\nContent-Length: 5\r\n\r\n");
  CHECK(head(http::Response{}) == "HTTP/1.1 200 OK\r\nDate: Sun, 06 Nov 1994 08:49:37 GMT\r\nContent-Length: 0\r\n\r\n");
}

TEST_CASE("204, 304 and 1xx have no Content-Length", "[http][R0.1]") {
  for (const int status : {100, 101, 204, 304}) {
    http::Response response;
    response.status = status;
    CHECK(head(response).find("Content-Length") == std::string::npos);
  }
}

TEST_CASE("Connection says close, and keep-alive to HTTP/1.0", "[http][R0.1]") {
  http::Response response;
  response.status = 204;
  const std::string begin = "HTTP/1.1 204 No Content\r\nDate: Sun, 06 Nov 1994 08:49:37 GMT\r\n";
  CHECK(head(response, true, 11) == begin + "\r\n");
  CHECK(head(response, false, 11) == begin + "Connection: close\r\n\r\n");
  CHECK(head(response, true, 10) == begin + "Connection: keep-alive\r\n\r\n");
  CHECK(head(response, false, 10) == begin + "Connection: close\r\n\r\n");
  response.close = true;
  CHECK(head(response, true, 11) == begin + "Connection: close\r\n\r\n");
  // RFC 9110 7.8
  http::Response upgrade;
  upgrade.status = 426;
  upgrade.fields.add("Upgrade", "websocket");
  const auto connection = [&](bool keep_alive, int version) { return http::added_fields(upgrade, keep_alive, version).connection; };
  CHECK(connection(true, 11) == "Upgrade");
  CHECK(connection(false, 11) == "close, Upgrade");
  CHECK(connection(true, 10) == "keep-alive, Upgrade");
  upgrade.status = 101;
  CHECK(connection(true, 11) == "Upgrade");
  response.status = 299;
  CHECK(head(response).substr(0, 15) == "HTTP/1.1 299 \r\n");
}

TEST_CASE("every status that R0.6 names has a reason phrase", "[http][R0.6]") {
  for (const int status : {200, 201, 202, 204, 206, 304, 400, 401, 403, 404, 405, 406, 409, 410, 412,
                           413, 414, 415, 416, 417, 421, 422, 426, 429, 431, 500, 501, 503, 505}) {
    CAPTURE(status);
    CHECK_FALSE(http::reason_phrase(status).empty());
  }
  CHECK(http::reason_phrase(999).empty());
}

TEST_CASE("1xx, 204 and 304 have no body, all other statuses may have one", "[http][R0.1]") {
  for (const int status : {100, 101, 103, 199, 204, 304}) {
    CAPTURE(status);
    CHECK_FALSE(http::may_have_body(status));
  }
  for (const int status : {200, 201, 203, 205, 206, 300, 303, 305, 400, 404, 500, 599}) {
    CAPTURE(status);
    CHECK(http::may_have_body(status));
  }
  for (int status = 100; status < 600; ++status) {  // what has no body has no length either (RFC 9110 8.6)
    http::Response response;
    response.status = status;
    CHECK(http::added_fields(response, true, 11).content_length == http::may_have_body(status));
  }
}
