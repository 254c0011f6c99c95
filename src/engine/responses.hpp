// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <exception>
#include <string>
#include <string_view>

#include <lrt/base/error.hpp>
#include <lrt/engine/engine.hpp>
#include <lrt/http/message.hpp>
#include <lrt/http/problem.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/shacl/report.hpp>

#include "src/engine/bases.hpp"
#include "src/engine/body_errors.hpp"
#include "src/engine/context.hpp"

namespace lrt::engine {

/// Builds the responses that are no representation of the requested resource, and the header fields that all responses share.
class Responses {
 public:
  /// @param terms             path of the list of terms
  /// @param context_document  path and query of the JSON-LD context
  Responses(const EngineOptions& options, const Bases& bases, std::string terms, std::string context_document)
      : options_(options), bases_(bases), terms_(std::move(terms)), context_document_(std::move(context_document)) {}

  /// An error with its details (SPEC 3.4): RFC 9457 problem details as JSON, or as Turtle or HTML where the client prefers that. Never 406.
  /// @param errors  the extension member `errors` of problem details in JSON: json_of()
  http::Response problem(const Context& context, int status, std::string detail, std::string errors = {}) const {
    return problem(context, {status, std::move(detail), std::move(errors)});
  }
  http::Response problem(const Context& context, http::Problem problem) const;
  http::Response denied(const Context& context, http::Denial why, int status, std::string detail) const {
    http::Response response = problem(context, status, std::move(detail));
    response.denial = why;
    return response;
  }
  /// An Error of user code: 422 if the type does not fit, 409 if the robot refuses, 500 for other failures.
  http::Response refused(const Context& context, const std::string& what, const Error& error) const;
  /// There is no resource at the target of the request.
  http::Response no_resource(const Context& context) const;
  /// The resource was removed while the request waited.
  http::Response gone(const Context& context) const;
  /// The host did not run the call in time, and will not run it later.
  http::Response timed_out(const Context& context) const;
  /// Too many requests wait for the host.
  http::Response overloaded(const Context& context) const;
  http::Response stopping(const Context& context) const;
  /// 422 with the validation report (SPEC 3.4): as RDF, or as problem details for clients that prefer JSON or whose body has no RDF.
  /// @param errors  the results of the report, for problem details
  http::Response violation(const Context& context, const shacl::Report& report, const std::vector<BodyError>& errors) const;
  /// 204, or another status without a body.
  http::Response no_content(const Context& context, int status = 204) const;
  /// A graph; or, where that is given and preferred, the plain value that it describes.
  http::Response graph(const Context& context, int status, const rdf::Graph& graph, const PlainValue* value = nullptr) const;
  void add_retry_after(http::Response& response) const;

  /// Allow, and Accept-Post where POST is allowed.
  void add_allow(http::Fields& fields, const Resource& resource, const Audience& audience) const;
  /// Link rel="type" of every response (LDP 4.2.1.4, 5.2.1.4). nullptr: of a path without a resource.
  void add_types(http::Fields& fields, const Resource* resource) const;

  Result<std::string> write(const rdf::Graph& graph, Variant variant, std::size_t base) const;
  /// By which representations refer to the JSON-LD context. The query is its version.
  std::string context_iri(std::size_t base) const { return bases_[base] + context_document_; }
  std::string iri(const Context& context, std::string_view path) const { return bases_[context.base] + std::string(path); }
  void log(LogLevel level, const std::string& message) const;
  /// "what: why". For handlers of exceptions, which must not throw when memory is exhausted: the message is made here, or lost.
  void log(LogLevel level, const char* what, const std::exception& why) const noexcept;

 private:
  void add_constrained_by(http::Fields& fields, const Context& context) const;

  const EngineOptions& options_;
  const Bases& bases_;
  const std::string terms_, context_document_;
};

}  // namespace lrt::engine
