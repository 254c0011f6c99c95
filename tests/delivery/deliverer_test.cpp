// SPDX-License-Identifier: Apache-2.0
#include <lrt/delivery/deliverer.hpp>

#include <pthread.h>
#include <signal.h>

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <future>
#include <iostream>
#include <map>
#include <set>

#include "src/delivery/deliverer.hpp"
#include "tests/delivery/certificates.hpp"
#include "tests/delivery/compress.hpp"
#include "tests/delivery/receiver.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/odd_responses.hpp"
#include "tests/support/skip.hpp"

using namespace lrt;
using namespace lrt::test;
using namespace std::chrono_literals;
using delivery::Deliverer;
using subscription::CallbackOptions;
using subscription::Channel;
using subscription::DeliveryResult;
using subscription::Notification;

namespace {

constexpr auto max_wait = 60s;  // then the test fails

Notification notification(std::string url, std::string body = "<a> <b> <c>.\n", bool failed_before = false) {
  Notification result;
  result.url = std::move(url);
  result.fields.add("Content-Type", "text/turtle");
  result.body = std::make_shared<const std::string>(std::move(body));
  result.failed_before = failed_before;
  return result;
}

/// A receiver of its own for each channel.
std::string alone(Channel channel) { return std::to_string(static_cast<std::uint64_t>(channel)); }

/// Notifications by channel, and their results in the order of delivered().
class TestSource final : public delivery::Source {
 public:
  std::optional<Notification> next_notification(Channel channel) override {
    const std::lock_guard lock(mutex_);
    ++asked_;
    note_if_late();
    if (throws_) throw std::runtime_error("the robot is out of words");
    auto& line = lines_[channel];
    if (line.empty()) return std::nullopt;
    if (!at_work_.insert(channel).second) twice_ = true;
    most_ = std::max(most_, at_work_.size());
    Notification result = std::move(line.front());
    line.pop_front();
    return result;
  }
  void delivered(Channel channel, DeliveryResult result) noexcept override {
    Deliverer* again = nullptr;
    {
      const std::lock_guard lock(mutex_);
      note_if_late();
      at_work_.erase(channel);
      results_.emplace_back(channel, std::move(result));
      if (!lines_[channel].empty()) again = deliverer;
      changed_.notify_all();
    }
    if (again != nullptr) again->notify(channel, alone(channel));
  }

  void add(Channel channel, Notification n) {
    const std::lock_guard lock(mutex_);
    lines_[channel].push_back(std::move(n));
  }
  std::vector<std::pair<Channel, DeliveryResult>> wait_for(std::size_t n) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, max_wait, [&] { return results_.size() >= n; });
    return results_;
  }
  template <class Condition>
  bool wait_until(Condition condition) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, max_wait, [&] { return condition(results_); });
  }
  std::size_t asked() const {
    const std::lock_guard lock(mutex_);
    return asked_;
  }
  std::size_t at_work() const {
    const std::lock_guard lock(mutex_);
    return at_work_.size();
  }
  std::size_t most_at_work() const {
    const std::lock_guard lock(mutex_);
    return most_;
  }
  bool one_at_a_time() const {
    const std::lock_guard lock(mutex_);
    return !twice_;
  }
  void throw_from_now_on(bool on) {
    const std::lock_guard lock(mutex_);
    throws_ = on;
  }
  void has_stopped() {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
  }
  bool called_after_stop() const {
    const std::lock_guard lock(mutex_);
    return late_;
  }
  Deliverer* deliverer = nullptr;  ///< notified again when a channel has another notification

 private:
  void note_if_late() { late_ = late_ || stopped_; }

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::map<Channel, std::deque<Notification>> lines_;
  std::vector<std::pair<Channel, DeliveryResult>> results_;
  std::set<Channel> at_work_;
  std::size_t asked_ = 0, most_ = 0;
  bool throws_ = false, stopped_ = false, late_ = false, twice_ = false;
};

CallbackOptions loopback() {
  CallbackOptions options;
  options.allow = {"127.0.0.0/8", "::1"};
  options.connect_time = 20s;
  options.response_time = 40s;  // longer than any exchange here
  return options;
}

struct Rig {
  explicit Rig(CallbackOptions options = loopback(), delivery::Details details = {}) {
    deliverer = delivery::make_thread_deliverer(
                    source, options,
                    [this](LogLevel, std::string_view text) {
                      const std::lock_guard lock(mutex);
                      log.emplace_back(text);
                    },
                    std::move(details))
                    .value();
    source.deliverer = deliverer.get();
  }
  ~Rig() { stop(); }
  void stop() {
    deliverer->stop();
    source.has_stopped();
  }
  void post(Channel channel, Notification n) {
    source.add(channel, std::move(n));
    deliverer->notify(channel, alone(channel));
  }
  DeliveryResult deliver(Notification n) {
    constexpr Channel channel{1'000'000};  // one subscription: its connection is reused
    post(channel, std::move(n));
    ++delivered_;
    DeliveryResult result;
    const bool came = source.wait_until([&](const auto& results) {
      std::size_t seen = 0;
      for (const auto& r : results)
        if (r.first == channel && ++seen == delivered_) result = r.second;
      return seen >= delivered_;
    });
    if (!came) throw std::runtime_error("no result");
    return result;
  }

  TestSource source;
  std::mutex mutex;
  std::vector<std::string> log;
  std::unique_ptr<Deliverer> deliverer;

 private:
  std::size_t delivered_ = 0;  // by deliver()
};

bool says(const std::string& text, std::string_view part) { return text.find(part) != std::string::npos; }

std::size_t threads_of_this_process() {
  const std::filesystem::directory_iterator all("/proc/self/task");
  return static_cast<std::size_t>(std::distance(begin(all), end(all)));
}

template <class Condition>
bool comes_true(Condition condition) {
  const auto until = std::chrono::steady_clock::now() + max_wait;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > until) return false;
    std::this_thread::sleep_for(1ms);
  }
  return true;
}

/// A resolver that knows the names below "example".
Resolve resolves_to(std::vector<std::string> addresses) {
  return [addresses](const std::string& name) -> Result<std::vector<Address>> {
    if (name.find(".example") == std::string::npos) return resolve(name);
    std::vector<Address> result;
    for (const std::string& a : addresses) result.push_back(numeric_address(a).value());
    return result;
  };
}

}  // namespace

TEST_CASE("a notification is posted as it was given", "[delivery][R0.13]") {
  Recorder recorder(answer(200, "thank you"));
  const Receiver receiver(std::ref(recorder));
  Rig rig;
  Notification n = notification(receiver.url("127.0.0.1", "/a%20b/c?d=%2F&e"), "body \x01 of bytes");
  n.fields.add("ETag", "\"x\"");
  n.fields.add("Link", "<http://localhost/arm>; rel=\"about\"");
  n.fields.add("Link", "<http://localhost/arm/subscriptions/1>; rel=\"via\"");
  const DeliveryResult result = rig.deliver(std::move(n));
  CHECK(result.status == 200);
  CHECK(result.error.empty());
  CHECK_FALSE(result.refused);
  REQUIRE(recorder.requests().size() == 1);
  const std::string request = recorder.requests()[0];
  INFO(request);
  CHECK(request.rfind("POST /a%20b/c?d=%2F&e HTTP/1.1\r\n", 0) == 0);
  CHECK(says(request, "\r\nHost: 127.0.0.1:" + std::to_string(receiver.port()) + "\r\n"));
  CHECK(says(request, "\r\nContent-Type: text/turtle\r\n"));
  CHECK(says(request, "\r\nContent-Length: 15\r\n"));
  CHECK(says(request, "\r\nETag: \"x\"\r\n"));
  CHECK(says(request, "\r\nLink: <http://localhost/arm>; rel=\"about\"\r\nLink: <http://localhost/arm/subscriptions/1>; rel=\"via\"\r\n"));
  CHECK(says(request, "\r\n\r\nbody \x01 of bytes"));
  for (const char* unwanted : {"Accept-Encoding", "Transfer-Encoding", "Connection", "X-Hub-Signature", "Authorization", "Expect"}) {
    CHECK_FALSE(says(request, unwanted));
  }
}

