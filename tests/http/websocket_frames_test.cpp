// SPDX-License-Identifier: Apache-2.0
#include "src/http/websocket_frames.hpp"

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <functional>
#include <iterator>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "src/http/websocket.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/websocket.hpp"

using namespace lrt;
using namespace lrt::test;
using http::WebSocketFrames;

namespace {

constexpr std::size_t all = std::numeric_limits<std::size_t>::max();

/// How bytes come and go.
struct Pace {
  std::size_t in = all;   ///< bytes of a receive()
  std::size_t out = all;  ///< bytes of a sent()
};
constexpr Pace paces[] = {{all, all}, {1, all}, {all, 1}, {1, 1}, {3, 2}};

std::string str(const Pace& pace) { return "in " + std::to_string(pace.in) + ", out " + std::to_string(pace.out); }

/// The bytes to write, joined.
std::string output_of(const WebSocketFrames& frames) {
  OutputParts parts;
  frames.add_output(parts);
  std::string bytes;
  for (std::size_t i = 0; i < parts.size(); ++i) bytes.append(static_cast<const char*>(parts.data()[i].iov_base), parts.data()[i].iov_len);
  return bytes;
}

/// Owns frames as the transport does, and holds them to the promises of their header at each step.
class Owner {
 public:
  explicit Owner(std::size_t limit = 4096, Pace pace = {}) : frames(std::make_unique<WebSocketFrames>(limit)), pace_(pace) { check(); }

  /// The client says this; as much of it is given as is wanted.
  void hear(std::string_view bytes) {
    input += bytes;
    go();
  }
  void hear(const Frame& frame) { hear(frame.bytes()); }
  void go() {
    for (;;) {
      while (auto message = frames->next()) {
        heard.push_back({message->bytes, message->text});
        check();
        if (echoes) replies_.push_back(std::make_shared<const std::string>(std::move(message->bytes)));
        if (hears_one) return;
      }
      check();
      if (!held && drain()) continue;
      if (frames->state() == WebSocketFrames::State::open && !frames->has_output() && !replies_.empty()) {
        frames->send(std::move(replies_.front()), heard[heard.size() - replies_.size()].second);
        replies_.erase(replies_.begin());
        check();
        continue;
      }
      if (input.empty() || !frames->wants_input()) return;
      const auto size = std::min(pace_.in, input.size());
      frames->receive(std::string(input.substr(0, size)));  // a copy, so that a later read is an error
      check();
      input.erase(0, size);
    }
  }
  void send(std::string bytes, bool text = true) {
    REQUIRE(frames->state() == WebSocketFrames::State::open);
    REQUIRE_FALSE(frames->has_output());
    frames->send(std::make_shared<const std::string>(std::move(bytes)), text);
    go();
  }
  void close(std::uint16_t code, std::string_view reason = {}) {
    frames->close(code, reason);
    go();
  }

  unsigned close_code() const {
    if (said.empty() || said.back().opcode != Frame::close) return 0;
    const auto& payload = said.back().payload;
    return payload.empty() ? 1005 : static_cast<unsigned char>(payload[0]) * 256U + static_cast<unsigned char>(payload[1]);
  }
  std::string close_reason() const { return said.back().payload.size() < 2 ? "" : said.back().payload.substr(2); }
  WebSocketFrames::State state() const { return frames->state(); }
  bool is_over() const { return state() == WebSocketFrames::State::closed; }

  std::unique_ptr<WebSocketFrames> frames;
  std::string input;                                ///< that was not wanted yet
  std::vector<std::pair<std::string, bool>> heard;  ///< messages, and whether each is text
  std::vector<Frame> said;                          ///< by the server
  bool held = false;                                ///< nothing leaves
  bool echoes = false;
  bool hears_one = false;  ///< message and does no more

 private:
  bool drain() {
    bool any = false;
    while (frames->has_output()) {
      const std::string output = output_of(*frames);
      const auto size = std::min(pace_.out, output.size());
      written_.append(output, 0, size);
      frames->sent(size);
      check();
      any = true;
    }
    std::string_view rest = written_;
    for (Frame frame; reader_.next(rest, frame);) said.push_back(frame);
    written_.erase(0, written_.size() - rest.size());
    if (is_over()) REQUIRE(written_.empty());  // no frame is cut
    return any;
  }
  /// States never go back; at the end there is nothing more to do.
  void check() {
    const auto state = frames->state();
    REQUIRE(state >= last_);
    REQUIRE((last_ != WebSocketFrames::State::closed || state == WebSocketFrames::State::closed));
    last_ = state;
    if (!is_over()) return;
    REQUIRE_FALSE(frames->has_output());
    REQUIRE_FALSE(frames->wants_input());
    REQUIRE_FALSE(frames->next());
    REQUIRE(frames->state() == state);
  }

  Pace pace_;
  FrameReader reader_;
  std::string written_;
  std::vector<std::shared_ptr<const std::string>> replies_;
  WebSocketFrames::State last_ = WebSocketFrames::State::open;
};

std::string text_of(std::size_t size) {
  std::string text(size, 'a');
  for (std::size_t i = 0; i < size; ++i) text[i] = static_cast<char>('a' + i % 23);
  return text;
}

Frame text(std::string payload) { return {Frame::text, std::move(payload)}; }
Frame part(unsigned opcode, std::string payload, bool fin) { return {opcode, std::move(payload), fin}; }
Frame closing(unsigned code, std::string_view reason = {}) { return {Frame::close, close_payload(code, reason)}; }

/// Ends with a close of that code, however the bytes come, after `messages` of the client were heard.
void refuses(const std::string& bytes, unsigned code, std::size_t messages = 0, std::size_t limit = 4096) {
  for (const auto& pace : paces) {
    INFO(str(pace));
    Owner owner(limit, pace);
    owner.hear(bytes);
    CHECK(owner.heard.size() == messages);
    REQUIRE(owner.close_code() == code);
    CHECK(owner.state() != WebSocketFrames::State::open);
    owner.hear(closing(code));
    CHECK(owner.said.size() == 1);
  }
}

}  // namespace

// --------------------------------------------------------------------------------------------------------------------- messages

