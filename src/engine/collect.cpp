#include <algorithm>

#include "src/engine/impl.hpp"

namespace lrt::engine {

/// Looks for a link of relation type to an LDP model other than ldp:Resource and ldp:RDFSource.
bool asks_for_other_model(std::string_view field) {
  constexpr std::string_view ldp = "http://www.w3.org/ns/ldp#";
  while (true) {
    const std::size_t open = field.find('<');
    const std::size_t close = field.find('>', open);
    if (open == std::string_view::npos || close == std::string_view::npos) return false;
    const std::string_view target = field.substr(open + 1, close - open - 1);
    field.remove_prefix(close + 1);
    // Parameters up to the comma that ends this link; quoted strings may hold anything.
    bool is_type = false, quoted = false;
    std::string name, value;
    std::string* part = nullptr;
    const auto end_parameter = [&] {
      if (http::iequals(name, "rel")) {
        std::size_t start = 0;
        while (start < value.size()) {  // a list of relation types
          const std::size_t end = std::min(value.find(' ', start), value.size());
          is_type |= http::iequals(std::string_view(value).substr(start, end - start), "type");
          start = end + 1;
        }
      }
      name.clear();
      value.clear();
    };
    std::size_t at = 0;
    for (; at < field.size() && (quoted || field[at] != ','); ++at) {
      const char c = field[at];
      if (c == '"') quoted = !quoted;
      else if (quoted && part) *part += c;
      else if (c == ';') end_parameter(), part = &name;
      else if (c == '=' && part == &name) part = &value;
      else if (c != ' ' && c != '\t' && part) *part += c;
    }
    end_parameter();
    field.remove_prefix(at);
    if (!is_type || target.substr(0, ldp.size()) != ldp) continue;
    if (target != vocab::ldp::Resource.text && target != vocab::ldp::RDFSource.text) return true;
  }
}

Outcome Engine::Impl::post_collection(Context& context) {
  auto& collection = static_cast<CollectionResource&>(*context.resource);
  // LDP 5.2.3.4: the requested interaction model must be one that a member has.
  if (asks_for_other_model(context.request.joined("Link"))) return problem(context, 409, "members of this container are ldp:RDFSource");
  auto read = read_value(context, *collection.spec->type, collection.spec->facets);
  if (auto* answer = std::get_if<http::Response>(&read)) return std::move(*answer);
  if (auto answer = precondition(context)) return *std::move(answer);
  if (collection.members.size() + collection.creating >= collection.spec->max_members)
    return problem(context, 409, "the collection is full with " + std::to_string(collection.spec->max_members) + " members");
  Ticket ticket{};
  Outcome outcome = defer(context, options_.host_time, ticket);
  Waiting* waiting = find_waiting(ticket);
  if (!waiting) return outcome;
  waiting->claim = collection.under_way[ticket] = std::make_shared<Claim>();
  ++collection.creating;
  add_job(where(*collection.thing), [door = door_, spec = collection.spec, claim = waiting->claim, path = collection.path, ticket,
                                     id = options_.ids->next(), value = std::move(std::get<rdf::Value>(read))]() mutable {
    Result<void> result;
    if (claim->take()) result = guarded<void>([&] { return spec->create(id, value); });
    else result = unexpected(Errc::cancelled, "called off");
    door->put([path, id, value = std::move(value), result = std::move(result), ticket](Engine::Impl& engine, TimePoint now) mutable {
      engine.member_created(path, id, std::move(value), std::move(result), ticket, now);
    });
  });
  return outcome;
}

void Engine::Impl::member_created(const std::string& path, const std::string& id, rdf::Value value, Result<void> result, Ticket ticket,
                                  TimePoint now) {
  Resource* resource = find(path);
  if (!resource || resource->kind != Kind::collection) return answer_gone(ticket);
  auto& collection = static_cast<CollectionResource&>(*resource);
  if (collection.under_way.erase(ticket) == 0) return answer_gone(ticket);  // of another collection that had this path
  --collection.creating;
  MemberResource* member = nullptr;
  if (result) {
    auto made = std::make_unique<MemberResource>(path + "/" + id, collection.thing, &collection, id, std::move(value));
    member = made.get();
    collection.members.push_back(std::move(made));
    take_path(*member);
    ++collection.revision;
  }
  const Waiting* waiting = find_waiting(ticket);
  if (!waiting) return;
  const http::Request request = waiting->request.view();
  Context context = resumed(request, now, &collection);
  if (!member) return reply(ticket, refused(context, "the collection \"" + path + "\" did not take the member", result.error()));
  const std::string location = iri_of(context, member->path);
  http::Response response;
  if (context.preferences.return_ == http::Preferences::Return::representation) {
    rdf::Graph graph;
    describe(graph, *member, bases_[context.base], 1);
    const Said said = said_by(*member);
    response = with_graph(context, 201, graph, &said);
    response.fields.add("Content-Location", location);
    response.fields.add("Preference-Applied", "return=representation");
  } else {
    response = no_content(context, 201);  // LDP 5.2.3.1
  }
  response.fields.add("Location", location);
  reply(ticket, std::move(response));
}

Outcome Engine::Impl::delete_member(Context& context) {
  auto& member = static_cast<MemberResource&>(*context.resource);
  if (auto answer = precondition(context)) return *std::move(answer);
  if (member.removing) return problem(context, 409, "the member is being removed already");
  Ticket ticket{};
  Outcome outcome = defer(context, options_.host_time, ticket);
  Waiting* waiting = find_waiting(ticket);
  if (!waiting) return outcome;
  member.removing = true;
  waiting->claim = member.collection->under_way[ticket] = std::make_shared<Claim>();
  add_job(where(*member.thing), [door = door_, spec = member.collection->spec, claim = waiting->claim, path = member.path, id = member.id,
                                 ticket]() mutable {
    Result<void> result;
    if (claim->take()) result = guarded<void>([&] { return spec->remove(id); });
    else result = unexpected(Errc::cancelled, "called off");
    door->put([path, result = std::move(result), ticket](Engine::Impl& engine, TimePoint now) mutable {
      engine.member_removed(path, std::move(result), ticket, now);
    });
  });
  return outcome;
}

void Engine::Impl::member_removed(const std::string& path, Result<void> result, Ticket ticket, TimePoint now) {
  Resource* resource = find(path);
  if (!resource || resource->kind != Kind::member) return answer_gone(ticket);
  auto& member = static_cast<MemberResource&>(*resource);
  if (member.collection->under_way.erase(ticket) == 0) return answer_gone(ticket);
  member.removing = false;
  if (const Waiting* waiting = find_waiting(ticket)) {
    const http::Request request = waiting->request.view();
    const Context context = resumed(request, now, &member);
    reply(ticket, result ? no_content(context) : refused(context, "the member \"" + path + "\" was not removed", result.error()));
  }
  if (!result) return;
  CollectionResource& collection = *member.collection;
  drop_path(member);
  collection.members.erase(
      std::find_if(collection.members.begin(), collection.members.end(), [&](const auto& m) { return m.get() == &member; }));
  ++collection.revision;
}

}  // namespace lrt::engine
