// SPDX-License-Identifier: Apache-2.0
#pragma once

// Common code of the lessons, so that a lesson shows only lrt. Your program does not need it.
//
// A lesson runs a server and a small client, which uses the real port on a thread of its own and prints each request and response. When the
// client has finished, the lesson ends. With --serve there is no client: the lesson serves on port 8080 until Ctrl-C, for use with curl; with
// --serve N on port N. --public-base URL and --allowed-host HOST are Listen::public_base and one of Security::allowed_hosts,
// --cors ORIGIN is one of Security::read_origins.
//
// The output is the same at every run: the client shows any port as 8080, ids as id-1, id-2 ..., times as <time> and entity tags as <tag>. Of
// the header fields it shows only Content-Type, Allow, Location and the field of show(). It removes the @prefix lines of received Turtle and
// adds them to the Turtle that it sends.

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/rdf/codec.hpp>
#include <lrt/server.hpp>
#include <lrt/shacl/validator.hpp>

namespace lesson {

/// The word after an argument of the program; empty: it is the last one. nullopt: there is no such argument.
inline std::optional<std::string> argument(std::string_view name) {
  std::ifstream line("/proc/self/cmdline");
  std::string word;
  while (std::getline(line, word, '\0'))
    if (word == name) return std::getline(line, word, '\0') ? word : std::string();
  return std::nullopt;
}

/// The port of --serve; nullopt: the lesson has a client and ends by itself.
inline std::optional<std::uint16_t> served_port() {
  const std::optional<std::string> word = argument("--serve");
  if (!word) return std::nullopt;
  return word->empty() || word->front() == '-' ? std::uint16_t{8080} : static_cast<std::uint16_t>(std::stoul(*word));
}

inline bool serves() { return served_port().has_value(); }

/// The port to listen on; 0 with the lesson's own client: any free port.
inline std::uint16_t port() { return served_port().value_or(0); }

/// lrt::Options with that port, and names of the server.
inline lrt::Options options() {
  lrt::Options o;
  o.listen.port = port();
  o.listen.public_base = argument("--public-base").value_or("");
  if (const auto host = argument("--allowed-host")) o.security.allowed_hosts = {*host};
  if (const auto origin = argument("--cors")) o.security.read_origins = {*origin};
  return o;
}

struct Response {
  int status = 0;
  std::string header, body;  // the header section with the status line

  std::string field(std::string_view name) const {
    const std::size_t at = header.find("\r\n" + std::string(name) + ": ");
    if (at == std::string::npos) return {};
    const std::size_t from = at + name.size() + 4;
    return header.substr(from, header.find("\r\n", from) - from);
  }
};

/// A web server that accepts POST and responds 204.
class Receiver {
 public:
  Receiver() : listener_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof at;
    if (::bind(listener_, reinterpret_cast<const sockaddr*>(&at), size) != 0 || ::listen(listener_, 8) != 0 ||
        ::getsockname(listener_, reinterpret_cast<sockaddr*>(&at), &size) != 0)
      std::perror("receiver");
    port_ = ntohs(at.sin_port);
  }
  ~Receiver() { ::close(listener_); }
  Receiver(const Receiver&) = delete;
  Receiver& operator=(const Receiver&) = delete;

  std::uint16_t port() const noexcept { return port_; }
  std::string url() const { return "http://127.0.0.1:" + std::to_string(port_) + "/receiver"; }
  /// Waits for a POST request and returns it with its header section and body.
  std::string next() {
    const int fd = ::accept(listener_, nullptr, nullptr);
    std::string request;
    char part[4096];
    for (std::size_t all = std::string::npos; request.size() < all;) {
      const ssize_t n = ::recv(fd, part, sizeof part, 0);
      if (n <= 0) break;
      request.append(part, static_cast<std::size_t>(n));
      const std::size_t end = request.find("\r\n\r\n"), length = request.find("Content-Length: ");
      if (end != std::string::npos && length < end) all = end + 4 + std::stoul(request.substr(length + 16));
    }
    const std::string response = "HTTP/1.1 204 No Content\r\nConnection: close\r\n\r\n";
    (void)::send(fd, response.data(), response.size(), MSG_NOSIGNAL);
    ::close(fd);
    return request;
  }

 private:
  int listener_;
  std::uint16_t port_ = 0;
};

class Client {
 public:
  explicit Client(std::uint16_t port) : port_(port) {}

