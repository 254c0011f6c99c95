// SPDX-License-Identifier: Apache-2.0
// Classes as they are: fields by getters, setters and lambdas, C arrays, maps.
#include <lrt/rdf/traits.hpp>

#include <cstring>
#include <map>
#include <stdexcept>
#include <unordered_map>

#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/value_codec.hpp>

#include "tests/support/catch.hpp"

using namespace lrt;
using rdf::Facets;
using rdf::traits;
using rdf::Type;
using rdf::Value;

namespace record_test {

/// A class that nobody wrote for lrt.
class Base {
 public:
  double volts = 12;
  const int serial = 7;
};
class Motor : public Base {
 public:
  double speed() const noexcept { return speed_; }
  double& speed() { return speed_; }
  void speed(double v) { speed_ = v; }
  void speed(int) { throw std::logic_error("the wrong overload"); }
  const char* name() const { return name_.c_str(); }
  void set_name(const std::string& name) { name_ = name; }
  std::string_view mode() const { return "fast"; }
  double hours() { return ++hours_; }  // a getter that is not const
  double current() const { return current_; }
  bool set_current(double v) { return v <= 3 ? (current_ = v, true) : false; }
  double torque() const { return torque_; }
  Result<void> set_torque(double v) {
    if (v > 5) return refused("too strong");
    torque_ = v;
    return {};
  }

  char label[8] = "left";
  double gains[3] = {1, 2, 3};

 private:
  double speed_ = 0, current_ = 0, torque_ = 0, hours_ = 0;
  std::string name_ = "m";
};

struct Readable {
  double x = 1;
  double twice() const { return 2 * x; }
};
struct Wheels {
  std::map<std::string, double> radius;
  std::unordered_map<std::string, std::vector<int>> ticks;
};

}  // namespace record_test

using record_test::Motor;
using record_test::Readable;
using record_test::Wheels;

template <>
struct lrt::rdf::traits<Motor> : Record<Motor> {
  static void describe(Record<Motor>& r) {
    r.field("volts", &Motor::volts).unit(unit::volt);
    r.field("speed", &Motor::speed, &Motor::speed).at_most(100);
    r.field("name", &Motor::name, &Motor::set_name);
    r.field("current", &Motor::current, &Motor::set_current);
    r.field("torque", &Motor::torque, &Motor::set_torque);
    r.field(
        "first_gain", [](const Motor& m) { return m.gains[0]; }, [](Motor& m, double v) { m.gains[0] = v; });
    r.field("label", &Motor::label);
    r.field("gains", &Motor::gains).at_least(0);
  }
};
template <>
struct lrt::rdf::traits<Readable> : Record<Readable> {
  static void describe(Record<Readable>& r) {
    r.field("x", &Readable::x);
    r.field("twice", &Readable::twice);
  }
};
template <>
struct lrt::rdf::traits<Wheels> : Record<Wheels> {
  static void describe(Record<Wheels>& r) {
    r.field("radius", &Wheels::radius).unit(unit::metre).above(0);
    r.field("ticks", &Wheels::ticks);
  }
};

namespace {

const Type& wheels() { return traits<Wheels>::type(); }

/// C++ to graph to text to graph to C++, in each syntax.
template <class T>
bool survives(const T& value, const Facets& facets = {}) {
  for (const rdf::Syntax syntax : rdf::available_syntaxes()) {
    rdf::Graph graph;
    rdf::write_value(graph, graph.intern(rdf::iri("http://localhost/x")), traits<T>::type(), facets, traits<T>::encode(value), "http://localhost/b");
    rdf::ReadOptions options;
    options.base = "http://localhost/";
    rdf::Graph back = rdf::read(rdf::write(graph, syntax).value(), syntax, options).value();
    std::vector<rdf::Mismatch> mismatches;
    const Result<Value> read =
        rdf::read_value(back, back.intern(rdf::iri("http://localhost/x")), traits<T>::type(), facets, "http://localhost/b", mismatches);
    if (!read) {
      UNSCOPED_INFO(read.error().message);
      return false;
    }
    const Result<T> decoded = traits<T>::decode(*read);
    if (!decoded || !traits<T>::same(*decoded, value)) return false;
  }
  return true;
}

Value with(const Motor& motor, std::size_t field, Value value) {
  Value::Sequence fields = *traits<Motor>::encode(motor).sequence();
  fields[field] = std::move(value);
  return Value(std::move(fields));
}

}  // namespace