TEST_CASE("a receiver is asked with a GET, and confirms with the challenge", "[delivery][R0.13][security]") {
  std::mutex mutex;
  std::string request, response;
  Receiver receiver([&](Peer& peer) {
    while (true) {
      const std::string one = peer.read_request();
      if (one.empty()) return;
      const std::lock_guard lock(mutex);
      request = one;
      peer.send(response);
    }
  });
  Rig rig;
  const auto confirmed = [&](const std::string& path, std::string_view text) {
    Notification question;
    question.url = receiver.url("127.0.0.1", path);
    question.secret = "key";
    question.challenge = "0f3b-77aa";
    question.query = "hub.mode=subscribe&hub.challenge=0f3b-77aa";
    {
      const std::lock_guard lock(mutex);
      response = text;
    }
    return rig.deliver(std::move(question));
  };
  CHECK(confirmed("/r", answer(200, "0f3b-77aa")).confirmed);
  CHECK(request.rfind("GET /r?hub.mode=subscribe&hub.challenge=0f3b-77aa HTTP/1.1\r\n", 0) == 0);
  CHECK(request.find("X-Hub-Signature") == std::string::npos);
  CHECK(confirmed("/r?a=b", answer(201, "0f3b-77aa\r\n")).confirmed);
  CHECK(request.rfind("GET /r?a=b&hub.mode=subscribe&", 0) == 0);
  for (const std::string& text :
       {answer(200), answer(204), answer(200, "0f3b-77ab"), answer(200, "0f3b-77aa0"), answer(200, " 0f3b-77aa"), answer(200, "0f3b-77aa\n0f3b-77aa"),
        answer(200, "0f3b-77aa" + std::string(9, ' ') + "x"), answer(404, "0f3b-77aa"), answer(302, "0f3b-77aa")}) {
    CAPTURE(text);
    CHECK_FALSE(confirmed("/r", text).confirmed);
  }
  Notification posted = notification(receiver.url(), "0f3b-77aa");
  {
    const std::lock_guard lock(mutex);
    response = answer(200, "0f3b-77aa");
  }
  CHECK_FALSE(rig.deliver(std::move(posted)).confirmed);
  CHECK(request.rfind("POST /hook HTTP/1.1", 0) == 0);
}

TEST_CASE("a secret signs the body and is not sent", "[delivery][R0.13]") {
  Recorder recorder;
  const Receiver receiver(std::ref(recorder));
  Rig rig;
  Notification n = notification(receiver.url(), "what do ya want for nothing?");  // RFC 4231 4.3
  n.secret = "Jefe";
  CHECK(rig.deliver(std::move(n)).status == 204);
  CHECK(says(recorder.requests().at(0), "\r\nX-Hub-Signature: sha256=5bdcc146bf60754e6a042426089575c75a003f089d2739839dec58b964ec3843\r\n"));
  CHECK_FALSE(says(recorder.requests().at(0), "Jefe"));
  n = notification("http://127.0.0.1:1/");
  n.secret = "Jefe";
  CHECK_FALSE(says(rig.deliver(std::move(n)).error, "Jefe"));
}

TEST_CASE("the status of every response is reported, and a redirect is not followed", "[delivery][R0.13][R0.16]") {
  Recorder elsewhere;
  const Receiver target(std::ref(elsewhere));
  Rig rig;
  for (const int status : {200, 201, 204, 301, 302, 307, 308, 401, 404, 407, 410, 429, 500, 503}) {
    INFO(status);
    Recorder recorder(answer(status, status == 204 ? "" : "words", "Location: " + target.url() + "\r\nWWW-Authenticate: Digest realm=\"a\"\r\n"));
    const Receiver receiver(std::ref(recorder));
    const DeliveryResult result = rig.deliver(notification(receiver.url()));
    CHECK(result.status == status);
    CHECK(result.error.empty());
    CHECK(recorder.requests().size() == 1);
  }
  CHECK(target.connections() == 0);
}

TEST_CASE("all framings of a response are read", "[delivery]") {
  struct Case {
    std::string name, bytes;
    bool keeps;
  };
  const std::vector<Case> cases{
      {"chunked", "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n5\r\nhello\r\n0\r\n\r\n", true},
      {"to the end", "HTTP/1.1 200 OK\r\n\r\nhello", false},
      {"close", "HTTP/1.1 200 OK\r\nContent-Length: 5\r\nConnection: close\r\n\r\nhello", false},
      {"close in capitals among others", "HTTP/1.1 200 OK\r\nContent-Length: 5\r\nConnection: x , Close\r\n\r\nhello", false},
      {"HTTP/1.0", "HTTP/1.0 200 OK\r\nContent-Length: 5\r\n\r\nhello", false},
      {"interim", "HTTP/1.1 100 Continue\r\n\r\nHTTP/1.1 204 No Content\r\n\r\n", true},
      {"without a reason", "HTTP/1.1 200\r\nContent-Length: 0\r\n\r\n", true},
      {"more than was announced", "HTTP/1.1 200 OK\r\nContent-Length: 5\r\n\r\nhelloHTTP/1.1 500 Later\r\n\r\n", false},
      {"204 with a length", "HTTP/1.1 204 No Content\r\nContent-Length: 5\r\n\r\n", false},
      {"compressed, which is nobody's business", "HTTP/1.1 200 OK\r\nContent-Encoding: gzip\r\nContent-Length: 5\r\n\r\nhello", true},
  };
  for (const Case& item : cases) {
    INFO(item.name);
    const Receiver receiver([&](Peer& peer) {
      while (!peer.read_request().empty()) {
        peer.send(item.bytes);
        if (item.name == "to the end") return;
      }
    });
    Rig rig;
    CHECK(rig.deliver(notification(receiver.url())).status / 100 == 2);
    CHECK(rig.deliver(notification(receiver.url())).status / 100 == 2);
    CHECK(receiver.connections() == (item.keeps ? 1 : 2));
  }
}

/// Sends an odd response to each request, and counts them.
Receiver::Serve odd_receiver(const OddResponse& odd, std::atomic<int>& requests) {
  return [&odd, &requests](Peer& peer) {
    while (!peer.read_request().empty()) {
      ++requests;
      const std::size_t piece = odd.is_byte_by_byte ? 1 : odd.bytes.size();
      for (std::size_t at = 0; at < odd.bytes.size(); at += piece) peer.send(std::string_view(odd.bytes).substr(at, piece));
      if (odd.closes) return;
    }
  };
}