  /// Each sends one request and prints it and the response. `fields` are further header fields, "Prefer: wait=1\r\n". The path may be a URI of
  /// the server, for example from Location.
  Response get(const std::string& path, const std::string& fields = {}) { return shown("GET", path, {}, fields); }
  Response put(const std::string& path, const std::string& turtle, const std::string& fields = {}) { return shown("PUT", path, turtle, fields); }
  Response post(const std::string& path, const std::string& turtle = {}, const std::string& fields = {}) {
    return shown("POST", path, turtle, fields);
  }
  /// The header field that makes a command valid for a time from now on, by the clock of the server.
  std::string valid_for(std::chrono::milliseconds time) const {
    const std::string now = ask("HEAD", "/", {}, {}).field("Robot-Time");
    const std::size_t slash = std::min(now.find('/'), now.size() - 1);
    return "Valid-Until: " + now.substr(0, slash + 1) + std::to_string(std::stoll(now.substr(slash + 1)) + time.count()) + "\r\n";
  }
  Response remove(const std::string& path) { return shown("DELETE", path, {}, {}); }
  /// PATCH in SPARQL 1.1 Update, with the prefixes declared.
  Response patch(const std::string& path, const std::string& update) {
    std::string declared = prefixes();
    for (std::size_t at = 0; (at = declared.find("@prefix ", at)) != std::string::npos;) declared.replace(at, 8, "PREFIX ");
    for (std::size_t at = 0; (at = declared.find("> .", at)) != std::string::npos;) declared.replace(at, 3, ">");
    const std::string fields = "Content-Type: application/sparql-update\r\n";
    const Response response = exchanged("PATCH", path, declared + update, fields);
    print("PATCH", path, update, fields, response);
    return response;
  }
  Response options(const std::string& path, const std::string& fields = {}) { return shown("OPTIONS", path, {}, fields); }
  /// PUT with a body that is not Turtle.
  Response put_as(const std::string& type, const std::string& path, const std::string& body) {
    const std::string fields = "Content-Type: " + type + "\r\n";
    const Response response = exchanged("PUT", path, body, fields);
    print("PUT", path, body, fields, response);
    return response;
  }

