// SPDX-License-Identifier: Apache-2.0
#include "src/engine/resources/control.hpp"

#include <algorithm>
#include <utility>
#include <variant>
#include <vector>

#include <lrt/base/immortal.hpp>
#include <lrt/http/problem.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/traits.hpp>

#include "src/base/function_ref.hpp"
#include "src/base/random.hpp"
#include "src/base/utf8.hpp"
#include "src/engine/description.hpp"
#include "src/engine/overview.hpp"
#include "src/engine/parts.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/http/form.hpp"

namespace lrt::engine {
inline namespace v0 {

namespace {

constexpr std::chrono::milliseconds default_life{10'000}, min_life{1'000}, max_life{60'000};
constexpr std::size_t max_name_bytes = 64;
constexpr std::size_t id_bytes = 16;

/// The time of the comparison does not depend on where the texts differ.
bool are_equal(std::string_view a, std::string_view b) noexcept {
  if (a.size() != b.size()) return false;
  unsigned char difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i) difference = static_cast<unsigned char>(difference | (a[i] ^ b[i]));
  return difference == 0;
}

std::string_view id_of(const http::Request& request) { return request.find(control_id_field).value_or(std::string_view()); }

bool is_name(const std::string& name) {
  return !name.empty() && name.size() <= max_name_bytes && !utf8::find_invalid(name) &&
         std::none_of(name.begin(), name.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; });
}

void visit_below(const ThingNode& thing, FunctionRef<void(ControlBase&)> visit) {
  for (const ThingNode* child : thing.children) {
    if (child->control) visit(*child->control);
    visit_below(*child, visit);
  }
}

/// Who has control, as a record.
const rdf::Type& record_type() {
  static const Immortal<rdf::Type> type([] {
    rdf::Type record;
    record.kind = rdf::Type::Kind::record;
    const auto field = [&](const char* name, Iri predicate, const rdf::Type& of) {
      record.fields.push_back({name, std::string(predicate.text), &of, {}});
    };
    field("held", vocab::lrt_::held, rdf::traits<bool>::type());
    field("heldBy", vocab::lrt_::heldBy, rdf::traits<std::string>::type());
    field("until", vocab::lrt_::until, rdf::traits<Utc>::type());
    field("required", vocab::lrt_::controlRequired, rdf::traits<bool>::type());
    return record;
  }());
  return *type;
}

}  // namespace

/// What a request to take or renew control says about it.
struct ControlResource::Wanted {
  std::optional<std::chrono::milliseconds> life;
  std::string name;