TEST_CASE("a notification is delivered exactly once to a receiver that answers in an odd, valid way", "[delivery][R0.13]") {
  CHECK(odd_responses().size() >= 32);
  for (const OddResponse& odd : odd_responses()) {
    INFO(odd.name);
    std::atomic<int> requests{0};
    const Receiver receiver(odd_receiver(odd, requests));
    Rig rig;
    for (int i = 1; i <= 2; ++i) {
      const DeliveryResult result = rig.deliver(notification(receiver.url()));
      CHECK(result.status == odd.status);
      CHECK(result.error.empty());
      CHECK(requests == i);
    }
  }
}

TEST_CASE("a receiver that answers in a wrong way, or beyond a limit, gets a message of its own", "[delivery][security]") {
  for (const BadResponse& bad : bad_responses()) {
    if (says(bad.bytes, "Content-Encoding")) continue;  // the body of a response to a notification is not decoded
    INFO(bad.name);
    std::atomic<int> requests{0};
    const Receiver receiver([&](Peer& peer) {
      if (peer.read_request().empty()) return;
      ++requests;
      peer.send(bad.bytes);
    });
    Rig rig;
    const DeliveryResult result = rig.deliver(notification(receiver.url()));
    CHECK(result.status == 0);
    CHECK(says(result.error, bad.says));
    CHECK(requests == 1);
  }
}

TEST_CASE("a challenge may come back in a coding, behind interim responses", "[delivery][R0.13]") {
  const std::string coded = compress("0f3b-77aa");
  const std::string text =
      "HTTP/1.1 103 Early Hints\r\n\r\nHTTP/1.1 200 OK\r\nContent-Encoding: gzip\r\nContent-Length: " + std::to_string(coded.size()) + "\r\n\r\n" +
      coded;
  Recorder recorder(text);
  const Receiver receiver(std::ref(recorder));
  Rig rig;
  Notification question;
  question.url = receiver.url();
  question.challenge = "0f3b-77aa";
  question.query = "hub.challenge=0f3b-77aa";
  CHECK(rig.deliver(std::move(question)).confirmed);
}

TEST_CASE("a response with ambiguous framing is an error", "[delivery][security]") {
  for (const char* bytes : {"HTTP/1.1 200 OK\r\nContent-Length: 5\r\nContent-Length: 3\r\n\r\nhello",
                            "HTTP/1.1 200 OK\r\nContent-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n"}) {
    const Receiver receiver([&](Peer& peer) {
      while (!peer.read_request().empty()) peer.send(bytes);
    });
    Rig rig;
    CHECK(rig.deliver(notification(receiver.url())).status == 0);
    CHECK(rig.deliver(notification(receiver.url())).status == 0);
    CHECK(receiver.connections() == 2);
  }
}

TEST_CASE("surplus bytes of one subscription's receiver are not read as the response to another's notification", "[delivery][security]") {
  const Receiver receiver([&](Peer& peer) {
    std::string request = peer.read_request();
    const bool stray = request.find("POST /stray") == 0;
    while (!request.empty()) {
      peer.send("HTTP/1.1 200 OK\r\nContent-Length: 0\r\n\r\n");
      if (stray) peer.send("HTTP/1.1 410 Gone\r\nContent-Length: 0\r\n\r\n");
      request = peer.read_request();
    }
  });
  Rig rig;
  for (std::uint64_t i = 0; i < 50; ++i) rig.post(Channel{1 + i % 2}, notification(receiver.url() + (i % 2 == 0 ? "stray" : "good")));
  for (const auto& [channel, result] : rig.source.wait_for(50)) {
    if (channel == Channel{2}) CHECK(result.status == 200);
  }
}

TEST_CASE("a response may be as long as max_response_bytes and no longer", "[delivery]") {
  CallbackOptions options = loopback();
  options.max_response_bytes = 1000;
  Rig rig(options);
  Recorder longest(answer(200, std::string(1000, 'x'))), too_long(answer(200, std::string(1001, 'x')));
  const Receiver first(std::ref(longest)), second(std::ref(too_long));
  CHECK(rig.deliver(notification(first.url())).status == 200);
  const DeliveryResult result = rig.deliver(notification(second.url()));
  CHECK(result.status == 0);
  CHECK(says(result.error, "longer than 1000 bytes"));
}

TEST_CASE("many notifications are sent in order over one connection", "[delivery][R0.13]") {
  Recorder recorder;
  const Receiver receiver(std::ref(recorder));
  Rig rig;
  constexpr int count = 200;
  for (int i = 0; i < count; ++i) rig.source.add(Channel{1}, notification(receiver.url(), "number " + std::to_string(i)));
  rig.deliverer->notify(Channel{1}, alone(Channel{1}));
  CHECK(rig.source.wait_for(count).size() == count);
  const auto requests = recorder.requests();
  REQUIRE(requests.size() == count);
  for (std::size_t i = 0; i < count; ++i) CHECK(says(requests[i], "\r\n\r\nnumber " + std::to_string(i)));
  CHECK(receiver.connections() == 1);
  CHECK(rig.source.one_at_a_time());
}

TEST_CASE("an idle connection that the receiver has closed is replaced", "[delivery]") {
  const Receiver receiver([&](Peer& peer) {
    peer.read_request();
    peer.send(answer(204));
  });
  Rig rig;
  for (int i = 0; i < 5; ++i) CHECK(rig.deliver(notification(receiver.url())).status == 204);
}

TEST_CASE("if a reused connection closes without a response, the notification is sent once more on a new one", "[delivery]") {
  std::atomic<int> requests{0};
  const Receiver receiver([&](Peer& peer) {
    peer.read_request();
    ++requests;
    peer.send(answer(204));
    if (!peer.read_request().empty()) ++requests;  // closes without a response
  });
  Rig rig;
  CHECK(rig.deliver(notification(receiver.url())).status == 204);
  CHECK(rig.deliver(notification(receiver.url())).status == 204);
  CHECK(requests == 3);
  CHECK(receiver.connections() == 2);
}

TEST_CASE("an incomplete response on a reused connection, or none on a new one, is a failure and not retried", "[delivery]") {
  std::atomic<int> requests{0};
  const Receiver half([&](Peer& peer) {
    peer.read_request();
    peer.send(answer(204));
    if (peer.read_request().empty()) return;
    ++requests;
    peer.send("HTTP/1.1 2");
  });
  Rig rig;
  CHECK(rig.deliver(notification(half.url())).status == 204);
  const DeliveryResult cut = rig.deliver(notification(half.url()));
  CHECK(cut.status == 0);
  CHECK(says(cut.error, "before its response was complete"));
  CHECK(requests == 1);
  CHECK(half.connections() == 1);

  const Receiver none([&](Peer& peer) { peer.read_request(); });
  const DeliveryResult nothing = rig.deliver(notification(none.url()));
  CHECK(nothing.status == 0);
  CHECK(says(nothing.error, "without a response"));
  CHECK(none.connections() == 1);
}

TEST_CASE("a refused connection is a failure with a message", "[delivery]") {
  std::string url;
  {
    url = Receiver([](Peer&) {}).url();
  }
  Rig rig;
  const DeliveryResult result = rig.deliver(notification(url));
  CHECK(result.status == 0);
  CHECK_FALSE(result.refused);
  CHECK(says(result.error, "127.0.0.1"));
  CHECK(says(result.error, "refused"));
}