TEST_CASE("the key of RFC 6455 1.3 is accepted with the value given there", "[transport][R0.12]") {
  CHECK(http::websocket_accept("dGhlIHNhbXBsZSBub25jZQ==") == "s3pPLMBiTxaQ9kYGzzhZRbK+xOo=");
  CHECK(http::websocket_accept("AAAAAAAAAAAAAAAAAAAAAA==") == accept_of("AAAAAAAAAAAAAAAAAAAAAA=="));
  const WebSocketFrames frames(100);
  CHECK(frames.state() == WebSocketFrames::State::open);
  CHECK(frames.wants_input());
  CHECK_FALSE(frames.has_output());
}

TEST_CASE("messages of all sizes come and go as they are", "[transport][R0.12]") {
  for (const auto& pace : paces)
    for (const std::size_t size : {0, 1, 5, 124, 125, 126, 127, 1535, 1536, 1537, 65535, 65536, 100000})
      for (const bool is_text : {true, false}) {
        INFO(str(pace) << ", " << size << " bytes");
        Owner owner(100000, pace);
        owner.echoes = true;
        owner.hear({is_text ? Frame::text : Frame::binary, text_of(size)});
        REQUIRE(owner.heard.size() == 1);
        REQUIRE((owner.heard[0].first == text_of(size)));
        CHECK(owner.heard[0].second == is_text);
        REQUIRE(owner.said.size() == 1);
        CHECK(owner.said[0].opcode == (is_text ? Frame::text : Frame::binary));
        CHECK(owner.said[0].fin);
        REQUIRE((owner.said[0].payload == text_of(size)));
        CHECK(owner.state() == WebSocketFrames::State::open);
        CHECK(owner.frames->wants_input());
      }
}

TEST_CASE("a mask of any kind is taken off", "[transport][R0.12]") {
  for (const std::uint32_t mask : {0U, 0xFFFFFFFFU, 0x01020304U, 0x80000000U}) {
    Owner owner;
    owner.hear(text("Hello").bytes(mask));
    REQUIRE(owner.heard.size() == 1);
    CHECK(owner.heard[0].first == "Hello");
  }
}

TEST_CASE("binary messages need not be UTF-8, and text may have every character", "[transport][R0.12]") {
  std::string bytes;
  for (int i = 0; i < 256; ++i) bytes += static_cast<char>(i);
  Owner owner;
  owner.echoes = true;
  owner.hear(Frame{Frame::binary, bytes});
  const std::string characters("\0\x7F\xC2\x80\xDF\xBF\xE0\xA0\x80\xED\x9F\xBF\xEE\x80\x80\xEF\xBF\xBF\xF0\x90\x80\x80\xF4\x8F\xBF\xBF", 26);
  owner.hear(text(characters));
  REQUIRE(owner.said.size() == 2);
  CHECK(owner.said[0].payload == bytes);
  CHECK(owner.said[1].payload == characters);
}

TEST_CASE("fragments are assembled, with pings between them", "[transport][R0.12]") {
  for (const auto& pace : paces) {
    INFO(str(pace));
    Owner owner(4096, pace);
    owner.hear(part(Frame::text, "Hel", false).bytes() + Frame{Frame::ping, "one"}.bytes() + part(Frame::continuation, "", false).bytes() +
               part(Frame::continuation, "lo", false).bytes() + Frame{Frame::pong, "unasked"}.bytes() + Frame{Frame::ping, ""}.bytes() +
               part(Frame::continuation, "!", true).bytes() + part(Frame::binary, "", false).bytes() + part(Frame::continuation, "", true).bytes());
    REQUIRE(owner.heard.size() == 2);
    CHECK(owner.heard[0].first == "Hello!");
    CHECK(owner.heard[0].second);
    CHECK(owner.heard[1].first.empty());
    CHECK_FALSE(owner.heard[1].second);
    REQUIRE(owner.said.size() == 2);
    CHECK(owner.said[0].opcode == Frame::pong);
    CHECK(owner.said[0].payload == "one");
    CHECK(owner.said[1].opcode == Frame::pong);
    CHECK(owner.said[1].payload.empty());
    CHECK(owner.state() == WebSocketFrames::State::open);
  }
}

TEST_CASE("a character may be cut by frames", "[transport][R0.12]") {
  const std::string characters = "\xCE\xBA\xE2\x82\xAC\xF0\x90\x8D\x88";
  for (const auto& pace : paces)
    for (std::size_t cut = 0; cut <= characters.size(); ++cut) {
      Owner owner(4096, pace);
      owner.hear(part(Frame::text, characters.substr(0, cut), false).bytes() + part(Frame::continuation, "", false).bytes() +
                 part(Frame::continuation, characters.substr(cut), true).bytes());
      REQUIRE(owner.heard.size() == 1);
      CHECK(owner.heard[0].first == characters);
    }
}

TEST_CASE("several messages that come at once are heard one by one, in order", "[transport][R0.12]") {
  std::string bytes;
  for (int i = 0; i < 300; ++i) bytes += text(std::to_string(i)).bytes();
  for (const auto& pace : paces) {
    INFO(str(pace));
    Owner owner(4096, pace);
    owner.echoes = true;
    owner.hear(bytes);
    REQUIRE(owner.heard.size() == 300);
    REQUIRE(owner.said.size() == 300);
    for (std::size_t i = 0; i < 300; ++i) {
      REQUIRE(owner.heard[i].first == std::to_string(i));
      REQUIRE(owner.said[i].payload == std::to_string(i));
    }
    CHECK(owner.frames->wants_input());
  }
}

TEST_CASE("messages that are not taken wait, and no input is wanted", "[transport][R0.12]") {
  Owner owner;
  owner.hears_one = true;
  owner.hear(text("a").bytes() + text("b").bytes() + Frame{Frame::ping, "p"}.bytes());
  CHECK(owner.heard.size() == 1);
  CHECK_FALSE(owner.frames->wants_input());
  owner.send("between");
  CHECK(owner.heard.size() == 2);
  owner.hears_one = false;
  owner.go();
  REQUIRE(owner.said.size() == 2);
  CHECK(owner.said[0].payload == "between");
  CHECK(owner.said[1].opcode == Frame::pong);
  CHECK(owner.frames->wants_input());
}