  /// Repeats a GET until the response contains `text`, then prints that response.
  Response get_until(const std::string& path, std::string_view text) {
    for (;;) {
      Response response = ask("GET", path, {}, {});
      if (response.body.find(text) != std::string::npos) return print("GET", path, {}, {}, response), response;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }

  /// Shows the port of this receiver as 9000 from now on.
  void receiver(const Receiver& r) { receiver_ = r.port(); }

  /// Opens a WebSocket on a resource (RFC 6455) and prints the first message, the present representation.
  void watch(const std::string& path) {
    socket_ = connect();
    send(socket_, "GET " + path + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port_) +
                      "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                      "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n");
    arrived_.clear();
    std::size_t end = 0;
    while ((end = arrived_.find("\r\n\r\n")) == std::string::npos && receive(socket_, arrived_)) {}
    const Response response = parse(arrived_);
    std::printf("%s", steady("WebSocket " + path + "\n" + response.header.substr(9, response.header.find("\r\n") - 9) +
                             "\nLocation: " + response.field("Location") + "\n\n")
                          .c_str());
    arrived_.erase(0, end == std::string::npos ? arrived_.size() : end + 4);
    watched();
  }

  /// Waits for the next message of the WebSocket and prints it, or the close code.
  void watched() {
    const auto byte = [this](std::size_t at) { return static_cast<std::size_t>(static_cast<unsigned char>(arrived_[at])); };
    const auto have = [this](std::size_t bytes) {
      while (arrived_.size() < bytes && receive(socket_, arrived_)) {}
      return arrived_.size() >= bytes;
    };
    if (!have(2)) return;
    std::size_t size = byte(1), at = 2;
    if (size == 126 && have(4)) size = byte(2) << 8 | byte(3), at = 4;  // messages of lessons are shorter than 64 KiB
    if (!have(at + size)) return;
    std::string text = arrived_.substr(at, size);
    if ((byte(0) & 15) == 8) text = "closed with " + std::to_string((byte(at) << 8) + byte(at + 1)) + "\n", ::close(socket_);
    arrived_.erase(0, at + size);
    std::printf("message:\n%s\n", steady(readable(std::move(text))).c_str());
  }

  /// Waits for the next notification at a receiver and prints it.
  void notified(Receiver& receiver) {
    const std::string request = receiver.next();
    const Response notification{0, request.substr(0, request.find("\r\n\r\n") + 2), request.substr(request.find("\r\n\r\n") + 4)};
    std::string text = "posted to the receiver: " + request.substr(0, request.find(" HTTP/")) + "\n";
    for (const std::string name : {"Content-Type", "Link", "X-Hub-Signature"})
      if (const std::string value = notification.field(name); !value.empty())
        text += name + ": " + (name[0] == 'X' ? value.substr(0, value.find('=')) + "=<hmac of the body>" : value) + "\n";
    std::printf("%s\n", steady(text + readable(notification.body)).c_str());
    std::fflush(stdout);
  }

  /// Also prints this field from now on, one line for each member of its list.
  void show(std::string name) { more_ = std::move(name); }

  /// From now on prints only the lines of a representation that contain one of these words.
  void only(std::vector<std::string> words) { only_ = std::move(words); }

  /// Validates the state of every thing against its Blueprint. Prints a report if it does not conform.
  void check_blueprints() const {
    if (ask("GET", "/", {}, {}).status == 401) return;  // not for those without credentials
    const auto graph_of = [this](const std::string& iri) {
      const std::string body = ask("GET", iri, {}, {}).body;
      return lrt::rdf::read(body, lrt::rdf::Syntax::turtle, {iri}).value();
    };
    std::vector<std::string> open = {"http://127.0.0.1:" + std::to_string(port_) + "/"};
    while (!open.empty()) {
      const std::string at = open.back();
      open.pop_back();
      const lrt::rdf::Graph graph = graph_of(at);
      for (const lrt::Iri part : {lrt::vocab::ldp::contains, lrt::vocab::dcterms::hasPart})
        for (const auto& child : graph.objects(lrt::rdf::iri(at), part)) open.emplace_back(child.text);
      const auto state = graph.object(lrt::rdf::iri(at), lrt::vocab::lrt_::state);
      if (!state) continue;
      const auto shapes = lrt::shacl::Shapes::compile(graph_of(at + "/blueprint")).value();
      const auto report = lrt::shacl::validate(shapes, graph_of(std::string(state->text))).value();
      if (!report.conforms()) std::printf("%s does not conform to its blueprint:\n%s", at.c_str(), report.to_text().c_str());
    }
  }

  Response ask(const std::string& method, const std::string& path, const std::string& turtle, const std::string& fields) const {
    if (turtle.empty()) return exchanged(method, path, turtle, fields);
    return exchanged(method, path, prefixes() + turtle + "\n", fields + "Content-Type: text/turtle\r\n");
  }

 private:
  Response exchanged(const std::string& method, const std::string& path, const std::string& body, const std::string& fields) const {
    const std::string host = "127.0.0.1:" + std::to_string(port_);
    std::string request = method + " " + without_base(path) + " HTTP/1.1\r\nHost: " + host + "\r\nConnection: close\r\n" + fields;
    if (!body.empty() || method == "POST") request += "Content-Length: " + std::to_string(body.size()) + "\r\n";
    return parse(exchange(request + "\r\n" + body));
  }

  Response shown(const std::string& method, const std::string& path, const std::string& turtle, const std::string& fields) {
    Response response = ask(method, path, turtle, fields);
    print(method, path, turtle, fields, response);
    return response;
  }

  void print(const std::string& method, const std::string& path, const std::string& turtle, const std::string& fields, const Response& response) {
    std::string text = method + " " + without_base(path) + "\n" + fields;
    if (const std::size_t tag = text.find('"'); tag != std::string::npos) text.replace(tag, text.find('"', tag + 1) - tag + 1, "<tag>");
    if (const std::size_t until = text.find("Valid-Until: "); until != std::string::npos)
      text.replace(until, text.find('\r', until) - until, "Valid-Until: <time>");
    if (!turtle.empty()) text += "  " + turtle + "\n";
    text += response.header.substr(9, response.header.find("\r\n") - 9) + "\n";  // without "HTTP/1.1 "
    for (const std::string name : {"Content-Type", "Allow", "Location"})
      if (const std::string value = response.field(name); !value.empty() && (name != "Allow" || method == "OPTIONS" || response.status == 405))
        text += name + ": " + value + "\n";
    if (std::string value = response.field(more_); !more_.empty() && !value.empty()) {
      for (std::size_t at = 0; (at = value.find(", ", at)) != std::string::npos;) value.replace(at, 2, "\n    ");
      text += more_ + ":\n    " + value + "\n";
    }
    text += readable(response.body, response.status == 200);
    text.erase(std::remove(text.begin(), text.end(), '\r'), text.end());
    std::printf("%s\n", steady(std::move(text)).c_str());
    std::fflush(stdout);
  }

  /// Turtle without its prefixes, reduced to the lines of only().
  std::string readable(std::string body, bool choose = true) const {
    while (body.compare(0, 8, "@prefix ") == 0) body.erase(0, body.find('\n') + 1);
    if (!body.empty() && body[0] == '\n') body.erase(0, 1);
    if (!body.empty() && body.back() != '\n') body += '\n';
    return choose && !only_.empty() && body.compare(0, 7, "closed ") != 0 ? chosen(body) : body;
  }

  std::string chosen(const std::string& body) const {
    std::string lines;
    for (std::size_t at = 0, end = 0; at < body.size(); at = end + 1) {
      end = std::min(body.find('\n', at), body.size());
      const std::string line = body.substr(at, end - at);
      if (std::any_of(only_.begin(), only_.end(), [&](const std::string& w) { return line.find(w) != std::string::npos; })) lines += line + "\n";
    }
    return lines;
  }

  /// Replaces the parts that differ from run to run: ports, ids and times.
  std::string steady(std::string text) {
    for (const auto& [real, shown] : {std::pair(port_, "8080"), std::pair(receiver_, "9000")}) {
      const std::string mine = "127.0.0.1:" + std::to_string(real);
      for (std::size_t at = 0; (at = text.find(mine, at)) != std::string::npos; ++at)
        text.replace(at, mine.size(), std::string("127.0.0.1:") + shown);
    }
    const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
    for (std::size_t at = 0; (at = text.find('.', at)) != std::string::npos; ++at) {  // times with another number of decimals get six
      std::size_t end = at + 1;
      while (end < text.size() && is_digit(text[end])) ++end;
      const bool is_time = at >= 9 && text[at - 3] == ':' && text[at - 6] == ':' && text[at - 9] == 'T' && end < text.size() && text[end] == 'Z';
      if (is_time) text.replace(at, end - at, ".000000");
    }
    const auto replace = [&text](std::string_view pattern, bool (*fits)(char), auto with) {  // 'x' in a pattern: any character that fits
      for (std::size_t at = 0; at + pattern.size() <= text.size(); ++at) {
        std::size_t i = 0;
        while (i < pattern.size() && (pattern[i] == 'x' ? fits(text[at + i]) : text[at + i] == pattern[i])) ++i;
        if (i == pattern.size()) text.replace(at, i, with(text.substr(at, i)));
      }
    };
    replace(
        "xxxxxxxx-xxxx-xxxx-xxxx-xxxxxxxxxxxx", [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); },
        [this](const std::string& id) { return ids_.emplace(id, "id-" + std::to_string(ids_.size() + 1)).first->second; });
    replace(
        "xxxx-xx-xxTxx:xx:xx.xxxxxxZ", [](char c) { return c >= '0' && c <= '9'; }, [](const std::string&) { return "<time>"; });
    return text;
  }

