// SPDX-License-Identifier: Apache-2.0
// A Thing with an input of each kind that the examples have not. Run by random_bodies_test.py.
//
//   random_bodies_robot [SEED]      with a seed: a Thing whose inputs are variants, most of a type drawn with it
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <lrt/engine/engine.hpp>
#include <lrt/lrt.hpp>
#include <lrt/rdf/variant.hpp>

enum class Gear { first, second, reverse };

struct Point {
  float x = 0, y = 0;
};

struct Job {
  std::string name;
  bool urgent = false;
  std::int32_t repeats = 0;
  std::optional<double> speed;
  std::optional<Point> start;
  std::vector<Point> way;
  std::array<std::uint8_t, 3> colour{};
  std::optional<std::chrono::milliseconds> pause;
};

/// Its initialisers are never used: a field that a client leaves out has the default that describe() declares.
struct Span {
  double low = 90, high = 91;
};
struct Tuning {
  double gain = 92, limit = 93;
  std::int32_t count = 94;
  std::string name = "initialiser";
  Gear gear = Gear::reverse;
  bool active = true;
  std::optional<double> offset = 95;
  std::vector<std::int32_t> steps{96};
  Span limits;
  std::map<std::string, double> extra{{"initialiser", 97}};
};

struct Stop {};
using Motion = std::variant<std::monostate, Point, Gear, Stop, std::vector<Point>>;
using Reach = std::variant<double, double, std::string>;
using Command = std::variant<Motion, Reach, bool>;

struct Task {
  Motion motion;
  std::optional<Reach> reach;
  std::vector<Command> more;
};

/// A value of a type that is drawn.
template <std::size_t number>
struct Drawn {
  static inline const lrt::rdf::Type* type = nullptr;
  lrt::rdf::Value value;
};

namespace lrt::rdf {
template <>
struct traits<Gear> : Enumeration<Gear> {
  static void describe(Enumeration& e) { e.name(Gear::first, "first").name(Gear::second, "second").name(Gear::reverse, "reverse"); }
};
template <>
struct traits<Point> : Record<Point> {
  static void describe(Record& r) {
    r.field("x", &Point::x).unit(unit::metre).between(-10, 10);
    r.field("y", &Point::y).unit(unit::metre);
  }
};
template <>
struct traits<Job> : Record<Job> {
  static void describe(Record& r) {
    r.field("name", &Job::name).length(1, 8);
    r.field("urgent", &Job::urgent);
    r.field("repeats", &Job::repeats).between(0, 20);
    r.field("speed", &Job::speed).unit(unit::metre_per_second).above(0).below(2);
    r.field("start", &Job::start);
    r.field("way", &Job::way);
    r.field("colour", &Job::colour);
    r.field("pause", &Job::pause);
  }
};
template <>
struct traits<Span> : Record<Span> {
  static void describe(Record& r) {
    r.field("low", &Span::low).value_if_absent(-1).between(-100, 0);
    r.field("high", &Span::high);
  }
};
template <>
struct traits<Tuning> : Record<Tuning> {
  static void describe(Record& r) {
    r.field("gain", &Tuning::gain).unit(unit::metre).between(0, 10).value_if_absent(1.5);
    r.field("limit", &Tuning::limit);
    r.field("count", &Tuning::count).value_if_absent(3).at_least(0);
    r.field("name", &Tuning::name).value_if_absent("none").length(0, 8);
    r.field("gear", &Tuning::gear).value_if_absent(Gear::second);
    r.field("active", &Tuning::active).value_if_absent(false);
    r.field("offset", &Tuning::offset).at_most(50);
    r.field("steps", &Tuning::steps).value_if_absent({4, 5});
    r.field("limits", &Tuning::limits).value_if_absent({-2, 2});
    r.field("extra", &Tuning::extra).value_if_absent({});
  }
};
template <>
struct traits<Stop> : Record<Stop> {
  static void describe(Record&) {}
};
template <>
struct traits<Motion> : Variant<Motion> {
  static void describe(Variant& v) { v.named("Motion"); }
};
template <>
struct traits<Reach> : Variant<Reach> {
  static void describe(Variant& v) {
    v.named("Reach");
    v.alternative<0>("angle").unit(unit::radian).between(-3, 3);
    v.alternative<1>("height").unit(unit::metre);
    v.alternative<2>("place").length(1, 8);
  }
};
template <>
struct traits<Command> : Variant<Command> {
  static void describe(Variant& v) {
    v.named("Command");
    v.alternative<Motion>("motion");
    v.alternative<Reach>("reach");
  }
};
template <>
struct traits<Task> : Record<Task> {
  static void describe(Record& r) {
    r.field("motion", &Task::motion);
    r.field("reach", &Task::reach);
    r.field("more", &Task::more);
  }
};
template <std::size_t number>
struct traits<Drawn<number>> {
  using T = Drawn<number>;
  static const Type& type() { return *T::type; }
  static Value encode(const T& v) { return v.value; }
  static Result<T> decode(const Value& v) { return T{v}; }
  static bool same(const T& a, const T& b) noexcept { return rdf::same(a.value, b.value); }
};
}  // namespace lrt::rdf

