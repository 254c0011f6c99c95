// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/value_codec.hpp>

#include "tools/lrt/command_line.hpp"

namespace lrt::tool {

using rdf::TermId;
using rdf::TermView;
using rdf::Triple;

namespace {

struct SubsOptions {
  std::vector<std::string> words, cancel;
  bool json = false;
};

/// A subscription (Figure 4).
struct Subscription {
  std::string url, protocol, resource, receiver, delivered, dropped, created, last_error;
};

std::string id_of(std::string_view url) {
  const std::size_t at = url.rfind('/');
  return std::string(at == std::string_view::npos ? url : url.substr(at + 1));
}

Subscription read(const client::Representation& representation, const std::string& url) {
  Subscription found;
  found.url = url;
  const rdf::Graph& graph = representation.graph;
  const std::optional<TermId> self = graph.find(rdf::iri(url));
  if (!self) return found;
  for (const Triple& t : graph.match(*self, std::nullopt, std::nullopt)) {
    const std::string_view predicate = graph.term(t.predicate).text;
    const std::string object(graph.term(t.object).text);
    const std::string_view name = predicate.substr(std::min(predicate.find_last_of("#/") + 1, predicate.size()));
    if (predicate == vocab::rdf_::type.text) {
      const std::string kind = id_of(object).substr(id_of(object).find('#') + 1);
      if (kind != "Subscription") found.protocol = kind;
    } else if (predicate == vocab::hybrit::onResource.text) {
      found.resource = object;
    } else if (name == "callbackURL" || name == "callbackUrl") {
      found.receiver = object;
    } else if (name == "delivered") {
      found.delivered = object;
    } else if (name == "dropped") {
      found.dropped = object;
    } else if (name == "created") {
      found.created = object;
    } else if (name == "lastError") {
      found.last_error = object;
    }
  }
  return found;
}

Result<std::vector<Subscription>> subscriptions_of(Session& session, const std::vector<std::string>& containers) {
  const Result<Client*> client = session.client();
  if (!client) return unexpected(client.error());
  std::vector<Subscription> all;
  for (const std::string& start : containers) {
    std::string container = start;
    constexpr int max_pages = 1'000;
    for (int page = 0; !container.empty() && page < max_pages; ++page) {
      const Result<client::RepresentationPtr> found = (*client)->get(container);
      if (!found) return unexpected(found.error());
      const auto contains = (*found)->graph.find(vocab::ldp::contains);
      if (contains) {
        for (const Triple& t : (*found)->graph.match(std::nullopt, contains, std::nullopt)) {
          const TermView member = (*found)->graph.term(t.object);
          if (!member.is_iri()) continue;
          const std::string url(member.text);
          const Result<client::RepresentationPtr> one = (*client)->get(url);
          if (!one && one.error().code == Errc::unknown_path) continue;  // it has ended meanwhile
          all.push_back(read(one ? **one : **found, url));
        }
      }
      const std::vector<std::string> next = (*found)->targets("next");
      container = next.empty() ? std::string() : next.front();
    }
  }
  return all;
}

Result<int> subs(Session& session, SubsOptions& options) {
  const bool needs_list =
      options.cancel.empty() || std::any_of(options.cancel.begin(), options.cancel.end(), [](const std::string& c) { return !is_url(c); });
  std::optional<client::Thing> thing;
  if (needs_list) {
    Result<std::optional<client::Thing>> named = session.take_thing(options.words);
    if (!named) return unexpected(std::move(named).error());
    thing = *std::move(named);
  }
  Result<Client*> client = session.client();
  if (!client) return unexpected(client.error());
  std::vector<Subscription> all;
  if (needs_list) {
    std::vector<std::string> containers;
    if (thing) {
      if (thing->subscriptions().empty()) return unexpected(Errc::unknown_path, "\"" + thing->name() + "\" has no list of subscriptions");
      containers.push_back(thing->subscriptions());
    } else {
      const Result<const client::Robot*> robot = session.robot();
      if (!robot) return unexpected(robot.error());
      for (const client::Thing& one : (*robot)->things())
        if (!one.subscriptions().empty()) containers.push_back(one.subscriptions());
    }
    Result<std::vector<Subscription>> found = subscriptions_of(session, containers);
    if (!found) return unexpected(found.error());
    all = *std::move(found);
  }

  for (const std::string& wanted : options.cancel) {
    std::string url = is_url(wanted) ? wanted : std::string();
    for (const Subscription& one : all)
      if (url.empty() && id_of(one.url) == wanted) url = one.url;
    if (url.empty()) return unexpected(Errc::unknown_path, "there is no subscription \"" + wanted + "\"");
    const Result<client::Property> trusted = session.property(url);  // of an origin that was given on the command line
    if (!trusted) return unexpected(trusted.error());
    const Result<client::Response> response = (*client)->send({"DELETE", url, {{"Accept", "application/problem+json, text/turtle;q=0.5"}}, {}});
    if (!response) return unexpected(response.error());
    if (!response->ok()) return unexpected(Errc::refused, "DELETE " + url + ": " + std::to_string(response->status) + ": " + response->reason());
  }
  if (!options.cancel.empty()) return Exit::success;

  if (options.json) {
    std::string json = "[";
    for (const Subscription& one : all) {
      json += (json.size() > 1 ? "," : "") + std::string("{\"url\":") + json_string(one.url) + ",\"protocol\":" + json_string(one.protocol) +
              ",\"resource\":" + json_string(one.resource);
      for (const auto& [name, value] : {std::pair{"receiver", &one.receiver},
                                        {"delivered", &one.delivered},
                                        {"dropped", &one.dropped},
                                        {"created", &one.created},
                                        {"lastError", &one.last_error}})
        if (!value->empty()) json += std::string(",\"") + name + "\":" + json_string(*value);
      json += "}";
    }
    return session.terminal().print_line(json + "]") ? Exit::success : Exit::failure;
  }
  if (all.empty()) {
    session.warn("no subscriptions");
    return Exit::success;
  }
  Table table;
  for (const Subscription& one : all) {
    table.add({{printable(id_of(one.url)), Style::strong},
               {printable(one.protocol)},
               {session.label(one.resource)},
               {one.receiver.empty() ? "-" : printable(one.receiver)},
               {one.delivered.empty() ? "-" : printable(one.delivered)},
               {one.dropped.empty() ? "-" : printable(one.dropped)},
               {one.last_error.empty() ? "-" : printable(one.last_error), Style::bad}});
  }
  return table.print(session.terminal(), {"id", "protocol", "resource", "receiver", "delivered", "dropped", "last error"}) ? Exit::success
                                                                                                                           : Exit::failure;
}

}  // namespace

void add_subs(CommandLine& line) {
  auto options = std::make_shared<SubsOptions>();
  CLI::App* const command = line.add("subs", "List and cancel subscriptions",
                                     "Examples:\n"
                                     "  lrt subs                               # of all Things\n"
                                     "  lrt subs right_s1\n"
                                     "  lrt subs --cancel 3536846b-66f8-42ce-a09b-001677e9f675",
                                     options, subs);
  command->add_option("NAME", options->words, "The name of a Thing")->type_name("[ROBOT] [NAME]")->expected(0, 2);
  command->add_option("--cancel", options->cancel, "Cancel the subscription with this URL or id")
      ->type_name("URL|ID")
      ->take_all()
      ->type_size(1)
      ->expected(1);
  command->add_flag("--json", options->json, "Print JSON");
}

}  // namespace lrt::tool