  static std::string without_base(const std::string& uri) { return uri.compare(0, 7, "http://") == 0 ? uri.substr(uri.find('/', 7)) : uri; }

  static std::string prefixes() {
    std::string text;
    for (const auto& [name, iri] : lrt::rdf::default_prefixes()) text += "@prefix " + name + ": <" + iri + "> .\n";
    return text;
  }

  int connect() const {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port_);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
    (void)::connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to);  // an error shows at the first send()
    return fd;
  }
  static bool send(int fd, const std::string& bytes) {
    return ::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
  }
  static bool receive(int fd, std::string& bytes) {
    char part[4096];
    const ssize_t n = ::recv(fd, part, sizeof part, 0);
    if (n > 0) bytes.append(part, static_cast<std::size_t>(n));
    return n > 0;
  }
  std::string exchange(const std::string& request) const {
    const int fd = connect();
    std::string response;
    if (send(fd, request))
      while (receive(fd, response)) {}
    ::close(fd);
    return response;
  }

  static Response parse(const std::string& text) {
    const std::size_t end = text.find("\r\n\r\n");
    if (text.size() < 12 || end == std::string::npos) return {0, "HTTP/1.1 no response\r\n", {}};
    return {std::stoi(text.substr(9, 3)), text.substr(0, end + 2), text.substr(end + 4)};
  }

  std::uint16_t port_;
  std::string more_;
  std::vector<std::string> only_;
  std::map<std::string, std::string> ids_;
  std::uint16_t receiver_ = 1;  // its port
  int socket_ = -1;             // of watch()
  std::string arrived_;         // received on socket_ and not printed yet
};

/// Runs a client on a thread of its own and then stops the server, so that run() returns.
class Visitor {
 public:
  Visitor(lrt::Server& server, std::function<void(Client&)> visit) {
    if (serves()) {
      std::printf("serving at %s (Ctrl-C ends)\n", server.url().c_str());
      std::fflush(stdout);
      return;
    }
    thread_ = std::thread([this, &server, visit = std::move(visit)] {
      Client client(server.port());
      visit(client);
      client.check_blueprints();
      here_ = false;
      server.stop();
    });
  }
  ~Visitor() {
    if (thread_.joinable()) thread_.join();
  }
  Visitor(const Visitor&) = delete;
  Visitor& operator=(const Visitor&) = delete;

  /// For a loop of the lesson's own: true while the client is active.
  bool is_here() const noexcept { return here_; }

 private:
  std::atomic<bool> here_{true};
  std::thread thread_;
};

}  // namespace lesson