TEST_CASE("hostile receivers are dropped in time and after few bytes", "[delivery][R0.16]") {
  struct Case {
    std::string name;
    Receiver::Serve serve;
    std::string error;
    bool lasts = false;  ///< until it times out
  };
  const auto endless = [](std::string start, std::string rest) {
    return [start, rest](Peer& peer) {
      peer.read_request();
      std::string block;
      while (block.size() < 64 * 1024) block += rest;
      peer.send(start);
      while (peer.send(block)) {}
    };
  };
  const auto dripping = [](std::string start, std::string rest) {
    return [start, rest](Peer& peer) {
      peer.read_request();
      peer.send(start);
      peer.drip(rest);
    };
  };
  const auto saying = [](std::string text) {
    return [text](Peer& peer) {
      peer.read_request();
      peer.send(text);
    };
  };
  const std::string ok = "HTTP/1.1 200 OK\r\n";
  const std::vector<Case> cases{
      {"never reads", [](Peer& peer) { peer.hang_deaf(); }, "in time", true},
      {"never responds", [](Peer& peer) { peer.hang(); }, "did not respond in time", true},
      {"drips its header section", dripping("", ok + "X: y\r\n"), "timed out before it was complete", true},
      {"drips a line", dripping(ok + "X: ", "yyyyyyyy"), "timed out before it was complete", true},
      {"drips its body", dripping(ok + "Content-Length: 60000\r\n\r\n", "x"), "timed out before it was complete", true},
      {"drips chunks", dripping(ok + "Transfer-Encoding: chunked\r\n\r\n", "1\r\nx\r\n"), "timed out before it was complete", true},
      {"drips until it closes", dripping(ok + "\r\n", "x"), "timed out before it was complete", true},
      {"body without end", endless(ok + "\r\n", "x"), "longer than 65536"},
      {"body too long", endless(ok + "Content-Length: 99999999999\r\n\r\n", "x"), "longer than 65536"},
      {"chunks without end", endless(ok + "Transfer-Encoding: chunked\r\n\r\n", "1\r\nx\r\n"), "longer than 65536"},
      {"a chunk's size without end", endless(ok + "Transfer-Encoding: chunked\r\n\r\n", "0"), "too long"},
      {"fields without end", endless(ok, "X: y\r\n"), "more than 1000 fields"},
      {"long fields without end", endless(ok, "X: yyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyyy\r\n"), "header section"},
      {"a field without end", endless(ok + "X: ", "y"), "header section"},
      {"a status line without end", endless("HTTP/1.1 200 ", "y"), "status line"},
      {"status lines without end", endless("", "HTTP/1.1 100 Continue\r\n\r\n"), "more than 16 interim responses"},
      {"a long status line after an interim one", endless("HTTP/1.1 100 Continue\r\n\r\nHTTP/1.1 200 ", "y"), "status line"},
      {"noise without end", endless("", "y"), "not HTTP"},
      {"noise with lines", endless("", "y\r\n"), "not HTTP"},
      {"zeros", endless(std::string(1, '\0'), std::string(1, '\0')), "not HTTP"},
      {"closes at once", [](Peer&) {}, "without a response"},
      {"closes in its header section", saying(ok + "X: "), "before its response was complete"},
      {"closes in its body", saying(ok + "Content-Length: 10\r\n\r\nhalf"), "before its response was complete"},
      {"closes in a chunk", saying(ok + "Transfer-Encoding: chunked\r\n\r\n5\r\nhe"), "before its response was complete"},
      {"HTTP/2", saying("HTTP/2 200\r\n\r\n"), "not HTTP"},
      {"SSH", saying("SSH-2.0-OpenSSH_9.2\r\n"), "not HTTP"},
      {"early hints only", saying("HTTP/1.1 103 Early Hints\r\n\r\n"), "103"},
      {"a status of two digits", saying("HTTP/1.1 20 OK\r\n\r\n"), "not HTTP"},
      {"a bad chunk", saying(ok + "Transfer-Encoding: chunked\r\n\r\nzz\r\n"), "a chunk with the size \"zz\""},
  };
  for (const Case& item : cases) {
    INFO(item.name);
    const auto is_expected = [&](const std::string& error) { return says(error, item.error); };
    CallbackOptions options = loopback();
    options.response_time = item.lasts ? 300ms : 30s;
    DeliveryResult result;
    do {  // on a slow machine the time may be over before the first byte comes; then with more
      Rig rig(options);
      const Receiver receiver(item.serve);
      result = rig.deliver(notification(receiver.url(), std::string(item.name == "never reads" ? 20'000'000 : 100, 'b')));
      options.response_time *= 4;
    } while (item.lasts && !is_expected(result.error) && options.response_time < 30s);
    INFO(result.error);
    CHECK(result.status == 0);
    CHECK_FALSE(result.refused);
    CHECK(is_expected(result.error));
  }
}

TEST_CASE("a receiver that does not accept connections is dropped after connect_time", "[delivery]") {
  // A listener with a full queue does not respond to SYN.
  const int listener = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  REQUIRE(::bind(listener, reinterpret_cast<sockaddr*>(&address), size) == 0);
  REQUIRE(::listen(listener, 0) == 0);
  ::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size);
  std::vector<int> fill;
  for (int i = 0; i < 4; ++i) {
    fill.push_back(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    (void)::connect(fill.back(), reinterpret_cast<sockaddr*>(&address), size);
  }
  CallbackOptions options = loopback();
  options.connect_time = 100ms;
  Rig rig(options);
  const DeliveryResult result = rig.deliver(notification("http://127.0.0.1:" + std::to_string(ntohs(address.sin_port)) + "/"));
  CHECK(result.status == 0);
  CHECK(says(result.error, "timed out while connecting"));
  for (const int descriptor : fill) ::close(descriptor);
  ::close(listener);
}

TEST_CASE("localhost is resolved, and Host is that of the URL", "[delivery][R0.13]") {
  Recorder recorder;
  const Receiver receiver(std::ref(recorder));
  Rig rig;
  CHECK(rig.deliver(notification(receiver.url("LocalHost"))).status == 204);
  CHECK(says(recorder.requests().at(0), "\r\nHost: localhost:" + std::to_string(receiver.port()) + "\r\n"));
}

TEST_CASE("an IPv6 address is connected to, and Host has the brackets", "[delivery][R0.13]") {
  Recorder recorder;
  std::unique_ptr<Receiver> receiver;
  try {
    receiver = std::make_unique<Receiver>(std::ref(recorder), nullptr, AF_INET6);
  } catch (const std::runtime_error&) {
    print_skip("this machine has no IPv6 loopback");
    return;
  }
  Rig rig;
  CHECK(rig.deliver(notification(receiver->url("[::1]"))).status == 204);
  CHECK(says(recorder.requests().at(0), "\r\nHost: [::1]:" + std::to_string(receiver->port()) + "\r\n"));
}