TEST_CASE("a large message is sent from where it is", "[transport][R0.12]") {
  Owner owner;
  const auto message = std::make_shared<const std::string>(text_of(100000));
  owner.frames->send(message, true);
  OutputParts output;
  owner.frames->add_output(output);
  REQUIRE(output.size() == 2);
  CHECK(output.data()[0].iov_len == 10);
  CHECK(output.data()[1].iov_base == message->data());
  CHECK(message.use_count() > 1);
  owner.go();
  CHECK(message.use_count() == 1);
  REQUIRE(owner.said.size() == 1);
  CHECK((owner.said[0].payload == *message));
}

TEST_CASE("messages are sent together, in their order, before a pong", "[transport][R0.12]") {
  for (const auto& pace : paces) {
    INFO(str(pace));
    Owner owner(4096, pace);
    owner.held = true;
    const std::vector<std::size_t> sizes{0, 1, 125, 126, 127, 65535, 65536, 70000};
    for (const std::size_t size : sizes) owner.frames->send(std::make_shared<const std::string>(text_of(size)), size % 2 == 0);
    if (pace.out == all) {
      OutputParts output;
      owner.frames->add_output(output);
      CHECK(output.size() == 2 * sizes.size() - 1);  // one message is empty
    }
    owner.hear(Frame{Frame::ping, "p"});
    owner.held = false;
    owner.go();
    REQUIRE(owner.said.size() == sizes.size() + 1);
    for (std::size_t i = 0; i < sizes.size(); ++i) {
      CHECK(owner.said[i].opcode == (sizes[i] % 2 == 0 ? Frame::text : Frame::binary));
      CHECK((owner.said[i].payload == text_of(sizes[i])));
    }
    CHECK(owner.said.back().opcode == Frame::pong);
  }
}

TEST_CASE("more messages than fit into one system call are sent by several", "[transport][R0.12]") {
  Owner owner;
  for (int i = 0; i < 100; ++i) owner.frames->send(std::make_shared<const std::string>(std::to_string(i)), true);
  OutputParts output;
  owner.frames->add_output(output);
  CHECK(output.size() == 64);
  owner.go();
  REQUIRE(owner.said.size() == 100);
  for (std::size_t i = 0; i < 100; ++i) CHECK(owner.said[i].payload == std::to_string(i));
  CHECK_FALSE(owner.frames->has_output());
}

TEST_CASE("output stays the same until a call or sent() changes it", "[transport][R0.12]") {
  Owner owner;
  owner.held = true;
  owner.send("0123456789");
  const std::string frame =
      "\x81\x0A"
      "0123456789";
  for (std::size_t left = frame.size(); left > 0; --left) {
    REQUIRE(output_of(*owner.frames) == frame.substr(frame.size() - left));
    REQUIRE(owner.state() == WebSocketFrames::State::open);
    owner.frames->sent(1);
  }
  CHECK_FALSE(owner.frames->has_output());
  owner.send("");
  CHECK(output_of(*owner.frames) == std::string("\x81\0", 2));
}

// ------------------------------------------------------------------------------------------------------------------------ limits

TEST_CASE("a message over the limit gets 1009", "[transport][R0.12]") {
  refuses(text(text_of(101)).bytes(), 1009, 0, 100);
  refuses(part(Frame::text, text_of(60), false).bytes() + part(Frame::continuation, text_of(41), true).bytes(), 1009, 0, 100);
  refuses(text(text_of(100)).bytes() + text(text_of(101)).bytes(), 1009, 1, 100);
  refuses(text("a").bytes() + text("ab").bytes(), 1009, 1, 1);
  refuses(text(text_of(65537)).bytes(), 1009, 0, 65536);
}

TEST_CASE("a length over the limit is refused before its bytes come", "[transport][R0.12]") {
  for (const std::uint64_t length : {std::uint64_t{101}, std::uint64_t{65535}, std::uint64_t{1} << 32, (std::uint64_t{1} << 63) - 1}) {
    INFO(length);
    Frame frame = text("");
    frame.length = length;
    refuses(frame.bytes(), 1009, 0, 100);
  }
}

TEST_CASE("a message of exactly the limit passes, in one frame or many", "[transport][R0.12]") {
  for (const auto& pace : paces) {
    Owner owner(10, pace);
    owner.hear(text("0123456789"));
    owner.hear(part(Frame::text, "01234", false));
    owner.hear(Frame{Frame::ping, text_of(125)});  // control frames do not count
    owner.hear(part(Frame::continuation, "56789", true));
    CHECK(owner.heard.size() == 2);
    CHECK(owner.state() == WebSocketFrames::State::open);
  }
}

// -------------------------------------------------------------------------------------------------------------------- violations

TEST_CASE("frames that break RFC 6455 5 get 1002", "[transport][R0.12]") {
  const auto refused = [&](const char* what, const std::string& bytes) {
    INFO(what);
    refuses(bytes, 1002);
    refuses(text("before").bytes() + bytes, 1002, 1);
    refuses(bytes + text("behind").bytes(), 1002);
  };
  Frame frame = text("Hello");
  frame.masked = false;
  refused("unmasked", frame.bytes());
  frame = {Frame::ping, ""};
  frame.masked = false;
  refused("unmasked ping", frame.bytes());
  for (const unsigned rsv : {1U, 2U, 4U, 7U}) {
    frame = text("Hello");
    frame.rsv = rsv;
    refused("reserved bits", frame.bytes());
    frame = {Frame::ping, "Hello"};
    frame.rsv = rsv;
    refused("reserved bits of a ping", frame.bytes());
  }
  for (const unsigned opcode : {3U, 4U, 5U, 6U, 7U, 11U, 12U, 13U, 14U, 15U}) {
    refused("reserved opcode", Frame{opcode, "Hello"}.bytes());
    refused("empty with a reserved opcode", Frame{opcode, ""}.bytes());
  }
  for (const unsigned opcode : {Frame::close, Frame::ping, Frame::pong}) {
    refused("fragmented control", part(opcode, opcode == Frame::close ? close_payload(1000) : "Hi", false).bytes());
    refused("long control", Frame{opcode, (opcode == Frame::close ? close_payload(1000) : "Hi") + text_of(124)}.bytes());
  }
  refused("continuation of nothing", part(Frame::continuation, "Hello", true).bytes());
  refused("continuation of nothing that goes on", part(Frame::continuation, "Hello", false).bytes());
  refused("continuation after the end", part(Frame::text, "", false).bytes() + part(Frame::continuation, "", false).bytes() + Frame{15, ""}.bytes());
  refused("a message within a message", part(Frame::text, "Hel", false).bytes() + text("lo").bytes());
  refused("a binary message within a message", part(Frame::text, "Hel", false).bytes() + Frame{Frame::binary, "lo"}.bytes());
}

