// SPDX-License-Identifier: Apache-2.0
#include "src/mirror/reading.hpp"

#include <algorithm>
#include <deque>
#include <set>
#include <string_view>
#include <utility>

#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/client/representation.hpp"
#include "src/http/url.hpp"
#include "src/mirror/comparison.hpp"

namespace lrt::mirror {

using rdf::TermView;
using rdf::Triple;

Result<MirroredGraph> mirrored(const rdf::Graph& graph) {
  const Result<std::string> text = rdf::write(graph, rdf::Syntax::n_triples);
  if (!text) return unexpected(text.error());
  std::vector<std::string_view> lines;
  for (std::string_view rest = *text; !rest.empty();) {
    const std::string_view line = rest.substr(0, std::min(rest.find('\n'), rest.size() - 1) + 1);
    lines.push_back(line);
    rest.remove_prefix(line.size());
  }
  std::sort(lines.begin(), lines.end());
  MirroredGraph result;
  result.turtle.reserve(text->size());
  for (const std::string_view line : lines) result.turtle += line;
  Result<std::string> digest = fingerprint(graph);
  if (!digest) return unexpected(std::move(digest).error());
  result.digest = *std::move(digest);
  return result;
}

namespace {

bool is_skipped(std::string_view predicate) noexcept {
  for (const Iri skipped :
       {vocab::rdf_::type, vocab::rdfs::seeAlso, vocab::rdfs::isDefinedBy, vocab::hybrit::subscriptions, vocab::hybrit::onResource,
        vocab::lrt_::state, vocab::lrt_::all, vocab::lrt_::invocation, vocab::lrt_::invocationOf, vocab::http_core::requestURI, vocab::vom::unit,
        vocab::qudt::hasUnit, vocab::lrt_::session, vocab::lrt_::query, vocab::lrt_::allGraphs, vocab::lrt_::structure, vocab::lrt_::identity})
    if (predicate == skipped.text) return true;
  return false;
}

}  // namespace

std::vector<std::string> mirrored_links(const rdf::Graph& graph, const std::string& self, const std::vector<client::Link>& links) {
  std::set<std::string_view> found, skipped;
  for (const Triple& t : graph.triples()) {
    const TermView object = graph.term(t.object);
    if (!object.is_iri()) continue;
    const std::string_view url = client::document_of(object.text), predicate = graph.term(t.predicate).text;
    // A resource may be linked by seeAlso and by another predicate. If one link marks it as an aggregate, all links are skipped.
    const bool is_neutral = predicate == vocab::rdfs::seeAlso.text || predicate == vocab::http_core::requestURI.text;
    if (!is_skipped(predicate)) found.insert(url);
    else if (!is_neutral) skipped.insert(url);
  }
  for (const client::Link& link : links)
    if (link.relation == "related" || link.relation == "item" || link.relation == "next") found.insert(client::document_of(link.target));
  std::vector<std::string> result;
  for (const std::string_view url : found)
    if (!url.empty() && url != self && skipped.count(url) == 0 && client::same_origin(url, self)) result.emplace_back(url);
  return result;
}

bool is_worth_watching(const client::Representation& representation) {
  const std::vector<std::string> types = representation.types();
  return representation.focus && std::find(types.begin(), types.end(), vocab::sh::NodeShape.text) == types.end();
}

bool is_away(const Error& error) noexcept {
  switch (error.code) {
    case Errc::io_error:
    case Errc::timed_out:
    case Errc::unconfirmed:  // what a store is to have is sent again until it has it
    case Errc::closed:
    case Errc::expected_http:
    case Errc::failed:          // 5xx: also of a proxy before the robot
    case Errc::limit_exceeded:  // 429, 503
    case Errc::cancelled: return true;
    default: return false;
  }
}

namespace {

/// Why a graph is not what is at its URL; empty: it is. The IRIs of a robot with a public base are those of that base, wherever it is asked.
std::string why_elsewhere(const client::Representation& representation) {
  std::string_view other;
  for (const Triple& t : representation.graph.triples()) {
    const TermView subject = representation.graph.term(t.subject);
    if (!subject.is_iri()) continue;
    if (client::same_origin(subject.text, representation.url)) return {};
    if (other.empty()) other = subject.text;
  }
  if (representation.focus && representation.graph.term(*representation.focus).is_iri())
    other = representation.graph.term(*representation.focus).text;
  const std::string begin = "\"" + representation.url + "\" ";
  if (other.empty()) return begin + "describes nothing in RDF";
  const Result<http::Url> url = http::parse_url(representation.url);
  const std::string name(client::document_of(other)), path = url ? url->target : "/";
  const bool is_same_path = name.size() > path.size() && name.compare(name.size() - path.size(), path.size(), path) == 0;
  return begin + (is_same_path ? "is a robot whose public base is another one: use \"" : "describes something else, \"") + name + "\"";
}

}  // namespace

Result<bool> read_robot(client::Session& session, const std::string& url, const RobotReading& reading) {
  const std::size_t max_resources = session.options().limits.max_resources;
  std::deque<std::string> wanted{std::string(client::document_of(url))};
  std::set<std::string> seen{wanted.front()};
  bool is_first = true, is_complete = true, has_known = false;
  unsigned silent = 0;  // resources in succession without a response
  std::string origin = url;
  const auto follow = [&](std::string link) {
    if (seen.insert(link).second) wanted.push_back(std::move(link));
    return seen.size() <= max_resources;
  };
  const auto too_many = [&] {
    return unexpected(Errc::limit_exceeded, "\"" + url + "\" leads to more than " + std::to_string(max_resources) + " resources");
  };
  while (!wanted.empty()) {
    const std::string next = std::move(wanted.front());
    wanted.pop_front();
    const Result<client::RepresentationPtr> read = session.get(next, reading.known_tag ? reading.known_tag(next) : std::string());
    if (!read) {
      constexpr unsigned max_silent = 3;
      const Errc code = read.error().code;
      const bool is_silent = code == Errc::io_error || code == Errc::timed_out || code == Errc::closed || code == Errc::expected_http;
      silent = is_silent ? silent + 1 : 0;
      if (is_first || code == Errc::cancelled || silent >= max_silent) return unexpected(read.error());
      if (is_away(read.error())) is_complete = false;
      reading.on_problem(next, read.error());
      continue;
    }
    silent = 0;
    if (!*read) {
      is_first = false;
      reading.on_unchanged(next);
      if (std::exchange(has_known, true)) continue;
      for (const std::string& known : reading.known())
        if (client::same_origin(known, origin) && !follow(known)) return too_many();
      continue;
    }
    const client::Representation& representation = **read;
    if (std::exchange(is_first, false)) {
      origin = representation.url;  // after redirects
      if (const std::string why = why_elsewhere(representation); !why.empty()) return unexpected(Errc::invalid_option, why);
    }
    if (!client::same_origin(representation.url, origin)) continue;
    if (representation.url != next && !seen.insert(representation.url).second) continue;
    reading.on_resource(*read);
    for (std::string& link : mirrored_links(representation.graph, representation.url, representation.links))
      if (!follow(std::move(link))) return too_many();
  }
  return is_complete;
}

}  // namespace lrt::mirror
