// SPDX-License-Identifier: Apache-2.0
#include <lrt/security.hpp>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "src/security/authentication.hpp"
#include "src/security/digest.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folder.hpp"

using namespace lrt;
using namespace lrt::security;

namespace {

const std::string anna = "tok-anna-0123456789", bert = "tok-bert-0123456789";

TimePoint at(int seconds) {
  return {std::chrono::steady_clock::time_point(std::chrono::seconds(1'000'000 + seconds)),
          std::chrono::system_clock::time_point(std::chrono::seconds(1'800'000'000 + seconds))};
}

std::string error_of(const std::string& text) {
  const Result<Tokens> tokens = Tokens::parse(text);
  return tokens ? "" : tokens.error().message;
}

void put(const std::string& path, const std::string& text) { std::ofstream(path) << text; }

http::Request with_authorization(std::string_view value) {
  http::Request request;
  request.fields = {{"Host", "robot"}, {"authorization", value}};
  return request;
}

}  // namespace

TEST_CASE("tokens are read line by line, with roles, comments and times of expiry", "[security][R0.2]") {
  const Tokens tokens = Tokens::parse("# who may do what\n\nanna reader " + anna + "\n\tbert\toperator,reader  " + bert +
                                      "  2027-01-15T08:00:10Z # two roles\r\n"
                                      "carl administrator sha256:BA7816BF8F01CFEA414140DE5DAE2223B00361A396177A9CB410FF61F20015AD")
                            .value();
  CHECK(tokens.size() == 3);
  REQUIRE(tokens.find(anna, at(0).utc));
  CHECK(tokens.find(anna, at(0).utc)->name == "anna");
  CHECK(tokens.find(anna, at(0).utc)->roles == std::vector<std::string>{"reader"});
  REQUIRE(tokens.find(bert, at(9).utc));
  CHECK(tokens.find(bert, at(9).utc)->roles == std::vector<std::string>{"operator", "reader"});
  CHECK_FALSE(tokens.find(bert, at(10).utc));
  REQUIRE(tokens.find("abc", at(0).utc));  // FIPS 180-4, B.1
  CHECK(tokens.find("abc", at(0).utc)->name == "carl");
  for (const std::string& unknown : {std::string(), anna + "x", anna.substr(1), std::string("TOK-ANNA-0123456789")})
    CHECK_FALSE(tokens.find(unknown, at(0).utc));
  CHECK(Tokens::parse("").value().size() == 0);
  const Tokens marked = Tokens::parse(
                            "\xEF\xBB\xBF"
                            "anna reader " +
                            anna + "\r\n")
                            .value();
  REQUIRE(marked.find(anna, at(0).utc));
  CHECK(marked.find(anna, at(0).utc)->name == "anna");
}

TEST_CASE("a bad line of tokens is named by its number, and its token is not shown", "[security][R0.2]") {
  const std::string good = "anna reader " + anna + "\n";
  CHECK(error_of("anna reader\n") == "line 1: expected NAME ROLE TOKEN [EXPIRES]");
  CHECK(error_of(good + "bert reader " + bert + " 2027-01-01T00:00:00Z more") == "line 2: expected NAME ROLE TOKEN [EXPIRES]");
  CHECK(error_of("anna reader short") == "line 1: expected a token of 16 to 512 characters, found 5");
  CHECK(error_of("anna reader " + std::string(513, 'a')) == "line 1: expected a token of 16 to 512 characters, found 513");
  CHECK(error_of("anna reader 0123456789=abcdef") == "line 1: a token has letters, digits, -._~+/ and = at the end; found another character");
  CHECK(error_of("anna reader sha256:12") == "line 1: expected 64 hexadecimal digits after sha256:");
  CHECK(error_of("anna reader,,x " + anna) == "line 1: expected the name of a role");
  CHECK(error_of(good + "\n\nanna reader " + anna) == "line 4: the token is that of a line before");
  CHECK(error_of(good + "bert reader " + bert + " tomorrow") == "line 2: expected a time such as 2027-01-01T00:00:00Z, found \"tomorrow\"");
  CHECK(error_of("bert reader " + bert + " 2027-01-01T00:00:00").find("line 1") == 0);
}

TEST_CASE("the roles of lrt", "[security][R0.2]") {
  const Roles roles = default_roles();
  CHECK(roles.at("reader") == (Right::read | Right::subscribe));
  CHECK_FALSE(roles.at("reader").has(Right::write));
  CHECK_FALSE(roles.at("reader").has(Right::invoke));
  for (const Right right : {Right::read, Right::write, Right::invoke, Right::subscribe}) {
    CHECK(roles.at("operator").has(right));
    CHECK(Rights::all().has(right));
    CHECK_FALSE(Rights().has(right));
  }
  CHECK(Rights().empty());
}

TEST_CASE("the Authorization field gives a token or a name with a password", "[security][R0.2]") {
  using Scheme = Credentials::Scheme;
  CHECK(credentials_of(http::Request()).scheme == Scheme::none);
  const Credentials bearer = credentials_of(with_authorization("bEARER  " + anna));
  CHECK(bearer.scheme == Scheme::bearer);
  CHECK(bearer.secret == anna);
  const Credentials basic = credentials_of(with_authorization("Basic QWxhZGRpbjpvcGVuIHNlc2FtZQ=="));  // RFC 7617 2
  CHECK(basic.scheme == Scheme::basic);
  CHECK(basic.user == "Aladdin");
  CHECK(basic.secret == "open sesame");
  const Credentials colons = credentials_of(with_authorization("Basic YTpiOmM="));
  CHECK(colons.user == "a");
  CHECK(colons.secret == "b:c");
  for (const char* bad :
       {"Basic", "Basic ", "Basic YTpi", "Basic YTpiOm", "Basic YTpiOmM", "Basic Y!piOmM=", "Basic YQ==", "Basic ====", "Basic YTpiOmM=="}) {
    CAPTURE(bad);
    const Credentials credentials = credentials_of(with_authorization(bad));
    CHECK(credentials.scheme == Scheme::basic);
    if (std::string_view(bad) != "Basic YTpi") CHECK(credentials.secret.empty());
  }
  CHECK(credentials_of(with_authorization("Digest x")).scheme == Scheme::other);
  CHECK(credentials_of(with_authorization("")).scheme == Scheme::other);
  http::Request twice = with_authorization("Bearer a");
  twice.fields.push_back({"Authorization", "Bearer b"});
  CHECK(credentials_of(twice).scheme == Scheme::other);
}

TEST_CASE("a changed file of tokens counts after a second, and a broken one changes nothing", "[security][R0.2]") {
  const test::Folder folder;
  const std::string path = folder / "tokens";
  std::vector<std::string> logged;
  const LogCallback log = [&](LogLevel, std::string_view text) { logged.emplace_back(text); };
  CHECK(open_tokens(path, log).error().code == Errc::io_error);
  put(folder / "tokens", "anna nobody\n");
  CHECK(open_tokens(path, log).error().message == path + ": line 1: expected NAME ROLE TOKEN [EXPIRES]");
  put(folder / "tokens", "anna reader " + anna + "\n");
  const auto file = open_tokens(path, log).value();
  CHECK(file->content(at(0))->find(anna, at(0).utc));
  put(folder / "tokens", "bert reader,operator " + bert + "\n");
  CHECK(file->content(at(0))->find(anna, at(0).utc));  // not looked at again yet
  CHECK_FALSE(file->content(at(1))->find(anna, at(1).utc));
  CHECK(file->content(at(1))->find(bert, at(1).utc));
  put(folder / "tokens", "bert\n");
  CHECK(file->content(at(2))->find(bert, at(2).utc));
  CHECK(logged == std::vector<std::string>{"the tokens of before stay: " + path + ": line 1: expected NAME ROLE TOKEN [EXPIRES]"});
  CHECK(file->content(at(3))->find(bert, at(3).utc));
  CHECK(logged.size() == 1);  // once for each change
  std::filesystem::remove(folder / "tokens");
  CHECK(file->content(at(4))->find(bert, at(4).utc));
  CHECK(logged.size() == 2);
  put(folder / "tokens", "");
  CHECK_FALSE(file->content(at(5))->find(bert, at(5).utc));
}

TEST_CASE("a name has the roles of its first token that has not expired", "[security][R0.2]") {
  const Tokens tokens = Tokens::parse("anna reader " + anna + "1 2027-01-15T08:00:10Z\nbert reader " + bert + "\nanna operator " + anna +
                                      "2\nanna administrator " + anna + "3\ncarl reader " + anna + "4 2027-01-15T08:00:00Z")
                            .value();
  const auto roles_of = [&](std::string_view name, int second) {
    const auto found = tokens.find_name(name, at(second).utc);
    if (found) CHECK(found->name == name);
    return found ? found->roles : std::vector<std::string>{};
  };
  CHECK(roles_of("anna", 0) == std::vector<std::string>{"reader"});
  CHECK(roles_of("anna", 9) == std::vector<std::string>{"reader"});
  CHECK(roles_of("anna", 10) == std::vector<std::string>{"operator"});
  CHECK(roles_of("bert", 1'000'000) == std::vector<std::string>{"reader"});
  CHECK(tokens.find_name("carl", at(-1).utc));
  CHECK_FALSE(tokens.find_name("carl", at(0).utc));
  for (const char* const unknown : {"", "Anna", "ann", "anna1", "reader"}) CHECK_FALSE(tokens.find_name(unknown, at(0).utc));
  CHECK_FALSE(Tokens::parse("").value().find_name("anna", at(0).utc));
}

TEST_CASE("the next time at which a token expires is after now, whatever the order of the lines", "[security][R0.2]") {
  const Tokens tokens = Tokens::parse("anna reader " + anna + "1 2027-01-15T08:00:20Z\nanna reader " + anna +
                                      "2 2027-01-15T09:00:10+01:00\nbert reader " + bert + "\nbert reader " + bert + "2 2027-01-15T08:00:10Z")
                            .value();
  CHECK(tokens.next_expiry(at(-1'000'000).utc) == at(10).utc);
  CHECK(tokens.next_expiry(at(10).utc - std::chrono::microseconds(1)) == at(10).utc);
  CHECK(tokens.next_expiry(at(10).utc) == at(20).utc);
  CHECK_FALSE(tokens.next_expiry(at(20).utc));
  CHECK_FALSE(Tokens::parse("bert reader " + bert).value().next_expiry(at(0).utc));
  CHECK_FALSE(Tokens::parse("").value().next_expiry(at(0).utc));
}

TEST_CASE("a token expires in whatever year its line says, also beyond the range of the clock", "[security][R0.2]") {
  const auto lasts = [](const std::string& time) {
    const Tokens tokens = Tokens::parse("anna reader " + anna + " " + time).value();
    const bool is_known = tokens.find(anna, at(0).utc) != nullptr;
    CHECK((tokens.find_name("anna", at(0).utc) != nullptr) == is_known);
    CHECK(tokens.next_expiry(at(0).utc).has_value() == is_known);
    return is_known;
  };
  for (const char* time :
       {"2262-04-11T23:47:16Z", "2262-04-11T23:47:16.9Z", "2262-04-11T23:47:17Z", "2263-01-01T00:00:00Z", "2262-04-11T23:47:17+14:00",
        "2300-01-01T00:00:00Z", "2554-07-21T23:34:34Z", "9999-12-31T23:59:59Z", "2000000-01-01T00:00:00Z"}) {
    CAPTURE(time);
    CHECK(lasts(time));
  }
  for (const char* time :
       {"2027-01-15T08:00:00Z", "1970-01-01T00:00:00Z", "1677-09-21T00:12:44Z", "1677-09-21T00:12:43Z", "1677-01-01T00:00:00Z",
        "1500-01-01T00:00:00Z", "1385-06-13T00:25:26Z", "0001-01-01T00:00:00Z", "-0001-01-01T00:00:00Z", "-2000000-01-01T00:00:00Z"}) {
    CAPTURE(time);
    CHECK_FALSE(lasts(time));
  }
  // What nobody can count is said to the operator, not taken as another year.
  for (const char* time : {"292277026596-01-01T00:00:00Z", "-292277022000-01-01T00:00:00Z", "99999999999999999999-01-01T00:00:00Z",
                           "-99999999999999999999-01-01T00:00:00Z", "18446744073709553641-01-01T00:00:00Z", "4294969346-13-01T00:00:00Z"}) {
    CAPTURE(time);
    CHECK(error_of("anna reader " + anna + " " + time).find("line 1: expected a time") != std::string::npos);
  }
}