TEST_CASE("a length with its highest bit set is refused", "[transport][R0.12]") {
  for (const auto& pace : paces) {
    Owner owner(100, pace);
    Frame frame = text("");
    frame.length = std::uint64_t{1} << 63;
    owner.hear(frame.bytes());
    CHECK((owner.close_code() == 1002 || owner.close_code() == 1009));
  }
}

TEST_CASE("text that is no UTF-8 gets 1007", "[transport][R0.12]") {
  for (const std::string wrong :
       {"\x80", "\xBF", "\xC0\x80", "\xC1\xBF", "\xC2", "\xC2\x41", "\xE0\x9F\xBF", "\xE2\x82", "\xE2\x28\xA1", "\xED\xA0\x80", "\xED\xBF\xBF",
        "\xF0\x8F\xBF\xBF", "\xF0\x90\x8D", "\xF4\x90\x80\x80", "\xF5\x80\x80\x80", "\xFE", "\xFF"}) {
    INFO(base64(wrong));
    REQUIRE_FALSE(is_utf8(wrong));
    refuses(text(wrong).bytes(), 1007);
    refuses(text("good").bytes() + text("gr\xC3\xBC\xC3\x9F" + wrong).bytes(), 1007, 1);
    refuses(part(Frame::text, wrong.substr(0, 1), false).bytes() + part(Frame::continuation, wrong.substr(1), true).bytes(), 1007);
    refuses(part(Frame::text, "a", false).bytes() + part(Frame::continuation, wrong, false).bytes() + part(Frame::continuation, "", true).bytes(),
            1007);
  }
  // before the message or the frame ends
  for (const std::string wrong : {"\xF4\x90", "\xE0\x9F", "\xED\xA0", "\xF0\x8F", "\xC1", "\xF5", "a\x80"}) {
    INFO(base64(wrong));
    refuses(part(Frame::text, wrong, false).bytes(), 1007);
    Frame frame = text(wrong);
    frame.length = 100;
    refuses(frame.bytes(), 1007);
  }
  // a character that the last frame does not complete, however empty that is
  for (const std::string cut : {"\xC3", "\xE2", "\xE2\x82", "\xF0", "\xF0\x90", "\xF0\x90\x8D"}) {
    INFO(base64(cut));
    refuses(part(Frame::text, "a" + cut, false).bytes() + part(Frame::continuation, "", true).bytes(), 1007);
    refuses(part(Frame::text, cut, false).bytes() + part(Frame::continuation, "", false).bytes() + part(Frame::continuation, "", true).bytes(), 1007);
    refuses(text("good").bytes() + part(Frame::text, cut, false).bytes() + part(Frame::continuation, "", true).bytes() + text("more").bytes(), 1007,
            1);
  }
}

// ----------------------------------------------------------------------------------------------------------------- ping and pong

TEST_CASE("a ping gets its payload", "[transport][R0.12]") {
  for (const auto& pace : paces)
    for (const std::size_t size : {0, 1, 124, 125}) {
      Owner owner(4, pace);
      owner.hear(Frame{Frame::ping, text_of(size)});
      REQUIRE(owner.said.size() == 1);
      CHECK(owner.said[0].opcode == Frame::pong);
      CHECK(owner.said[0].payload == text_of(size));
      CHECK(owner.frames->wants_input());
    }
}

TEST_CASE("the pong to a ping behind a message that has not been sent comes after it, and what follows waits", "[transport][R0.12]") {
  for (const auto& pace : paces) {
    INFO(str(pace));
    Owner owner(4096, pace);
    owner.held = true;
    owner.send("first");
    owner.hear(Frame{Frame::ping, "p"}.bytes() + text("x").bytes() + Frame{Frame::ping, "q"}.bytes());
    CHECK_FALSE(owner.frames->wants_input());
    CHECK(owner.said.empty());
    owner.held = false;
    owner.go();
    CHECK(owner.heard.size() == 1);
    REQUIRE(owner.said.size() == 3);
    CHECK(owner.said[0].payload == "first");
    CHECK(owner.said[1].payload == "p");
    CHECK(owner.said[2].payload == "q");
    CHECK(owner.input.empty());
    CHECK(owner.frames->wants_input());
  }
}

TEST_CASE("a client that pings and does not read makes nothing grow, and has its pongs when it reads", "[transport][R0.12]") {
  Owner owner;
  owner.send("first");
  owner.held = true;
  std::string bytes;
  for (int i = 0; i < 1000; ++i) bytes += Frame{Frame::ping, text_of(125)}.bytes();
  owner.hear(bytes.substr(0, bytes.size() / 2));
  owner.hear(bytes.substr(bytes.size() / 2));
  CHECK_FALSE(owner.frames->wants_input());
  CHECK_FALSE(owner.input.empty());
  CHECK(output_of(*owner.frames).size() <= 2 * 127);
  owner.held = false;
  owner.go();
  CHECK(owner.input.empty());
  REQUIRE(owner.said.size() == 1001);
  for (std::size_t i = 1; i < owner.said.size(); ++i) REQUIRE((owner.said[i].opcode == Frame::pong && owner.said[i].payload == text_of(125)));
}

TEST_CASE("unsolicited pongs are ignored", "[transport][R0.12]") {
  for (const auto& pace : paces) {
    Owner owner(4096, pace);
    owner.hear(Frame{Frame::pong, ""}.bytes() + Frame{Frame::pong, text_of(125)}.bytes() + text("x").bytes());
    CHECK(owner.heard.size() == 1);
    CHECK(owner.said.empty());
  }
}

TEST_CASE("a ping of ours is empty, and its pong is no message", "[transport][R0.12]") {
  for (const auto& pace : paces) {
    Owner owner(4096, pace);
    owner.frames->ping();
    CHECK(owner.frames->has_output());
    owner.hear(part(Frame::text, "a", false));
    REQUIRE(owner.said.size() == 1);
    CHECK(owner.said[0].opcode == Frame::ping);
    CHECK(owner.said[0].payload.empty());
    owner.hear(Frame{Frame::pong, ""}.bytes() + part(Frame::continuation, "b", true).bytes());
    REQUIRE(owner.heard.size() == 1);
    CHECK(owner.heard[0].first == "ab");
    owner.send("still there");
    CHECK(owner.said.size() == 2);
    CHECK(owner.state() == WebSocketFrames::State::open);
  }
}

