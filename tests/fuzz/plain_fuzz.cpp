// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/plain.hpp"

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/value_codec.hpp>

#include "tests/fuzz/round_trip.hpp"

// A byte for the type, one for the format, and the body -> triples -> value -> every format -> the same value.

namespace plain_fuzz {
enum class Mode { slow, fast };
struct Step {
  double x = 0;
  Mode mode = Mode::slow;
  std::optional<std::string> label;
};
struct Move {
  float angle = 0;
  std::uint64_t count = 0;
  Step step;
  std::vector<Step> way;
  std::array<double, 2> range{};
};
}  // namespace plain_fuzz

namespace lrt::rdf {
template <>
struct traits<plain_fuzz::Mode> : Enumeration<plain_fuzz::Mode> {
  static void describe(Enumeration<plain_fuzz::Mode>& e) { e.name(plain_fuzz::Mode::slow, "slow").name(plain_fuzz::Mode::fast, "fast"); }
};
template <>
struct traits<plain_fuzz::Step> : Record<plain_fuzz::Step> {
  static void describe(Record<plain_fuzz::Step>& r) {
    r.field("x", &plain_fuzz::Step::x).allow_non_finite();
    r.field("mode", &plain_fuzz::Step::mode);
    r.field("label", &plain_fuzz::Step::label);
  }
};
template <>
struct traits<plain_fuzz::Move> : Record<plain_fuzz::Move> {
  static void describe(Record<plain_fuzz::Move>& r) {
    r.field("angle", &plain_fuzz::Move::angle).unit(lrt::unit::degree);
    r.field("count", &plain_fuzz::Move::count);
    r.field("step", &plain_fuzz::Move::step).unit(lrt::unit::metre);
    r.field("way", &plain_fuzz::Move::way);
    r.field("range", &plain_fuzz::Move::range).unit(lrt::unit::metre);
  }
};
}  // namespace lrt::rdf

using lrt::Result;
using lrt::fuzz::broken;
using namespace lrt::rdf;

namespace {

constexpr std::string_view names = "http://example.org/vocabulary#";
constexpr std::array<Plain, 5> formats = {Plain::json, Plain::json_with_units, Plain::text, Plain::cbor, Plain::octets};

struct Case {
  const Type* type;
  Facets facets;
};

const std::vector<Case>& cases() {
  using std::chrono::nanoseconds;
  using std::chrono::system_clock;
  const Facets any = Facets().allow_non_finite(), degrees = Facets{lrt::unit::degree}.allow_non_finite();
  static const std::vector<Case> all = {
      {&traits<double>::type(), any},
      {&traits<float>::type(), degrees},
      {&traits<std::int64_t>::type(), degrees},
      {&traits<std::uint8_t>::type(), {}},
      {&traits<bool>::type(), {}},
      {&traits<std::string>::type(), {}},
      {&traits<plain_fuzz::Mode>::type(), {}},
      {&traits<nanoseconds>::type(), {}},
      {&traits<system_clock::time_point>::type(), {}},
      {&traits<std::optional<double>>::type(), degrees},
      {&traits<std::vector<float>>::type(), degrees},
      {&traits<std::vector<std::array<std::int16_t, 3>>>::type(), {}},
      {&traits<std::array<std::vector<std::string>, 2>>::type(), {}},
      {&traits<plain_fuzz::Step>::type(), degrees},
      {&traits<plain_fuzz::Move>::type(), {}},
      {&traits<std::array<std::vector<float>, 2>>::type(), any},
      {&traits<std::vector<std::vector<std::int16_t>>>::type(), {}},
  };
  return all;
}

/// What a body says, as a value of the type; nullopt: the type refuses it.
Result<std::optional<Value>> value_of(std::string_view body, Plain format, const Case& c) {
  Graph graph;
  const TermId focus = graph.intern(lrt::rdf::iri("http://example.org/focus"));
  if (Result<void> r = read_plain(body, format, *c.type, c.facets, names, 2000, graph, focus); !r) return lrt::unexpected(r.error());
  std::vector<Mismatch> mismatches;
  Result<Value> value = read_value(graph, focus, *c.type, c.facets, names, mismatches);
  return value ? std::optional<Value>(*value) : std::nullopt;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const Case& c = cases()[data[0] % cases().size()];
  const Plain read_as = formats[data[1] % formats.size()];
  const std::string_view body(reinterpret_cast<const char*>(data + 2), size - 2);
  const Result<std::optional<Value>> value = value_of(body, read_as, c);
  if (!value) {
    const std::string& message = value.error().message;
    if (message.empty() || message.size() > 1000) broken("an error without a word, or with too many", message);
    return 0;
  }
  if (!*value) return 0;
  for (const Plain format : formats) {
    const Result<std::string> written = write_plain(*c.type, c.facets, **value, format);
    if (format == Plain::octets) {
      const Result<Octets> layout = octets_of(*c.type, **value);
      if (layout ? !written || written->size() != layout->size() : written.has_value())
        broken("octets that are not of their layout", written.value_or(std::string()));
      if (!layout || !reads_octets(*c.type)) continue;
    }
    if (!written) broken("not written", written.error().message);
    const Result<std::optional<Value>> back = value_of(*written, format, c);
    if (!back) broken(back.error().message.c_str(), *written);
    if (!*back || !same(**value, **back)) broken("another value", *written);
  }
  return 0;
}