TEST_CASE("fields are read and written by getters, setters, lambdas and inherited members", "[model]") {
  Motor motor;
  motor.volts = 11.5;
  motor.speed() = 42;
  motor.set_name("left wheel");
  std::strcpy(motor.label, "1234567");
  motor.gains[2] = 0.5;
  CHECK(survives(motor));
  const Motor copy = traits<Motor>::decode(traits<Motor>::encode(motor)).value();
  const Motor& constant = copy;
  CHECK(constant.speed() == 42);
  CHECK(std::string(copy.name()) == "left wheel");
  CHECK(copy.volts == 11.5);
  CHECK(copy.gains[2] == 0.5);
  CHECK(std::string(copy.label) == "1234567");
  CHECK_FALSE(traits<Motor>::same(motor, Motor()));
  CHECK(traits<Motor>::runs_user_code());
  CHECK(traits<Motor>::type().fields[1].facets.max() == 100.0);
  CHECK(traits<Motor>::type().fields[7].type->longest == 3);
}

TEST_CASE("a setter may refuse a value", "[model]") {
  CHECK(traits<Motor>::decode(with(Motor(), 3, Value(3.0))));
  CHECK(traits<Motor>::decode(with(Motor(), 3, Value(4.0))).error().code == Errc::expected_value);
  CHECK(traits<Motor>::decode(with(Motor(), 4, Value(6.0))).error().message == "too strong");
}

TEST_CASE("a field of type char[N] is a text of at most N - 1 bytes", "[model]") {
  CHECK(traits<Motor>::type().fields[6].facets.max_length() == 7);
  CHECK(std::string(traits<Motor>::decode(with(Motor(), 6, Value(std::string("1234567")))).value().label) == "1234567");
  CHECK_FALSE(traits<Motor>::decode(with(Motor(), 6, Value(std::string("12345678")))));
  CHECK_FALSE(traits<Motor>::decode(with(Motor(), 6, Value(std::string("ääää")))));  // 8 bytes
  CHECK_FALSE(traits<Motor>::decode(with(Motor(), 6, Value(std::string("a\0b", 3)))));
  Motor full;
  std::memset(full.label, 'x', sizeof full.label);  // without an end
  CHECK(*(*traits<Motor>::encode(full).sequence())[6].text() == "xxxxxxxx");
  Motor a, b;
  std::strcpy(a.label, "left");
  std::memset(b.label, 'z', sizeof b.label);
  std::strcpy(b.label, "left");
  CHECK(traits<Motor>::same(a, b));  // what follows the end does not count
}

namespace record_test {
struct Odd {
  double hours() { return ++calls; }
  double broken() const { throw std::runtime_error("no sensor"); }
  const int serial = 7;
  int calls = 0;
};
struct Broken {
  double broken() const { throw std::runtime_error("no sensor"); }
};
}  // namespace record_test
template <>
struct lrt::rdf::traits<record_test::Odd> : Record<record_test::Odd> {
  static void describe(Record<record_test::Odd>& r) {
    r.field("hours", &record_test::Odd::hours);
    r.field("serial", &record_test::Odd::serial);
  }
};
template <>
struct lrt::rdf::traits<record_test::Broken> : Record<record_test::Broken> {
  static void describe(Record<record_test::Broken>& r) { r.field("broken", &record_test::Broken::broken); }
};

TEST_CASE("a getter alone and a const member are read-only fields, and a getter that is not const is called on a copy", "[model]") {
  const record_test::Odd odd;
  CHECK(*(*traits<record_test::Odd>::encode(odd).sequence())[0].real() == 1);
  CHECK(*(*traits<record_test::Odd>::encode(odd).sequence())[0].real() == 1);
  CHECK(*(*traits<record_test::Odd>::encode(odd).sequence())[1].integer() == 7);
  CHECK(traits<record_test::Odd>::type().fields[0].read_only);
  CHECK(traits<record_test::Odd>::type().fields[1].read_only);
  CHECK_FALSE(traits<Readable>::type().fields[0].read_only);
  CHECK(traits<Readable>::type().fields[1].read_only);
  CHECK_FALSE(traits<Motor>::type().fields[1].read_only);
  CHECK(*(*traits<Readable>::encode(Readable{4}).sequence())[1].real() == 8);
  CHECK(traits<Readable>::decode(traits<Readable>::encode(Readable{})).error().message == "the field is read-only");
  CHECK_THROWS_AS(traits<record_test::Broken>::encode({}), std::runtime_error);
  CHECK_FALSE(traits<record_test::Broken>::same({}, {}));  // publish() is noexcept
}

