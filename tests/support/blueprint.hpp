// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

#include <lrt/rdf/vocab.hpp>
#include <lrt/shacl/validator.hpp>

#include "tests/support/message.hpp"

namespace lrt::test {

/// The Blueprints of a Thing as one graph that judges this Thing alone, as a client does that knows which Thing it has read: the shape of its
/// kind gets the Thing as target, and no class.
/// @param get   gives the Answer to GET of a path
/// @param path  of the Thing, "/arm"
template <class Get>
rdf::Graph blueprint_of(Get get, const std::string& path, const std::string& base = "http://localhost") {
  const std::string self = base + path;
  const rdf::Graph thing = get(path).graph();
  rdf::Graph all;
  int document = 0;
  for (const rdf::TermView& iri : thing.objects(rdf::iri(self), rdf::TermView(vocab::hybrit::blueprint))) {
    if (iri.text.substr(0, base.size()) != base) continue;  // elsewhere
    const rdf::Graph one = get(std::string(iri.text.substr(base.size()))).graph();
    const std::string prefix = "d" + std::to_string(document++) + "-";  // two documents may have equal labels of blank nodes
    for (const rdf::Triple& t : one.triples()) {
      const auto is = [&](Iri term) { return one.term(t.predicate) == rdf::TermView(term); };
      if (is(vocab::sh::targetClass) || (is(vocab::sh::targetNode) && one.term(t.subject) == iri)) continue;
      const auto node = [&](rdf::TermId id) {
        const rdf::TermView term = one.term(id);
        return all.intern(term.is_blank() ? rdf::blank(prefix + std::string(term.text)) : term);
      };
      const rdf::TermId s = node(t.subject), p = node(t.predicate), o = node(t.object);
      all.add(s, p, o);
    }
    all.add(iri, rdf::TermView(vocab::sh::targetNode), rdf::iri(self));
  }
  return all;
}

/// What the state of a Thing violates of its Blueprints; empty: it conforms.
/// @param state  judged instead of its state
template <class Get>
std::string violations(Get get, const std::string& path, const std::string& base = "http://localhost", const std::string& state = "/state") {
  const Result<shacl::Shapes> shapes = shacl::Shapes::compile(blueprint_of(get, path, base));
  if (!shapes) return shapes.error().message;
  const Result<shacl::Report> report = shacl::validate(*shapes, get(path + state).graph());
  return report ? report->to_text() : report.error().message;
}

}  // namespace lrt::test
