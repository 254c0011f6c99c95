// SPDX-License-Identifier: Apache-2.0
#include "src/shacl/regex.hpp"

#include <string>

#include "tests/support/catch.hpp"

namespace {

using lrt::shacl::Regex;
using Outcome = Regex::Outcome;

Regex compiled(std::string_view pattern, std::string_view flags = "") {
  auto regex = Regex::compile(pattern, flags, 1000);
  if (!regex) FAIL(pattern << ": " << regex.error().message);
  return *std::move(regex);
}

Outcome outcome(std::string_view pattern, std::string_view subject, std::string_view flags = "") {
  Regex::Scratch scratch;
  std::size_t steps = 0;
  return compiled(pattern, flags).search(subject, scratch, steps);
}

std::string repeated(std::string_view text, std::size_t bytes) {
  std::string out;
  while (out.size() < bytes) out += text;
  return out;
}

struct Attack {
  const char *pattern, *repeat, *end;
};

// A quadratic search, a match that backtracks, items that read many characters before they fail, and back references.
const Attack attacks[] = {
    {"[0-9]+ kg", "1", "g"}, {"\\p{L}+\\d", "ä", ""}, {"[a-z]*[a-z]*!", "a", "b!c"}, {"\\d{3000}x", "1", "x"},   {"(?:\\d{2000}y|z)x", "1", "zyx"},
    {"(a+)\\1x", "a", "bx"}, {"(?:a+)+b", "a", "cb"}, {".*=", "x", "\n=y"},          {"(?=.*=)[^x]=", "x", "="}, {"\\w+@\\w+\\.com", "a@", ".com"},
};

}  // namespace

TEST_CASE("the work of a search is linear in its subject, whatever the pattern", "[shacl]") {
  for (const Attack& attack : attacks) {
    const Regex regex = compiled(attack.pattern);
    for (const std::size_t size : {std::size_t{1} << 16, std::size_t{1} << 17, std::size_t{1} << 18}) {
      INFO(attack.pattern << " on " << size << " bytes");
      const std::string subject = repeated(attack.repeat, size) + attack.end;
      Regex::Scratch scratch;
      std::size_t steps = 0;
      (void)regex.search(subject, scratch, steps);
      CHECK(steps < 300'000 + 10 * subject.size());
    }
  }
}

TEST_CASE("a quadratic search is undecided", "[shacl]") {
  const std::string digits = repeated("1", 1 << 16);
  CHECK(outcome("[0-9]+ kg", digits + "g") == Outcome::undecided);
  CHECK(outcome("\\d{3000}x", digits + "yx") == Outcome::undecided);
  CHECK(outcome("([0-9]+)\\1 kg", digits + "g") == Outcome::undecided);
  CHECK(outcome("[0-9]+ kg", digits + " kg") == Outcome::match);
  CHECK(outcome("^[0-9]+ kg", digits + "g") == Outcome::no_match);
  CHECK(outcome("[0-9]+ kg", repeated("12 lb, ", 1 << 16) + "g") == Outcome::no_match);
  CHECK(outcome("kg|lb|[xyz]1", repeated("a k l ", 1 << 18)) == Outcome::no_match);
}

TEST_CASE("searches with one Scratch share a reserve, so that many short ones are no way around the bound", "[shacl]") {
  const Regex regex = compiled("^(a+)+$");
  const std::string subject = std::string(40, 'a') + "!";
  Regex::Scratch scratch;
  std::size_t steps = 0;
  for (int i = 0; i < 2'000; ++i) CHECK(regex.search(subject, scratch, steps) != Outcome::match);
  CHECK(steps < 300'000 + 2'000 * (100 + 10 * subject.size()));
  CHECK(regex.search("aaa", scratch, steps) == Outcome::match);
}

TEST_CASE("with the flag q every character stands for itself", "[shacl]") {
  CHECK(outcome("a.b*[c]\\d(?C){2}", "xa.b*[c]\\d(?C){2}x", "q") == Outcome::match);
  CHECK(outcome("a.b", "axb", "q") == Outcome::no_match);
  CHECK(outcome("_ ä\n#", "_ ä\n#", "qx") == Outcome::match);
  CHECK(outcome("É$", "é$", "qi") == Outcome::match);
  CHECK(outcome("a\\", "b\na\\", "qm") == Outcome::match);
}

TEST_CASE("expressions match as in XPath", "[shacl]") {
  CHECK(outcome("^(a|b)*$", repeated("ab", 3'000)) == Outcome::match);
  CHECK(outcome("^[a-z-[aeiou]]+$", "xyz") == Outcome::match);
  CHECK(outcome("^[a-z-[aeiou]]+$", "xyza") == Outcome::no_match);
  CHECK(outcome("^([a-z]+)-\\1$", "left-left") == Outcome::match);
  CHECK(outcome("^([a-z]+)-\\1$", "left-right") == Outcome::no_match);
  CHECK(outcome("^\\i\\c*$", "ns:name") == Outcome::match);
  CHECK(outcome("^a b$", "ab", "x") == Outcome::match);
}

TEST_CASE("a regular expression replaces what it matches, as XPath says", "[shacl][query]") {
  using Replaced = Regex::Replaced;
  Regex::Scratch scratch;
  std::size_t steps = 0;
  std::string result;
  const auto replace = [&](std::string_view subject, std::string_view pattern, std::string_view replacement, std::string_view flags = "",
                           std::size_t max_bytes = 1000) {
    return compiled(pattern, flags).replace(subject, replacement, max_bytes, scratch, steps, result);
  };
  const auto replaced = [&](std::string_view subject, std::string_view pattern, std::string_view replacement, std::string_view flags = "") {
    CHECK(replace(subject, pattern, replacement, flags) == Replaced::done);
    return result;
  };
  CHECK(replaced("abracadabra", "bra", "*") == "a*cada*");
  CHECK(replaced("abracadabra", "a.*?a", "*") == "*c*bra");
  CHECK(replaced("AAAA", "A+?", "b") == "bbbb");
  CHECK(replaced("darted", "^(.*?)d(.*)$", "$1c$2") == "carted");
  CHECK(replaced("abc", "(a)", "$12$3\\$\\\\") == "a2$\\bc");  // there is one group: $1, then 2; $3 is nothing
  CHECK(replaced("äxä", "x", "$0$0") == "äxxä");
  CHECK(replaced("a$b", "$", "\\$", "q") == "a\\$b");
  CHECK(replaced("", "a", "b").empty());
  CHECK(replaced("abc", "x", "b") == "abc");
  CHECK(replace("aaa", "a*", "b") == Replaced::invalid);
  CHECK(replace("aaa", "(?=a)", "b") == Replaced::invalid);
  CHECK(replace("aaa", "a", "\\n") == Replaced::invalid);
  CHECK(replace("aaa", "a", "$x") == Replaced::invalid);
  CHECK(replace("aaa", "a", "$") == Replaced::invalid);
  CHECK(replace("aaa", "a", std::string(500, 'b')) == Replaced::too_long);
  CHECK(replace(repeated("a", 40'000) + "cb", "(?:a+)+b", "b") == Replaced::undecided);
}