TEST_CASE("of a name's addresses only allowed ones are connected to", "[delivery][R0.13][R0.16]") {
  Recorder recorder;
  const Receiver receiver(std::ref(recorder));
  CallbackOptions options = loopback();
  delivery::Details details;
  SECTION("the first that is allowed") {
    options.allow = {"receiver.example", "127.0.0.1"};
    details.look_up = resolves_to({"169.254.169.254", "127.0.0.2", "::1", "127.0.0.1"});
    Rig rig(options, details);
    CHECK(rig.deliver(notification(receiver.url("receiver.example"))).status == 204);
    CHECK(says(recorder.requests().at(0), "\r\nHost: receiver.example:"));
  }
  SECTION("the next, if the first does not accept") {
    options.allow = {"receiver.example", "127.0.0.0/8"};
    details.look_up = resolves_to({"127.0.0.2", "127.0.0.1"});
    Rig rig(options, details);
    CHECK(rig.deliver(notification(receiver.url("receiver.example"))).status == 204);
  }
  SECTION("none") {
    options.allow = {"receiver.example"};
    details.look_up = resolves_to({"127.0.0.1", "::ffff:127.0.0.1"});
    Rig rig(options, details);
    const DeliveryResult result = rig.deliver(notification(receiver.url("receiver.example")));
    CHECK(result.status == 0);
    CHECK(result.refused);
    CHECK(says(result.error, "127.0.0.1"));
    CHECK(receiver.connections() == 0);
  }
  SECTION("a name that was removed from the list") {
    options.allow = {"127.0.0.1"};
    details.look_up = resolves_to({"127.0.0.1"});
    Rig rig(options, details);
    CHECK(rig.deliver(notification(receiver.url("receiver.example"))).refused);
    CHECK(rig.deliver(notification("ftp://127.0.0.1/")).refused);
    CHECK(receiver.connections() == 0);
  }
  SECTION("no address at all") {
    options.allow = {"receiver.example"};
    details.look_up = [](const std::string&) -> Result<std::vector<Address>> {
      return unexpected(Errc::io_error, "no address of \"receiver.example\": try again");
    };
    Rig rig(options, details);
    const DeliveryResult result = rig.deliver(notification(receiver.url("receiver.example")));
    CHECK_FALSE(result.refused);
    CHECK(says(result.error, "try again"));
  }
  SECTION("a name is looked up for each connection") {
    options.allow = {"receiver.example", "127.0.0.1"};
    auto times = std::make_shared<std::atomic<int>>(0);
    details.look_up = [times](const std::string&) -> Result<std::vector<Address>> {
      return std::vector<Address>{numeric_address((*times)++ == 0 ? "127.0.0.1" : "127.0.0.9").value()};
    };
    const Receiver closing([](Peer& peer) {
      peer.read_request();
      peer.send(answer(204, "", "Connection: close\r\n"));
    });
    Rig rig(options, details);
    CHECK(rig.deliver(notification(closing.url("receiver.example"))).status == 204);
    CHECK(rig.deliver(notification(closing.url("receiver.example"))).refused);  // rebound in between
    CHECK(closing.connections() == 1);
  }
}

namespace {

struct Https {
  Certificate authority = make_certificate({"Test authority", "", -3600, 3600, true});
  PemFile trusted{authority};
  CallbackOptions options = loopback();
  delivery::Details details;
  Recorder recorder;

  Https() {
    options.allow = {"127.0.0.1", "receiver.example", ".robots.example"};
    options.ca_file = trusted.path();
    details.look_up = resolves_to({"127.0.0.1"});
  }
};

}  // namespace

