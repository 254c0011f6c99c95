#include "src/transport/classic/httplib_heads.hpp"

#include <httplib.h>

#include <cstring>
#include <exception>

#include "src/base/ascii.hpp"
#include "src/transport/classic/sigpipe.hpp"

namespace lrt::transport {
namespace {

/// Stand-ins that no head has which check_raw_head() passed. cpp-httplib decodes %XX in values and in the path, refuses a second '?', and
/// drops fields without a value.
constexpr char percent = '\x01';
constexpr char question = '\x02';
constexpr char nothing = '\x03';
/// Before each name goes the number of its field, in ascending digits that cpp-httplib does not know from '%' and ':'. Without it, cpp-httplib
/// acts on Range, Expect and Connection, mixes fields of its own (REMOTE_ADDR) with the client's, and loses their order. It also keeps the
/// comparisons in its map short.
constexpr std::string_view digits = "!\"#$&'()*+,-./0123456789;<=>?@";
constexpr std::size_t number_size = 3;
constexpr std::size_t most_fields = digits.size() * digits.size() * digits.size();

void replace(char* text, std::size_t size, char from, char to) noexcept {
  for (char* const end = text + size; (text = static_cast<char*>(std::memchr(text, from, static_cast<std::size_t>(end - text)))) != nullptr;) {
    *text++ = to;
  }
}

/// What cpp-httplib takes for a connection.
class Memory : public httplib::Stream {
 public:
  explicit Memory(std::string_view input) : input_(input) {}

  bool is_readable() const override { return true; }
  bool is_writable() const override { return true; }
  ssize_t read(char* into, std::size_t) override {  // is asked for one byte at a time
    if (input_.empty()) return 0;
    *into = input_.front();
    input_.remove_prefix(1);
    return 1;
  }
  ssize_t write(const char*, std::size_t size) override { return static_cast<ssize_t>(size); }
  void get_remote_ip_and_port(std::string&, int&) const override {}
  void get_local_ip_and_port(std::string&, int&) const override {}
  socket_t socket() const override { return INVALID_SOCKET; }

 private:
  std::string_view input_;
};

/// Takes a response's head with another status line: cpp-httplib knows the phrases of older RFCs, and calls a status that it does not know
/// "Internal Server Error".
class Head final : public Memory {
 public:
  Head(std::string& out, int status) : Memory("GET / HTTP/1.1\r\n\r\n"), out_(out), status_(status) {}

  ssize_t write(const char* text, std::size_t size) override {
    std::string_view rest(text, size);
    if (!begun_) {
      const auto end = rest.find("\r\n");
      if (end == std::string_view::npos) return static_cast<ssize_t>(size);
      begun_ = true;
      rest.remove_prefix(end);
      out_ += "HTTP/1.1 ";
      out_ += std::to_string(status_);
      out_ += ' ';
      out_ += http::reason_phrase(status_);
    }
    out_ += rest;
    return static_cast<ssize_t>(size);
  }
  bool begun() const noexcept { return begun_; }

 private:
  std::string& out_;
  int status_;
  bool begun_ = false;
};

}  // namespace

class HttplibHeads::Server final : public httplib::Server {
 public:
  Server() {
    set_pre_routing_handler([this](const httplib::Request&, httplib::Response& response) {
      response.status = response_ != nullptr ? response_->status : 200;
      return HandlerResponse::Handled;
    });
    // The last to be asked before the fields are written: what cpp-httplib has put there (Keep-Alive, Content-Length: 0) goes.
    set_post_routing_handler([this](const httplib::Request&, httplib::Response& response) {
      response.headers.clear();
      if (response_ != nullptr) fill(response.headers);
    });
    take_ = [this](httplib::Request& found) { take(found); };
  }

  std::optional<http::Refusal> read(std::string_view head, std::string& kept, http::Request& request) {
    head_ = head;
    kept_ = &kept;
    request_ = &request;
    request.fields.clear();
    const std::size_t fields = present(head);
    if (fields > most_fields) return http::Refusal{431, "more than " + std::to_string(most_fields) + " header fields"};
    taken_ = false;
    Memory memory(presented_);
    process(memory, take_);
    if (!taken_) return http::Refusal{400, "the head cannot be parsed"};
    if (request.fields.size() != fields) {
      return http::Refusal{400, "the head cannot be parsed: expected " + std::to_string(fields) + " fields, found " +
                                    std::to_string(request.fields.size())};
    }
    return std::nullopt;
  }

