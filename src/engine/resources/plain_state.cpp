// SPDX-License-Identifier: Apache-2.0
#include "src/engine/resources/plain_state.hpp"

#include <algorithm>
#include <utility>

#include "src/engine/resources/kind.hpp"
#include "src/engine/resources/property.hpp"
#include "src/engine/resources/thing.hpp"

namespace lrt::engine {
inline namespace v0 {

void PlainState::add(const ThingNode& thing, const Audience& audience) {
  std::vector<rdf::FieldType> own = thing.kind->state_fields(thing, audience);
  std::size_t at = 0;
  for (const PropertyResource* p : thing.in_state()) {
    if (!audience.sees(*p)) continue;
    const bool fails = p->is_failing();
    if (fails) failed_.push_back({own[at].name, own[at].predicate, p->failure()});
    values.push_back(fails ? rdf::Value() : p->value);
    ++at;
  }
  fields.insert(fields.end(), std::make_move_iterator(own.begin()), std::make_move_iterator(own.end()));
}

void PlainState::add_failures(std::list<rdf::Type>& types) {
  if (failed_.empty()) return;
  rdf::Type& record = types.emplace_back();
  record.kind = rdf::Type::Kind::record;
  rdf::Value::Sequence reasons;
  for (Failed& failed : failed_) {
    record.fields.push_back({std::move(failed.name), std::move(failed.predicate), &rdf::traits<std::string>::type(), {}});
    reasons.push_back(rdf::Value(std::move(failed.why)));
  }
  std::string name = "@errors";
  while (std::any_of(fields.begin(), fields.end(), [&](const rdf::FieldType& f) { return f.name == name; })) name += name_aside;
  fields.push_back({name, "#" + name, &record, {}});
  values.push_back(rdf::Value(std::move(reasons)));
}

}  // namespace v0
}  // namespace lrt::engine
