// SPDX-License-Identifier: Apache-2.0
#include <lrt/client/typed.hpp>

#include <deque>
#include <map>
#include <mutex>

#include <lrt/base/immortal.hpp>
#include <lrt/rdf/value_codec.hpp>

namespace lrt::client {
inline namespace v0 {

const rdf::Type& with_datatype(const rdf::Type& type, Iri datatype) {
  struct Kept {
    std::mutex mutex;  // guards all
    std::map<std::pair<const rdf::Type*, std::string>, rdf::Type> types;
  };
  static Immortal<Kept> kept;
  rdf::Type changed = type;
  if (type.element) changed.element = &with_datatype(*type.element, datatype);
  const std::lock_guard lock(kept->mutex);
  const auto [entry, is_new] = kept->types.emplace(std::pair(&type, std::string(datatype.text)), changed);
  if (is_new && !type.element) entry->second.datatype = Iri(std::string_view(entry->first.second));
  return entry->second;
}

Members::Members(Thing thing, std::string kind, const std::vector<std::string>& classes) : thing_(std::move(thing)), kind_(std::move(kind)) {
  for (const std::string& c : classes)
    if (!thing_.is(Iri(std::string_view(c)))) miss("it is no " + rdf::abbreviate(c));
}

void Members::miss(const std::string& what) {
  if (missing_.empty()) missing_ = what;
}

std::optional<Property> Members::property(std::string_view predicate, std::string_view name, bool required) {
  if (!predicate.empty())
    if (Result<Property> found = thing_.property(predicate)) return *std::move(found);
  if (Result<Property> found = thing_.property(name)) return *std::move(found);
  if (required) miss("it has no property \"" + std::string(name) + "\"");
  return std::nullopt;
}

std::optional<Action> Members::action(std::string_view predicate, std::string_view name, bool required) {
  if (!predicate.empty())
    if (Result<Action> found = thing_.action(predicate)) return *std::move(found);
  if (Result<Action> found = thing_.action(name)) return *std::move(found);
  if (required) miss("it has no action \"" + std::string(name) + "\"");
  return std::nullopt;
}

Result<void> Members::fits() const {
  if (missing_.empty()) return {};
  return unexpected(Errc::expected_value, "expected a " + kind_ + ", found <" + thing_.url() + ">: " + missing_);
}

}  // namespace v0
}  // namespace lrt::client