namespace {

// What a C++ value has, said by code that knows nothing of codecs: the names of its alternatives, from outside.
std::string said(const std::string& alternative, const std::string& inner = {}) { return inner.empty() ? alternative : alternative + "/" + inner; }
std::string said(const Motion& m) {
  constexpr const char* names[] = {"none", "point", "gear", "stop", "list"};
  const std::string point = "{x:,y:}";
  std::string inner;
  if (std::holds_alternative<Point>(m)) inner = point;
  if (const auto* const points = std::get_if<std::vector<Point>>(&m)) {
    for (std::size_t i = 0; i < points->size(); ++i) inner += (i > 0 ? "," : "") + point;
    inner = "[" + inner + "]";
  }
  return said(names[m.index()], inner);
}
std::string said(const Reach& r) {
  constexpr const char* names[] = {"angle", "height", "place"};
  return names[r.index()];
}
std::string said(const Command& c) {
  if (const Motion* m = std::get_if<Motion>(&c)) return said("motion", said(*m));
  if (const Reach* r = std::get_if<Reach>(&c)) return said("reach", said(*r));
  return "boolean";
}
template <class T>
std::string said(const std::optional<T>& v) {
  return v ? said(*v) : "absent";
}
template <class T>
std::string said(const std::vector<T>& v) {
  std::string all;
  for (std::size_t i = 0; i < v.size(); ++i) all += (i > 0 ? "," : "") + said(v[i]);
  return "[" + all + "]";
}
std::string said(const Task& t) { return "{motion:" + said(t.motion) + ",reach:" + said(t.reach) + ",more:" + said(t.more) + "}"; }

using lrt::rdf::Type;

std::string said(const Type& type, const lrt::rdf::Value& value) {
  const auto* const members = value.sequence();
  switch (type.kind) {
    case Type::Kind::optional: return value.is_null() ? "absent" : said(*type.element, value);
    case Type::Kind::list: {
      std::string all;
      for (std::size_t i = 0; i < members->size(); ++i) all += (i > 0 ? "," : "") + said(*type.element, (*members)[i]);
      return "[" + all + "]";
    }
    case Type::Kind::record: {
      std::string all = "{";
      for (std::size_t i = 0; i < type.fields.size(); ++i)
        all += (i > 0 ? "," : "") + type.fields[i].name + ":" + said(*type.fields[i].type, (*members)[i]);
      return type.fields.empty() ? "" : all + "}";
    }
    case Type::Kind::variant: {
      std::string all;
      for (std::size_t i = 0; i < type.fields.size(); ++i)
        if (!(*members)[i].is_null()) all += said(type.fields[i].name, said(*type.fields[i].type, (*members)[i]));
      return all;
    }
    default: return "";
  }
}
template <std::size_t number>
std::string said(const Drawn<number>& v) {
  return said(*Drawn<number>::type, v.value);
}

/// Draws types with variants.
class Types {
 public:
  explicit Types(unsigned seed) : random_(seed) {}

