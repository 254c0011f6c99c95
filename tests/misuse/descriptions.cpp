// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "tests/misuse/harness.hpp"

namespace {

// Records that are wrong in one way each.
struct Node {
  int value = 0;
  std::vector<Node> children;
};
struct Tree {
  std::map<std::string, Tree> branches;
};
struct Husband;
struct Wife {
  std::vector<Husband> husbands;
};
struct Husband {
  std::vector<Wife> wives;
};
struct Mirror {
  int x = 0;
};
template <int fault>
struct Faulty {
  double a = 0, b = 0;
  std::string name;
  int count = 0;
};
struct Late {
  double x = 0;
};
enum class Twice { a, b };
enum class Renamed { a };
enum class Nameless { a, b };
enum class Unnamed { a };
struct NoConversion {
  int x = 0;
};
struct ReadOnly {
  double x() const { return 0; }
};
struct Plain {
  double x = 0;
};

constexpr lrt::Unit no_iri{lrt::Iri{"rpm"}, {}, "rpm"};
constexpr lrt::Unit only_code{{}, {}, "rpm"};
constexpr lrt::Unit no_kind{lrt::unit::metre.qudt, {}, "m", lrt::Iri{"length"}};
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();

}  // namespace

namespace lrt::rdf {

template <>
struct traits<Node> : Record<Node> {
  static void describe(Record<Node>& r) {
    r.field("value", &Node::value);
    r.field("children", &Node::children);
  }
};
template <>
struct traits<Tree> : Record<Tree> {
  static void describe(Record<Tree>& r) { r.field("branches", &Tree::branches); }
};
template <>
struct traits<Wife> : Record<Wife> {
  static void describe(Record<Wife>& r) { r.field("husbands", &Wife::husbands); }
};
template <>
struct traits<Husband> : Record<Husband> {
  static void describe(Record<Husband>& r) { r.field("wives", &Husband::wives); }
};
template <>
struct traits<Mirror> : Record<Mirror> {
  static void describe(Record<Mirror>& r) {
    r.field("image", [](const Mirror& m) { return m; });
  }
};
template <int fault>
struct traits<Faulty<fault>> : Record<Faulty<fault>> {
  static void describe(Record<Faulty<fault>>& r) {
    using S = Faulty<fault>;
    r.named("Faulty" + std::to_string(fault));
    if (fault == 0) r.field("a", &S::a), r.field("a", &S::b);
    if (fault == 1) r.field(Iri{"http://x/1#a"}, &S::a), r.field(Iri{"http://x/1#a"}, &S::b);
    if (fault == 2) r.field("", &S::a);
    if (fault == 3) r.field(std::string("a\0b", 3), &S::a);
    if (fault == 4) r.field("\xff", &S::a);
    if (fault == 5) r.field(Iri{"a"}, &S::a);
    if (fault == 6) r.field("name", &S::name).unit(unit::metre);
    if (fault == 7) r.field("a", &S::a).unit(no_iri);
    if (fault == 8) r.field("a", &S::a).between(not_a_number, 1);
    if (fault == 9) r.field("a", &S::a).between(2, 1);
    if (fault == 10) r.field("name", &S::name).at_most(3);
    if (fault == 11) r.field("a", &S::a).length(0, 3);
    if (fault == 12) r.field("count", &S::count).allow_non_finite();
    if (fault == 13) r.field("count", &S::count).at_least(3e9);
    if (fault == 14) r.field("a", &S::a).title("x", "no language");
    if (fault == 15) r.field(Iri{"http://x/1#a"}, &S::a), r.field(Iri{"http://x/2#a"}, &S::b);
  }
};
/// What field() returns is used after the next field().
template <>
struct traits<Late> : Record<Late> {
  static void describe(Record<Late>& r) {
    auto&& first = r.field("x", &Late::x);
    if constexpr (std::is_same_v<decltype(first), Facets&>) {
      std::puts("a reference to Facets: used before the next field() only");
      first.unit(unit::metre);
    }
    for (int i = 0; i < 40; ++i) r.field("x" + std::to_string(i), &Late::x);
    if constexpr (!std::is_same_v<decltype(first), Facets&>) first.unit(unit::metre);
  }
};
template <>
struct traits<Twice> : Enumeration<Twice> {
  static void describe(Enumeration<Twice>& e) { e.name(Twice::a, "a").name(Twice::b, "a"); }
};
template <>
struct traits<Renamed> : Enumeration<Renamed> {
  static void describe(Enumeration<Renamed>& e) { e.name(Renamed::a, "a").name(Renamed::a, "b"); }
};
template <>
struct traits<Nameless> : Enumeration<Nameless> {
  static void describe(Enumeration<Nameless>& e) { e.name(Nameless::a, "a"); }
};
template <>
struct traits<Unnamed> : Enumeration<Unnamed> {
  static void describe(Enumeration<Unnamed>&) {}
};
template <>
struct traits<ReadOnly> : Record<ReadOnly> {
  static void describe(Record<ReadOnly>& r) { r.field("x", &ReadOnly::x); }
};
template <>
struct traits<Plain> : Record<Plain> {
  static void describe(Record<Plain>& r) { r.field("x", &Plain::x); }
};
/// Traits of a user with a type that refers to itself.
template <>
struct traits<NoConversion> {
  static const Type& type() {
    static Type t;
    t.kind = Type::Kind::list;
    t.element = &t;
    return t;
  }
  static Value encode(const NoConversion&) { return Value(Value::Sequence()); }
  static Result<NoConversion> decode(const Value&) { return NoConversion(); }
  static bool same(const NoConversion&, const NoConversion&) noexcept { return true; }
};

}  // namespace lrt::rdf