TEST_CASE("https accepts a certificate for the host from a trusted authority", "[delivery][R0.13][R0.16]") {
  const Https https;
  const Certificate& authority = https.authority;
  const Certificate stranger = make_certificate({"Other authority", "", -3600, 3600, true});
  struct Case {
    std::string name;
    CertificateText text;
    const Certificate* issuer;
    std::string host, error;
  };
  const std::vector<Case> cases{
      {"a name", {"x", "DNS:receiver.example"}, &authority, "receiver.example", ""},
      {"a name, dot at the end", {"x", "DNS:receiver.example"}, &authority, "receiver.example.", ""},
      {"localhost", {"x", "DNS:localhost"}, &authority, "localhost", ""},
      {"a wildcard", {"x", "DNS:*.robots.example"}, &authority, "a.robots.example", ""},
      {"an address", {"x", "IP:127.0.0.1"}, &authority, "127.0.0.1", ""},
      {"another name", {"receiver.example", "DNS:other.example"}, &authority, "receiver.example", "hostname mismatch"},
      {"a name for an address", {"x", "DNS:127.0.0.1"}, &authority, "127.0.0.1", "IP address mismatch"},
      {"another address", {"127.0.0.1", "IP:127.0.0.2"}, &authority, "127.0.0.1", "IP address mismatch"},
      {"a wildcard for too much", {"x", "DNS:*.example"}, &authority, "receiver.example", "hostname mismatch"},
      {"a wildcard for two labels", {"x", "DNS:*.robots.example"}, &authority, "a.b.robots.example", "hostname mismatch"},
      {"a wildcard within a label", {"x", "DNS:a*.robots.example"}, &authority, "ab.robots.example", "hostname mismatch"},
      {"expired", {"x", "DNS:localhost", -7200, -3600}, &authority, "localhost", "expired"},
      {"not yet valid", {"x", "DNS:localhost", 3600, 7200}, &authority, "localhost", "not yet valid"},
      {"of a stranger", {"x", "DNS:localhost"}, &stranger, "localhost", "certificate is not accepted"},
      {"self-signed", {"x", "DNS:localhost"}, nullptr, "localhost", "self-signed"},
  };
  for (const Case& item : cases) {
    INFO(item.name);
    const TlsContext context = tls_server(make_certificate(item.text, item.issuer));
    Recorder recorder;
    const Receiver receiver(std::ref(recorder), context.get());
    Rig rig(https.options, https.details);
    const DeliveryResult result = rig.deliver(notification(receiver.url(item.host)));
    INFO(result.error);
    CHECK(result.status == (item.error.empty() ? 204 : 0));
    CHECK(says(result.error, item.error));
    if (item.error.empty()) {
      CHECK(rig.deliver(notification(receiver.url(item.host), std::string(300'000, 'x'))).status == 204);
      CHECK(receiver.connections() == 1);
      CHECK(says(recorder.requests().at(1), std::string(300'000, 'x')));
    } else {
      CHECK(recorder.requests().empty());
    }
  }
}

TEST_CASE("https without ca_file trusts the system's authorities only", "[delivery][R0.16]") {
  Https https;
  https.options.ca_file.clear();
  const TlsContext context = tls_server(make_certificate({"x", "DNS:localhost"}, &https.authority));
  const Receiver receiver(std::ref(https.recorder), context.get());
  Rig rig(https.options, https.details);
  CHECK(says(rig.deliver(notification(receiver.url("localhost"))).error, "certificate is not accepted"));
  CHECK(https.recorder.requests().empty());
}

TEST_CASE("SNI is a name and never an address", "[delivery]") {
  struct Names {
    std::mutex mutex;
    std::vector<std::string> list;
  } names;
  Https https;
  const TlsContext context = tls_server(make_certificate({"x", "DNS:receiver.example,IP:127.0.0.1"}, &https.authority));
  SSL_CTX_set_tlsext_servername_arg(context.get(), &names);
  SSL_CTX_set_tlsext_servername_callback(
      context.get(), +[](SSL* ssl, int*, void* to) {
        auto& found = *static_cast<Names*>(to);
        const char* const name = SSL_get_servername(ssl, TLSEXT_NAMETYPE_host_name);
        const std::lock_guard lock(found.mutex);
        found.list.emplace_back(name != nullptr ? name : "(none)");
        return SSL_TLSEXT_ERR_OK;
      });
  const Receiver receiver(std::ref(https.recorder), context.get());
  Rig rig(https.options, https.details);
  CHECK(rig.deliver(notification(receiver.url("receiver.example"))).status == 204);
  CHECK(rig.deliver(notification(receiver.url("127.0.0.1"))).status == 204);
  const std::lock_guard lock(names.mutex);
  CHECK(names.list == std::vector<std::string>{"receiver.example", "(none)"});
}

TEST_CASE("a server with HTTP/2 and HTTP/1.1 on a port is told to use HTTP/1.1", "[delivery]") {
  struct Protocols {
    std::mutex mutex;
    std::string offered;
  } protocols;
  Https https;
  const TlsContext context = tls_server(make_certificate({"x", "IP:127.0.0.1"}, &https.authority));
  SSL_CTX_set_alpn_select_cb(
      context.get(),
      +[](SSL*, const unsigned char** chosen, unsigned char* size, const unsigned char* in, unsigned in_size, void* to) {
        auto& found = *static_cast<Protocols*>(to);
        const std::lock_guard lock(found.mutex);
        found.offered.assign(in, in + in_size);
        *chosen = in + 1;
        *size = in[0];
        return SSL_TLSEXT_ERR_OK;
      },
      &protocols);
  const Receiver receiver(std::ref(https.recorder), context.get());
  Rig rig(https.options, https.details);
  CHECK(rig.deliver(notification(receiver.url("127.0.0.1"))).status == 204);
  const std::lock_guard lock(protocols.mutex);
  CHECK(protocols.offered == "\x08http/1.1");
}

TEST_CASE("TLS 1.1 is too old", "[delivery]") {
  Https https;
  const TlsContext context = tls_server(make_certificate({"x", "DNS:localhost"}, &https.authority), TLS1_1_VERSION);
  const Receiver receiver(std::ref(https.recorder), context.get());
  Rig rig(https.options, https.details);
  const DeliveryResult result = rig.deliver(notification(receiver.url("localhost")));
  INFO(result.error);
  CHECK(result.status == 0);
  CHECK(says(result.error, "TLS: "));
  CHECK(says(result.error, "version"));
}

TEST_CASE("receivers that fail in TLS", "[delivery][R0.16]") {
  const auto tried = [](const Receiver& receiver, std::chrono::milliseconds connect_time) {
    CallbackOptions options = loopback();
    options.connect_time = connect_time;
    Rig rig(options);
    const DeliveryResult result = rig.deliver(notification("https://127.0.0.1:" + std::to_string(receiver.port()) + "/"));
    CHECK(result.status == 0);
    return result.error;
  };
  CHECK(says(tried(Receiver([](Peer& peer) { peer.hang(); }), 500ms), "handshake timed out"));
  CHECK(says(tried(Receiver([](Peer& peer) { peer.drip(std::string("\x16\x03\x03\x3f\xff\x02\x00\x3f\xf0", 9) + std::string(10'000, 'x')); }), 500ms),
             "handshake timed out"));
  CHECK(says(tried(Receiver([](Peer&) {}), 30s), "TLS: "));
  CHECK(says(tried(Receiver([](Peer& peer) {
                     peer.send("HTTP/1.1 400 Bad Request\r\n\r\n");
                     peer.hang();
                   }),
                   30s),
             "TLS: "));
}

TEST_CASE("a broken TLS connection raises no signal in this program", "[delivery]") {
  // SIGPIPE has its default action here: it ends the program.
  Https https;
  const TlsContext context = tls_server(make_certificate({"x", "IP:127.0.0.1"}, &https.authority));
  const Receiver receiver(
      [](Peer& peer) {  // resets the connection in the middle of a long request
        const linger hard{1, 0};
        ::setsockopt(peer.descriptor(), SOL_SOCKET, SO_LINGER, &hard, sizeof hard);
      },
      context.get());
  Rig rig(https.options);
  for (int i = 0; i < 5; ++i) {
    const DeliveryResult result = rig.deliver(notification(receiver.url(), std::string(16'000'000, 'x')));
    CHECK(result.status == 0);
    CHECK_FALSE(result.error.empty());
  }
}

TEST_CASE("hanging receivers that failed before do not delay others", "[delivery][R0.16]") {
  const Receiver hanging([](Peer& peer) { peer.hang(); });
  Recorder recorder;
  const Receiver good(std::ref(recorder));
  CallbackOptions options = loopback();
  options.max_threads = 4;
  options.response_time = 10min;  // longer than the test waits
  Rig rig(options);
  for (std::uint64_t i = 1; i <= 40; ++i) rig.post(Channel{i}, notification(hanging.url(), "x", true));
  for (std::uint64_t i = 101; i <= 200; ++i) rig.post(Channel{i}, notification(good.url()));
  CHECK(rig.source.wait_for(100).size() == 100);
  CHECK(recorder.requests().size() == 100);
  CHECK(comes_true([&] { return hanging.connections() == 2; }));  // half of four
}

TEST_CASE("a receiver that just failed is served from the queue of slow receivers", "[delivery]") {
  std::atomic<bool> works{false};
  const Receiver sick([&](Peer& peer) {
    while (!peer.read_request().empty()) peer.send(works ? answer(204) : answer(500));
  });
  auto hanging = std::make_unique<Receiver>([](Peer& peer) { peer.hang(); });
  CallbackOptions options = loopback();
  options.max_threads = 2;
  options.response_time = 10min;  // longer than the test waits
  Rig rig(options);
  rig.post(Channel{1}, notification(sick.url()));
  CHECK(rig.source.wait_for(1).at(0).second.status == 500);
  rig.post(Channel{2}, notification(hanging->url(), "x", true));
  rig.post(Channel{3}, notification(hanging->url(), "x", true));
  works = true;
  rig.post(Channel{1}, notification(sick.url()));
  CHECK(comes_true([&] { return hanging->connections() == 1; }));
  hanging.reset();  // closes its connections
  CHECK(rig.source.wait_until([](const auto& results) {
    return std::any_of(results.begin(), results.end(), [](const auto& r) { return r.first == Channel{1} && r.second.status == 204; });
  }));
  CHECK(rig.source.wait_for(4).size() == 4);
}

TEST_CASE("one hanging receiver with many subscriptions leaves threads for others", "[delivery]") {
  const Receiver hanging([](Peer& peer) { peer.hang(); });
  Recorder recorder;
  const Receiver good(std::ref(recorder));
  CallbackOptions options = loopback();
  options.max_threads = 8;
  Rig rig(options);
  for (std::uint64_t i = 1; i <= 100; ++i) {
    rig.source.add(Channel{i}, notification(hanging.url()));
    rig.deliverer->notify(Channel{i}, "hanging");
  }
  REQUIRE(comes_true([&] { return hanging.connections() == 2; }));  // a quarter of eight
  for (std::uint64_t i = 101; i <= 150; ++i) {
    rig.source.add(Channel{i}, notification(good.url()));
    rig.deliverer->notify(Channel{i}, "good");
  }
  CHECK(rig.source.wait_for(50).size() == 50);
  CHECK(hanging.connections() == 2);
}

TEST_CASE("at most max_threads exchanges run at once, and one for each channel", "[delivery]") {
  Recorder recorder;
  const Receiver receiver(std::ref(recorder));
  CallbackOptions options = loopback();
  options.max_threads = 3;
  Rig rig(options);
  constexpr std::uint64_t channels = 30;
  constexpr int each = 10;
  for (std::uint64_t i = 1; i <= channels; ++i) {
    for (int k = 0; k < each; ++k) rig.source.add(Channel{i}, notification(receiver.url()));
  }
  std::vector<std::thread> hosts;
  for (int t = 0; t < 3; ++t) {
    hosts.emplace_back([&] {
      for (int k = 0; k < each; ++k) {
        for (std::uint64_t i = 1; i <= channels; ++i) rig.deliverer->notify(Channel{i}, alone(Channel{i}));
      }
    });
  }
  for (std::thread& host : hosts) host.join();
  CHECK(rig.source.wait_for(channels * each).size() == channels * each);
  CHECK(rig.source.one_at_a_time());
  CHECK(rig.source.most_at_work() <= 3);
  CHECK(static_cast<std::uint64_t>(receiver.connections()) <= channels);  // one each
}

TEST_CASE("a channel that is notified during its exchange is fetched again", "[delivery]") {
  std::promise<void> arrived, go;
  std::atomic<int> requests{0};
  const Receiver receiver([&](Peer& peer) {
    while (!peer.read_request().empty()) {
      if (requests++ == 0) {
        arrived.set_value();
        go.get_future().wait();
      }
      peer.send(answer(204));
    }
  });
  Rig rig;
  rig.source.deliverer = nullptr;
  rig.post(Channel{1}, notification(receiver.url()));
  REQUIRE(arrived.get_future().wait_for(max_wait) == std::future_status::ready);
  rig.post(Channel{1}, notification(receiver.url()));
  go.set_value();
  CHECK(rig.source.wait_for(2).size() == 2);
  CHECK(rig.source.one_at_a_time());
}

TEST_CASE("threads start on demand and end when idle, and connections close with them", "[delivery]") {
  std::atomic<int> open{0};
  const Receiver receiver([&](Peer& peer) {
    ++open;
    while (!peer.read_request().empty()) peer.send(answer(204));
    --open;
  });
  delivery::Details details;
  details.idle_time = 1ms;
  details.kept_time = 5ms;
  const std::size_t before = threads_of_this_process();
  Rig rig(loopback(), details);
  CHECK(threads_of_this_process() == before);
  for (std::uint64_t i = 1; i <= 20; ++i) rig.post(Channel{i}, notification(receiver.url()));
  CHECK(rig.source.wait_for(20).size() == 20);
  CHECK(comes_true([&] { return open == 0; }));
  // The receiver's own threads for its connections are finished, not joined: /proc does not list them.
  CHECK(comes_true([&] { return threads_of_this_process() <= before; }));
  CHECK(rig.deliver(notification(receiver.url())).status == 204);
}

TEST_CASE("signals are delivered to the host's threads only", "[delivery]") {
  sigset_t mine;
  ::pthread_sigmask(SIG_SETMASK, nullptr, &mine);
  std::atomic<bool> blocked{false};
  delivery::Details details;
  details.look_up = [&](const std::string& name) {
    sigset_t set;
    ::pthread_sigmask(SIG_SETMASK, nullptr, &set);
    blocked = sigismember(&set, SIGPIPE) == 1 && sigismember(&set, SIGTERM) == 1 && sigismember(&set, SIGINT) == 1 && sigismember(&set, SIGSEGV) == 0;
    return resolve(name);
  };
  Recorder recorder;
  const Receiver receiver(std::ref(recorder));
  Rig rig(loopback(), details);
  CHECK(rig.deliver(notification(receiver.url("localhost"))).status == 204);
  CHECK(blocked);
  sigset_t after;
  ::pthread_sigmask(SIG_SETMASK, nullptr, &after);
  for (const int signal : {SIGPIPE, SIGTERM, SIGINT}) CHECK(sigismember(&mine, signal) == sigismember(&after, signal));
}

TEST_CASE("a source that throws or has no notification does no harm", "[delivery]") {
  Recorder recorder;
  const Receiver receiver(std::ref(recorder));
  Rig rig;
  rig.deliverer->notify(Channel{1}, alone(Channel{1}));  // nothing
  CHECK(comes_true([&] { return rig.source.asked() == 1; }));
  rig.source.throw_from_now_on(true);
  rig.deliverer->notify(Channel{2}, alone(Channel{2}));
  CHECK(comes_true([&] { return rig.source.asked() == 2; }));
  rig.source.throw_from_now_on(false);
  CHECK(rig.deliver(notification(receiver.url())).status == 204);
  rig.post(Channel{2}, notification(receiver.url()));
  CHECK(rig.source.wait_for(2).size() == 2);
  const std::lock_guard lock(rig.mutex);
  REQUIRE(rig.log.size() == 1);
  CHECK(says(rig.log[0], "out of words"));
}

namespace {

/// A resolver in which names with "hangs" wait until it is released or destroyed. Others are at 127.0.0.1.
class HangingResolver {
 public:
  ~HangingResolver() { release(); }
  void release() {
    if (!std::exchange(released_, true)) gate_.set_value();
  }
  Resolve resolve() {
    return [open = open_, calls = calls_](const std::string& name) -> Result<std::vector<Address>> {
      {
        const std::lock_guard lock(calls->mutex);
        calls->names.push_back(name);
      }
      if (says(name, "hangs")) open.wait();
      if (says(name, "nowhere")) return unexpected(Errc::io_error, "no address of \"" + name + "\"");
      return std::vector<Address>{numeric_address("127.0.0.1").value()};
    };
  }
  /// How often names with this part were resolved.
  std::size_t calls(std::string_view part) const {
    const std::lock_guard lock(calls_->mutex);
    return static_cast<std::size_t>(std::count_if(calls_->names.begin(), calls_->names.end(), [&](const std::string& n) { return says(n, part); }));
  }

 private:
  struct Calls {
    std::mutex mutex;
    std::vector<std::string> names;
  };
  bool released_ = false;
  std::promise<void> gate_;
  std::shared_future<void> open_ = gate_.get_future().share();
  std::shared_ptr<Calls> calls_ = std::make_shared<Calls>();
};

CallbackOptions with_names() {
  CallbackOptions options = loopback();
  options.allow = {"127.0.0.1", ".example", ".test"};
  options.resolve_time = 10min;  // longer than the test waits
  return options;
}

}  // namespace

TEST_CASE("names that hang in the resolver do not delay receivers with an address, nor names of other domains", "[delivery][attack]") {
  HangingResolver resolver;
  Recorder recorder;
  const Receiver good(std::ref(recorder));
  CallbackOptions options = with_names();
  options.max_threads = 4;
  options.max_resolver_threads = 4;
  delivery::Details details;
  details.look_up = resolver.resolve();
  Rig rig(options, details);
  for (std::uint64_t i = 1; i <= 40; ++i) rig.post(Channel{i}, notification(good.url("hangs" + std::to_string(i) + ".one.example")));
  REQUIRE(comes_true([&] { return resolver.calls("hangs") == 2; }));  // half of four
  for (std::uint64_t i = 101; i <= 150; ++i) rig.post(Channel{i}, notification(good.url(i % 2 == 0 ? "127.0.0.1" : "good.test")));
  CHECK(rig.source.wait_for(50).size() == 50);
  CHECK(resolver.calls("hangs") == 2);
  resolver.release();
  CHECK(rig.source.wait_for(90).size() == 90);
  for (const auto& [channel, result] : rig.source.wait_for(90)) CHECK(result.status == 204);
}

TEST_CASE("a name that hangs takes one thread of the resolver, whatever the number of its subscriptions", "[delivery][attack]") {
  HangingResolver resolver;
  Recorder recorder;
  const Receiver good(std::ref(recorder));
  CallbackOptions options = with_names();
  options.max_threads = 2;
  delivery::Details details;
  details.look_up = resolver.resolve();
  Rig rig(options, details);
  for (std::uint64_t i = 1; i <= 40; ++i) rig.post(Channel{i}, notification(good.url("hangs.example", "/" + std::to_string(i))));
  for (std::uint64_t i = 101; i <= 110; ++i) rig.post(Channel{i}, notification(good.url("n" + std::to_string(i) + ".example")));
  CHECK(rig.source.wait_for(10).size() == 10);
  CHECK(resolver.calls("hangs") == 1);
  resolver.release();
  CHECK(rig.source.wait_for(50).size() == 50);
  CHECK(resolver.calls("hangs") == 1);  // all forty got the same result
}

TEST_CASE("a name that is not resolved within resolve_time is a failed notification", "[delivery]") {
  HangingResolver resolver;
  Recorder recorder;
  const Receiver good(std::ref(recorder));
  CallbackOptions options = with_names();
  options.resolve_time = 50ms;
  options.max_resolver_threads = 1;
  delivery::Details details;
  details.look_up = resolver.resolve();
  Rig rig(options, details);
  for (std::uint64_t i = 1; i <= 10; ++i) rig.post(Channel{i}, notification(good.url("hangs" + std::to_string(i) + ".example")));
  for (const auto& [channel, result] : rig.source.wait_for(10)) {
    CHECK(result.status == 0);
    CHECK_FALSE(result.refused);
    CHECK(result.error == "resolving \"hangs" + alone(channel) + ".example\" timed out");
  }
  CHECK(resolver.calls("hangs") == 1);  // the other names did not get the thread
  resolver.release();
  CHECK(comes_true([&] { return rig.deliver(notification(good.url("good.example"))).status == 204; }));
}

TEST_CASE("a name without an address is not resolved again for a short time", "[delivery]") {
  HangingResolver resolver;
  CallbackOptions options = with_names();
  delivery::Details details;
  details.look_up = resolver.resolve();
  SECTION("within that time") {
    details.failed_time = 10min;
    Rig rig(options, details);
    for (int i = 0; i < 5; ++i) CHECK(says(rig.deliver(notification("http://nowhere.example/")).error, "no address"));
    CHECK(resolver.calls("nowhere") == 1);
    CHECK(says(rig.deliver(notification("http://nowhere.test/")).error, "no address"));
    CHECK(resolver.calls("nowhere") == 2);
  }
  SECTION("afterwards") {
    details.failed_time = 0ms;
    Rig rig(options, details);
    for (int i = 0; i < 5; ++i) CHECK(says(rig.deliver(notification("http://nowhere.example/")).error, "no address"));
    CHECK(resolver.calls("nowhere") == 5);
  }
}

TEST_CASE("an address in the URL is not resolved", "[delivery]") {
  HangingResolver resolver;
  Recorder recorder;
  const Receiver good(std::ref(recorder));
  delivery::Details details;
  details.look_up = resolver.resolve();
  Rig rig(with_names(), details);
  CHECK(rig.deliver(notification(good.url())).status == 204);
  CHECK(resolver.calls("") == 0);
  CHECK(literal_address("[::1]")->text == "::1");
  CHECK(literal_address("127.0.0.1")->text == "127.0.0.1");
  for (const char* name : {"localhost", "127.1", "::1", "[127.0.0.1]", "1.2.3.4.example", "[]", ""}) CHECK_FALSE(literal_address(name));
}

TEST_CASE("stop ends everything that hangs, and the source is not called afterwards", "[delivery]") {
  const Receiver hanging([](Peer& peer) { peer.hang(); });
  CallbackOptions options = loopback();
  options.response_time = options.connect_time = 10min;
  SECTION("receivers") {
    Rig rig(options);
    for (std::uint64_t i = 1; i <= 40; ++i) rig.post(Channel{i}, notification(hanging.url()));
    REQUIRE(comes_true([&] { return hanging.connections() == 32; }));
    const auto start = std::chrono::steady_clock::now();
    rig.stop();
    std::cout << "stop with 32 receivers that hang: "
              << std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() - start).count() << " us\n";
    rig.deliverer->notify(Channel{99}, alone(Channel{99}));
    rig.stop();
    CHECK_FALSE(rig.source.called_after_stop());
    CHECK(rig.source.wait_until([](const auto& results) { return results.empty(); }));
  }
  SECTION("a resolver") {
    // It returns after the deliverer and the source are destroyed.
    auto release = std::make_shared<std::promise<void>>();
    auto inside = std::make_shared<std::atomic<int>>(0);
    auto back = std::make_shared<std::atomic<int>>(0);
    {
      delivery::Details details;
      details.look_up = [inside, back, gate = release->get_future().share()](const std::string&) {
        ++*inside;
        gate.wait();
        ++*back;
        return Result<std::vector<Address>>(std::vector<Address>{numeric_address("127.0.0.1").value()});
      };
      options.allow = {"127.0.0.1", ".example"};
      Rig rig(options, details);
      for (std::uint64_t i = 1; i <= 20; ++i) rig.post(Channel{i}, notification(hanging.url("n" + std::to_string(i) + ".example")));
      REQUIRE(comes_true([&] { return *inside == 8; }));  // max_resolver_threads
      const auto start = std::chrono::steady_clock::now();
      rig.stop();
      std::cout << "stop with 8 look-ups that hang: "
                << std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() - start).count() << " us\n";
      CHECK_FALSE(rig.source.called_after_stop());
    }
    CHECK(*back == 0);
    release->set_value();
    CHECK(comes_true([&] { return *back == 8; }));
    CHECK(comes_true([&] { return inside.use_count() == 1; }));  // the last of them has released the shared state
    CHECK(hanging.connections() == 0);
  }
  SECTION("at any moment") {
    Recorder recorder;
    const Receiver good(std::ref(recorder));
    for (int round = 0; round < 30; ++round) {
      Rig rig(options);
      for (std::uint64_t i = 1; i <= 8; ++i) rig.post(Channel{i}, notification(i % 2 == 0 ? good.url() : hanging.url()));
      for (int k = 0; k < round; ++k) std::this_thread::yield();
      std::thread host([&] {
        for (std::uint64_t i = 9; i <= 40; ++i) rig.deliverer->notify(Channel{i}, alone(Channel{i}));
      });
      rig.stop();
      CHECK_FALSE(rig.source.called_after_stop());
      host.join();
    }
  }
}

TEST_CASE("invalid options are refused", "[delivery]") {
  TestSource source;
  CallbackOptions options = loopback();
  SECTION("a bad entry") { options.allow = {"127.1"}; }
  SECTION("no threads") { options.max_threads = 0; }
  SECTION("no time") { options.response_time = 0ms; }
  SECTION("no time to resolve") { options.resolve_time = 0ms; }
  SECTION("no thread to resolve") { options.max_resolver_threads = 0; }
  SECTION("no such file of authorities") { options.ca_file = "/nonexistent/ca.pem"; }
  SECTION("a file of authorities without any") { options.ca_file = "/etc/hostname"; }
  const auto made = delivery::make_deliverer(source, options, nullptr);
  REQUIRE_FALSE(made);
  CHECK(made.error().code == Errc::invalid_option);
  CHECK_FALSE(made.error().message.empty());
}
