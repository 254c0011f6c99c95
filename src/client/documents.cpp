// SPDX-License-Identifier: Apache-2.0
#include <deque>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include <lrt/base/iri.hpp>
#include <lrt/client.hpp>
#include <lrt/client/description.hpp>
#include <lrt/rdf/vocab.hpp>

namespace lrt::client {
inline namespace v0 {
namespace {

std::string without_fragment(std::string_view url) { return std::string(url.substr(0, url.find('#'))); }

std::string origin_of(std::string_view url) {
  const iri::Parts parts = iri::split(url);
  return std::string(parts.scheme) + "://" + std::string(parts.authority);
}

/// Reads each document once.
class Documents {
 public:
  Documents(lrt::Client& client, std::vector<std::string>& problems, const DescribeOptions& options)
      : client_(client), problems_(problems), options_(options) {}

  Result<rdf::Graph> run(const Robot& robot) {
    for (const Thing& thing : robot.things()) origins_.insert(origin_of(thing.url()));
    for (const Thing& thing : robot.things()) {
      if (known_.insert(without_fragment(thing.url())).second) merge_document(graph_, thing.representation()->graph);
      for (const std::string& blueprint : thing.blueprints()) want(blueprint);
      for (const Property& property : thing.properties()) want(property.url());
      for (const Action& action : thing.actions()) want(action.url());
    }
    // The documents that were read may refer to further shapes.
    for (std::size_t seen = 0; !wanted_.empty();) {
      if (Result<void> done = read_wanted(); !done) return Unexpected{std::move(done).error()};
      want_shapes(seen);
      seen = graph_.size();
    }
    return std::move(graph_);
  }

 private:
  void want(std::string_view iri) {
    std::string url = without_fragment(iri);
    if (origins_.count(origin_of(url)) > 0 && known_.insert(url).second) wanted_.push_back(std::move(url));
  }
  Result<void> read_wanted() {
    for (; !wanted_.empty(); wanted_.pop_front()) {
      if (known_.size() > options_.max_documents)
        return unexpected(Errc::limit_exceeded, "more than " + std::to_string(options_.max_documents) + " documents describe the robot");
      const Result<RepresentationPtr> found = client_.get(wanted_.front());
      if (found) merge_document(graph_, (*found)->graph);
      else if (problems_.size() < options_.max_warnings) problems_.push_back("cannot read <" + wanted_.front() + ">: " + found.error().message);
      if (graph_.size() > options_.max_triples)
        return unexpected(Errc::limit_exceeded, "more than " + std::to_string(options_.max_triples) + " triples describe the robot");
    }
    return {};
  }
  void want_shapes(std::size_t first_triple) {
    for (std::size_t i = first_triple; i < graph_.size(); ++i) {
      const rdf::Triple& t = graph_.triples()[i];
      const std::string_view predicate = graph_.term(t.predicate).text;
      const bool refers = predicate == vocab::sh::node.text || predicate == vocab::sh::property.text || predicate == vocab::hybrit::consumes.text ||
                          predicate == vocab::hybrit::produces.text || predicate == vocab::dcterms::conformsTo.text;
      if (refers && graph_.term(t.object).is_iri()) want(graph_.term(t.object).text);
    }
  }

  lrt::Client& client_;
  std::vector<std::string>& problems_;
  const DescribeOptions& options_;
  rdf::Graph graph_;
  std::set<std::string> origins_, known_;
  std::deque<std::string> wanted_;
};

}  // namespace

Result<rdf::Graph> read_documents(lrt::Client& client, const Robot& robot, std::vector<std::string>& problems, const DescribeOptions& options) {
  return Documents(client, problems, options).run(robot);
}

Result<Description> describe(lrt::Client& client, const Robot& robot, const DescribeOptions& options) {
  std::vector<std::string> problems;
  const Result<rdf::Graph> graph = read_documents(client, robot, problems, options);
  if (!graph) return Unexpected{graph.error()};
  Result<Description> described = describe(*graph, options);
  if (described) described->warnings.insert(described->warnings.begin(), problems.begin(), problems.end());
  return described;
}

}  // namespace v0
}  // namespace lrt::client
