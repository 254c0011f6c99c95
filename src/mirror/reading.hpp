// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "src/client/session.hpp"

namespace lrt::mirror {

/// The part of a representation that a mirror needs.
struct MirroredGraph {
  std::string turtle{};  ///< all triples in N-Triples, which is Turtle, sorted
  std::string digest{};  ///< its fingerprint()
};
/// @par Errors  unsupported_syntax: a term is not valid RDF; failed
Result<MirroredGraph> mirrored(const rdf::Graph& graph);

/// The URLs that a mirror follows, sorted: those of a graph and of Link fields that have the origin of `url`, but no aggregates, invocations,
/// subscriptions and classes.
std::vector<std::string> mirrored_links(const rdf::Graph& graph, const std::string& url, const std::vector<client::Link>& links);

/// Whether changes of a resource are worth a subscription: not those of shapes.
bool is_worth_watching(const client::Representation& representation);

/// How read_robot() reports what it reads.
struct RobotReading {
  std::function<void(const client::RepresentationPtr&)> on_resource;
  /// A resource that cannot be read, and why. unknown_path: it does not exist
  std::function<void(const std::string& url, const Error& error)> on_problem;
  /// The entity tag of a resource of an earlier reading that is still known; empty: it is to be read. May be empty.
  std::function<std::string(const std::string& url)> known_tag{};
  /// A resource still has its known_tag().
  std::function<void(const std::string& url)> on_unchanged{};
  /// All resources of that earlier reading. They are read too if one is unchanged, because its links are not known.
  std::function<std::vector<std::string>()> known{};
};

/// Reads all resources of a robot, breadth first, each once.
/// @return  whether each resource has responded, if with an error; false: those that were not read may exist
/// @par Errors  of the exchange with the URL, or with three resources in succession that give no response; limit_exceeded: more resources than client::Limits::max_resources; cancelled;
///              invalid_option: what is at the URL describes something elsewhere, as a robot whose public base is another one
Result<bool> read_robot(client::Session& session, const std::string& url, const RobotReading& reading);

/// Whether an error shows that the server is not reachable, rather than that it refused the request.
bool is_away(const Error& error) noexcept;

}  // namespace lrt::mirror
