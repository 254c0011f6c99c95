// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/http/message.hpp>

namespace lrt::rdf {
inline namespace v0 {
class Graph;
}  // namespace v0
}  // namespace lrt::rdf

namespace lrt::engine {
inline namespace v0 {

/// A list of terms, for its page.
struct TermList {
  std::string_view iri;                                              ///< of its document
  const rdf::Graph& graph;                                           ///< a subject of class owl:Ontology, and terms with rdfs:label
  const std::vector<std::pair<std::string, std::string>>& prefixes;  ///< rdf::Prefixes
  const std::vector<std::string_view>& types;                        ///< its media types in RDF
};

/// HTML for people: a further representation of every resource. The bytes are the same for all resources but lists of
/// terms, because the page's script reads its own address and requests the data as any client does.
///
/// @par Threads  Constant functions: any, concurrently.
class LRT_API PageSource {
 public:
  virtual ~PageSource() = default;
  /// The page in UTF-8.
  virtual const std::shared_ptr<const std::string>& html() const = 0;
  /// Its entity tag.
  virtual const std::string& tag() const = 0;
  /// An error page.
  /// @param home  IRI of the list of Things
  virtual std::string error(int status, std::string_view detail, std::string_view home) const = 0;
  /// Makes the login page the body of a 401, with its fields. Its script sends the token by POST, as `Authorization:
  /// Bearer TOKEN`.
  /// @param response  the response
  /// @param session   IRI of the session
  /// @return          false: there is no such page, and error() is shown
  virtual bool add_login(http::Response& response, std::string_view session) const {
    (void)response, (void)session;
    return false;
  }
  /// Adds Content-Type and the security policy of pages.
  virtual void add_fields(http::Fields& fields) const = 0;
  /// The page of a list of terms, which can be read without its script: an element with an `id` for each term.
  /// @return  empty: there is no such page, and html() is shown
  virtual std::string terms(const TermList& list) const {
    (void)list;
    return {};
  }
};

}  // namespace v0
}  // namespace lrt::engine
