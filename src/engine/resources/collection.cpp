// SPDX-License-Identifier: Apache-2.0
#include "src/engine/resources/collection.hpp"

#include <algorithm>

#include <lrt/base/ids.hpp>
#include <lrt/rdf/value_codec.hpp>

#include "src/engine/description.hpp"
#include "src/engine/overview.hpp"
#include "src/engine/parts.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/engine/stop_state.hpp"

namespace lrt::engine {
inline namespace v0 {

void describe_container_types(About& about) { about.a(vocab::ldp::BasicContainer).a(vocab::ldp::Container).a(vocab::ldp::RDFSource); }

void describe_container(About& about, const Container& container, const Description& d) {
  if (d.page == minimal_page) return;
  const std::vector<Resource*> members = container.members(d.audience);
  const std::size_t first = std::min(members.size(), (d.page - 1) * d.engine.options.max_page_members);
  const std::size_t last = std::min(members.size(), first + d.engine.options.max_page_members);
  for (std::size_t i = first; i < last; ++i) about.link(vocab::ldp::contains, d.base + members[i]->path);
  for (std::size_t i = first; i < last; ++i) {
    About member(d.graph, d.base + members[i]->path);
    container.describe_member(*members[i], member, d);
  }
}

// ---------------------------------------------------------------------------------------------------------------- member

MemberResource::MemberResource(std::string its_path, CollectionResource& its_collection, std::string its_id, rdf::Value its_value)
    : ValueResource(std::move(its_path), its_collection.thing),
      collection(its_collection),
      member_id(std::move(its_id)),
      value(std::move(its_value)) {}

Methods MemberResource::methods() const noexcept {
  Methods methods;
  methods.remove = static_cast<bool>(collection.spec->remove);
  return methods;
}

Outcome MemberResource::remove(Context& context, Parts& parts) {
  if (auto response = parts.representations.failed_precondition(context)) return *std::move(response);
  if (removing_) return parts.responses.problem(context, 409, "the member is being removed already");
  const auto ticket = parts.defer_command(context, thing->where(*collection.spec));
  if (!ticket) return parts.responses.overloaded(context);
  removing_ = true;
  const SharedCheck check = parts.rules.judge_before_call(context);
  auto token = parts.calls.call<void>(
      thing->where(*collection.spec),
      [spec = collection.spec, known_id = member_id, check] { return call_if_passes<void>(check, [&] { return spec->remove(known_id); }); },
      [ref = Ref(*this), &parts, ticket = *ticket, check](const Result<void>& result, TimePoint now) {
        if (MemberResource* member = parts.registry.find(ref)) member->removed(result, refusal_of(check), ticket, parts, now);
        else parts.respond_gone(ticket);
      });
  parts.pending.waits_for(*ticket, token);
  collection.calls_[*ticket] = std::move(token);
  return Deferred{*ticket};
}

void MemberResource::removed(const Result<void>& result, Refusal refusal, Ticket ticket, Parts& parts, TimePoint now) {
  CollectionResource& its_collection = collection;
  its_collection.calls_.erase(ticket);
  removing_ = false;
  if (const Context* context = parts.pending.resume(ticket, now)) {
    parts.pending.respond(ticket, refusal != Refusal::none ? parts.rules.refused(*context, refusal)
                                  : result                 ? parts.responses.no_content(*context)
                                           : parts.responses.refused(*context, "the member \"" + path + "\" was not removed", result.error()));
  }
  if (!result) return;
  parts.registry.remove(*this);
  auto& members = its_collection.members_;
  members.erase(std::find_if(members.begin(), members.end(), [this](const auto& m) { return m.get() == this; }));  // this object was destroyed
  its_collection.mark_changed();
}

void MemberResource::describe(const Description& d) const {
  About about(d.graph, d.base + path);
  describe_types(about, d);
  d.quote(*this,
          [&] { rdf::write_value(d.graph, about.subject(), *collection.spec->type, collection.spec->facets, value, d.engine.vocabulary(d.base)); });
}

void MemberResource::describe_types(About& about, const Description& d) const {
  about.a(vocab::ldp::RDFSource);
  describe_value_types(about, *collection.spec->type, d.engine.vocabulary(d.base));
}

std::optional<PlainValue> MemberResource::plain_value(const Audience&) const {
  return PlainValue{collection.spec->type, &collection.spec->facets, &value};
}

void MemberResource::summarize(Overview& o) const {
  if (const Result<std::string> json = rdf::write_plain(*collection.spec->type, collection.spec->facets, value, rdf::Plain::json))
    o.json("value", *json);
}

const model::ResourceSpec* MemberResource::command() const noexcept { return collection.spec.get(); }

std::string MemberResource::up() const { return collection.path; }

// ------------------------------------------------------------------------------------------------------------ collection

CollectionResource::CollectionResource(std::string its_path, ThingNode* its_thing, std::shared_ptr<model::CollectionSpec> s)
    : Resource(std::move(its_path), its_thing), spec(std::move(s)) {}
CollectionResource::~CollectionResource() = default;

Methods CollectionResource::methods() const noexcept {
  Methods methods;
  methods.post = static_cast<bool>(spec->create);
  return methods;
}

Outcome CollectionResource::post(Context& context, Parts& parts) {
  // LDP 5.2.3.4: the requested interaction model must be one that a member has.
  if (requests_other_model(context.request().joined("Link")))
    return parts.responses.problem(context, 409, "members of this container are ldp:RDFSource");
  auto read = parts.bodies.read_value(context, *spec->type, spec->facets, spec);
  if (auto outcome = outcome_of(read)) return *std::move(outcome);
  if (auto response = parts.representations.failed_precondition(context)) return *std::move(response);
  if (members_.size() + creating_ >= spec->max_members)
    return parts.responses.problem(context, 409, "the collection has reached its maximum of " + std::to_string(spec->max_members) + " members");
  const auto ticket = parts.defer_command(context, thing->where(*spec));
  if (!ticket) return parts.responses.overloaded(context);
  const std::string new_id = parts.options.ids->next();
  const auto value = std::make_shared<const rdf::Value>(std::move(std::get<Body>(read).value));
  std::shared_ptr<CancelToken>& call = calls_[*ticket];
  const SharedCheck check = parts.rules.judge_before_call(context);
  call = parts.calls.call<void>(
      thing->where(*spec), [s = spec, new_id, value, check] { return call_if_passes<void>(check, [&] { return s->create(new_id, *value); }); },
      [ref = Ref(*this), &parts, new_id, value, ticket = *ticket, check](const Result<void>& result, TimePoint now) {
        if (CollectionResource* collection = parts.registry.find(ref))
          collection->created(new_id, *value, result, refusal_of(check), ticket, parts, now);
        else parts.respond_gone(ticket);
      });
  ++creating_;
  parts.pending.waits_for(*ticket, call);
  return Deferred{*ticket};
}

void CollectionResource::created(const std::string& new_id, rdf::Value value, const Result<void>& result, Refusal refusal, Ticket ticket,
                                 Parts& parts, TimePoint now) {
  calls_.erase(ticket);
  --creating_;
  MemberResource* member = nullptr;
  if (result) {
    auto made = std::make_unique<MemberResource>(path + "/" + new_id, *this, new_id, std::move(value));
    members_.reserve(members_.size() + 1);
    parts.registry.add(*made);
    member = made.get();
    members_.push_back(std::move(made));
    mark_changed();
  }
  const Context* context = parts.pending.resume(ticket, now);
  if (!context) return;
  if (refusal != Refusal::none) return parts.pending.respond(ticket, parts.rules.refused(*context, refusal));
  if (!member)
    return parts.pending.respond(ticket,
                                 parts.responses.refused(*context, "the collection \"" + path + "\" did not accept the member", result.error()));
  const std::string location = parts.responses.iri(*context, member->path);
  http::Response response;
  if (context->wants_representation()) {
    const rdf::Graph graph = parts.representations.describe(*member, context->base, context->audience);
    const PlainValue plain = *member->plain_value(context->audience);
    response = parts.responses.graph(*context, 201, graph, &plain);
    response.fields.add("Content-Location", location);
    response.fields.add("Preference-Applied", "return=representation");
  } else {
    response = parts.responses.no_content(*context, 201);  // LDP 5.2.3.1
  }
  response.fields.add("Location", location);
  parts.pending.respond(ticket, std::move(response));
}

void CollectionResource::removed(Parts& parts) {
  for (const auto& [ticket, token] : calls_) {
    token->cancel();
    parts.respond_gone(ticket);
  }
  calls_.clear();
  for (const auto& member : members_) parts.registry.remove(*member);
}

void CollectionResource::describe(const Description& d) const {
  About about(d.graph, d.base + path);
  describe_types(about, d);
  about.link(vocab::rdfs::seeAlso, d.base + thing->self.path);
  about.statements(spec->statements, d.base);
  describe_container(about, *this, d);
}

void CollectionResource::describe_controls(About& about, const Description& d) const {
  Resource::describe_controls(about, d);
  if (!methods().post) return;
  if (const std::string reason = reason_of_stop(*thing, *spec); !reason.empty()) about.add(vocab::lrt_::unavailable, rdf::literal(reason));
  if (d.audience.methods(*this).post)
    describe_binding(about, d, *this, vocab::http_methods::POST, {rdf::target_class(*spec->type, d.engine.vocabulary(d.base))});
}

void CollectionResource::describe_types(About& about, const Description&) const { describe_container_types(about); }

void CollectionResource::summarize(Overview& o) const {
  o.described(spec->statements, spec->classes, nullptr);
  o.schema("schema", spec->type, spec->facets);
  if (methods().post) o.text("unavailable", reason_of_stop(*thing, *spec));
}

void CollectionResource::overview(Overview& o) const { o.members("members", *this); }

std::vector<Resource*> CollectionResource::members() const {
  std::vector<Resource*> all;
  for (const auto& m : members_) all.push_back(m.get());
  return all;
}

}  // namespace v0
}  // namespace lrt::engine