  static std::variant<Wanted, http::Response> of(const Context& context, const Responses& responses) {
    Wanted wanted;
    const std::string_view target = context.request().target;
    if (const auto text = http::query_parameter(target, "life")) {
      const std::optional<double> seconds = rdf::lexical::parse_double(*text);
      if (!seconds || !(*seconds >= 1) || !(*seconds <= 60))
        return responses.problem(context, 400, "life: expected 1 to 60 seconds, found \"" + *text + "\"");
      wanted.life = std::chrono::milliseconds(static_cast<std::int64_t>(*seconds * 1000));
    }
    if (auto text = http::query_parameter(target, "name")) {
      if (!is_name(*text))
        return responses.problem(context, 400,
                                 "name: expected 1 to " + std::to_string(max_name_bytes) + " bytes of UTF-8 without control characters");
      wanted.name = *std::move(text);
    }
    return wanted;
  }
};

bool ControlResource::Lease::is_of(const Context& context) const {
  const security::Principal* const who = context.audience.principal.get();
  if (!principal.empty() || who) return who && principal == who->name;
  return !id.empty() && context.request().count(control_id_field) == 1 && are_equal(id, id_of(context.request()));
}

ControlBase::Holder ControlResource::holder(const Context& context) const {
  if (!is_held(context.now)) return Holder::nobody;
  return lease_.is_of(context) ? Holder::sender : Holder::another;
}

std::string ControlResource::holder_text(const Context& context) const {
  const std::string who = lease_.name.empty() ? "another client" : "\"" + lease_.name + "\"";
  (void)context;
  return who + " has control of \"" + thing->self.path.substr(1) + "\" until " + to_xsd_date_time(lease_.until_utc) +
         ", or longer if it renews it; a client with the right to may take it over (Take-Over: ?1)";
}

// -------------------------------------------------------------------------------------------------- taking, renewing, giving back

Outcome ControlResource::post(Context& context, Parts& parts) {
  auto read = Wanted::of(context, parts.responses);
  if (auto* wrong = std::get_if<http::Response>(&read)) return std::move(*wrong);
  Wanted& wanted = std::get<Wanted>(read);
  if (auto failed = parts.representations.failed_precondition(context)) return *std::move(failed);

  // The leases of others that are in the way.
  std::vector<ControlBase*> others;
  const auto look = [&](ControlBase& control) {
    if (control.holder(context) == Holder::another) others.push_back(&control);
  };
  for (const ThingNode* above = thing; above; above = above->parent)
    if (above->control) look(*above->control);
  visit_below(*thing, look);
  if (!others.empty()) {
    const auto field = context.request().find(take_over_field);
    if (field != "?1") return controlled_by_another(context, parts.responses, *others.front());
    for (const ControlBase* control : others)
      if (!context.audience.may(security::Right::control, *control))
        return parts.responses.denied(context, http::Denial::right, 403,
                                      "another client has control, and these credentials do not allow taking it over (the right \"control\")");
    for (ControlBase* control : others) static_cast<ControlResource*>(control)->end(parts);
  }

  const bool is_again = !lease_.name.empty() || !lease_.principal.empty() || !lease_.id.empty() ? lease_.is_of(context) : false;
  if (!is_again) {
    Lease lease;
    if (const auto& who = context.audience.principal) {
      lease.principal = who->name;
      lease.name = std::string(utf8::prefix(who->name, max_name_bytes));
    } else {
      // A client that has control of another Thing uses the same id for both.
      const auto sends_own = [&] {
        bool is_own = false;
        for (const auto& [at, other] : parts.registry.things())
          if (other->control && other->control->holder(context) == Holder::sender) is_own = true;
        return is_own;
      };
      lease.id = !id_of(context.request()).empty() && sends_own() ? std::string(id_of(context.request())) : random_hex(id_bytes);
    }
    lease_ = std::move(lease);
    number->fetch_add(1, std::memory_order_acq_rel);  // commands of others that still wait for the host are not carried out
  }
  if (!wanted.name.empty() && lease_.principal.empty()) lease_.name = std::move(wanted.name);
  renew(wanted.life.value_or(default_life), context, parts);
  return held_response(context, true);
}

Outcome ControlResource::put(Context& context, Parts& parts) {
  auto read = Wanted::of(context, parts.responses);
  if (auto* wrong = std::get_if<http::Response>(&read)) return std::move(*wrong);
  if (auto failed = parts.representations.failed_precondition(context)) return *std::move(failed);
  switch (holder(context)) {
    case Holder::another: return controlled_by_another(context, parts.responses, *this);
    case Holder::nobody: return control_required(context, parts.responses, *this, 409);
    default: break;
  }
  renew(std::get<Wanted>(read).life.value_or(lease_.life), context, parts);
  return held_response(context, false);
}

Outcome ControlResource::remove(Context& context, Parts& parts) {
  if (auto failed = parts.representations.failed_precondition(context)) return *std::move(failed);
  if (holder(context) == Holder::another) return controlled_by_another(context, parts.responses, *this);
  if (is_held(context.now)) end(parts);
  return parts.responses.no_content(context);
}

void ControlResource::renew(std::chrono::milliseconds life, Context& context, Parts& parts) {
  lease_.life = std::clamp(life, min_life, max_life);
  lease_.until = context.now.steady + lease_.life;
  lease_.until_utc = context.now.utc + lease_.life;
  lease_.is_held = true;
  parts.leases.set(lease_end, lease_.until, id);
  mark_changed();
}

/// Nobody has it now. Commands of its holder that wait for the host are not carried out if another client takes it.
void ControlResource::end(Parts& parts) {
  parts.leases.clear(lease_end);
  lease_.is_held = false;
  number->fetch_add(1, std::memory_order_acq_rel);
  lease_ = Lease();
  mark_changed();
}

void ControlResource::expire(TimePoint now, DeadlineQueue<ResourceId>& leases) {
  lease_end.reset();
  if (!lease_.is_held) return;
  if (lease_.until > now.steady) return leases.set(lease_end, lease_.until, id);
  lease_.is_held = false;
  mark_changed();
}

/// For its holder alone: it may have the id.
http::Response ControlResource::held_response(const Context& context, bool with_id) const {
  std::string text = "{";
  if (with_id && !lease_.id.empty()) text += "\"controlId\":" + http::json_string(lease_.id) + ",";
  if (!lease_.name.empty()) text += "\"heldBy\":" + http::json_string(lease_.name) + ",";
  text += "\"until\":" + http::json_string(to_xsd_date_time(lease_.until_utc)) + ",\"life\":" + seconds(lease_.life) + "}";
  http::Response response;
  response.status = 200;
  response.fields.add("Content-Type", "application/json");
  response.fields.add("Cache-Control", "private, no-store");
  if (with_id && !lease_.id.empty()) response.fields.add(control_id_field, lease_.id);
  response.fields.add("Vary", context.vary());
  response.set_body(std::move(text));
  return response;
}

// ------------------------------------------------------------------------------------------------------------ description

void ControlResource::describe(const Description& d) const {
  About about(d.graph, d.base + path);
  describe_types(about, d);
  about.link(vocab::rdfs::seeAlso, d.base + thing->self.path);
  const auto boolean = [&](Iri predicate, bool value) { about.add(predicate, rdf::literal(value ? "true" : "false", vocab::xsd::boolean)); };
  boolean(vocab::lrt_::held, lease_.is_held);
  if (lease_.is_held && !lease_.name.empty()) about.add(vocab::lrt_::heldBy, rdf::literal(lease_.name));
  if (lease_.is_held) about.when(vocab::lrt_::until, lease_.until_utc);
  boolean(vocab::lrt_::controlRequired, options_.required);
}

void ControlResource::describe_types(About& about, const Description&) const { about.a(vocab::lrt_::Control); }

std::optional<PlainValue> ControlResource::plain_value(const Audience&) const {
  static const rdf::Facets no_facets;
  rdf::Value::Sequence values = {rdf::Value(lease_.is_held), lease_.is_held && !lease_.name.empty() ? rdf::Value(lease_.name) : rdf::Value(),
                                 lease_.is_held ? rdf::traits<Utc>::encode(lease_.until_utc) : rdf::Value(), rdf::Value(options_.required)};
  return PlainValue{&record_type(), &no_facets, nullptr, rdf::Value(std::move(values))};
}

void ControlResource::summarize(Overview& o) const { o.json("required", options_.required ? "true" : "false"); }

std::string ControlResource::up() const { return thing->self.path; }

}  // namespace v0
}  // namespace lrt::engine
