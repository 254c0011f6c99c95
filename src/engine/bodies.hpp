// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <variant>
#include <vector>

#include <lrt/engine/engine.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/world.hpp>

#include "src/engine/body_task.hpp"
#include "src/engine/context.hpp"
#include "src/engine/description.hpp"
#include "src/engine/graph_task.hpp"
#include "src/engine/host_calls.hpp"
#include "src/engine/pending_requests.hpp"
#include "src/engine/responses.hpp"
#include "src/rdf/plain.hpp"

namespace lrt::engine {

/// Validates request bodies (BodyTask): small ones at once, larger ones in a BodyJob. Then the request is handled again.
class Bodies {
 public:
  /// Deferred: the body is validated on another thread, and Continue will be called.
  using Read = std::variant<Body, http::Response, Deferred>;
  /// Handles a request again after its body was validated: `Context::judged`.
  using Continue = std::function<void(Ticket, Context&)>;
  /// How a body is written, by its header fields.
  struct Format {
    std::optional<rdf::Syntax> syntax;  ///< of RDF
    std::optional<rdf::Plain> plain;    ///< of a value without RDF; neither: there is no body
    std::string charset;                ///< that Content-Type names
  };

  /// @param context_document  path of the JSON-LD context, which bodies may refer to
  Bodies(const EngineOptions& options, const EngineView& view, const Responses& responses, HostCalls& calls, PendingRequests& pending,
         std::string context_document);

  void set_continue(Continue function) { continue_ = std::move(function); }

  /// Checks the header fields of a body: Content-Encoding, Content-Range and Content-Type. Does not need the body.
  /// @param type  of the value that the body may be without RDF; nullptr: none
  std::variant<Format, http::Response> format_of(const Context& context, const rdf::Type* type, bool is_empty) const;
  /// The value in a body; the response if there is none.
  /// @param owner  of type and facets
  Read read_value(Context& context, const rdf::Type& type, const rdf::Facets& facets, std::shared_ptr<const void> owner);
  /// The patch in a body, which is judged when it is applied to a value: Body::patch. The response if it cannot be read.
  /// @pre PropertySpec::patches
  Read read_patch(Context& context, const model::PropertySpec& property, std::shared_ptr<const void> owner);
  /// The node in a body that the rule finds and the input shape of the requested resource accepts.
  Read read_graph(Context& context, const FocusRule& focus);
  /// What a request that changes a graph of a World has to do; the response if its body cannot be read.
  std::variant<GraphTask, http::Response> graph_task(const Context& context, std::shared_ptr<model::GraphState> state) const;
  /// The graphs in a body that may change several graphs of a World: Body::dataset. A body with a default graph only is one new graph,
  /// Body::graph, with its triples below `one_path`.
  /// @param one_path  empty: the body must name its graphs
  /// @pre may_have_graphs() of its syntax
  Read read_graphs(Context& context, const GraphOptions& limits, std::string one_path);
  /// Makes and judges the graphs of DatasetChange::parts, at once or in a BodyJob.
  Read prepare_graphs(Context& context, const std::shared_ptr<DatasetChange>& change);
  /// Whether the body of a request is in a syntax with named graphs; the response if it is in none that is read.
  std::variant<bool, http::Response> has_graphs(const Context& context) const;
  /// The response to a patch of a value or a change of graphs that was refused when it was carried out.
  http::Response refused(const Context& context, BodyFault fault) const;
  http::Response graphs_are_busy(const Context& context) const;
  /// Executes the change, at once or in a BodyJob.
  Read change_graph(Context& context, GraphTask task);
  /// The result of the change, when the request is handled again.
  /// @pre Context::judged
  Read changed_graph(Context& context);
  /// A body of a resource that takes none: it may have any content that can be read, and is ignored.
  Read read_nothing(Context& context);

  std::vector<BodyJob> take_jobs() { return std::exchange(jobs_, {}); }

 private:
  std::variant<BodyTask, http::Response> task_for(const Context& context, const rdf::Type* value, const rdf::Facets& facets) const;
  std::optional<http::Response> set_shapes(const Context& context, BodyTask& task) const;
  /// Validates a body, on any thread.
  using Work = UniqueFunction<JudgedBody()>;
  Read judge(Context& context, BodyTask task);
  std::shared_ptr<const void> own_text(const Context& context, std::string_view& text) const;
  Read defer(Context& context, std::size_t bytes, std::size_t effort, Work work, bool writes);
  Read verdict(Context& context);
  Read as_read(const Context& context, JudgedBody judged) const;
  Read as_change(const Context& context, JudgedBody judged) const;
  http::Response not_accepted(const Context& context, const rdf::Type* value, const std::string& detail) const;
  http::Response too_many(const Context& context) const;
  void ended(const std::string& client, std::size_t bytes) noexcept;

  const EngineOptions& options_;
  const EngineView& view_;
  const Responses& responses_;
  HostCalls& calls_;
  PendingRequests& pending_;
  const std::string context_document_;
  const std::shared_ptr<const BodyLimits> limits_;
  Continue continue_;
  std::vector<BodyJob> jobs_;
  /// The jobs of one address that have not ended.
  struct Waiting {
    std::size_t jobs = 0;  ///< a job may have no bytes: an empty body changes a graph, too
    std::size_t bytes = 0;
  };
  std::size_t waiting_bytes_ = 0;  ///< of bodies in jobs that have not ended
  std::unordered_map<std::string, Waiting> waiting_by_client_;
};

/// The outcome of a request whose body was refused or is not validated yet; nullopt: it has a Body.
std::optional<Outcome> outcome_of(Bodies::Read& read);

/// Whether a Link field (RFC 8288 3) requests an LDP interaction model other than ldp:Resource and ldp:RDFSource (LDP 5.2.3.4).
bool requests_other_model(std::string_view field);

}  // namespace lrt::engine