  const Type& variant(int depth) {
    Type type;
    type.kind = Type::Kind::variant;
    return fields(std::move(type), 1 + random_() % 5, depth);
  }
  /// A variant, or what has variants.
  const Type& input() {
    switch (random_() % 5) {
      case 0: return list(variant(2));
      case 1: return optional(variant(2));
      case 2: return record(3);
      default: return variant(3);
    }
  }

 private:
  const Type& keep(Type type) { return types_.emplace_back(std::move(type)); }
  const Type& list(const Type& element) { return keep(lrt::rdf::detail::list_type(element, 0, 4)); }
  const Type& optional(const Type& element) { return keep(lrt::rdf::detail::optional_type(element)); }
  const Type& record(int depth) {
    Type type;
    type.kind = Type::Kind::record;
    return fields(std::move(type), random_() % 4, depth);
  }
  const Type& fields(Type type, std::size_t count, int depth) {
    type.name = "Drawn" + std::to_string(types_.size()) + "-" + std::to_string(++names_);
    type.classes = {"#" + type.name};
    for (std::size_t i = 0; i < count; ++i) {
      const std::string name = "a" + std::to_string(i);
      const Type* of = &any(depth - 1);
      if (type.kind == Type::Kind::record && random_() % 4 == 0) of = &optional(*of);
      lrt::rdf::Facets facets;
      if (of->is_number() && random_() % 2 == 0) facets.unit(random_() % 2 == 0 ? lrt::unit::radian : lrt::unit::metre);
      if (of->is_number() && random_() % 2 == 0) facets.between(-5, 20);
      type.fields.push_back({name, "#" + type.name + "/" + name, of, facets});
    }
    return keep(std::move(type));
  }
  const Type& any(int depth) {
    using lrt::rdf::traits;
    switch (random_() % (depth > 0 ? 11 : 7)) {
      case 0: return traits<bool>::type();
      case 1: return traits<std::int16_t>::type();
      case 2: return traits<std::string>::type();
      case 3: return traits<Gear>::type();
      case 4: return traits<float>::type();
      case 5: return traits<std::monostate>::type();
      case 6: return traits<double>::type();
      case 7: return record(depth);
      case 8: return list(any(depth - 1));
      default: return variant(depth);
    }
  }

  std::mt19937 random_;
  std::deque<Type> types_;
  std::size_t names_ = 0;
};

}  // namespace

template <class T>
void add(lrt::Thing& thing, const char* name, const lrt::rdf::Facets& facets = {}) {
  auto value = std::make_shared<T>();
  thing.property(name, [value] { return *value; }).on_write([value](const T& wanted) { *value = wanted; }).facets(facets);
}

/// A property, and beside it what the C++ value has.
template <class T>
void add_said(lrt::Thing& thing, const std::string& name, T first = {}) {
  auto value = std::make_shared<T>(std::move(first));
  thing.property(name, [value] { return *value; }).on_write([value](const T& wanted) { *value = wanted; });
  thing.property(name + "Said", [value] { return said(*value); });
}
/// Some value of a type.
lrt::rdf::Value first_of(const Type& type) {
  using lrt::rdf::Value;
  switch (type.kind) {
    case Type::Kind::boolean: return Value(false);
    case Type::Kind::integer: return Value(std::int64_t{1});
    case Type::Kind::real: return Value(1.0);
    case Type::Kind::text: return Value(std::string());
    case Type::Kind::enumeration: return Value(type.names.front());
    case Type::Kind::list: return Value(Value::Sequence());
    case Type::Kind::record:
    case Type::Kind::variant: {
      Value::Sequence members(type.fields.size());
      const std::size_t end = type.kind == Type::Kind::variant ? 1 : members.size();
      for (std::size_t i = 0; i < end; ++i) members[i] = first_of(*type.fields[i].type);
      return Value(std::move(members));
    }
    default: return Value();
  }
}
template <std::size_t... number>
void add_drawn(lrt::Thing& thing, Types& types, std::index_sequence<number...>) {
  const auto add = [&](auto drawn, std::size_t n) {
    using T = decltype(drawn);
    T::type = &types.input();
    add_said<T>(thing, "drawn" + std::to_string(n), T{first_of(*T::type)});
  };
  (add(Drawn<number>(), number), ...);
}

