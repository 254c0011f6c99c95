// SPDX-License-Identifier: Apache-2.0
// Random and extreme lexical forms of every numeric, time and duration type: what the codec, JSON, CBOR, SPARQL, SHACL and a server make of each is
// what a reader of numbers of any length makes of it, or all refuse it. LRT_NUMBER_FORMS is how many, LRT_NUMBER_SEED where they begin.
#include <lrt/rdf/lexical.hpp>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <string>
#include <variant>

#include <lrt/rdf/codec.hpp>
#include <lrt/shacl/validator.hpp>

#include "src/query/evaluate.hpp"
#include "src/query/parser.hpp"
#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/number_forms.hpp"

namespace {

using namespace lrt::test;
using forms::Generator;
using forms::Named;
using lrt::rdf::lexical::Datatype;

std::size_t number_in(const char* variable, std::size_t otherwise) {
  const char* const text = std::getenv(variable);
  return text != nullptr ? std::strtoull(text, nullptr, 10) : otherwise;
}
const std::size_t count = number_in("LRT_NUMBER_FORMS", 5'000), seed = number_in("LRT_NUMBER_SEED", 40);

std::string quoted(const std::string& text) { return '"' + text + '"'; }
bool can_be_quoted(const std::string& text) { return text.find_first_of("\"\\\n\r") == std::string::npos; }

/// The columns of the one row of a query.
std::map<std::string, std::string> row_of(const std::string& text) {
  static const lrt::query::Dataset empty;
  static const std::atomic<bool> never{false};
  const auto query = lrt::query::parse("PREFIX xsd: <http://www.w3.org/2001/XMLSchema#> " + text, {});
  if (!query) FAIL(text << ": " << query.error().message);
  const auto answer = lrt::query::evaluate(**query, empty, {}, never, std::chrono::system_clock::time_point());
  if (!answer) FAIL(text << ": " << answer.error().message);
  const auto& table = std::get<lrt::query::Table>(*answer);
  REQUIRE(table.rows() == 1);
  std::map<std::string, std::string> row;
  for (std::size_t i = 0; i < table.columns(); ++i)
    if (const auto term = table.at(0, i)) row[std::string(1, static_cast<char>('a' + i))] = std::string(term->text);
  return row;
}

/// What SPARQL makes of two forms of a type: casts of the first, and comparisons.
std::string fault_of_query(const std::string& a, const std::string& b, const Named& type) {
  const std::string x = quoted(a), y = quoted(b), t = std::string("^^xsd:") + type.name;
  const auto row =
      row_of("SELECT (xsd:double(" + x + ") AS ?a) (xsd:float(" + x + ") AS ?b) (xsd:decimal(" + x + ") AS ?c) (xsd:integer(" + x + ") AS ?d) (" + x +
             t + " = " + y + t + " AS ?e) (" + x + t + " < " + y + t + " AS ?f) (xsd:float(" + x + t + ") AS ?g) (IF(" + x + t + ", 1, 0) AS ?h) {}");
  const auto found = [&](const char* column) {
    const auto at = row.find(column);
    return at == row.end() ? std::string("an error") : at->second;
  };
  const auto differs = [&](const char* what, const char* column, const std::string& wanted) {
    return std::string(what) + " of " + forms::shown(a) + t + " and " + forms::shown(b) + ": found " + found(column) + ", expected " + wanted;
  };
  const std::size_t begin = a.find_first_not_of(' ');  // a cast ignores white space around its text
  const std::string_view trimmed =
      begin == std::string::npos ? std::string_view() : std::string_view(a).substr(begin, a.find_last_not_of(' ') + 1 - begin);
  const auto n = big::number_of(trimmed);
  const auto real = [&](const char* column, double value) {
    const auto again = big::number_of(found(column));
    return again && forms::same(column == std::string("a") ? big::nearest<double>(*again) : static_cast<double>(big::nearest<float>(*again)), value);
  };
  if (n ? !real("a", big::nearest<double>(*n)) : row.count("a") != 0) return differs("xsd:double()", "a", n ? "the nearest double" : "an error");
  if (n ? !real("b", static_cast<double>(big::nearest<float>(*n))) : row.count("b") != 0) return differs("xsd:float()", "b", "the nearest float");
  const bool is_decimal = n && n->kind == big::Number::Kind::finite && !n->has_exponent;
  // 100 digits are what lrt computes with: one with more is an error.
  const auto fits = [](const big::Number& number) {
    std::string digits = number.digits.str();
    big::Integer places = -number.exponent;
    while (places > 0 && digits.size() > 1 && digits.back() == '0') digits.pop_back(), --places;
    return number.digits == 0 || (places <= 100 && digits.size() <= 100);
  };
  if (is_decimal && fits(*n)) {
    const auto again = big::number_of(found("c"));
    if (!again || big::compare_exactly(*n, *again) != 0) return differs("xsd:decimal()", "c", "the same number");
  } else if (row.count("c") != 0) {
    return differs("xsd:decimal()", "c", "an error");
  }
  if (is_decimal && !n->has_point && fits(*n)) {
    const auto again = big::number_of(found("d"));
    if (!again || big::compare_exactly(*n, *again) != 0) return differs("xsd:integer()", "d", "the same number");
  } else if (row.count("d") != 0) {
    return differs("xsd:integer()", "d", "an error");
  }
  const bool is_number = big::is_number_type(type.type), is_good = big::is_well_formed(a, type.type);
  if (is_number && is_good) {
    const bool is_exact = type.type != Datatype::double_ && type.type != Datatype::float_;  // and has no -0
    const double value = is_exact && big::nearest<float>(*n) == 0 ? 0
                         : type.type == Datatype::double_         ? static_cast<double>(static_cast<float>(big::nearest<double>(*n)))
                                                                  : static_cast<double>(big::nearest<float>(*n));
    if (!real("g", value)) return differs("xsd:float() of the term", "g", "the nearest float");
    const double own = type.type == Datatype::double_  ? big::nearest<double>(*n)
                       : type.type == Datatype::float_ ? static_cast<double>(big::nearest<float>(*n))
                       : n->digits == 0                ? 0
                                                       : 1;
    const std::string truth = own == 0 || std::isnan(own) ? "0" : "1";
    if (found("h") != truth) return differs("truth", "h", truth);
  }
  if (a == b) return {};  // equal as terms
  const auto order = forms::order_of(a, b, type.type);
  if (order == 2) return {};
  if (order) {
    const std::string equal = *order == 0 ? "true" : "false", less = *order < 0 ? "true" : "false";
    if (found("e") != equal) return differs("=", "e", equal);
    if (found("f") != less) return differs("<", "f", less);
  } else {
    const bool are_numbers = is_number && is_good && big::is_well_formed(b, type.type);  // one is NaN
    for (const char* column : {"e", "f"})
      if (found(column) == "true" || (are_numbers && found(column) != "false")) return differs("order", column, "none");
  }
  return {};
}

/// sh:datatype and sh:minInclusive, by a whole validation.
std::string fault_of_shape(const std::string& a, const std::string& b, const Named& type) {
  const std::string t = std::string("^^xsd:") + type.name;
  const auto graph = [](const std::string& text) {
    lrt::rdf::ReadOptions options;
    options.base = "http://example.org/";
    return lrt::rdf::read("@prefix sh: <http://www.w3.org/ns/shacl#> . @prefix xsd: <http://www.w3.org/2001/XMLSchema#> . @prefix : <u:> .\n" + text,
                          lrt::rdf::Syntax::turtle, options);
  };
  const auto conforms = [&](const std::string& constraint) {
    const auto shapes =
        lrt::shacl::Shapes::compile(graph("[] a sh:NodeShape ; sh:targetNode :x ; sh:property [ sh:path :p ; " + constraint + " ] .").value());
    return lrt::shacl::validate(shapes.value(), graph(":x :p " + quoted(a) + t + " .").value()).value().conforms();
  };
  if (conforms(std::string("sh:datatype xsd:") + type.name) != big::is_well_formed(a, type.type)) return "sh:datatype of " + forms::shown(a) + t;
  const auto order = forms::order_of(b, a, type.type);
  if (order == 2) return {};
  if (conforms("sh:minInclusive " + quoted(b) + t) != (order && *order <= 0))
    return "sh:minInclusive " + forms::shown(b) + t + " of " + forms::shown(a);
  return {};
}

/// A robot with a property of each type, asked by PUT and GET.
class Robot {
 public:
  Robot() {
    lrt::Thing thing{"x"};
    add<double>(thing, "double");
    add<float>(thing, "float");
    add<std::int64_t>(thing, "long");
    add<std::uint64_t>(thing, "unsignedLong");
    add<std::chrono::nanoseconds>(thing, "duration");
    add<std::chrono::time_point<std::chrono::system_clock, std::chrono::nanoseconds>>(thing, "dateTime");
    bench_.add(std::move(thing));
  }
  std::string fault_of(const std::string& text, const Named& type) {
    std::string fault;
    if (big::is_number_type(type.type)) {
      const auto n = big::number_of(text);
      const bool is_good = big::is_well_formed(text, type.type);
      const auto wanted = [&](auto made) -> std::optional<decltype(made)> {
        if (!is_good || (n->kind != big::Number::Kind::finite)) return std::nullopt;
        return forms::expected<decltype(made)>(*n, type.type);
      };
      fault = put<double>("double", text, type, wanted(0.0)) + put<float>("float", text, type, wanted(0.0F)) +
              put<std::int64_t>("long", text, type, wanted(std::int64_t{})) + put<std::uint64_t>("unsignedLong", text, type, wanted(std::uint64_t{}));
    } else if (type.type == Datatype::duration || type.type == Datatype::day_time_duration) {
      const auto d = big::duration_of(text, Datatype::day_time_duration);
      const auto ns = d ? big::nanoseconds(d->negative ? big::Integer(-d->seconds) : d->seconds, d->decimals, d->negative) : std::nullopt;
      fault = put<std::chrono::nanoseconds>("duration", text, type, ns ? std::optional(std::chrono::nanoseconds(*ns)) : std::nullopt);
    } else if (type.type == Datatype::date_time) {
      using Time = std::chrono::time_point<std::chrono::system_clock, std::chrono::nanoseconds>;
      const auto m = big::moment_of(text, type.type);
      auto ns = m && m->zoned ? big::nanoseconds(m->since.whole, m->since.decimals) : std::nullopt;
      // What the Blueprint promises: from 1677-09-22T00:00:00Z to 2262-04-11T23:47:16Z.
      if (ns && (*ns < -9'223'286'400'000'000'000 || *ns > 9'223'372'036'000'000'000)) ns.reset();
      fault = put<Time>("dateTime", text, type, ns ? std::optional(Time(std::chrono::nanoseconds(*ns))) : std::nullopt);
    }
    return fault;
  }

 private:
  template <class T>
  static inline std::optional<T> written{};

  template <class T>
  void add(lrt::Thing& thing, const char* name) {
    thing.property<T>(name).on_write([](T value) { written<T> = value; });
  }
  template <class T>
  std::string put(const std::string& name, const std::string& text, const Named& type, const std::optional<T>& wanted) {
    written<T> = std::nullopt;
    const std::string literal = quoted(text) + "^^xsd:" + type.name;
    const bool is_number = big::is_number_type(type.type);
    const Answer answer = bench_.ask(Bench::turtle_request("PUT", "/x/" + name, is_number ? number_body(literal) : "<> rdf:value " + literal + " ."));
    const int status = answer.status;
    const std::string body = answer.body.substr(0, 1'000);
    const bool is_accepted = status / 100 == 2;
    if (is_accepted == wanted.has_value() && written<T> == wanted) return {};
    return "PUT of " + forms::shown(text) + "^^xsd:" + type.name + " to a " + name + ": " + std::to_string(status) + " " + body + ", " +
           (written<T> ? "written" : "not written") + ", expected " + (wanted ? "a value" : "a refusal") + "\n";
  }

  Bench bench_;
};

}  // namespace

TEST_CASE("lexical forms have one value everywhere, or none", "[query][rdf][shacl][numbers]") {
  Generator generator(seed);
  Robot robot;
  std::map<const Named*, std::string> before;
  std::string report;
  std::size_t faults = 0;
  for (std::size_t i = 0; i < count && faults < 20; ++i) {
    const Named& type = generator.type();
    const std::string text = generator.form(type.type);
    std::string& other = before[&type];
    std::string fault = forms::fault_of(text, type);
    if (fault.empty()) fault = forms::fault_of(other, text, type);
    if (can_be_quoted(text) && can_be_quoted(other)) {
      if (fault.empty()) fault = fault_of_query(text, other, type);
      if (fault.empty() && i % 10 == 0) fault = fault_of_shape(text, other, type);
      if (fault.empty() && i % 10 == 5) fault = robot.fault_of(text, type);
    }
    if (!fault.empty()) {
      ++faults;
      report += fault + "\n";
    }
    if (other.empty() || generator.below(3) == 0) other = text;
  }
  INFO(report);
  CHECK(faults == 0);
}

TEST_CASE("a number that a double cannot hold is not written as another", "[query][numbers]") {
  Robot robot;
  for (const char* text : {"1e9223372036854775807", "-1e9223372036854775807", "1e9223372036854775808", "1e-9223372036854775808", "1e309", "1e-324",
                           "0.1e-9223372036854775807", "1000e9223372036854775806", "1e99999999999999999999", "1e-99999999999999999999"}) {
    for (const Named& type : forms::types) {
      if (type.type != Datatype::double_ && type.type != Datatype::float_) continue;
      CAPTURE(text, type.name);
      CHECK(robot.fault_of(text, type).empty());
      CHECK(forms::fault_of(text, type).empty());
      CHECK(fault_of_query(text, "1", type).empty());
    }
  }
}