namespace misuse {
namespace {

using lrt::Thing;

template <class T>
std::string of_type() {
  return add([](Thing& arm) { arm.property("value", [] { return T(); }); });
}
template <int fault>
std::string of_fault() {
  return of_type<Faulty<fault>>();
}
/// A property of this type with these calls.
template <class T, class Calls>
std::function<std::string()> with(Calls calls) {
  return [calls] {
    return add([&](Thing& arm) {
      auto property = arm.property("value", [] { return T(); });
      calls(property);
    });
  };
}
template <class Describe>
std::function<std::string()> thing(Describe describe) {
  return [describe] { return add(describe); };
}
std::string named(std::string_view path) {
  Host host;
  return text_of(host.server.add(Thing(path)));
}

}  // namespace

std::vector<Misuse> of_descriptions() {
  using lrt::Iri;
  const auto number = [] { return 1.0; };
  return {
      // Things
      {"add() of a Thing that was moved", "closed: expected a Thing, found one that was moved from",
       [] {
         Host host;
         Thing a("arm"), b(std::move(a));
         return text_of(host.server.add(std::move(a)));  // NOLINT(bugprone-use-after-move)
       }},
      {"add() of several Things, one of which was moved", "closed, then 404",
       [] {
         Host host;
         std::vector<Thing> things;
         things.emplace_back("one");
         things.emplace_back("two");
         Thing taken = std::move(things[1]);
         const lrt::Result<void> added = host.server.add(std::move(things));
         return std::string(to_string(added.error().code)) + ", then " + host.ask("GET", "/one");
       }},
      {"property() after add()", "check: property() of a Thing that was moved from: describe a Thing before Server::add(std::move(thing))",
       [=] {
         Host host;
         Thing arm("arm");
         host.server.add(std::move(arm)).value();
         arm.property("late", number);  // NOLINT(bugprone-use-after-move)
         return std::string();
       }},
      {"publish() of a property of a Thing that was moved", "check: property() of a Thing that was moved from",
       [] {
         Thing a("arm"), b(std::move(a));
         a.property<double>("late").publish(1);  // NOLINT(bugprone-use-after-move)
         return std::string();
       }},
      {"action() after add()", "check: action() of a Thing that was moved from",
       [] {
         Thing a("arm"), b(std::move(a));
         a.action("late", [] {});  // NOLINT(bugprone-use-after-move)
         return std::string();
       }},
      {"collection() after add()", "check: collection() of a Thing that was moved from",
       [] {
         Thing a("arm"), b(std::move(a));
         a.collection<int>("late");  // NOLINT(bugprone-use-after-move)
         return std::string();
       }},
      {"title(), type(), control() and add() again after add()", "closed: expected a Thing, found one that was moved from",
       [] {
         Host host;
         Thing a("arm"), b(std::move(a));
         a.title("arm").type(Iri{"http://x/Arm"}).control();  // NOLINT(bugprone-use-after-move)
         return text_of(host.server.add(std::move(a)));
       }},
      {"path() of a Thing that was moved", "\"\"",
       [] {
         Thing a("arm"), b(std::move(a));
         return '"' + a.path() + '"';  // NOLINT(bugprone-use-after-move)
       }},
      {"graph() of a World that was moved", "closed: expected a Thing, found one that was moved from",
       [] {
         Host host;
         lrt::World a("world"), b(std::move(a));
         (void)a.graph("map");  // NOLINT(bugprone-use-after-move)
         return text_of(host.server.add(std::move(a)));
       }},
      {"a Thing without a name", "expected_iri: path \"\": it is empty: write a name", [] { return named(""); }},
      {"a path with an empty name", "expected_iri: path \"a//b\": a name between two '/' is empty: write \"a/b\"", [] { return named("a//b"); }},
      {"a path with dot segments", "expected_iri: path \"a/../b\": \"..\" is not a name", [] { return named("a/../b"); }},
      {"a path that ends with '/'", "expected_iri: path \"arm/\": it ends with '/': write \"arm\"", [] { return named("arm/"); }},
      {"a path with NUL", "expected_iri: path: expected UTF-8 without U+0000", [] { return named(std::string_view("a\0b", 3)); }},
      {"a path that is no UTF-8", "expected_iri: path: expected UTF-8", [] { return named("a\xff"); }},
      {"a property without a name", "expected_iri: property of thing \"arm\": path \"\": it is empty",
       thing([=](Thing& t) { t.property("", number); })},
      {"a property that begins with '/'", "it begins with '/': write \"x\"", thing([=](Thing& t) { t.property("/x", number); })},
      {"an action without a name", "expected_iri: action of thing \"arm\": path \"\"", thing([](Thing& t) { t.action("", [] {}); })},
      {"two properties of one path", "duplicate_path: path \"arm/x\" is already in use",
       thing([=](Thing& t) { t.property("x", number), t.property("x", number); })},
      {"a Thing at the path of another", "duplicate_path: path \"arm\" is already in use",
       [] {
         Host host;
         host.server.add(Thing("arm")).value();
         return text_of(host.server.add(Thing("arm")));
       }},
      {"a type that is no IRI", "expected_iri: thing \"arm\": expected an absolute IRI as type, found \"Arm\"",
       thing([](Thing& t) { t.type(Iri{"Arm"}); })},
      {"a predicate that is no IRI", "expected an absolute IRI as predicate, found \"p\"", thing([](Thing& t) { t.add(Iri{"p"}, 1); })},
      {"an object that is no IRI", "expected an absolute IRI as object, found \"o\"", thing([](Thing& t) { t.add(Iri{"http://x/p"}, Iri{"o"}); })},
      {"an external Blueprint that is no IRI", "expected an absolute IRI as blueprint", thing([](Thing& t) { t.blueprint(Iri{"b"}); })},
      {"a language that is none", "expected_rdf", thing([](Thing& t) { t.title("arm", "not a language"); })},
      {"two titles in one language", "invalid_option", thing([](Thing& t) { t.title("arm", "en").title("Arm", "en"); })},
      {"Turtle that is none", "expected_rdf: thing \"arm\", its Turtle", thing([](Thing& t) { t.add_turtle("<> a"); })},
      {"shapes that are none", "expected_rdf: thing \"arm\", its shapes", thing([](Thing& t) { t.shapes("<> a"); })},
      {"a file of shapes that is not there", "io_error: thing \"arm\": the shapes file", thing([](Thing& t) { t.shapes_from_file("/nowhere"); })},
      {"a negative age of a Thing", "invalid_option: thing \"arm\": max_age() expected times of at least 0",
       thing([](Thing& t) { t.max_age(std::chrono::seconds(-1)); })},
      // types
      {"a struct that contains a list of itself", "property \"arm/value\": field \"children\": its record contains itself", of_type<Node>},
      {"a list of such structs", "its record contains itself", of_type<std::vector<Node>>},
      {"a map of lists of such structs", "its record contains itself", of_type<std::map<std::string, std::vector<Node>>>},
      {"a published struct that contains itself", "its record contains itself", thing([](Thing& t) {
         t.property<Node>("value").publish(Node{1, {Node{2, {}}}});
       })},
      {"a struct that contains a map of itself", "field \"branches\": its record contains itself", of_type<Tree>},
      {"two structs that contain each other", "field \"husbands\": field \"wives\": its record contains itself", of_type<Wife>},
      {"the other of these structs", "its record contains itself", of_type<Husband>},
      {"an action with such an input", "action \"arm/actions/use\": field \"children\": its record contains itself",
       thing([](Thing& t) { t.action("use", [](const Node&) {}); })},
      {"a collection of such structs", "collection \"arm/nodes\": field \"children\": its record contains itself",
       thing([](Thing& t) { t.collection<Node>("nodes"); })},
      {"a getter that returns its own struct", "field \"image\": its record contains itself", of_type<Mirror>},
      {"traits whose type refers to itself", "property \"arm/value\": its type contains itself", of_type<NoConversion>},
      {"two fields of one name", "property \"arm/value\": field \"a\": two fields have this name", of_fault<0>},
      {"two fields of one term", "field \"a\": two fields have this name", of_fault<1>},
      {"a field without a name", "field \"\": its name is empty", of_fault<2>},
      {"a field whose name has NUL", "expected UTF-8 without NUL as its name", of_fault<3>},
      {"a field whose name is no UTF-8", "expected UTF-8 without NUL as its name", of_fault<4>},
      {"a field whose term is no IRI", "expected an absolute IRI as its predicate, found \"a\"", of_fault<5>},
      {"two terms of one name", "field \"a\": two fields have this name", of_fault<15>},
      {"a unit of a text field", "field \"name\": its unit: expected numbers, found texts", of_fault<6>},
      {"a unit of a field that is no IRI", "field \"a\": its unit: expected an absolute IRI, found \"rpm\"", of_fault<7>},
      {"NaN as the bound of a field", "field \"a\": its bounds: expected a number, found NaN", of_fault<8>},
      {"bounds of a field that exclude all", "field \"a\": no value is within the bounds", of_fault<9>},
      {"bounds of a text field", "field \"name\": its bounds: expected numbers, found texts", of_fault<10>},
      {"a length of a number field", "field \"a\": length(): expected texts, found numbers", of_fault<11>},
      {"NaN for an integer field", "field \"count\": allow_non_finite(): expected numbers with a fraction, found numbers", of_fault<12>},
      {"a bound beyond the type of a field", "field \"count\": no value is within the bounds", of_fault<13>},
      {"a title of a field in no language", "expected_rdf", of_fault<14>},
      {"a field that gets its unit after the next field()", "nothing; m",
       [] { return of_type<Late>() + "; " + std::string(lrt::rdf::traits<Late>::type().fields[0].facets.unit().ucum); }},
      {"two enumerators of one name", "two enumerators have the name \"a\"", of_type<Twice>},
      {"one enumerator of two names", "one enumerator has the names \"a\" and \"b\"", of_type<Renamed>},
      {"an enumerator without a name", "has no name; give it one by name()", of_type<Nameless>},
      {"an enumeration without names", "no enumerator has a name", of_type<Unnamed>},
      {"a list of enumerators of one name", "two enumerators have the name \"a\"", of_type<std::vector<Twice>>},
      {"a record that clients cannot send", "its field \"x\" is read-only; give the field a setter",
       with<ReadOnly>([](auto& p) { p.on_write([](const ReadOnly&) {}); })},
      // units and bounds
      {"a unit that is no IRI", "invalid_option: \"arm/value\": its unit: expected an absolute IRI, found \"rpm\"",
       with<double>([](auto& p) { p.unit(no_iri); })},
      {"a unit without an IRI", "its unit \"rpm\" has no IRI: give it one of QUDT", with<double>([](auto& p) { p.unit(only_code); })},
      {"a kind of quantity that is no IRI", "its unit: expected an absolute IRI, found \"length\"", with<double>([](auto& p) { p.unit(no_kind); })},
      {"a unit of a text", "\"arm/value\": its unit: expected numbers, found texts", with<std::string>([](auto& p) { p.unit(lrt::unit::metre); })},
      {"a unit of a truth value", "expected numbers, found truth values", with<bool>([](auto& p) { p.unit(lrt::unit::metre); })},
      {"a unit of a duration", "expected numbers, found durations", with<std::chrono::seconds>([](auto& p) { p.unit(lrt::unit::second); })},
      {"a unit of a list of texts", "expected numbers, found texts", with<std::vector<std::string>>([](auto& p) { p.unit(lrt::unit::metre); })},
      {"NaN as a bound", "\"arm/value\": its bounds: expected a number, found NaN", with<double>([](auto& p) { p.at_least(not_a_number); })},
      {"NaN as an upper bound of a list", "its bounds: expected a number, found NaN",
       with<std::vector<double>>([](auto& p) { p.below(not_a_number); })},
      {"bounds in the wrong order", "\"arm/value\": no value is within the bounds", with<double>([](auto& p) { p.between(2, 1); })},
      {"bounds that exclude their only value", "no value is within the bounds", with<double>([](auto& p) { p.at_least(1).below(1); })},
      {"a lower bound of infinity", "no value is within the bounds", with<double>([](auto& p) { p.at_least(infinity); })},
      {"a bound below the type", "no value is within the bounds", with<std::uint8_t>([](auto& p) { p.at_most(-1); })},
      {"a bound beyond the type", "no value is within the bounds", with<std::int16_t>([](auto& p) { p.at_least(40000); })},
      {"bounds of a text", "its bounds: expected numbers, found texts", with<std::string>([](auto& p) { p.at_most(3); })},
      {"bounds of a record", "give bounds to the fields of a record", with<Plain>([](auto& p) { p.between(0, 1); })},
      {"a length of a number", "length(): expected texts, found numbers", with<double>([](auto& p) { p.length(1, 3); })},
      {"a length of an optional number", "length(): expected texts, found numbers", with<std::optional<int>>([](auto& p) { p.length(1, 3); })},
      {"a length in the wrong order", "no value is within the bounds of its length", with<std::string>([](auto& p) { p.length(3, 1); })},
      {"NaN for integers", "allow_non_finite(): expected numbers with a fraction", with<int>([](auto& p) { p.allow_non_finite(); })},
      {"bounds of an action without input", "there is no input to which the unit, bounds or length could apply",
       thing([](Thing& t) { t.action("go", [] {}).at_most(1); })},
      {"NaN as a bound of an input", "\"arm/actions/go\": its bounds: expected a number, found NaN",
       thing([](Thing& t) { t.action("go", [](double) {}).at_most(not_a_number); })},
      {"bounds of members in the wrong order", "\"arm/points\": no value is within the bounds",
       thing([](Thing& t) { t.collection<double>("points").between(1, 0); })},
      {"a field of an input that is not there", "consumes(\"y\"): expected an input that is a record with this field",
       thing([](Thing& t) { t.action("go", [](const Plain&) {}).consumes("y", lrt::Facets{lrt::unit::metre}); })},
      // functions
      {"a null std::function as the read function", "invalid_option: property \"arm/value\": expected a function, found a null one",
       thing([](Thing& t) { t.property("value", std::function<double()>()); })},
      {"a null pointer as the read function", "property \"arm/value\": expected a function, found a null one",
       thing([](Thing& t) { t.property("value", static_cast<double (*)()>(nullptr)); })},
      {"a null action", "action \"arm/actions/go\": expected a function, found a null one",
       thing([](Thing& t) { t.action("go", std::function<void(double)>()); })},
      {"a null pointer as an action", "action \"arm/actions/go\": expected a function, found a null one",
       thing([](Thing& t) { t.action("go", static_cast<void (*)()>(nullptr)); })},
      {"a null on_write", "property \"arm/value\": on_write() expected a function, found a null one",
       with<double>([](auto& p) { p.on_write(std::function<void(double)>()); })},
      {"a null lambda of expires", "expires() expected a function, found a null one",
       with<double>([](auto& p) { p.on_write([](double) {}).expires(std::chrono::seconds(1), std::function<void()>()); })},
      {"a null encoder", "representation() expected a function, found a null one",
       with<double>([](auto& p) { p.representation("image/png", std::function<std::string(const double&)>()); })},
      {"a null on_create", "collection \"arm/points\": on_create() expected a function, found a null one",
       thing([](Thing& t) { t.collection<int>("points").on_create(std::function<void(int)>()); })},
      {"a null on_remove", "on_remove() expected a function, found a null one",
       thing([](Thing& t) { t.collection<int>("points").on_remove(std::function<void(const std::string&)>()); })},
      {"a null stop state", "stop() expected a function, found a null one",
       thing([](Thing& t) { t.action("halt", [] {}).stop(std::function<bool()>()); })},
      // the rest of descriptions
      {"a life without on_write", "expires() needs on_write()", with<double>([](auto& p) { p.expires(std::chrono::seconds(1), [] {}); })},
      {"a life of no time", "expires(): expected 1 ms to 1 h, found 0 ms",
       with<double>([](auto& p) { p.on_write([](double) {}).expires(std::chrono::seconds(0), [] {}); })},
      {"a negative period", "property \"arm/value\": sample(): expected a period of at least 0, found -5 ms",
       with<double>([](auto& p) { p.sample(std::chrono::milliseconds(-5)); })},
      {"a negative age", "property \"arm/value\": max_age() expected times of at least 0",
       with<double>([](auto& p) { p.max_age(std::chrono::seconds(-1)); })},
      {"more kept values than memory", "keep() expected at most 1000000 values",
       thing([](Thing& t) { t.property<double>("value").keep(std::numeric_limits<std::size_t>::max()); })},
      {"octets of a text", "octets() needs a number or lists of numbers", with<std::string>([](auto& p) { p.octets(); })},
      {"a media type that is none", "expected_media_type",
       with<double>([](auto& p) { p.representation("png", [](double) { return std::string(); }); })},
      {"a media type twice", "is already declared", with<double>([](auto& p) {
         const auto none = [](double) { return std::string(); };
         p.representation("image/png", none).representation("image/png", none);
       })},
      {"a stop with an input", "a stop takes no input", thing([](Thing& t) { t.action("halt", [](double) {}).stop(); })},
      {"a stop that waits for the host", "a stop must not wait for Server::poll",
       thing([](Thing& t) { t.action("halt", [] {}).stop().dispatch(lrt::Dispatch::in_poll); })},
      {"an action of which none may run", "ActionPolicy::parallel(0) lets no invocation run",
       thing([](Thing& t) { t.action("go", [] {}).policy(lrt::ActionPolicy::parallel(0)); })},
      {"an effect on an empty handle", "effect(): expected a handle that Thing::property() or Thing::action() returned, found an empty one",
       thing([](Thing& t) { t.action("go", [] {}).effect(lrt::PulledProperty<double>()); })},
      {"a part that is an empty handle", "found an empty one", thing([](Thing& t) { t.action("go", [] {}).composed_of(lrt::Action()); })},
      {"an effect of an input that is not there", "expected an action with an input, found none",
       thing([=](Thing& t) { t.action("go", [] {}).effect(t.property("x", number), lrt::from_input); })},
      {"an executor that is not there, of a Thing", "invalid_option: thing \"arm\": Dispatch::executor needs Threads::executor",
       thing([](Thing& t) { t.dispatch(lrt::Dispatch::executor); })},
      {"an executor that is not there, of a property", "property \"arm/value\": Dispatch::executor needs Threads::executor",
       with<double>([](auto& p) { p.dispatch(lrt::Dispatch::executor); })},
      {"an executor that is not there, of an action", "action \"arm/actions/go\": Dispatch::executor needs Threads::executor",
       thing([](Thing& t) { t.action("go", [] {}).dispatch(lrt::Dispatch::executor); })},
      {"an executor that is not there, of a stop", "action \"arm/actions/halt\": Dispatch::executor needs Threads::executor",
       thing([](Thing& t) { t.action("halt", [] {}).stop().dispatch(lrt::Dispatch::executor); })},
      {"a guard that is gone", "invalid_option: thing \"arm\": guard() expected an object that exists, found one that is gone",
       thing([](Thing& t) { t.guard(std::weak_ptr<int>()); })},
  };
}

}  // namespace misuse
