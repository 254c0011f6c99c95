// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/unit.hpp>

#include <algorithm>
#include <deque>
#include <mutex>
#include <string>

#include <lrt/base/immortal.hpp>

namespace lrt::rdf {
inline namespace v0 {
namespace detail {

namespace {

struct KeptUnit {
  explicit KeptUnit(const Unit& u)
      : qudt(u.qudt.text),
        vom(u.vom.text),
        ucum(u.ucum),
        quantity_kind(u.quantity_kind.text),
        unit{Iri(std::string_view(qudt)), Iri(std::string_view(vom)), ucum, Iri(std::string_view(quantity_kind))} {}
  KeptUnit(const KeptUnit&) = delete;
  KeptUnit& operator=(const KeptUnit&) = delete;

  const std::string qudt, vom, ucum, quantity_kind;
  const Unit unit;
};

struct KeptUnits {
  std::mutex mutex;  // guards `all`
  std::deque<KeptUnit> all;
};

bool is_identical(const Unit& a, const Unit& b) noexcept {
  return a.qudt == b.qudt && a.vom == b.vom && a.ucum == b.ucum && a.quantity_kind == b.quantity_kind;
}

}  // namespace

const Unit& kept_unit(const Unit& unit) {
  if (is_identical(unit, unit::none)) return unit::none;
  static Immortal<KeptUnits> units;
  const std::lock_guard lock(units->mutex);
  const auto known = std::find_if(units->all.begin(), units->all.end(), [&](const KeptUnit& k) { return is_identical(k.unit, unit); });
  return known != units->all.end() ? known->unit : units->all.emplace_back(unit).unit;
}

}  // namespace detail
}  // namespace v0
}  // namespace lrt::rdf
