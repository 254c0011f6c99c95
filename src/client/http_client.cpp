// SPDX-License-Identifier: Apache-2.0
#include "src/client/http_client.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <optional>
#include <set>
#include <system_error>
#include <utility>

#include "src/base/ascii.hpp"
#include "src/base/base64.hpp"
#include "src/base/read_file.hpp"
#include "src/base/utf8.hpp"
#include "src/client/names.hpp"
#include "src/client/robot_times.hpp"
#include "src/exchange/connect.hpp"
#include "src/exchange/idle_wires.hpp"
#include "src/exchange/no_sigpipe.hpp"
#include "src/exchange/redirect.hpp"
#include "src/http/host.hpp"
#include "src/http/robot_time.hpp"

namespace lrt::client {
inline namespace v0 {
namespace {

using exchange::Instant;
using exchange::WaitLimit;
using exchange::Wire;
using lrt::detail::iequals_ascii;

constexpr std::chrono::seconds connection_idle_time{15};

bool is_safe(std::string_view method) noexcept { return method == "GET" || method == "HEAD" || method == "OPTIONS"; }

const std::string* field_of(const Request& request, std::string_view name) noexcept {
  for (const auto& [known, value] : request.fields)
    if (iequals_ascii(known, name)) return &value;
  return nullptr;
}

/// A request that may change something. A query in a POST changes nothing (SPARQL 1.1 Protocol 2.1).
bool is_command(const Request& request) {
  if (is_safe(request.method)) return false;
  const std::string* const type = request.method == "POST" ? field_of(request, "Content-Type") : nullptr;
  return !type || (type->rfind("application/sparql-query", 0) != 0 && type->rfind("application/x-www-form-urlencoded", 0) != 0);
}

/// The client waits for the response itself, however long the robot needs (RFC 7240 4.3).
bool waits(const Request& request) {
  for (const auto& [name, value] : request.fields)
    if (iequals_ascii(name, "Prefer") && lrt::detail::lower(value).find("wait") != std::string::npos) return true;
  return false;
}

/// A response is expected that much before the end of a command's life: it may be at the end that a server says how far the command is.
std::chrono::milliseconds way_back(std::chrono::milliseconds life) { return std::min(life / 8, std::chrono::milliseconds(100)); }

Result<std::string> read_token(const std::string& file) {
  constexpr std::size_t longest = 64 * 1024;
  const Result<std::string> text = read_file(file, longest);
  if (!text) return unexpected(Errc::invalid_option, "token file " + text.error().message);
  const std::string_view line = utf8::without_mark(*text);
  const std::string token(lrt::detail::trim(line.substr(0, line.find_first_of("\r\n"))));
  if (token.empty()) return unexpected(Errc::invalid_option, "token file \"" + file + "\": expected a token in the first line");
  return token;
}

/// CommandTime::end() of each thread.
Instant& end_of_command() noexcept {
  thread_local Instant end = Instant::max();
  return end;
}

/// What its sender is told of a command that was sent, or in part.
std::string not_confirmed(const Request& request) {
  const bool expires = field_of(request, http::valid_until_field) != nullptr;
  return std::string("; the ") + request.method + " is not confirmed: it may have been carried out" +
         (expires ? ", and will not be carried out later" : "") + "; read what it changes";
}

class HttpClientImpl final : public HttpClient {
 public:
  using Tls = std::shared_ptr<const exchange::ClientTls>;
  /// @param own  with the client's certificate; @param anonymous  without
  HttpClientImpl(const Options& options, Tls own, Tls anonymous, std::string token, int stop_descriptor)
      : HttpClient(options),
        own_tls_(std::move(own)),
        anonymous_tls_(std::move(anonymous)),
        names_(options.threads),
        token_(std::move(token)),
        stop_descriptor_(stop_descriptor) {}
  ~HttpClientImpl() override { ::close(stop_descriptor_); }
  HttpClientImpl(const HttpClientImpl&) = delete;
  HttpClientImpl& operator=(const HttpClientImpl&) = delete;

  Result<Response> send(const Request& given) override {
    Request request = given;
    WaitLimit limit{std::chrono::steady_clock::now() + options_.limits.response_time, stop_descriptor_};  // of all redirects together
    if (is_safe(request.method)) limit.until = std::min(limit.until, CommandTime::end());
    if (Result<void> limited = set_life(request, limit); !limited) return unexpected(std::move(limited).error());
    bool has_new_token = false, is_elsewhere = false;
    for (unsigned redirects = 0;;) {
      if (const std::size_t mark = request.url.find('#'); mark != std::string::npos) request.url.resize(mark);
      const Result<http::Url> url = http::parse_url(request.url);
      if (!url) return unexpected(url.error().code, "\"" + request.url + "\": " + url.error().message);
      Result<Response> response = once(request, *url, is_elsewhere, limit);
      log(request, response);
      if (!response) return response;
      response->url = request.url;
      if (response->status == 401 && !has_new_token && !is_elsewhere && reload_token(*url)) {
        has_new_token = true;
        continue;
      }
      Result<std::optional<exchange::Redirect>> found = exchange::redirect_of(response->status, response->fields, request.method, request.url);
      if (!found) return unexpected(std::move(found).error());
      if (!*found) return response;
      if (++redirects > options_.limits.max_redirects)
        return unexpected(Errc::limit_exceeded, "\"" + given.url + "\": more than " + std::to_string(options_.limits.max_redirects) + " redirects");
      exchange::Redirect& next = **found;
      if (next.leaves_origin && stays_on_origins_)
        return unexpected(Errc::refused,
                          "\"" + request.url + "\": it redirects the " + request.method + " to \"" + next.url + "\", which is of another origin");
      if (next.leaves_origin) {
        is_elsewhere = true;
        const auto secret = [](const auto& field) {
          return iequals_ascii(field.first, "Authorization") || iequals_ascii(field.first, "Cookie") || iequals_ascii(field.first, "Control-Id");
        };
        request.fields.erase(std::remove_if(request.fields.begin(), request.fields.end(), secret), request.fields.end());
      }
      if (next.method != request.method) {
        request.body.clear();
        const auto describes_body = [](const auto& field) { return iequals_ascii(field.first, "Content-Type"); };
        request.fields.erase(std::remove_if(request.fields.begin(), request.fields.end(), describes_body), request.fields.end());
      }
      request.method = std::move(next.method);
      request.url = std::move(next.url);
    }
  }

  Result<std::unique_ptr<Wire>> connect(const http::Url& url, WaitLimit limit, bool is_elsewhere) override {
    return open(url, limit, is_elsewhere || !is_trusted(url));
  }

  bool is_trusted(const http::Url& url) const override {
    const std::lock_guard lock(mutex_);
    return trusted_.count(url.origin()) != 0;
  }

  std::vector<std::pair<std::string, std::string>> identity_fields(const http::Url& url) override {
    const std::lock_guard lock(mutex_);
    std::vector<std::pair<std::string, std::string>> result;
    if (trusted_.count(url.origin()) == 0) return result;
    const Identity& identity = options_.identity;
    if (!token_.empty()) {
      result.emplace_back("Authorization", "Bearer " + token_);
    } else if (!identity.user.empty() && (url.secure || http::is_this_machine(url.host))) {
      result.emplace_back("Authorization", "Basic " + lrt::detail::base64(identity.user + ":" + identity.password));
    }
    result.insert(result.end(), identity.fields.begin(), identity.fields.end());
    return result;
  }
  void trust(const http::Url& url) override {
    const std::lock_guard lock(mutex_);
    trusted_.insert(url.origin());
  }
  void add_control(const std::string& origin, const std::string& id) override {
    const std::lock_guard lock(mutex_);
    if (!id.empty()) controls_.emplace_back(origin, id);
  }
  void remove_control(const std::string& origin, const std::string& id) noexcept override {
    const std::lock_guard lock(mutex_);
    const auto found = std::find_if(controls_.begin(), controls_.end(), [&](const auto& c) { return c.first == origin && c.second == id; });
    if (found != controls_.end()) controls_.erase(found);
  }
  void stop() noexcept override {
    stopped_ = true;
    const std::uint64_t one = 1;
    [[maybe_unused]] const auto written = ::write(stop_descriptor_, &one, sizeof one);
  }
  int stop_descriptor() const noexcept override { return stop_descriptor_; }

  RobotTimes& robot_times() noexcept override { return times_; }

 private:
  /// Gives a command the time until which it is worth carrying out, and its sender a limit to wait for the response.
  Result<void> set_life(Request& request, WaitLimit& limit) {
    auto life = request.life.value_or(options_.command_life);
    if (life.count() <= 0 || !is_command(request) || field_of(request, http::valid_until_field)) return {};
    const Result<http::Url> url = http::parse_url(request.url);
    if (!url) return {};  // send() says what is wrong with it
    const Instant begin = std::chrono::steady_clock::now();
    life = std::min(life, std::chrono::duration_cast<std::chrono::milliseconds>(CommandTime::end() - begin));
    const std::string origin = url->origin();
    if (times_.must_ask(origin, url->target, life, begin)) {
      const Request question{"OPTIONS", request.url, {}, {}};
      Result<Response> answer = once(question, *url, false, {std::min(limit.until, begin + life), stop_descriptor_});
      log(question, answer);
      if (!answer) return unexpected(answer.error().code, answer.error().message + "; the command was not sent");
    }
    // The question has taken a part of the life.
    const Instant now = std::chrono::steady_clock::now();
    const auto rest = life - way_back(life) - std::chrono::duration_cast<std::chrono::milliseconds>(now - begin);
    const auto until = times_.until(origin, url->target, std::max(rest, std::chrono::milliseconds(0)), now);
    if (!until) return {};
    request.fields.emplace_back(http::valid_until_field, *until);
    if (!waits(request)) limit.until = std::min(limit.until, begin + life);
    return {};
  }

  Result<std::unique_ptr<Wire>> open(const http::Url& url, WaitLimit limit, bool anonymous) {
    const Instant now = std::chrono::steady_clock::now();
    const Result<std::vector<Address>> found = names_.find(url.host, {std::min(limit.until, now + options_.limits.resolve_time), stop_descriptor_});
    if (!found) return unexpected(found.error());
    std::vector<const Address*> addresses;
    for (const Address& address : *found) addresses.push_back(&address);
    const exchange::NoSigpipe guard(url.secure);
    return exchange::connect(url, addresses, [&] { return tls(anonymous); },
                             {std::min(limit.until, std::chrono::steady_clock::now() + options_.limits.connect_time), stop_descriptor_});
  }

  /// "GET http://robot/arm: 200"
  void log(const Request& request, const Result<Response>& response) const {
    if (!options_.log) return;
    try {
      options_.log(LogLevel::debug, request.method + " " + request.url + ": " +
                                        (response ? std::to_string(response->status) : std::string(to_string(response.error().code))));
    } catch (...) {}  // user code: its error cannot be reported
  }

  /// One exchange, without regard to redirects.
  Result<Response> once(const Request& request, const http::Url& url, bool is_elsewhere, WaitLimit limit) {
    if (stopped_) return unexpected(Errc::cancelled, "\"" + request.url + "\": the client stops");
    const auto identity = is_elsewhere ? std::vector<std::pair<std::string, std::string>>() : identity_fields(url);
    exchange::Request sent{request.method, url.target, url.authority, {}, request.body};
    for (const auto& [name, value] : request.fields) sent.fields.push_back({name, value});
    for (const auto& own : identity) {
      const bool given = std::any_of(request.fields.begin(), request.fields.end(), [&](const auto& f) { return iequals_ascii(f.first, own.first); });
      if (!given) sent.fields.push_back({own.first, own.second});
    }
    const std::string control = is_elsewhere || request.method == "GET" || request.method == "HEAD" ? std::string() : control_id(request, url);
    if (!control.empty()) sent.fields.push_back({"Control-Id", control});
    // A certificate is shown by the connection, so a request without the identity needs one of its own.
    const bool anonymous = is_elsewhere || !is_trusted(url);
    const std::string peer = (anonymous ? "anonymous " : "own ") + url.origin();
    // A server may close an idle connection at the moment when it is used again. A request that must not be sent twice gets a new one
    // (RFC 9112 9.3.1).
    std::unique_ptr<Wire> wire = is_safe(request.method) ? take_idle(peer) : nullptr;
    while (true) {
      const bool is_fresh = wire == nullptr;
      if (is_fresh) {
        Result<std::unique_ptr<Wire>> made = open(url, limit, anonymous);
        if (!made) return unexpected(std::move(made).error());
        wire = *std::move(made);
      }
      const exchange::NoSigpipe guard(url.secure);
      std::string body;
      exchange::Receiver receiver;
      receiver.body = [&](std::string_view bytes) {
        body.append(bytes);
        return true;
      };
      exchange::Outcome outcome =
          exchange::exchange(*wire, sent, {options_.limits.max_header_bytes, options_.limits.max_body_bytes}, limit, receiver);
      if (outcome.silent && !is_fresh) {
        wire = nullptr;
        continue;
      }
      if (outcome.keep) put_idle(peer, std::move(wire));
      else wire->end();
      if (outcome.header.status == 0) {
        const bool may_be_done = is_command(request) && outcome.code != Errc::cancelled;
        return unexpected(may_be_done ? Errc::unconfirmed : outcome.code,
                          "\"" + request.url + "\": " + outcome.error + (may_be_done ? not_confirmed(request) : std::string()));
      }
      times_.heard(url.origin(), url.target, outcome.header.fields.find(http::robot_time_field), std::chrono::steady_clock::now());
      return Response{outcome.header.status, std::move(outcome.header.fields), std::move(body), {}};
    }
  }

  /// What a command to this origin adds; empty: nothing.
  std::string control_id(const Request& request, const http::Url& url) const {
    for (const auto& [name, value] : request.fields)
      if (iequals_ascii(name, "Control-Id")) return {};
    const std::lock_guard lock(mutex_);
    for (const auto& [origin, id] : controls_)
      if (origin == url.origin()) return id;
    return {};
  }

  std::unique_ptr<Wire> take_idle(const std::string& peer) {
    while (true) {
      std::unique_ptr<Wire> wire;
      {
        const std::lock_guard lock(mutex_);
        wire = idle_.take(peer);
      }
      if (!wire || wire->is_idle()) return wire;
    }
  }
  void put_idle(const std::string& peer, std::unique_ptr<Wire> wire) {
    std::vector<std::unique_ptr<Wire>> surplus;
    {
      const std::lock_guard lock(mutex_);
      idle_.put(peer, std::move(wire));
      surplus = idle_.take_surplus(options_.limits.max_idle_connections, std::chrono::steady_clock::now() - connection_idle_time);
    }
    for (const auto& old : surplus) old->end();
  }
  /// True if the file has another token than the one that was refused.
  bool reload_token(const http::Url& url) {
    const std::lock_guard lock(mutex_);
    if (options_.identity.token_file.empty() || trusted_.count(url.origin()) == 0) return false;
    Result<std::string> read = read_token(options_.identity.token_file);
    if (!read || *read == token_) return false;
    token_ = *std::move(read);
    return true;
  }

  /// Without files of the options it is made when it is first needed: to read the authorities of the system takes longer than a request.
  Result<Tls> tls(bool anonymous) {
    const std::lock_guard lock(mutex_);
    if (!own_tls_) {
      Result<Tls> made = exchange::ClientTls::make({});
      if (!made) return made;
      own_tls_ = anonymous_tls_ = *std::move(made);
    }
    return anonymous ? anonymous_tls_ : own_tls_;
  }

  Tls own_tls_, anonymous_tls_;  // null: not made yet
  NameResolver names_;
  mutable std::mutex mutex_;
  std::string token_;
  std::set<std::string> trusted_;
  std::vector<std::pair<std::string, std::string>> controls_;  ///< origins and ids of control
  exchange::IdleWires idle_;
  RobotTimes times_;
  const int stop_descriptor_;
  std::atomic<bool> stopped_{false};
};

}  // namespace

CommandTime::CommandTime(std::chrono::milliseconds life) noexcept : before_(end_of_command()) {
  if (life.count() > 0) end_of_command() = std::min(before_, std::chrono::steady_clock::now() + life);
}
CommandTime::~CommandTime() { end_of_command() = before_; }
Instant CommandTime::end() noexcept { return end_of_command(); }

Result<std::shared_ptr<HttpClient>> HttpClient::create(const Options& options) {
  const Identity& identity = options.identity;
  const auto must_be_positive = [](std::chrono::milliseconds time, const char* name) -> Result<void> {
    if (time.count() > 0) return {};
    return unexpected(Errc::invalid_option, std::string(name) + " of a client: expected more than 0");
  };
  const Limits& limits = options.limits;
  for (const auto& [time, name] :
       {std::pair{limits.resolve_time, "resolve_time"}, {limits.connect_time, "connect_time"}, {limits.response_time, "response_time"}})
    if (Result<void> good = must_be_positive(time, name); !good) return unexpected(std::move(good).error());
  if (identity.certificate_file.empty() != identity.key_file.empty())
    return unexpected(Errc::invalid_option, "certificate_file and key_file of a client: expected both or none");
  std::string token = identity.token;
  if (!identity.token_file.empty()) {
    if (!token.empty()) return unexpected(Errc::invalid_option, "token and token_file of a client: expected only one");
    Result<std::string> read = read_token(identity.token_file);
    if (!read) return unexpected(std::move(read).error());
    token = *std::move(read);
  }
  for (const char c : token)
    if (!lrt::detail::is(c, lrt::detail::uri))
      return unexpected(Errc::invalid_option, "token of a client: expected no white space or control character");
  const bool has_files = !options.ca_file.empty() || !identity.certificate_file.empty();
  Result<std::shared_ptr<const exchange::ClientTls>> tls = std::shared_ptr<const exchange::ClientTls>();
  if (has_files) tls = exchange::ClientTls::make(options.ca_file, identity.certificate_file, identity.key_file);
  if (!tls) return unexpected(std::move(tls).error());
  auto anonymous = tls;
  if (!identity.certificate_file.empty()) anonymous = exchange::ClientTls::make(options.ca_file);
  if (!anonymous) return unexpected(std::move(anonymous).error());
  const int descriptor = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (descriptor < 0) return unexpected(Errc::io_error, "cannot create an event descriptor: " + std::system_category().message(errno));
  auto client = std::make_shared<HttpClientImpl>(options, *std::move(tls), *std::move(anonymous), std::move(token), descriptor);
  for (const std::string& origin : identity.trusted_origins) {
    const Result<http::Url> url = http::parse_url(origin);
    if (!url || url->target != "/") return unexpected(Errc::invalid_option, "trusted origin \"" + origin + "\": expected scheme, host and port");
    client->trust(*url);
  }
  return std::shared_ptr<HttpClient>(std::move(client));
}

std::optional<std::chrono::seconds> retry_after(const http::Fields& fields) {
  const std::string_view text = fields.find("Retry-After").value_or(std::string_view());
  unsigned value = 0;
  const auto parsed = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || parsed.ec != std::errc() || parsed.ptr != text.data() + text.size()) return std::nullopt;
  return std::chrono::seconds(value);
}

}  // namespace v0
}  // namespace lrt::client
