// SPDX-License-Identifier: Apache-2.0
// Bearer tokens of an identity provider: JSON Web Tokens (RFC 7519), verified by libjwt in Security::authenticate. "sub" is the name of the principal, the
// words of "scope" are its roles. A browser logs in with such a token as with any other.
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

#include <lrt/lrt.hpp>

namespace {

volatile std::sig_atomic_t ended = 0;

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
    const long now = static_cast<long>(std::chrono::system_clock::to_time_t(std::chrono::system_clock::now()));
    if (jwt_get_grant_int(jwt.get(), "exp") <= now || jwt_get_grant_int(jwt.get(), "nbf") > now) return std::nullopt;
    if (text(*jwt, "iss") != issuer_ || text(*jwt, "aud") != audience_ || text(*jwt, "sub").empty()) return std::nullopt;
    std::istringstream scope(text(*jwt, "scope"));
    return lrt::security::Principal{text(*jwt, "sub"), {std::istream_iterator<std::string>(scope), {}}};
  }

 private:
  static std::string text(jwt_t& jwt, const char* claim) {
    const char* const value = jwt_get_grant(&jwt, claim);
    return value ? value : "";
  }

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
