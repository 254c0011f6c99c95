// SPDX-License-Identifier: Apache-2.0
#include "src/http/websocket.hpp"

#include <string>
#include <vector>

#include "tests/support/catch.hpp"

using namespace lrt::http;

namespace {

const std::vector<Field> good = {{"Host", "robot"},
                                 {"Upgrade", "websocket"},
                                 {"Connection", "Upgrade"},
                                 {"Sec-WebSocket-Version", "13"},
                                 {"Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ=="}};

Request request(std::vector<Field> fields) {
  Request made;
  made.method = "GET";
  made.target = "/arm";
  made.fields = std::move(fields);
  return made;
}

/// The good one with a field replaced, or removed where the value is empty.
Request with(std::string_view name, std::string_view value) {
  auto made = request({});
  for (const auto& field : good)
    if (field.name != name) made.fields.push_back(field);
  if (!value.empty()) made.fields.push_back({name, value});
  return made;
}

/// 0 where nothing is refused.
int status_of(const Request& asked) {
  const auto refusal = check_websocket(asked);
  return refusal ? refusal->status : 0;
}

}  // namespace

TEST_CASE("a protocol is requested by any member of any Upgrade field, whatever its case and version", "[http][R0.12][R0.13]") {
  CHECK(requests_upgrade(request({{"Upgrade", "websocket"}}), "websocket"));
  CHECK(requests_upgrade(request({{"upgrade", "WebSocket"}}), "websocket"));
  CHECK(requests_upgrade(request({{"Upgrade", "h2c,  websocket/13 , callback"}}), "websocket"));
  CHECK(requests_upgrade(request({{"Upgrade", "h2c"}, {"Host", "a"}, {"UPGRADE", ",, callback"}}), "callback"));
  CHECK_FALSE(requests_upgrade(request({}), "websocket"));
  CHECK_FALSE(requests_upgrade(request({{"Upgrade", ""}}), "websocket"));
  CHECK_FALSE(requests_upgrade(request({{"Upgrade", "websocket2, web socket, x/websocket"}}), "websocket"));
  CHECK_FALSE(requests_upgrade(request({{"X-Upgrade", "websocket"}}), "websocket"));
}

TEST_CASE("an opening handshake is one as RFC 6455 4.2.1 has it", "[http][R0.12]") {
  CHECK(status_of(request(good)) == 0);
  CHECK(status_of(with("Connection", "keep-alive, UPGRADE")) == 0);
  CHECK(status_of(with("Upgrade", "h2c, WebSocket")) == 0);
  CHECK(status_of(with("Sec-WebSocket-Key", "////+++AAAAAAAAAAAAAAA==")) == 0);
  auto lines = with("Connection", "keep-alive");
  lines.fields.push_back({"connection", "upgrade"});
  CHECK(status_of(lines) == 0);
}

TEST_CASE("a handshake without a Connection option, of another method, version or with a body is refused", "[http][R0.12]") {
  CHECK(status_of(with("Connection", "")) == 400);
  CHECK(status_of(with("Connection", "keep-alive, upgraded")) == 400);
  CHECK(status_of(with("Upgrade", "callback")) == 400);
  auto post = request(good);
  post.method = "POST";
  CHECK(status_of(post) == 400);
  auto head = request(good);
  head.method = "HEAD";
  CHECK(status_of(head) == 400);
  auto old = request(good);
  old.version = 10;
  CHECK(status_of(old) == 400);
  auto body = request(good);
  body.body = "x";
  CHECK(status_of(body) == 400);
}

TEST_CASE("only version 13 is spoken: 426 for all else", "[http][R0.1][R0.12]") {
  for (const auto* const version : {"", "12", "14", "8", "13, 8", "013", "13.0", "x"}) {
    INFO(version);
    CHECK(status_of(with("Sec-WebSocket-Version", version)) == 426);
  }
  auto twice = request(good);
  twice.fields.push_back({"Sec-WebSocket-Version", "13"});
  CHECK(status_of(twice) == 426);
}

TEST_CASE("the key is 16 bytes in base64, once", "[http][R0.12]") {
  for (const auto* const key : {"", "dGhlIHNhbXBsZSBub25jZQ", "dGhlIHNhbXBsZSBub25jZQ=", "dGhlIHNhbXBsZSBub25jZWE=", "dGhlIHNhbXBsZSBub25jZ!==",
                                "dGhlIHNhbXBsZSBub25jZQ==, dGhlIHNhbXBsZSBub25jZQ==", "AAAAAAAAAAAAAAAAAAAAAAAAAAAA", "dGhlIHNhbXBsZSBub25j-_=="}) {
    INFO(key);
    CHECK(status_of(with("Sec-WebSocket-Key", key)) == 400);
  }
  auto twice = request(good);
  twice.fields.push_back({"Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ=="});
  CHECK(status_of(twice) == 400);
}

TEST_CASE("a close frame may have no payload, or a status code that an endpoint may send", "[http][R0.12]") {
  const auto payload = [](unsigned code, std::string_view reason = {}) {
    return std::string{static_cast<char>(code >> 8), static_cast<char>(code & 0xFF)}.append(reason);
  };
  CHECK(is_close_payload(""));
  CHECK_FALSE(is_close_payload("\x03"));  // half a status code
  std::vector<unsigned> changes;          // codes at which the verdict is another one than for the code before
  bool allowed = false;
  for (unsigned code = 0; code < 0x10000; ++code)
    if (is_close_payload(payload(code)) != allowed) {
      allowed = !allowed;
      changes.push_back(code);
    }
  // RFC 6455 7.4.1: 1004 is reserved; 1005, 1006 and 1015 are never sent. 7.4.2: 3000 to 4999 belong to libraries and applications.
  CHECK(changes == std::vector<unsigned>{1000, 1004, 1007, 1014, 3000, 5000});
}

TEST_CASE("the reason of a close frame is UTF-8", "[http][R0.12]") {
  CHECK(is_close_payload("\x03\xE8the robot stops"));
  CHECK(is_close_payload("\x03\xE8\xC3\xB6 \xF0\x9F\xA4\x96"));
  CHECK(is_close_payload(std::string_view("\x03\xE8\0", 3)));
  for (const auto* const reason : {"\xC3", "\x80", "\xED\xA0\x80", "\xC0\x80", "ok \xF4\x90\x80\x80", "\xF0\x9F\xA4"})
    CHECK_FALSE(is_close_payload(std::string("\x03\xE8") + reason));
  CHECK_FALSE(is_close_payload("\x03\xEDthe code of a connection without a code"));
}