lrt::Thing variants(unsigned seed) {
  static Types types(seed);
  lrt::Thing thing{"machine"};
  thing.dispatch(lrt::Dispatch::io_thread);
  add_said<Motion>(thing, "motion");
  add_said<Reach>(thing, "reach");
  add_said<Command>(thing, "command");
  add_said<Task>(thing, "task");
  add_said<std::vector<Motion>>(thing, "motions");
  add_said<std::optional<Reach>>(thing, "maybe");
  add_drawn(thing, types, std::make_index_sequence<16>());
  thing.action("go", [](const Command&) {});
  thing.action("reach", [](const std::optional<Reach>&) {});
  return thing;
}

lrt::Thing inputs() {
  using lrt::rdf::Facets;
  lrt::Thing thing{"machine"};
  thing.dispatch(lrt::Dispatch::io_thread);
  add<bool>(thing, "on");
  add<std::int64_t>(thing, "count");
  add<std::uint64_t>(thing, "large");
  add<std::int8_t>(thing, "small", Facets().between(-5, 5));
  add<std::uint16_t>(thing, "steps", Facets().unit(lrt::unit::metre));
  add<float>(thing, "single");
  add<float>(thing, "any", Facets().allow_non_finite());
  add<double>(thing, "boundOrNone", Facets().at_least(0).allow_non_finite());
  add<double>(thing, "below", Facets().unit(lrt::unit::radian).at_most(3));
  add<std::string>(thing, "text");
  add<Gear>(thing, "gear");
  add<std::chrono::nanoseconds>(thing, "period");
  add<std::chrono::system_clock::time_point>(thing, "since");
  add<std::vector<std::int32_t>>(thing, "numbers");
  add<std::vector<std::vector<double>>>(thing, "table");
  add<std::array<double, 3>>(thing, "three", Facets().unit(lrt::unit::degree).between(-90, 90));
  add<std::map<std::string, double>>(thing, "named");
  add<std::optional<double>>(thing, "maybe", Facets().unit(lrt::unit::radian));
  add<std::optional<std::int32_t>>(thing, "maybeCount");
  add<std::optional<Point>>(thing, "maybePoint");
  add<Job>(thing, "job");
  add<Tuning>(thing, "tuning");
  add<Tuning>(thing, "twin");
  thing.action("work", [](const Job&) {});
  thing.action("shift", [](const std::optional<Gear>&) {});
  thing.action("turn", [](const std::optional<double>&) {}).unit(lrt::unit::radian).between(-1, 1);
  return thing;
}

int main(int argc, char** argv) {
  lrt::Thing thing = argc > 1 ? variants(static_cast<unsigned>(std::strtoul(argv[1], nullptr, 10))) : inputs();
  lrt::Options options;
  options.listen.port = 0;
  auto server = lrt::Server::create(options);
  if (!server) return std::fprintf(stderr, "%s\n", server.error().message.c_str()), 1;
  if (auto added = server->add(std::move(thing)); !added) return std::fprintf(stderr, "%s\n", added.error().message.c_str()), 1;
  std::printf("%s\n", server->url().c_str());
  std::fflush(stdout);
  server->run();
}
