// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/macros.hpp>

#include <cstdint>
#include <string>
#include <vector>

#include "tests/support/catch.hpp"

using namespace lrt::rdf;

// A namespace with a capital letter, and classes without.
namespace macros_test {
struct Gains {
  double p = 0, i = 0, d = 0;
};
LRT_RECORD(Gains, p, i, d)
inline void lrt_describe(lrt::rdf::Record<Gains>& r) {
  r.named("PidGains").facets("p").unit(lrt::unit::newton_metre).at_least(0);
  r.facets("d").title("Damping", "en");
  r.facets(&Gains::i).at_most(5).value_if_absent(1.5);
}

struct arm {
  struct gains {
    int x = 0;
  };
  enum Old { low = 3, high = 7 };
};
LRT_RECORD(arm::gains, x)
LRT_ENUM(arm::Old, low, high)

struct Base {
  int number = 1;
};
class Private : public Base {
 public:
  int doubled() const { return 2 * number; }

 private:
  struct Inner {
    std::vector<int> all;
    LRT_RECORD_MEMBERS(Inner, all)
  };
  Inner inner_;
  LRT_RECORD_MEMBERS(Private, number, inner_, doubled)
};
template <class T>
struct Limits {
  T low{}, high{};
  struct Kind {
    T value{};
    LRT_RECORD_MEMBERS(Kind, value)
  };
  Kind kind;
  LRT_RECORD_MEMBERS(Limits, low, high, kind)
};
struct Empty {};
LRT_RECORD(Empty)
struct Misspelt {
  int speed = 0;
};
LRT_RECORD(Misspelt, speed)
inline void lrt_describe(lrt::rdf::Record<Misspelt>& r) { r.facets("sped").at_least(0); }

namespace Deep {
struct Arm {
  struct Gains {
    int x = 0;
  };
};
}  // namespace Deep

enum class Mode { fault = -1, idle, busy = 5, last = 127, flag = 1 << 20 };
enum class Code : std::uint16_t { ok, lost = 1000, count };
enum class Small : std::uint8_t { none, all = 255 };
enum class Far { ok, never = 129 };

struct Many {
#define F(n) int a##n = n, b##n = n, c##n = n, d##n = n, e##n = n, f##n = n, g##n = n, h##n = n;
  F(0) F(1) F(2) F(3) F(4) F(5) F(6) F(7) F(8) F(9)
#undef F
};
#define F(n) a##n, b##n, c##n, d##n, e##n, f##n, g##n, h##n
LRT_RECORD(Many, F(0), F(1), F(2), F(3), F(4), F(5), F(6), F(7), F(8), F(9))
#undef F
}  // namespace macros_test
LRT_RECORD(macros_test::Deep::Arm::Gains, x)

template <>
struct lrt::rdf::traits<macros_test::Code> : lrt::rdf::Enumeration<macros_test::Code> {
  static void describe(Enumeration<macros_test::Code>& e) {
    using macros_test::Code;
    e.name_all<0, 1010>().without_name(Code::count).name(Code::lost, "away");
  }
};

namespace {
template <class T>
const Type& type() {
  return traits<T>::type();
}
template <class T>
std::vector<std::string> names() {
  return type<T>().names;
}
using Names = std::vector<std::string>;
}  // namespace

TEST_CASE("a macro describes a struct by the names of its members", "[rdf]") {
  using macros_test::Gains;
  const Type& gains = type<Gains>();
  REQUIRE(gains.fields.size() == 3);
  CHECK(gains.name == "PidGains");
  CHECK(gains.fields[0].name == "p");
  CHECK(gains.fields[0].predicate == "#PidGains/p");
  CHECK(gains.fields[0].facets.unit() == lrt::unit::newton_metre);
  CHECK(gains.fields[0].facets.min() == 0.0);
  CHECK(gains.fields[1].facets.max() == 5.0);
  REQUIRE(gains.fields[1].absent);
  CHECK(*gains.fields[1].absent->real() == 1.5);
  CHECK(gains.fields[2].facets.words().titles.begin()->text == "Damping");
  const Value value = traits<Gains>::encode({1, 2, 3});
  CHECK(traits<Gains>::decode(value).value().d == 3);
  CHECK(type<macros_test::Empty>().fields.empty());
  CHECK(type<macros_test::Many>().fields.size() == 80);
  CHECK(type<macros_test::Many>().fields.back().name == "h9");
  CHECK(traits<macros_test::Many>::decode(traits<macros_test::Many>::encode({})).value().h9 == 9);
}

TEST_CASE("facets of a field that does not exist are a fault of the type", "[rdf]") {
  CHECK(type<macros_test::Misspelt>().fault == "facets(\"sped\") names no field that has been added");
}

TEST_CASE("a macro within a class describes what is private", "[rdf]") {
  const Type& shown = type<macros_test::Private>();
  REQUIRE(shown.fields.size() == 3);
  CHECK(shown.fields[0].name == "number");
  CHECK(shown.fields[1].predicate == "#Private/inner_");
  CHECK(shown.fields[1].type->name == "Private.Inner");
  CHECK(shown.fields[2].read_only);
}

TEST_CASE("terms have the enclosing classes and the arguments, and no namespaces", "[rdf]") {
  CHECK(type<macros_test::arm::gains>().name == "arm.gains");
  CHECK(type<macros_test::Deep::Arm::Gains>().name == "Deep.Arm.Gains");  // the macro is outside: a capital letter is taken for a class
  CHECK(type<macros_test::Limits<double>>().name == "Limits-double");
  CHECK(type<macros_test::Limits<macros_test::Gains>>().name == "Limits-Gains");
  CHECK(type<macros_test::Limits<macros_test::arm::gains>::Kind>().name == "Limits-gains.Kind");
  CHECK(type<macros_test::Limits<double>::Kind>().fields[0].predicate == "#Limits-double.Kind/value");
}

TEST_CASE("the compiler names enumerators", "[rdf]") {
  CHECK(names<macros_test::Mode>() == Names{"fault", "idle", "busy", "last", "flag"});
  CHECK(type<macros_test::Mode>().fault.empty());
  CHECK(*traits<macros_test::Mode>::encode(macros_test::Mode::flag).text() == "flag");
  CHECK(traits<macros_test::Mode>::decode(Value(std::string("fault"))).value() == macros_test::Mode::fault);
  CHECK_FALSE(traits<macros_test::Mode>::decode(Value(std::string("Fault"))));
  CHECK(traits<macros_test::Mode>::encode(static_cast<macros_test::Mode>(3)).text()->empty());
  CHECK(names<macros_test::Small>() == Names{"none", "all"});
  CHECK(names<macros_test::Code>() == Names{"ok", "away"});
  CHECK(traits<macros_test::Code>::encode(macros_test::Code::count).text()->empty());
  CHECK(names<macros_test::arm::Old>() == Names{"low", "high"});
  CHECK(traits<macros_test::Far>::encode(macros_test::Far::never).text()->empty());  // outside of what name_all() looks at
}