  bool write(std::string& out, const http::Response& response, std::string_view date, bool keep_alive, int version) {
    response_ = &response;
    date_ = date;
    added_ = http::added_fields(response, keep_alive, version);
    Head head(out, response.status);
    const bool good = process(head, nullptr);
    response_ = nullptr;
    return good && head.begun();
  }

 private:
  /// `close`: without it, it would say how long it keeps the connection.
  bool process(Memory& memory, const std::function<void(httplib::Request&)>& setup) {
    bool closed = false;
    try {
      return process_request(memory, true, closed, setup);
    } catch (...) {  // no memory
      return false;
    }
  }

  /// The head as cpp-httplib leaves it alone, in presented_. The method is not its business: it refuses all but ten.
  /// @return  the number of fields
  std::size_t present(std::string_view head) {
    presented_.assign("GET");
    method_ = head.substr(0, head.find(' '));
    std::size_t end = head.find("\r\n") + 2;
    presented_.append(head, method_.size(), end - method_.size());
    replace(presented_.data(), presented_.size(), '?', question);
    std::size_t count = 0;
    while (end + 2 < head.size()) {
      const std::size_t begin = end;
      end = head.find("\r\n", begin) + 2;
      presented_ += digits[count / digits.size() / digits.size() % digits.size()];
      presented_ += digits[count / digits.size() % digits.size()];
      presented_ += digits[count % digits.size()];
      presented_.append(head, begin, end - begin);
      std::size_t last = end - 3;
      while (detail::is_ows(head[last])) --last;
      if (head[last] == ':' && head.find(':', begin) == last) presented_.insert(presented_.size() - 2, 1, nothing);
      ++count;
    }
    replace(presented_.data(), presented_.size(), '%', percent);
    presented_ += "\r\n";
    return count;
  }

  void take(const httplib::Request& found) {
    auto& request = *request_;
    kept_->clear();
    kept_->reserve(head_.size());  // more than is put there: the views stay
    request.method = method_;
    request.target = keep(found.target);
    request.version = found.version == "HTTP/1.0" ? 10 : 11;
    for (const auto& [name, value] : found.headers) {
      if (name.front() > digits.back()) break;  // cpp-httplib's own
      const auto kept_name = keep(std::string_view(name).substr(number_size));
      request.fields.push_back({kept_name, keep(value.size() == 1 && value.front() == nothing ? std::string_view() : value)});
    }
    replace(kept_->data(), kept_->size(), percent, '%');
    replace(kept_->data(), kept_->size(), question, '?');
    taken_ = true;
  }
  std::string_view keep(std::string_view text) {
    const std::size_t at = kept_->size();
    *kept_ += text;
    return std::string_view(*kept_).substr(at);
  }

  void fill(httplib::Headers& headers) const {
    for (const auto& [name, value] : response_->fields.list()) headers.emplace(name, value);
    if (added_.date) headers.emplace("Date", date_);
    if (added_.content_length) headers.emplace("Content-Length", std::to_string(response_->content().size()));
    if (!added_.connection.empty()) headers.emplace("Connection", added_.connection);
  }

  std::function<void(httplib::Request&)> take_;
  std::string presented_;
  std::string_view head_;
  std::string_view method_;
  std::string* kept_ = nullptr;
  http::Request* request_ = nullptr;
  bool taken_ = false;

  const http::Response* response_ = nullptr;
  std::string_view date_;
  http::AddedFields added_;
};

HttplibHeads::HttplibHeads() {
  const KeptSigpipe kept;
  server_ = std::make_unique<Server>();
}

HttplibHeads::~HttplibHeads() = default;

std::optional<http::Refusal> HttplibHeads::read(std::string_view head, std::string& kept, http::Request& request) {
  return server_->read(head, kept, request);
}

void HttplibHeads::write(std::string& out, const http::Response& response, std::string_view date, bool keep_alive, int version) {
  const std::size_t before = out.size();
  if (server_->write(out, response, date, keep_alive, version)) return;
  out.resize(before);
  http::write_head(out, response, date, keep_alive, version);
}

}  // namespace lrt::transport
