// SPDX-License-Identifier: Apache-2.0
// Servers on loopback, one for each transport of the build, and clients that do what an input says: the conformance cases and the recorded
// exchanges, mutated as bytes and in their structure. Whatever comes in, each response is whole and well framed, there are no more responses than
// requests, 500 comes only after a lambda has thrown, and a new client is served.
//
// An input is what clients send; 0xFF and a character is an operation:
//
//   A B C D   the following is of that connection     /   sends what precedes, and lets the servers work
//   b         a body follows, up to the next operation: Content-Length and the end of the header section precede it
//   k         a chunk follows; z: the last chunk       |   a segment ends here, also within a body
//   w X       a frame follows, masked, whose first byte is X
//   h         half close    c   sudden close           n   reads no more
//   t X       the clock advances by 2^(X mod 20) ms    s X the robot's state changes
//   H R       host of the server, of the receiver      L T Location, ETag of the last response
//   0xFF      the byte 0xFF
//
// The conformance cases are added to the corpus at the start.

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/lrt.hpp>
#include <lrt/transport/named.hpp>

#include "tests/conformance/cases.hpp"
#include "tests/conformance/wire.hpp"
#include "tests/support/fakes.hpp"
#include "tests/support/sample_robot.hpp"
#include "tests/support/websocket.hpp"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace {

using namespace lrt;
using namespace lrt::test;

constexpr char operation = '\xFF';

[[noreturn]] void fail(const std::string& what, std::string_view sent = {}, std::string_view received = {}) {
  std::fprintf(stderr, "%s\n--- sent\n%.*s\n--- received\n%.*s\n---\n", what.c_str(), static_cast<int>(sent.size()), sent.data(),
               static_cast<int>(received.size()), received.data());
  std::abort();
}

// ------------------------------------------------------------------------------------------------------------------ sockets

class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  int get() const { return number_; }
  explicit operator bool() const { return number_ >= 0; }

 private:
  int number_ = -1;
};

