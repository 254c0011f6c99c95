// SPDX-License-Identifier: Apache-2.0
#include "src/engine/targets.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>

#include <lrt/rdf/lexical.hpp>

#include "src/engine/parts.hpp"
#include "src/http/form.hpp"

namespace lrt::engine {

/// The path of a target without that of the public base, which a proxy may remove or keep. If Things have paths below it, only a proxy that
/// removes it is served: else one target could mean two resources.
std::string_view Targets::local_path(std::string_view path) const {
  const std::string_view prefix = parts_.bases.public_path();
  if (prefix.empty() || path.substr(0, prefix.size()) != prefix || parts_.registry.has_things_below(prefix)) return path;
  const std::string_view rest = path.substr(prefix.size());
  if (rest.empty()) return "/";
  return rest.front() == '/' ? rest : path;
}

Result<Resource*> Targets::resource_at(std::string_view path) const {
  const std::string_view found_at = local_path(path);
  if (Resource* const found = parts_.registry.find(found_at)) return found;
  const Result<std::string> canonical = canonical_path(found_at);
  if (!canonical) return Unexpected{canonical.error()};
  return parts_.registry.find(*canonical);
}

/// The World that can create a graph at an unused path: the path is below the World's path.
Resource* Targets::new_graph(std::string_view path, const Audience& audience) const {
  const Result<std::string> canonical = canonical_path(local_path(path));
  if (!canonical || parts_.registry.find(*canonical)) return nullptr;
  std::string above = *canonical;
  for (std::size_t slash = above.rfind('/'); slash != 0 && slash != std::string::npos; slash = above.rfind('/')) {
    above.erase(slash);
    Resource* const resource = parts_.registry.find(above);
    if (!resource) continue;
    GraphStore* const store = resource->graph_store();
    return store ? store->new_graph(*canonical, audience, parts_) : nullptr;
  }
  return nullptr;
}

std::optional<http::Response> Targets::find(Context& context, const http::Target& target) const {
  const Result<Resource*> found = resource_at(target.path);
  if (!found) return parts_.responses.problem(context, 400, "target: " + found.error().message);
  context.resource = *found;
  if (GraphStore* const store = context.resource && !target.query.empty() ? context.resource->graph_store() : nullptr) {
    const Result<Resource*> named = store->find_graph(context.request().target, context, parts_);
    if (!named) return parts_.responses.problem(context, 400, named.error().message);
    context.resource = *named;
  }
  const std::string_view method = context.request().method;
  if (!context.resource && (method == "PUT" || method == "POST")) context.resource = new_graph(target.path, context.audience);
  if (!context.resource) return parts_.responses.no_resource(context);
  context.resource_id = context.resource->id;
  if (target.query.empty()) return std::nullopt;
  if (const auto links = http::query_parameter(context.request().target, "links")) {
    const auto first = rdf::lexical::parse_uint64(*links);
    if (!first) return parts_.responses.problem(context, 400, "links: expected a number from 0");
    context.first_link = static_cast<std::size_t>(std::min<std::uint64_t>(*first, std::numeric_limits<std::size_t>::max()));
  }
  if (Paged* const paged = context.resource->paged()) {
    if (const auto text = http::query_parameter(context.request().target, "q", http::Plus::space)) {
      const Result<Resource*> part = paged->search(*text);
      if (!part) return parts_.responses.problem(context, 400, part.error().message);
      context.resource = *part;
    }
  }
  return context.resource->container() || context.resource->paged() ? read_page(context, target.query) : std::nullopt;
}

/// The parameter `page` of what has pages.
std::optional<http::Response> Targets::read_page(Context& context, std::string_view query) const {
  while (!query.empty()) {
    const std::string_view one = query.substr(0, query.find('&'));
    query.remove_prefix(std::min(query.size(), one.size() + 1));
    if (one.substr(0, 5) != "page=") continue;
    std::size_t page = 0;
    for (const char c : one.substr(5)) {
      if (c < '0' || c > '9' || page > 1'000'000) return parts_.responses.problem(context, 400, "page: expected a number from 1");
      page = page * 10 + static_cast<std::size_t>(c - '0');
    }
    const Container* const container = context.resource->container();
    const std::size_t pages = container ? page_count(container->members(context.audience).size(), parts_.options.max_page_members)
                                        : context.resource->paged()->pages(context.audience);
    if (page == 0 || page > pages) return parts_.responses.problem(context, 404, "page: expected a number from 1 to " + std::to_string(pages));
    context.page = page;
  }
  return std::nullopt;
}

}  // namespace lrt::engine