// ----------------------------------------------------------------------------------------------------------------------- closing

TEST_CASE("a client's close gets its code, and then it is over", "[transport][R0.12]") {
  for (const auto& pace : paces)
    for (const unsigned code : {1000U, 1001U, 1002U, 1003U, 1007U, 1008U, 1009U, 1010U, 1011U, 3000U, 3999U, 4000U, 4999U})
      for (const std::string& reason : {std::string(), std::string("gr\xC3\xBC\xC3\x9F"), text_of(123)}) {
        INFO(str(pace) << ", " << code << " " << reason);
        Owner owner(4096, pace);
        owner.hear(text("last").bytes() + closing(code, reason).bytes());
        CHECK(owner.heard.size() == 1);
        CHECK(owner.close_code() == code);
        CHECK(owner.state() == WebSocketFrames::State::closed);
      }
}

TEST_CASE("a close without a code gets a close", "[transport][R0.12]") {
  for (const auto& pace : paces) {
    Owner owner(4096, pace);
    owner.hear(Frame{Frame::close, ""});
    CHECK((owner.close_code() == 1000 || owner.close_code() == 1005));
    CHECK(owner.state() == WebSocketFrames::State::closed);
  }
}

TEST_CASE("it is closing until the response to a close has been sent", "[transport][R0.12]") {
  Owner owner;
  owner.held = true;
  owner.hear(closing(1000));
  CHECK(owner.state() == WebSocketFrames::State::closing);
  for (auto left = output_of(*owner.frames).size(); left > 1; --left) owner.frames->sent(1);
  CHECK(owner.state() == WebSocketFrames::State::closing);
  owner.frames->sent(1);
  CHECK(owner.state() == WebSocketFrames::State::closed);
}

TEST_CASE("a close that must not be sent gets 1002", "[transport][R0.12]") {
  refuses(Frame{Frame::close, "\x03"}.bytes(), 1002);
  for (const unsigned code : {0U, 1U, 999U, 1004U, 1005U, 1006U, 1015U, 1016U, 2000U, 2999U, 5000U, 65535U}) {
    INFO(code);
    refuses(closing(code).bytes(), 1002);
    refuses(text("a").bytes() + closing(code, "reason").bytes(), 1002, 1);
  }
}

TEST_CASE("a close whose reason is no UTF-8 gets an error", "[transport][R0.12]") {
  for (const auto& pace : paces)
    for (const char* reason : {"\xFF", "a\xC3", "\xED\xA0\x80"}) {
      Owner owner(4096, pace);
      owner.hear(closing(1000, reason));
      CHECK((owner.close_code() == 1007 || owner.close_code() == 1002));  // RFC 6455 8.1, 7.1.7: the one or the other
      CHECK(owner.state() != WebSocketFrames::State::open);
    }
}

TEST_CASE("what comes behind a close is not read", "[transport][R0.12]") {
  for (const auto& pace : paces) {
    INFO(str(pace));
    Owner owner(4096, pace);
    owner.hear(closing(1000).bytes() + text("more").bytes() + Frame{Frame::ping, ""}.bytes() + Frame{15, ""}.bytes() + closing(1001).bytes());
    CHECK(owner.heard.empty());
    CHECK(owner.said.size() == 1);
    CHECK(owner.close_code() == 1000);
    CHECK(owner.state() == WebSocketFrames::State::closed);
  }
}

TEST_CASE("our close is complete when the client has closed", "[transport][R0.12]") {
  for (const auto& pace : paces)
    for (const std::string& answer : {closing(1000).bytes(), closing(4001, "bye").bytes(), Frame{Frame::close, ""}.bytes()}) {
      INFO(str(pace));
      Owner owner(4096, pace);
      owner.close(1001, "gr\xC3\xBC\xC3\x9F");
      CHECK(owner.close_code() == 1001);
      CHECK(owner.close_reason() == "gr\xC3\xBC\xC3\x9F");
      CHECK(owner.state() == WebSocketFrames::State::closing);
      CHECK(owner.frames->wants_input());
      owner.hear(answer);
      CHECK(owner.state() == WebSocketFrames::State::closed);
      CHECK(owner.said.size() == 1);
    }
}

TEST_CASE("a reason of our close has 123 bytes at most", "[transport][R0.12]") {
  Owner owner;
  owner.close(1011, text_of(123));
  CHECK(owner.close_reason() == text_of(123));
}

TEST_CASE("what a client still says after our close is dropped", "[transport][R0.12]") {
  for (const auto& pace : paces) {
    INFO(str(pace));
    Owner owner(4096, pace);
    owner.hear(part(Frame::text, "a", false));
    owner.hear(part(Frame::continuation, "not whole", false).bytes().substr(0, 9));
    owner.close(1001);
    owner.hear(part(Frame::continuation, "not whole", false).bytes().substr(9));
    owner.hear(part(Frame::continuation, "b", true).bytes() + text("c").bytes() + Frame{Frame::ping, "p"}.bytes() + Frame{Frame::pong, ""}.bytes() +
               Frame{Frame::binary, text_of(4000)}.bytes());
    CHECK(owner.heard.empty());
    CHECK(owner.said.size() == 1);
    CHECK(owner.state() == WebSocketFrames::State::closing);
    owner.hear(closing(1001));
    CHECK(owner.said.size() == 1);
    CHECK(owner.state() == WebSocketFrames::State::closed);
  }
}

TEST_CASE("what is wrong about a message that comes while our close waits makes no other close", "[transport][R0.12]") {
  for (const auto& pace : paces) {
    INFO(str(pace));
    Owner owner(4096, pace);
    owner.held = true;
    owner.send("message");
    owner.close(1001);
    owner.hear(part(Frame::text, "\xC3", false).bytes() + part(Frame::continuation, "", true).bytes());
    owner.held = false;
    owner.go();
    CHECK(owner.said.size() == 2);
    CHECK(owner.close_code() == 1001);
    CHECK(owner.state() == WebSocketFrames::State::closing);
    owner.hear(closing(1001));
    CHECK(owner.state() == WebSocketFrames::State::closed);
  }
}