sockaddr_in loopback(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

/// A connection to a server on this machine.
Descriptor connected_to(std::uint16_t port) {
  Descriptor made(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const sockaddr_in address = loopback(port);
  int result = ::connect(made.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address);
  if (result != 0 && errno == EINTR) {  // libFuzzer has an alarm; the system goes on connecting
    pollfd item{made.get(), POLLOUT, 0};
    while (::poll(&item, 1, -1) < 0 && errno == EINTR) {}
    socklen_t size = sizeof errno;
    ::getsockopt(made.get(), SOL_SOCKET, SO_ERROR, &errno, &size);
    result = errno;
  }
  if (result != 0) fail("no connection: error " + std::to_string(errno));
  ::fcntl(made.get(), F_SETFL, O_NONBLOCK);
  return made;
}

/// Receives notifications, confirms subscriptions, and is the only address to which the servers may post.
class Receiver {
 public:
  Receiver() : listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    sockaddr_in address = loopback(0);
    socklen_t size = sizeof address;
    if (::bind(listener_.get(), reinterpret_cast<sockaddr*>(&address), sizeof address) != 0 || ::listen(listener_.get(), 64) != 0 ||
        ::getsockname(listener_.get(), reinterpret_cast<sockaddr*>(&address), &size) != 0)
      fail("the receiver cannot listen");
    host_ = "127.0.0.1:" + std::to_string(ntohs(address.sin_port));
  }
  const std::string& host() const { return host_; }
  /// Responds to what has arrived. Its connections serve one request.
  void work() {
    while (true) {
      Descriptor made(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
      if (!made) break;
      if (clients_.size() == 64) clients_.erase(clients_.begin());
      clients_.push_back({std::move(made), {}});
    }
    for (std::size_t i = 0; i < clients_.size();) {
      if (is_done(clients_[i])) clients_.erase(clients_.begin() + static_cast<std::ptrdiff_t>(i));
      else ++i;
    }
  }

 private:
  struct Client {
    Descriptor socket;
    std::string received;
  };
  static bool is_done(Client& client) {
    char buffer[16 * 1024];
    const auto n = ::recv(client.socket.get(), buffer, sizeof buffer, 0);
    if (n < 0 && (errno == EAGAIN || errno == EINTR)) return false;
    if (n <= 0) return true;
    client.received.append(buffer, static_cast<std::size_t>(n));
    const std::size_t end = client.received.find("\r\n\r\n");
    if (end == std::string::npos) return false;
    std::string body, status = "204 No Content";
    const std::size_t challenge = client.received.find("hub.challenge=");
    if (challenge < end) {
      body = client.received.substr(challenge + 14, client.received.find_first_of("& ", challenge) - challenge - 14);
      status = "200 OK";
    } else {
      const std::size_t length = client.received.find("Content-Length: ");
      if (length < end && client.received.size() < end + 4 + std::strtoul(client.received.c_str() + length + 16, nullptr, 10)) return false;
    }
    const std::string response = "HTTP/1.1 " + status + "\r\nConnection: close\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body;
    (void)::send(client.socket.get(), response.data(), response.size(), MSG_NOSIGNAL);
    return true;
  }
  Descriptor listener_;
  std::string host_;
  std::vector<Client> clients_;
};

// ---------------------------------------------------------------------------------------------------------------- responses

struct Response {
  int status = 0;
  std::string_view header;
};

/// Reads all that one connection has received. What it may contain depends on what was sent.
class Reading {
 public:
  Reading(std::string_view sent, bool whole) : whole_(whole) {
    has_head_ = sent.find("HEAD") != std::string_view::npos;
    // A header section ends with an empty line; one without that may be refused.
    for (std::size_t i = 0; i + 1 < sent.size(); ++i)
      max_ += sent[i] == '\n' && (sent[i + 1] == '\n' || (sent[i + 1] == '\r' && i + 2 < sent.size() && sent[i + 2] == '\n'));
  }

  /// @return  empty, or what is wrong
  std::string read(std::string_view received) { return all(received, 0) ? std::string() : wrong_; }
  const std::vector<Response>& responses() const { return responses_; }

 private:
  bool fails(const char* what) {
    if (wrong_.empty()) wrong_ = what;
    return false;
  }
  bool all(std::string_view rest, std::size_t interim) {
    if (rest.empty()) return true;
    const std::size_t end = rest.find("\r\n\r\n");
    constexpr std::string_view start = "HTTP/1.1 ";
    if (rest.substr(0, start.size()) != start.substr(0, rest.size())) return fails("expected a response");
    if (end == std::string_view::npos) return whole_ ? fails("half a header section") : true;
    const std::string_view header = rest.substr(0, end + 2);
    Response response;
    response.header = header;
    for (const char c : header.substr(start.size(), 3)) {
      if (c < '0' || c > '9') return fails("status");
      response.status = response.status * 10 + (c - '0');
    }
    if (response.status < 100 || response.status > 599) return fails("status");
    std::optional<std::size_t> length;
    bool chunked = false, closes = false, event_stream = false;
    for (std::size_t at = header.find("\r\n") + 2; at < header.size();) {
      const std::size_t stop = header.find("\r\n", at);
      const std::string_view line = header.substr(at, stop - at);
      at = stop + 2;
      const std::size_t colon = line.find(':');
      if (colon == 0 || colon == std::string_view::npos) return fails("field without a name");
      for (const char c : line.substr(0, colon))
        if (c <= ' ' || c > '~') return fails("name of a field");
      for (const char c : line)
        if ((static_cast<unsigned char>(c) < ' ' && c != '\t') || c == 0x7F) return fails("control character in a field");
      const std::string_view name = line.substr(0, colon), value = line.substr(std::min(line.size(), colon + 2));
      if (http::iequals(name, "Content-Length")) {
        if (length || value.empty() || value.size() > 9 || value.find_first_not_of("0123456789") != std::string_view::npos)
          return fails("Content-Length");
        length = std::stoul(std::string(value));
      } else if (http::iequals(name, "Transfer-Encoding")) {
        if (!http::iequals(value, "chunked") || chunked) return fails("Transfer-Encoding");
        chunked = true;
      } else if (http::iequals(name, "Connection")) {
        closes |= http::iequals(value, "close");
      } else if (http::iequals(name, "Content-Type")) {
        event_stream = value.substr(0, 17) == "text/event-stream";
      }
    }
    if (length && chunked) return fails("Content-Length and Transfer-Encoding");
    rest.remove_prefix(end + 4);
    if (response.status == 101) {
      responses_.push_back(response);
      if (responses_.size() > max_ + 1) return fails("more responses than requests");
      return frames(rest);
    }
    if (response.status < 200) {
      if (interim == 1) return fails("100 Continue twice");
      return all(rest, interim + 1);
    }
    responses_.push_back(response);
    if (responses_.size() > max_ + 1) return fails("more responses than requests");
    const std::size_t count = responses_.size();
    const auto follows = [&](std::string_view next) {
      if (closes && !next.empty()) return fails("something after Connection: close");
      if (all(next, 0)) return true;
      responses_.resize(count);
      return false;
    };
    const bool empty = response.status == 204 || response.status == 304;
    if (empty && length.value_or(0) != 0 && response.status == 204) return fails("204 with a body");
    if (empty || has_head_) {
      if (follows(rest)) return true;
      if (empty) return false;
    }
    if (chunked) return chunks(rest, follows);
    if (length) {
      if (rest.size() >= *length) return follows(rest.substr(*length));
      return whole_ ? fails("half a body") : true;
    }
    return event_stream || closes ? true : fails("a body without framing");
  }
  template <class Follows>
  bool chunks(std::string_view rest, Follows follows) {
    while (true) {
      const std::size_t line = rest.find("\r\n");
      if (line == std::string_view::npos) return rest.size() < 20 ? true : fails("size of a chunk");
      if (line == 0 || line > 8 || rest.substr(0, line).find_first_not_of("0123456789abcdefABCDEF") != std::string_view::npos)
        return fails("size of a chunk");
      const std::size_t size = std::stoul(std::string(rest.substr(0, line)), nullptr, 16);
      rest.remove_prefix(line + 2);
      if (rest.size() < size + 2) return true;
      if (rest.substr(size, 2) != "\r\n") return fails("end of a chunk");
      rest.remove_prefix(size + 2);
      if (size == 0) return follows(rest);
    }
  }
  bool frames(std::string_view rest) {
    FrameReader reader;
    Frame frame;
    try {
      while (reader.next(rest, frame)) {}
    } catch (const std::exception& e) {
      wrong_ = e.what();
      return false;
    }
    return true;
  }

  bool whole_, has_head_ = false;
  std::size_t max_ = 0;
  std::vector<Response> responses_;
  std::string wrong_;
};

/// The value of the last field of that name.
std::string last_field(std::string_view received, std::string_view name) {
  const std::size_t at = received.rfind("\r\n" + std::string(name) + ": ");
  if (at == std::string_view::npos) return {};
  const std::size_t begin = at + name.size() + 4;
  return std::string(received.substr(begin, received.find("\r\n", begin) - begin));
}

// ------------------------------------------------------------------------------------------------------------ robot and clients

Receiver& receiver() {
  static Receiver made;
  return made;
}

/// What came of an input of one request.
struct Outcome {
  std::string request;
  int status;
};

class Exchange {
 public:
  explicit Exchange(std::string_view transport) : transport_(transport), server_(Server::create(options()).value()) {
    server_.add(robot_.arm()).value();
    server_.add(robot_.tool()).value();
    host_ = "127.0.0.1:" + std::to_string(server_.port());
  }
  ~Exchange() {
    for (auto& client : clients_) drop(client);
  }
  Exchange(const Exchange&) = delete;
  Exchange& operator=(const Exchange&) = delete;

  void run(std::string_view input) {
    for (std::size_t at = 0; at < input.size();) {
      if (input[at] != operation || at + 1 == input.size()) {
        text_ += input[at++];
        continue;
      }
      const char which = input[at + 1];
      at += 2;
      const bool has_operand = which == 't' || which == 's' || which == 'w';
      const char operand = has_operand && at < input.size() ? input[at++] : '\0';
      carry_out(which, operand);
    }
    finish_block();
    flush();
    check();
  }
  /// If there was one connection, with one response.
  std::optional<Outcome> outcome() const {
    const Client& only = clients_[0];
    Reading reading(only.sent, false);
    if (!only.socket || !reading.read(only.received).empty() || reading.responses().size() != 1) return std::nullopt;
    return Outcome{only.sent, reading.responses().front().status};
  }

 private:
  struct Client {
    Descriptor socket;
    std::string sent, received, unsent;
    std::vector<std::size_t> segments;  ///< ends of segments of `unsent`
    bool reads = true, half_closed = false, ended = false, reset = false;
  };

  Options options() {
    Options o;
    o.listen.port = 0;
    o.listen.transport = [name = transport_](transport::TransportOptions t) { return transport::make_named(name, std::move(t)); };
    o.threads.io = Io::in_poll;
    o.clock = &clock_;
    o.ids = std::make_shared<FixedIds>();
    o.callbacks.allow = {receiver().host()};
    o.callbacks.confirmation = subscription::Confirmation::all;
    o.security.read_origins = {"*"};
    o.security.allowed_origins = {"https://dashboard.example"};
    o.security.allowed_hosts = {"robot.example:80"};
    return o;
  }
  Client& client() { return clients_[current_]; }

  void carry_out(char which, char operand) {
    const auto number = static_cast<unsigned char>(operand);
    switch (which) {
      case operation: text_ += operation; return;
      case 'H': text_ += host_; return;
      case 'R': text_ += receiver().host(); return;
      case 'L': text_ += last_field(client().received, "Location"); return;
      case 'T': text_ += last_field(client().received, "ETag"); return;
      case '|': splits_.push_back(text_.size()); return;
      default: break;
    }
    finish_block();
    switch (which) {
      case 'A':
      case 'B':
      case 'C':
      case 'D': current_ = static_cast<std::size_t>(which - 'A'); break;
      case 'b':
      case 'k': block_ = which; break;
      case 'w': block_ = which, frame_ = operand; break;
      case 'z': client().unsent += "0\r\n\r\n"; break;
      case '/': flush(); break;
      case 'h':
        flush();
        if (client().socket && !std::exchange(client().half_closed, true)) ::shutdown(client().socket.get(), SHUT_WR);
        settle();
        break;
      case 'c':
        flush();
        close_client();
        break;
      case 'n': client().reads = false; break;
      case 't':
        flush();
        clock_.advance(std::chrono::milliseconds(1 << number % 20));
        settle();
        break;
      case 's':
        flush();
        change(number);
        settle();
        break;
      default: break;
    }
  }
  void change(unsigned char what) {
    switch (what % 8) {
      case 0: robot_.angle_handle->publish(what - 128.0); break;
      case 1: robot_.count = what; break;
      case 2: robot_.locked = what >= 128; break;
      case 3: robot_.hot = what >= 128; break;
      default: {
        if (robot_.grips.empty()) break;
        if (what % 8 == 4) return robot_.grips.back().progress(0.5);
        Responder grip = std::move(robot_.grips.back());
        robot_.grips.pop_back();
        if (what % 8 == 5) grip.succeed();
        else if (what % 8 == 6) grip.fail("it slipped");
        else ++robot_.thrown;  // a dropped responder is a failure of the robot's code
      }
    }
  }
  /// Appends what was gathered since the last operation.
  void finish_block() {
    std::string before, after;
    const char block = std::exchange(block_, '\0');
    if (block == 'b') {
      before = "Content-Length: " + std::to_string(text_.size()) + "\r\n\r\n";
    } else if (block == 'k' && !text_.empty()) {
      char size[24];
      std::snprintf(size, sizeof size, "%zx\r\n", text_.size());
      before = size, after = "\r\n";
    } else if (block == 'w') {
      Frame frame;
      frame.payload = text_;
      before = frame.bytes();
      before[0] = frame_;
      splits_.clear();
      text_.clear();
    }
    Client& to = client();
    for (const std::size_t at : splits_) to.segments.push_back(to.unsent.size() + before.size() + at);
    splits_.clear();
    to.unsent.append(before).append(text_).append(after);
    text_.clear();
  }

  void connect() {
    if (client().socket) return;
    client() = Client();
    client().socket = connected_to(server_.port());
  }
  void flush() {
    Client& to = client();
    if (to.unsent.empty()) return settle();
    std::string bytes = std::move(to.unsent);
    std::vector<std::size_t> segments = std::move(to.segments);
    connect();
    segments.push_back(bytes.size());
    std::size_t at = 0;
    for (const std::size_t end : segments) {
      while (at < end && send_some(to, std::string_view(bytes).substr(at, end - at), at)) {}
      settle();
    }
  }
  /// @return  whether it makes sense to continue
  bool send_some(Client& to, std::string_view bytes, std::size_t& at) {
    if (to.half_closed || to.reset) return false;
    const auto n = ::send(to.socket.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (n < 0 && (errno == EAGAIN || errno == EINTR)) {
      const std::size_t before = work_;
      settle();
      return work_ != before;
    }
    if (n < 0) {
      to.reset = true;
      return false;
    }
    to.sent.append(bytes.substr(0, static_cast<std::size_t>(n)));
    at += static_cast<std::size_t>(n);
    return true;
  }
  /// The server works, and clients read, until nothing moves.
  void settle() {
    int quiet = 0;
    for (int round = 0; quiet < 3; ++round) {
      if (round == 100'000) fail(transport_ + ": the server never comes to rest");
      const bool left = server_.poll().count() == 0;
      receiver().work();
      bool moved = false;
      for (Client& c : clients_)
        if (c.reads) moved |= receive(c);
      quiet = left || moved ? 0 : quiet + 1;
    }
  }
  bool receive(Client& from) {
    if (!from.socket || from.ended) return false;
    char buffer[16 * 1024];
    bool moved = false;
    while (true) {
      const auto n = ::recv(from.socket.get(), buffer, sizeof buffer, 0);
      if (n < 0 && (errno == EAGAIN || errno == EINTR)) return moved;
      moved = true;
      ++work_;
      if (n <= 0) {
        from.reset |= n < 0;
        from.ended = true;
        return true;
      }
      from.received.append(buffer, static_cast<std::size_t>(n));
    }
  }
  /// Gives the connection up with a reset.
  static void drop(Client& one) {
    if (!one.socket) return;
    const linger now{1, 0};
    ::setsockopt(one.socket.get(), SOL_SOCKET, SO_LINGER, &now, sizeof now);
    one.socket = Descriptor();
  }
  void close_client() {
    if (!client().socket) return;
    check(client());
    drop(client());
    settle();
  }

  void check(const Client& one) {
    if (one.sent.empty() && one.received.empty()) return;
    const auto read = [&](bool whole) {
      Reading reading(one.sent, whole);
      const std::string wrong = reading.read(one.received);
      if (wrong.empty())
        for (const Response& response : reading.responses())
          if (response.status == 500 && robot_.thrown == 0) fail(transport_ + ": 500 without a cause", one.sent, one.received);
      return wrong;
    };
    // A reset may have thrown away what was under way, and a body may still be judged.
    if (const std::string wrong = read(false); !wrong.empty()) fail(transport_ + ": " + wrong, one.sent, one.received);
    if (one.reset || !one.reads) return;
    const std::string wrong = read(true);
    if (!wrong.empty()) fail(transport_ + ": " + wrong, one.sent, one.received);
  }
  void check() {
    for (const Client& one : clients_)
      if (one.socket) check(one);
    Client probe;
    probe.socket = connected_to(server_.port());
    const std::string request = "GET /arm/speed HTTP/1.1\r\nHost: " + host_ + "\r\nAccept: application/json\r\nConnection: close\r\n\r\n";
    if (::send(probe.socket.get(), request.data(), request.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(request.size()))
      fail(transport_ + ": does not read");
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(5);
    while (!probe.ended) {
      if (std::chrono::steady_clock::now() > end) fail(transport_ + ": does not serve a new client", request, probe.received);
      server_.poll();
      receiver().work();
      (void)receive(probe);
    }
    if (probe.received.substr(0, 12) != "HTTP/1.1 200" || probe.received.find("1.5") == std::string::npos)
      fail(transport_ + ": wrong response to a new client", request, probe.received);
  }

  std::string transport_;
  FakeClock clock_;
  SampleRobot robot_;
  Server server_;
  std::string host_;
  std::array<Client, 4> clients_;
  std::size_t current_ = 0, work_ = 0;
  std::string text_;
  std::vector<std::size_t> splits_;
  char block_ = '\0', frame_ = '\0';
};

// -------------------------------------------------------------------------------------------------------------------- seeds

std::string replaced(std::string text, std::string_view what, std::string_view by) {
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += by.size()) text.replace(at, what.size(), by);
  return text;
}

std::string change_of(const std::string& set) {
  const std::string name = set.substr(0, set.find(' ')), value = set.substr(set.find(' ') + 1);
  if (name == "clock") {
    char power = 0;
    while (power < 19 && (1L << power) < std::stol(value)) ++power;
    return {operation, 't', power};
  }
  const unsigned kind = name == "angle"       ? 8 * 18
                        : name == "count"     ? 1 + 8 * 9
                        : name == "locked"    ? 2 + (value != "0" ? 128 : 0)
                        : name == "hot"       ? 3 + (value != "0" ? 128 : 0)
                        : value == "progress" ? 4
                        : value == "succeed"  ? 5
                        : value == "fail"     ? 6
                                              : 7;
  return {operation, 's', static_cast<char>(kind)};
}

std::string input_of(const Case& from) {
  std::string input;
  std::map<std::string, std::string> words{{"{host}", "\xFFH"}, {"{base}", "http://\xFFH"}, {"127.0.0.1:9/", "\xFFR/"}};
  for (const Step& step : from.steps) {
    if (!step.set.empty()) {
      input += change_of(step.set);
      continue;
    }
    std::string request = step.request;
    if (request.find("\nHost: ") == std::string::npos) request.insert(std::min(request.find('\n'), request.size()), "\nHost: {host}");
    const std::size_t end = std::min(request.find("\n\n"), request.size());
    std::string header = request.substr(0, end), body = request.substr(std::min(request.size(), end + 2));
    header.insert(std::min(header.find('\n'), header.size()), " HTTP/1.1");
    header = replaced(std::move(header), "\n", "\r\n");
    for (const auto& [word, value] : words) header = replaced(std::move(header), word, value), body = replaced(std::move(body), word, value);
    input += header + "\r\n";
    if (step.declared != 0)
      input += "Content-Length: " + std::to_string(step.declared) +
               "\r\nExpect: 100-continue\r\n\r\n\xFF/\xFF"
               "c";
    else if (!body.empty() || header.find("Content-Type") != std::string::npos)
      input +=
          "\xFF"
          "b" +
          body + "\xFF/";
    else input += "\r\n\xFF/";
    for (const auto& [name, pattern] : step.fields)
      if (pattern[0] == '$') words.emplace(pattern, name == "ETag" ? "\xFFT" : "\xFFL");
  }
  return input;
}

std::string input_of(const WireExchange& from) {
  std::string input;
  for (const WireStep& step : from.steps) input += step.set.empty() ? replaced(step.request, "\xFF", "\xFF\xFF") + "\xFF/" : change_of(step.set);
  return input + "\xFFh";
}

/// WebSockets and event streams of two clients.
std::vector<std::string> input_of_streams() {
  const auto request = [](const std::string& target, const std::string& fields) {
    return "GET " + target + " HTTP/1.1\r\nHost: \xFFH\r\n" + fields + "\r\n\xFF/";
  };
  const std::string key = "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
  const std::string upgrade = "Connection: Upgrade\r\nUpgrade: websocket\r\n" + key;
  const std::string publish = {operation, 's', '\x50'};
  std::vector<std::string> inputs;
  for (const std::string& target : {"/arm/angle", "/arm/angle?queue=10", "/arm", "/arm/actions/grip", "/arm/speed"}) {
    inputs.push_back(request(target, upgrade) + publish + "\xFFw\x89ping\xFF/\xFFw\x81text\xFF/" + publish +
                     "\xFFw\x01"
                     "a\xFFw\x80z\xFFw\x88\x03\xE8\xFF/");
    inputs.push_back(request(target, "Accept: text/event-stream\r\n") + publish +
                     "\xFF"
                     "B" +
                     request(target, upgrade) + publish + "\xFFt\x0F" + publish);
  }
  inputs.push_back(
      "POST /arm/waypoints HTTP/1.1\r\nHost: \xFFH\r\nContent-Type: application/json\r\nTransfer-Encoding: "
      "chunked\r\n\r\n\xFFk{\"x\":1,\xFFk\"y\":2,"
      "\"frame\":\"a\"}\xFFz\xFF/GET /arm/count HTTP/1.1\r\nHost: \xFFH\r\n\r\nGET /arm/name HTTP/1.1\r\nHost: "
      "\xFFH\r\n\r\n\xFFh");
  return inputs;
}

const std::vector<std::string>& seeds() {
  static const std::vector<std::string> made = [] {
    std::vector<std::string> inputs = input_of_streams();
    for (const Case& c : read_cases(LRT_SOURCE_DIR "/tests/conformance/cases.txt")) inputs.push_back(input_of(c));
    for (const WireExchange& e : read_recording(LRT_SOURCE_DIR "/tests/conformance/wire.txt").exchanges) inputs.push_back(input_of(e));
    return inputs;
  }();
  return made;
}

std::string seed_folder;

// ------------------------------------------------------------------------------------------------------------------ mutations

class Mutator {
 public:
  Mutator(std::string input, unsigned seed) : input_(std::move(input)), random_(seed) {}

  std::string mutated() {
    switch (below(14)) {
      case 0: insert(place(), {operation, '|'}); break;
      case 1: insert(place(), {operation, '/'}); break;
      case 2: lines(); break;
      case 3: insert(operation_place(), pick_seed()); break;
      case 4: insert(operation_place(), switched(pick_seed())); break;
      case 5: insert(operation_place(), {operation, "hcn"[below(3)]}); break;
      case 6: insert(operation_place(), {operation, 't', static_cast<char>(below(20))}); break;
      case 7: insert(operation_place(), {operation, 's', static_cast<char>(below(256))}); break;
      case 8: to_chunks(); break;
      case 9: insert(operation_place(), frame()); break;
      case 10: delete_operation(); break;
      case 11: insert(operation_place(), {operation, "ABCD"[below(4)]}); break;
      case 12: insert(place(), pick(tokens())); break;
      default: repeat(); break;
    }
    return std::move(input_);
  }

 private:
  static const std::vector<std::string>& tokens() {
    static const std::vector<std::string> all = {"Content-Length: 5\r\n",
                                                 "Content-Length: 0\r\n",
                                                 "Transfer-Encoding: chunked\r\n",
                                                 "Transfer-Encoding: gzip, chunked\r\n",
                                                 "Connection: close\r\n",
                                                 "Connection: Upgrade\r\n",
                                                 "Upgrade: websocket\r\n",
                                                 "Upgrade: callback\r\n",
                                                 "Expect: 100-continue\r\n",
                                                 "Accept: text/event-stream\r\n",
                                                 "Accept: application/json\r\n",
                                                 "Prefer: wait=5\r\n",
                                                 "Prefer: respond-async\r\n",
                                                 "Range: bytes=0-9\r\n",
                                                 "If-Match: *\r\n",
                                                 "If-None-Match: *\r\n",
                                                 "Origin: https://dashboard.example\r\n",
                                                 "Origin: https://other.example\r\n",
                                                 "Content-Encoding: gzip\r\n",
                                                 "Host: \xFFH\r\n",
                                                 "\r\n",
                                                 "\r\n\r\n",
                                                 "HTTP/1.0",
                                                 "HEAD ",
                                                 "OPTIONS ",
                                                 "DELETE ",
                                                 "PATCH ",
                                                 "\xFFL",
                                                 "\xFFT",
                                                 "0\r\n\r\n",
                                                 "FFFFFFFFFFFFFFFF\r\n",
                                                 ";a=b",
                                                 "\n",
                                                 "\r",
                                                 std::string(1, '\0')};
    return all;
  }
  std::size_t below(std::size_t n) { return n == 0 ? 0 : std::uniform_int_distribution<std::size_t>(0, n - 1)(random_); }
  template <class T>
  const T& pick(const std::vector<T>& from) {
    return from[below(from.size())];
  }
  const std::string& pick_seed() { return pick(seeds()); }
  std::size_t place() { return below(input_.size() + 1); }
  std::vector<std::size_t> operations() const {
    std::vector<std::size_t> all;
    for (std::size_t at = 0; at + 1 < input_.size(); ++at)
      if (input_[at] == operation) all.push_back(at++);
    return all;
  }
  std::size_t operation_place() {
    auto all = operations();
    all.push_back(input_.size());
    return pick(all);
  }
  void insert(std::size_t at, const std::string& what) { input_.insert(at, what); }
  /// On another connection, and back.
  std::string switched(const std::string& input) { return std::string{operation, "BCD"[below(3)]} + input + std::string{operation, 'A'}; }
  void lines() {
    std::vector<std::pair<std::size_t, std::size_t>> found;  // begin and end of lines
    for (std::size_t begin = 0, end = 0; (end = input_.find("\r\n", begin)) != std::string::npos; begin = end + 2) found.emplace_back(begin, end + 2);
    if (found.empty()) return;
    const auto one = pick(found), other = pick(found);
    const std::string line = input_.substr(one.first, one.second - one.first);
    switch (below(3)) {
      case 0: input_.insert(other.first, line); break;
      case 1: input_.erase(one.first, line.size()); break;
      default: input_.erase(one.first, line.size()); input_.insert(other.first > one.first ? other.first - line.size() : other.first, line);
    }
  }
  void to_chunks() {
    const std::size_t at = input_.find(
        "\xFF"
        "b",
        below(input_.size() + 1));
    if (at == std::string::npos) return;
    const std::size_t end = std::min(input_.find(operation, at + 2), input_.size());
    std::string body = "Transfer-Encoding: chunked\r\n\r\n\xFFk" + input_.substr(at + 2, end - at - 2);
    for (std::size_t n = below(4); n > 0; --n) body.insert(30 + below(body.size() - 30), "\xFFk");
    input_.replace(at, end - at, body + (below(4) == 0 ? "" : "\xFFz"));
  }
  std::string frame() {
    static constexpr char opcodes[] = "\x81\x82\x80\x01\x00\x88\x89\x8A\xC1\x83\x8F\x09";
    std::string made{operation, 'w', opcodes[below(12)]};
    static const std::vector<std::string> payloads = {
        "", "hello", "\xC3\xA9", "\xC3", "\x03\xE8", "\x03\xED", "\x03", std::string(125, 'x'), std::string(126, 'x')};
    made += pick(payloads);
    return below(2) == 0 ? made + "\xFF/" : made + "\xFF|";
  }
  void delete_operation() {
    const auto all = operations();
    if (!all.empty()) input_.erase(pick(all), 2);
  }
  void repeat() {
    const std::size_t begin = operation_place(), end = operation_place();
    const std::string part = input_.substr(std::min(begin, end), std::max(begin, end) - std::min(begin, end));
    input_.insert(operation_place(), part);
  }

  std::string input_;
  std::minstd_rand random_;
};

}  // namespace

/// Adds the cases to the folders of the command line.
extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  bool folders = true;
  for (int i = 1; i < *argc; ++i) folders &= (*argv)[i][0] == '-' || std::filesystem::is_directory((*argv)[i]);
  if (!folders) return 0;
  std::string made = (std::filesystem::temp_directory_path() / "network_fuzz-XXXXXX").string();
  if (::mkdtemp(made.data()) == nullptr) fail("no folder " + made);
  seed_folder = made;
  for (std::size_t i = 0; i < seeds().size(); ++i) std::ofstream(seed_folder + "/" + std::to_string(i)) << seeds()[i];
  std::atexit([] { std::filesystem::remove_all(seed_folder); });
  static std::vector<char*> arguments(*argv, *argv + *argc);
  if (std::none_of(arguments.begin() + 1, arguments.end(), [](const char* a) { return a[0] != '-'; })) {
    static std::string own = seed_folder + "/found";
    std::filesystem::create_directory(own);
    arguments.push_back(own.data());
  }
  arguments.push_back(seed_folder.data());
  arguments.push_back(nullptr);
  *argc = static_cast<int>(arguments.size()) - 1;
  *argv = arguments.data();
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size, unsigned seed) {
  if (seed % 3 == 0) return LLVMFuzzerMutate(data, size, max_size);
  const std::string mutated = Mutator(std::string(reinterpret_cast<const char*>(data), size), seed).mutated();
  if (mutated.empty() || mutated.size() > max_size) return LLVMFuzzerMutate(data, size, max_size);
  std::copy(mutated.begin(), mutated.end(), data);
  return mutated.size();
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view input(reinterpret_cast<const char*>(data), size);
  std::optional<Outcome> first;
  for (const std::string_view name : transport::names()) {
    Exchange exchange(name);
    exchange.run(input);
    const std::optional<Outcome> outcome = exchange.outcome();
    if (!first) first = outcome;
    else if (outcome && outcome->status / 100 != first->status / 100 && first->status / 100 == 2)
      fail("the transports disagree: " + std::to_string(first->status) + ", " + std::to_string(outcome->status), outcome->request);
  }
  return 0;
}
