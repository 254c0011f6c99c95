// SPDX-License-Identifier: Apache-2.0
#include "src/security/sealed_tokens.hpp"

#include <set>
#include <string>

#include "src/security/failed_logins.hpp"
#include "src/security/sealing.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::security;

namespace {

constexpr SealedTokens::Instant start{};
constexpr std::chrono::seconds second{1};

}  // namespace

TEST_CASE("a sealed text is read with its secret only, and a change is noticed", "[security]") {
  const std::string secret = random_secret(), other = random_secret(), text = "reader-0123456789abcdef";
  const std::string sealed = seal(secret, text);
  CHECK(unseal(secret, sealed) == text);
  CHECK(unseal(secret, seal(secret, "")) == "");
  CHECK(sealed.find("reader") == std::string::npos);
  CHECK_FALSE(unseal(other, sealed));
  CHECK_FALSE(unseal(secret, ""));
  for (std::size_t i = 0; i < sealed.size(); ++i) {
    std::string changed = sealed;
    changed[i] = static_cast<char>(changed[i] ^ 1);
    CHECK_FALSE(unseal(secret, changed));
  }
}

TEST_CASE("a secret has 256 random bits, and none comes twice", "[security]") {
  std::set<std::string> seen;
  for (int i = 0; i < 1000; ++i) {
    const std::string secret = random_secret();
    CHECK(secret.size() == 64);
    CHECK(secret.find_first_not_of("0123456789abcdef") == std::string::npos);
    CHECK(seen.insert(secret).second);
  }
}

TEST_CASE("a secret stands for its token until its time is over or it is removed", "[security]") {
  SealedTokens tokens({10 * second, 100, 100});
  const std::string secret = tokens.add("anna", "here", "a-token", start).value();
  CHECK(tokens.find(secret, "here", start + 9 * second) == "a-token");
  CHECK_FALSE(tokens.find(secret, "there", start));
  CHECK_FALSE(tokens.find(random_secret(), "here", start));
  CHECK_FALSE(tokens.find("", "here", start));
  CHECK_FALSE(tokens.find(secret, "here", start + 10 * second));
  tokens.remove(secret, "here");
  CHECK_FALSE(tokens.find(secret, "here", start));
  const std::string once = tokens.add("anna", "", "a-token", start).value();
  CHECK(tokens.take(once, "", start) == "a-token");
  CHECK_FALSE(tokens.take(once, "", start));
  const std::string late = tokens.add("anna", "", "a-token", start).value();
  CHECK_FALSE(tokens.take(late, "", start + 10 * second));
}

TEST_CASE("one owner of sealed tokens ends only their own", "[security]") {
  SealedTokens tokens({100 * second, 4, 2});
  const std::string annas = tokens.add("anna", "", "a", start).value();
  const std::string first = tokens.add("bert", "", "1", start).value(), second_one = tokens.add("bert", "", "2", start + second).value();
  const std::string third = tokens.add("bert", "", "3", start + 2 * second).value();
  CHECK_FALSE(tokens.find(first, "", start));
  CHECK(tokens.find(second_one, "", start) == "2");
  CHECK(tokens.find(third, "", start) == "3");
  CHECK(tokens.find(annas, "", start) == "a");
  CHECK(tokens.add("carl", "", "c", start));
  CHECK_FALSE(tokens.add("dora", "", "d", start));  // full
  CHECK(tokens.add("bert", "", "4", start));        // for one of their own
  CHECK(tokens.add("dora", "", "d", start + 101 * second));
}

TEST_CASE("an address with too many failed logins waits until a minute is over", "[security]") {
  FailedLogins failed(2);
  failed.add("192.0.2.1", start);
  CHECK_FALSE(failed.pause("192.0.2.1", start));
  failed.add("192.0.2.1", start + 10 * second);
  CHECK(failed.pause("192.0.2.1", start + 10 * second) == 50 * second);
  CHECK_FALSE(failed.pause("192.0.2.2", start));
  CHECK_FALSE(failed.pause("192.0.2.1", start + 60 * second));
  failed.add("192.0.2.1", start + 60 * second);
  CHECK_FALSE(failed.pause("192.0.2.1", start + 60 * second));
  failed.add("2001:db8::1", start);
  failed.add("2001:db8::2", start);
  CHECK(failed.pause("2001:db8::3", start));  // of one /64
}

TEST_CASE("addresses beyond the table of failed logins are counted as one", "[security]") {
  FailedLogins failed(2);
  for (std::size_t i = 0; i < FailedLogins::max_addresses; ++i)
    failed.add("10." + std::to_string(i / 65536) + "." + std::to_string(i / 256 % 256) + "." + std::to_string(i % 256), start);
  CHECK_FALSE(failed.pause("192.0.2.1", start));
  failed.add("192.0.2.1", start);
  failed.add("192.0.2.2", start);
  CHECK(failed.pause("192.0.2.3", start));
  CHECK_FALSE(failed.pause("10.0.0.1", start));
  failed.add("192.0.2.3", start + 60 * second);  // the others are over
  CHECK_FALSE(failed.pause("192.0.2.3", start + 60 * second));
}