TEST_CASE("messages that came before our close and were not taken are dropped", "[transport][R0.12]") {
  for (const auto& pace : paces) {
    Owner owner(4096, pace);
    owner.hears_one = true;
    owner.hear(text("a").bytes() + text("b").bytes() + text("c").bytes());
    CHECK(owner.heard.size() == 1);
    owner.hears_one = false;
    owner.close(1001);
    CHECK(owner.heard.size() == 1);
    owner.hear(closing(1001));
    CHECK(owner.state() == WebSocketFrames::State::closed);
  }
  WebSocketFrames frames(4096);
  frames.receive(text("a").bytes());
  frames.close(1001, {});
  CHECK_FALSE(frames.next());
}

TEST_CASE("our close comes after the message that is being sent", "[transport][R0.12]") {
  for (const auto& pace : paces) {
    INFO(str(pace));
    Owner owner(4096, pace);
    owner.held = true;
    owner.send(text_of(1000));
    owner.frames->sent(1);  // within the header
    owner.close(1001, "bye");
    owner.close(1011, "again");
    CHECK(owner.state() == WebSocketFrames::State::closing);
    std::string rest;
    while (owner.frames->has_output()) {
      const std::string output = output_of(*owner.frames);
      rest += output;
      owner.frames->sent(output.size());
    }
    rest.insert(0, "\x81");
    FrameReader reader;
    std::string_view view = rest;
    Frame message, close;
    REQUIRE(reader.next(view, message));
    REQUIRE(reader.next(view, close));
    CHECK(view.empty());
    CHECK(message.payload == text_of(1000));
    CHECK(close.payload == close_payload(1001, "bye"));
    owner.hear(closing(1001));
    CHECK(owner.state() == WebSocketFrames::State::closed);
    CHECK_FALSE(owner.frames->has_output());
  }
}

TEST_CASE("the response to a close that comes while a message is being sent comes after it", "[transport][R0.12]") {
  for (const auto& pace : paces) {
    INFO(str(pace));
    Owner owner(4096, pace);
    owner.held = true;
    owner.send("message");
    owner.hear(closing(1000));
    CHECK_FALSE(owner.is_over());
    owner.held = false;
    owner.go();
    REQUIRE(owner.said.size() == 2);
    CHECK(owner.said[0].payload == "message");
    CHECK(owner.close_code() == 1000);
    CHECK(owner.state() == WebSocketFrames::State::closed);
  }
}

TEST_CASE("the close after a violation while a message is being sent comes after it", "[transport][R0.12]") {
  for (const auto& pace : paces) {
    Owner owner(4096, pace);
    owner.held = true;
    owner.send("message");
    owner.hear(Frame{15, ""});
    owner.held = false;
    owner.go();
    REQUIRE(owner.said.size() == 2);
    CHECK(owner.said[0].payload == "message");
    CHECK(owner.close_code() == 1002);
    CHECK(owner.state() != WebSocketFrames::State::open);
  }
}

TEST_CASE("closes that cross make one close each", "[transport][R0.12]") {
  for (const auto& pace : paces) {
    INFO(str(pace));
    Owner owner(4096, pace);
    owner.held = true;
    owner.close(1001);
    owner.hear(closing(1000));
    CHECK_FALSE(owner.is_over());  // ours has not left
    owner.held = false;
    owner.go();
    CHECK(owner.said.size() == 1);
    CHECK(owner.close_code() == 1001);
    CHECK(owner.state() == WebSocketFrames::State::closed);
  }
  for (const auto& pace : paces) {  // the client's first, behind a message
    INFO(str(pace));
    Owner owner(4096, pace);
    owner.held = true;
    owner.send("message");
    owner.hear(closing(1000));
    owner.close(1001);
    owner.held = false;
    owner.go();
    CHECK(owner.said.size() == 2);
    CHECK((owner.close_code() == 1000 || owner.close_code() == 1001));
    CHECK(owner.state() == WebSocketFrames::State::closed);
  }
}

TEST_CASE("a ping behind our close gets no pong", "[transport][R0.12]") {
  for (const auto& pace : paces) {
    INFO(str(pace));
    Owner owner(4096, pace);
    owner.held = true;
    owner.send("message");
    owner.hear(Frame{Frame::ping, "p"});  // waits
    owner.close(1001);
    owner.held = false;
    owner.hear(closing(1001));
    CHECK(owner.close_code() == 1001);
    CHECK(owner.said.size() <= 3);
    CHECK(owner.state() == WebSocketFrames::State::closed);
  }
}

TEST_CASE("a violation after our close ends it without another", "[transport][R0.12]") {
  for (const auto& pace : paces) {
    INFO(str(pace));
    Owner owner(4096, pace);
    owner.close(1001);
    owner.hear(Frame{15, "x"}.bytes() + closing(1001).bytes());
    CHECK(owner.said.size() == 1);
    CHECK(owner.is_over());
  }
}

// ------------------------------------------------------------------------------------------------------------------------ the end

TEST_CASE("frames can be destroyed at any time, and others go on", "[transport][R0.12]") {
  const std::string script = Frame{Frame::ping, "p"}.bytes() + part(Frame::text, "Hel", false).bytes() + Frame{Frame::ping, ""}.bytes() +
                             part(Frame::continuation, "lo", true).bytes() + text("x").bytes() + text("y").bytes() + Frame{Frame::ping, "q"}.bytes() +
                             closing(1000, "reason").bytes() + text("behind").bytes();
  Owner other;
  for (const bool held : {false, true})
    for (const int act : {0, 1, 2, 3, 4})
      for (std::size_t size = 0; size <= script.size(); ++size) {
        Owner owner;
        owner.held = held;
        owner.hears_one = act == 1;
        owner.hear(script.substr(0, size / 2));
        const bool can_say = owner.state() == WebSocketFrames::State::open && !owner.frames->has_output();
        if (act == 2 && can_say) owner.send(text_of(100));
        if (act == 3 && can_say) owner.frames->ping();
        if (act == 4) owner.close(1001);
        owner.hear(script.substr(size / 2, size - size / 2));
        if (size % 3 == 0) owner.frames->sent(owner.frames->has_output() ? 1 : 0);
      }
  other.echoes = true;
  other.hear(text("still here"));
  REQUIRE(other.said.size() == 1);
  CHECK(other.said[0].payload == "still here");
}

