#pragma once

#include <chrono>
#include <string>

#include <lrt/base/clock.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/vocab.hpp>

namespace lrt::engine {

/// Adds triples about one subject, in the order in which they are to be read.
class About {
 public:
  About(rdf::Graph& graph, rdf::TermId subject) : graph_(graph), subject_(subject) {}
  About(rdf::Graph& graph, const std::string& iri) : About(graph, graph.intern(rdf::iri(iri))) {}

  About& a(Iri type) { return add(vocab::rdf::type, rdf::TermView(type)); }
  About& add(Iri predicate, const rdf::TermView& object) {
    graph_.add(subject_, graph_.intern(predicate), graph_.intern(object));
    return *this;
  }
  About& add(Iri predicate, rdf::TermId object) {
    graph_.add(subject_, graph_.intern(predicate), object);
    return *this;
  }
  About& link(Iri predicate, const std::string& iri) { return add(predicate, rdf::iri(iri)); }
  About& when(Iri predicate, std::chrono::system_clock::time_point time) {
    return time == decltype(time){} ? *this : add(predicate, rdf::literal(to_xsd_date_time(time), vocab::xsd::dateTime));
  }
  rdf::TermId subject() const noexcept { return subject_; }
  rdf::Graph& graph() const noexcept { return graph_; }

 private:
  rdf::Graph& graph_;
  rdf::TermId subject_;
};

}  // namespace lrt::engine
