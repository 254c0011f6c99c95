// SPDX-License-Identifier: Apache-2.0
// Bearer tokens of an identity provider: JSON Web Tokens (RFC 7519), verified by libjwt in Security::authenticate. "sub" is the name of the principal, the
// words of "scope" are its roles, "exp" is when its streams end. A browser logs in with such a token as with any other.
//
//   ex_jwt KEY ISSUER AUDIENCE [PORT]     KEY: a file with the provider's public key (RSA, PEM)

#include <jwt.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <thread>
#include <utility>

#include <lrt/http/problem.hpp>
#include <lrt/lrt.hpp>

namespace {

volatile std::sig_atomic_t ended = 0;

constexpr double latest_time = 253402300799;    // the end of the year 9999 [s]
constexpr double end_of_clock = 9'000'000'000;  // system_clock ends in 2262

using Json = std::unique_ptr<char, void (*)(void*)>;  // a text of libjwt

/// The claims of a token. A claim may have any type of JSON, and only the right one counts.
class Claims {
 public:
  explicit Claims(jwt_t& jwt) : jwt_(jwt) {}

  bool has(const char* name) const { return json(name).has_value(); }
  /// A string.
  std::optional<std::string> text(const char* name) const {
    const char* const value = jwt_get_grant(&jwt_, name);
    return value ? std::optional<std::string>(value) : std::nullopt;
  }
  /// NumericDate (RFC 7519 2): a number of JSON, also with a fraction; of the years 1970 to 9999.
  std::optional<double> time(const char* name) const {
    const auto value = json(name);
    if (!value || (*value)[0] < '0' || (*value)[0] > '9') return std::nullopt;
    const double number = std::strtod(value->c_str(), nullptr);
    return number <= latest_time ? std::optional(number) : std::nullopt;
  }
  /// "aud" is a string, or an array of strings, one of which is this one (RFC 7519 4.1.3).
  bool is_for(const std::string& audience) const {
    const std::string value = json("aud").value_or("");
    const std::string wanted = lrt::http::json_string(audience);
    if (value.empty() || value[0] != '[') return value == wanted;
    bool found = false;
    std::size_t at = 0;
    do {  // jansson writes ["one","two"], without spaces
      const std::size_t begin = ++at;
      if (value[at] != '"') return false;
      for (++at; value[at] != '"'; ++at)
        if (value[at] == '\\') ++at;
      found = value.compare(begin, ++at - begin, wanted) == 0 || found;
    } while (value[at] == ',');
    return found;
  }

 private:
  /// As JSON; nullopt: it is absent.
  std::optional<std::string> json(const char* name) const {
    const Json value(jwt_get_grants_json(&jwt_, name), std::free);
    return value ? std::optional<std::string>(value.get()) : std::nullopt;
  }

  jwt_t& jwt_;
};

class TokenJudge {
 public:
  TokenJudge(std::string key, std::string issuer, std::string audience)
      : key_(std::move(key)), issuer_(std::move(issuer)), audience_(std::move(audience)) {}

  std::optional<lrt::security::Principal> operator()(const lrt::http::Request& request) const {
    constexpr std::string_view scheme = "Bearer ";
    const auto field = request.find("Authorization");
    if (!field || request.count("Authorization") != 1 || field->substr(0, scheme.size()) != scheme) return std::nullopt;
    const std::string token(field->substr(scheme.size()));
    jwt_t* decoded = nullptr;
    if (jwt_decode(&decoded, token.c_str(), reinterpret_cast<const unsigned char*>(key_.data()), static_cast<int>(key_.size())) != 0)
      return std::nullopt;
    const std::unique_ptr<jwt_t, void (*)(jwt_t*)> jwt(decoded, jwt_free);
    // The token names the algorithm that libjwt has used. "none" is no signature, and of HS256 the public key would be the secret.
    if (jwt_get_alg(jwt.get()) != JWT_ALG_RS256) return std::nullopt;
    const Json critical(jwt_get_headers_json(jwt.get(), "crit"), std::free);
    if (critical) return std::nullopt;  // RFC 7515 4.1.11: it wants what this program does not know
    const Claims claims(*jwt);
    const double now = std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
    const auto end = claims.time("exp");
    if (!end || *end <= now) return std::nullopt;
    // A claim that may be absent counts as what it says, or the token is refused: a "nbf" that is a string must not become one that is absent.
    if (claims.has("nbf") && claims.time("nbf").value_or(latest_time) > now) return std::nullopt;
    if (claims.has("iat") && !claims.time("iat")) return std::nullopt;
    const auto scope = claims.has("scope") ? claims.text("scope") : std::optional<std::string>("");
    const auto subject = claims.text("sub");
    if (claims.text("iss") != issuer_ || !claims.is_for(audience_) || !subject || subject->empty() || !scope) return std::nullopt;
    std::istringstream words(*scope);
    lrt::security::Principal principal{*subject, {std::istream_iterator<std::string>(words), {}}};
    if (*end < end_of_clock) principal.expires = std::chrono::system_clock::time_point(std::chrono::seconds(static_cast<long long>(*end)));
    return principal;
  }

 private:
  std::string key_, issuer_, audience_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) return std::fprintf(stderr, "usage: ex_jwt KEY ISSUER AUDIENCE [PORT]\n"), 2;
  std::ifstream file(argv[1]);
  std::string key((std::istreambuf_iterator<char>(file)), {});
  if (key.empty()) return std::fprintf(stderr, "ex_jwt: %s cannot be read, or is empty\n", argv[1]), 1;

  lrt::Options options;
  options.listen.port = static_cast<std::uint16_t>(argc > 4 ? std::atoi(argv[4]) : 8080);
  options.security.authenticate = TokenJudge(std::move(key), argv[2], argv[3]);
  options.security.roles = {{"read", lrt::security::Right::read | lrt::security::Right::subscribe}, {"move", lrt::security::Rights::all()}};
  auto server = lrt::Server::create(std::move(options));
  if (!server) return std::fprintf(stderr, "ex_jwt: %s\n", server.error().message.c_str()), 1;

  double angle = 12.5;
  lrt::Thing arm{"arm"};
  arm.property(
         "angle", [&] { return angle; }, lrt::unit::degree)
      .on_write([&](double written) { angle = written; });
  if (!server->add(std::move(arm))) return 1;

  std::signal(SIGINT, [](int) { ended = 1; });
  std::signal(SIGTERM, [](int) { ended = 1; });
  std::printf("listening on %s\n", server->url().c_str());
  std::fflush(stdout);
  while (ended == 0) {
    server->poll();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  server->stop();
}