TEST_CASE("frames of several WebSockets do not meet", "[transport][R0.12]") {
  std::vector<std::unique_ptr<Owner>> owners;
  for (std::size_t i = 0; i < 50; ++i) owners.push_back(std::make_unique<Owner>(4096, paces[i % 5]));
  for (int round = 0; round < 4; ++round)
    for (std::size_t i = 0; i < owners.size(); ++i) {
      if (i % 7 == 3) owners[i]->close(1001);
      if (i % 7 == 5) owners[i]->hear(Frame{15, ""});
      if (i % 7 < 3) owners[i]->hear(part(round == 0 ? Frame::text : Frame::continuation, std::to_string(i), round == 3));
    }
  for (std::size_t i = 0; i < owners.size(); ++i) {
    INFO(i);
    if (i % 7 == 3) CHECK(owners[i]->close_code() == 1001);
    if (i % 7 == 5) CHECK(owners[i]->close_code() == 1002);
    if (i % 7 >= 3) continue;
    const auto number = std::to_string(i);
    REQUIRE(owners[i]->heard.size() == 1);
    CHECK(owners[i]->heard[0].first == number + number + number + number);
  }
}

TEST_CASE("what is received and sent does not depend on how the bytes are cut", "[transport][R0.12]") {
  for (unsigned seed = 0; seed < 400; ++seed) {
    INFO("seed " << seed);
    std::mt19937 random(seed);
    const auto below = [&](unsigned n) { return static_cast<unsigned>(random() % n); };  // the same everywhere, unlike a distribution
    std::string script;
    for (unsigned i = 0, count = 1 + below(8); i < count; ++i) {
      static constexpr unsigned opcodes[] = {0, 0, 1, 1, 2, 8, 9, 9, 10, 11};
      Frame frame{opcodes[below(10)], text_of(below(4) == 0 ? below(300) : below(20)), below(3) != 0};
      if (frame.opcode == Frame::close && below(2) == 0) frame.payload = close_payload(1000 + below(16));
      if (frame.opcode >= Frame::close && below(8) != 0) frame.fin = true;
      if (below(20) == 0) frame.rsv = below(8);
      if (below(10) == 0) frame.payload += static_cast<char>(0x80 + below(128));
      script += frame.bytes();
    }
    if (below(4) == 0) script[below(static_cast<unsigned>(script.size()))] ^= static_cast<char>(1 << below(8));
    std::vector<std::pair<std::string, bool>> heard;
    std::vector<std::string> said;
    for (const auto& pace : paces) {
      INFO(str(pace));
      Owner owner(256, pace);
      owner.hear(script);
      std::vector<std::string> frames;
      for (const auto& frame : owner.said) frames.push_back(std::to_string(frame.opcode) + frame.payload);
      if (&pace == &paces[0]) heard = owner.heard, said = frames;
      REQUIRE((owner.heard == heard));
      REQUIRE((frames == said));
    }
  }
}

// ------------------------------------------------------------------------------------------------- what readers of frames differ in

TEST_CASE("a length in more bytes than it needs is refused", "[transport][R0.12]") {
  for (const auto& [size, bytes] : {std::pair<std::size_t, int>{0, 2}, {125, 2}, {0, 8}, {126, 8}, {65535, 8}}) {
    INFO(size << " in " << bytes);
    Frame frame = text(text_of(size));
    frame.length_bytes = bytes;
    refuses(text("good").bytes() + frame.bytes(), 1002, 1, 100000);
  }
  Owner owner(100000);
  for (const std::size_t size : {126, 65535, 65536}) owner.hear(text(text_of(size)));
  CHECK(owner.heard.size() == 3);
}

TEST_CASE("a pong may hold any bytes, whatever the last message was", "[transport][R0.12]") {
  const std::string no_text = "\xFF\xC0\x80\xF4";
  Owner owner;
  owner.hear(text("text").bytes() + Frame{Frame::pong, no_text}.bytes() + part(Frame::text, "\xE2\x82", false).bytes() +
             Frame{Frame::pong, no_text}.bytes() + part(Frame::continuation, "\xAC", true).bytes());
  REQUIRE(owner.heard.size() == 2);
  CHECK(owner.heard[1].first == "\xE2\x82\xAC");
  CHECK(owner.state() == WebSocketFrames::State::open);
}

TEST_CASE("close codes that were registered after RFC 6455 are echoed", "[transport][R0.12]") {
  for (const unsigned code : {1012U, 1013U}) {
    Owner owner;
    owner.hear(closing(code, "later"));
    CHECK(owner.close_code() == code);
    CHECK(owner.state() == WebSocketFrames::State::closed);
  }
}

TEST_CASE("half a close code is none, whatever follows it in memory", "[transport][R0.12]") {
  for (const char half : {'\x03', '\x0B', '\x0C', '\x10'}) refuses(Frame{Frame::close, std::string(1, half)}.bytes(), 1002);
}

TEST_CASE("a message of megabytes is one frame, and nothing of it is left behind", "[transport][R0.12]") {
  Owner owner(4 << 20);
  for (const std::size_t size : {std::size_t{300000}, std::size_t{3000001}}) {
    const auto message = text_of(size);
    owner.said.clear();
    owner.send(message, false);
    REQUIRE(owner.said.size() == 1);
    CHECK(owner.said[0].opcode == Frame::binary);
    CHECK((owner.said[0].payload == message));
    owner.heard.clear();
    owner.hear(text(message));
    REQUIRE(owner.heard.size() == 1);
    CHECK((owner.heard[0].first == message));
  }
  owner.close(1000);
  CHECK(owner.close_code() == 1000);
}

TEST_CASE("frames that are gone hold no descriptor, however they ended", "[transport][R0.12]") {
  const auto descriptors = [] {
    const std::filesystem::directory_iterator all_of_them("/proc/self/fd");
    return std::distance(begin(all_of_them), end(all_of_them));
  };
  Owner first;
  const auto before = descriptors();
  {
    Owner open, half, closed, refused, unsent, awaiting;
    half.hear(text("half").bytes().substr(0, 8));
    closed.hear(closing(1000));
    refused.hear(Frame{15, ""});
    unsent.frames->send(std::make_shared<const std::string>(text_of(1000000)), true);
    awaiting.close(1001);
    CHECK(closed.is_over());
    CHECK(refused.is_over());
  }
  CHECK(descriptors() == before);
}