namespace record_test {
struct Named {
  std::string name = "n";
};
struct Wheel : virtual Named {
  double radius = 1;
};
struct Counted {
  virtual ~Counted() = default;
  int count = 3;
};
struct Second {
  double second = 2;
};
/// Its members are at the places that a second base, a virtual base and a virtual function leave.
struct Mixed : Counted, Second, Wheel {
  volatile int ticks = 5;
  bool on = true;
};
enum class Step : signed char { back = -1, none = 0, forth = 1 };
}  // namespace record_test
template <>
struct lrt::rdf::traits<record_test::Step> : Enumeration<record_test::Step> {
  static void describe(Enumeration<record_test::Step>& e) { e.name(record_test::Step::back, "back").name(record_test::Step::forth, "forth"); }
};
template <>
struct lrt::rdf::traits<record_test::Mixed> : Record<record_test::Mixed> {
  static void describe(Record<record_test::Mixed>& r) {
    r.field("name", &record_test::Mixed::name);
    r.field("radius", &record_test::Mixed::radius);
    r.field("count", &record_test::Mixed::count);
    r.field("second", &record_test::Mixed::second);
    r.field("ticks", &record_test::Mixed::ticks);
    r.field("on", &record_test::Mixed::on);
  }
};

TEST_CASE("members of second, virtual and polymorphic bases, and volatile ones, are fields", "[model]") {
  record_test::Mixed mixed;
  mixed.name = "left";
  mixed.radius = 0.5;
  mixed.count = 4;
  mixed.second = 7;
  mixed.ticks = 6;
  mixed.on = false;
  CHECK(survives(mixed));
  const record_test::Mixed copy = traits<record_test::Mixed>::decode(traits<record_test::Mixed>::encode(mixed)).value();
  CHECK(copy.name == "left");
  CHECK(copy.radius == 0.5);
  CHECK(copy.count == 4);
  CHECK(copy.second == 7);
  CHECK(copy.ticks == 6);
  CHECK_FALSE(copy.on);
  CHECK_FALSE(traits<record_test::Mixed>::same(mixed, record_test::Mixed()));
  CHECK_FALSE(traits<record_test::Mixed>::runs_user_code());
  // A base of another object: the virtual base is elsewhere.
  struct More : record_test::Mixed {
    double more[4] = {};
  };
  More more;
  more.name = "below";
  CHECK(*(*traits<record_test::Mixed>::encode(more).sequence())[0].text() == "below");
}

TEST_CASE("an enum may have negative values; a value without a name is an empty text", "[model]") {
  using record_test::Step;
  CHECK(*traits<Step>::encode(Step::back).text() == "back");
  CHECK(traits<Step>::decode(Value(std::string("back"))).value() == Step::back);
  CHECK(*traits<Step>::encode(Step::none).text() == "");
  CHECK(traits<Step>::decode(Value(std::string("none"))).error().message == "expected one of the names");
}

TEST_CASE("maps survive every syntax, and their order does not count", "[model]") {
  CHECK(survives(std::map<std::string, double>{}));
  CHECK(survives(std::map<std::string, double>{{"left", 0.1}, {"right", -1}, {"", 5}}));
  CHECK(survives(std::map<std::string, double>{{"left", 0.1}}, Facets{unit::metre}));
  CHECK(survives(Wheels{{{"left", 0.25}, {"right", 0.26}}, {{"a", {}}, {"b", {1, 2}}}}));
  CHECK(survives(std::unordered_map<std::string, std::map<std::string, bool>>{{"x", {{"y", true}}}, {"z", {}}}));
  CHECK(survives(std::vector<std::map<std::string, int>>{{{"a", 1}}, {}}));
  const Value a = traits<std::unordered_map<std::string, int>>::encode({{"a", 1}, {"b", 2}, {"c", 3}});
  const Value b = traits<std::unordered_map<std::string, int>>::encode({{"c", 3}, {"b", 2}, {"a", 1}});
  CHECK(rdf::same(a, b));
  CHECK(wheels().fields[0].type->kind == Type::Kind::map);
  using Map = std::map<std::string, int>;
  CHECK(traits<Map>::same({{"a", 1}}, {{"a", 1}}));
  CHECK_FALSE(traits<Map>::same({{"a", 1}}, {{"a", 2}}));
  CHECK_FALSE(traits<Map>::same({{"a", 1}}, {{"b", 1}}));
  CHECK_FALSE(traits<Map>::same({{"a", 1}}, {{"a", 1}, {"b", 1}}));
}

TEST_CASE("a name that a map has twice is refused", "[model]") {
  rdf::ReadOptions options;
  options.base = "http://localhost/x";
  rdf::Graph graph = rdf::read(R"(@prefix schema: <http://schema.org/> . @prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> .
    <> rdf:value ( [ schema:name "a" ; schema:value 1 ] [ schema:name "a" ; schema:value 2 ] ) .)",
                               rdf::Syntax::turtle, options)
                         .value();
  std::vector<rdf::Mismatch> mismatches;
  const auto read = rdf::read_value(graph, graph.intern(rdf::iri("http://localhost/x")), traits<std::map<std::string, int>>::type(), {},
                                    "http://localhost/b", mismatches);
  REQUIRE_FALSE(read);
  CHECK(read.error().message.find("expected each name once, found \"a\" twice") != std::string::npos);
}