TEST_CASE("frames leave SIGPIPE as the host has set it", "[transport]") {
  struct sigaction before {};
  struct sigaction mine {};
  mine.sa_handler = SIG_DFL;
  ::sigaction(SIGPIPE, &mine, &before);
  const WebSocketFrames frames(1000);
  CHECK(frames.state() == WebSocketFrames::State::open);
  struct sigaction after {};
  ::sigaction(SIGPIPE, nullptr, &after);
  CHECK(after.sa_handler == SIG_DFL);
  ::sigaction(SIGPIPE, &before, nullptr);
}

// ----------------------------------------------------------------------------------------------------------- the client's side

namespace {

using Side = WebSocketFrames::Side;

/// What `from` says reaches `to`, some bytes at a time. Returns the messages that `to` has got.
std::vector<std::pair<std::string, bool>> carry(WebSocketFrames& from, WebSocketFrames& to, std::size_t at_once, std::string* seen = nullptr) {
  std::vector<std::pair<std::string, bool>> heard;
  const auto take = [&] {
    while (auto message = to.next()) heard.emplace_back(std::move(message->bytes), message->text);
  };
  while (from.has_output()) {
    const std::string bytes = output_of(from).substr(0, at_once);
    from.sent(bytes.size());
    if (seen) *seen += bytes;
    take();
    if (to.wants_input()) to.receive(bytes);
    take();
  }
  return heard;
}

Frame of_server(unsigned opcode, std::string payload, bool fin = true) {
  Frame frame{opcode, std::move(payload), fin};
  frame.masked = false;
  return frame;
}

}  // namespace

TEST_CASE("a client and a server understand each other, some bytes at a time", "[transport][R0.12]") {
  for (const std::size_t at_once : {all, std::size_t{1}, std::size_t{3}, std::size_t{7}})
    for (const std::size_t size : {0, 1, 125, 126, 65535, 65536}) {
      INFO(at_once << " bytes at once of a message of " << size);
      if (at_once == 1 && size > 1000) continue;
      WebSocketFrames server(100'000), client(100'000, Side::client);
      const std::string message = text_of(size);
      for (const bool text : {true, false}) {
        std::string sent;
        client.send(std::make_shared<const std::string>(message), text);
        const auto at_server = carry(client, server, at_once, &sent);
        REQUIRE(at_server.size() == 1);
        CHECK((at_server[0] == std::make_pair(message, text)));
        CHECK((static_cast<unsigned char>(sent[1]) & 0x80U) != 0);
        server.send(std::make_shared<const std::string>(message), text);
        const auto at_client = carry(server, client, at_once);
        REQUIRE(at_client.size() == 1);
        CHECK((at_client[0] == std::make_pair(message, text)));
      }
      client.ping("payload");
      CHECK(carry(client, server, at_once).empty());
      CHECK(server.pings() == 1);
      CHECK(carry(server, client, at_once).empty());
      CHECK(client.remarks().pong == "payload");
      server.close(1001, "away");
      CHECK(carry(server, client, at_once).empty());
      CHECK(client.remarks().close ==
            "\x03\xE9"
            "away");
      CHECK(client.remarks().fault == 0);
      CHECK(carry(client, server, at_once).empty());
      CHECK(server.state() == WebSocketFrames::State::closed);
      CHECK(client.state() == WebSocketFrames::State::closed);
    }
}

TEST_CASE("each frame of a client has a mask of its own", "[transport]") {
  WebSocketFrames server(1000), client(1000, Side::client);
  std::string first, second;
  client.send(std::make_shared<const std::string>("the same text"), true);
  carry(client, server, all, &first);
  client.send(std::make_shared<const std::string>("the same text"), true);
  carry(client, server, all, &second);
  CHECK(first.size() == second.size());
  CHECK(first.substr(2, 4) != second.substr(2, 4));
  CHECK(first.find("the same text") == std::string::npos);
}

TEST_CASE("what a server may not send has a reason, and closes", "[transport][R0.12]") {
  Frame masked = of_server(Frame::text, "x"), reserved = of_server(Frame::text, "x"), long_form = of_server(Frame::text, "x");
  masked.masked = true;
  reserved.rsv = 4;
  const struct {
    std::string bytes;
    std::uint16_t code;
    const char* reason;
  } cases[] = {
      {masked.bytes(), 1002, "a frame of the server is masked (RFC 6455 5.1)"},
      {reserved.bytes(), 1002, "a reserved bit is set, and no extension was agreed on (RFC 6455 5.2)"},
      {of_server(5, "x").bytes(), 1002, "a frame has a reserved opcode (RFC 6455 5.2)"},
      {of_server(11, "x").bytes(), 1002, "a frame has a reserved opcode (RFC 6455 5.2)"},
      {of_server(Frame::ping, std::string(126, 'x')).bytes(), 1002, "a control frame is longer than 125 bytes or fragmented (RFC 6455 5.5)"},
      {of_server(Frame::continuation, "x").bytes(), 1002, "a message begins within another, or a continuation without one (RFC 6455 5.4)"},
      {of_server(Frame::text, "\xC3(").bytes(), 1007, "a text message is not UTF-8 (RFC 6455 5.6)"},
      {of_server(Frame::text, std::string(1001, 'x')).bytes(), 1009, "a message is too large"},
      {of_server(Frame::close, "\x03").bytes(), 1002, "a close has a code or a reason that may not be sent (RFC 6455 5.5.1, 7.4)"},
      {std::string("\x81\x7E\x00\x01x", 5), 1002, "a length does not have the fewest bytes (RFC 6455 5.2)"},
  };
  for (const auto& c : cases) {
    INFO(c.reason);
    WebSocketFrames client(1000, Side::client);
    client.receive(c.bytes);
    CHECK_FALSE(client.next());
    CHECK(client.remarks().fault == c.code);
    CHECK(std::string(client.remarks().reason) == c.reason);
    CHECK_FALSE(client.remarks().close);
    CHECK(client.has_output());
  }
}
