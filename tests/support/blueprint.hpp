// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <type_traits>

#include <lrt/rdf/vocab.hpp>
#include <lrt/shacl/validator.hpp>

#include "tests/support/message.hpp"

namespace lrt::test {

/// The path of the Blueprint of a Thing's kind, "/blueprints/RevoluteJoint-1a2b3c4d", which the Thing names as its class.
/// @param get      gives the Answer to GET of a path, or has a function get() that does
/// @param ordinal  0: of the kind, 1: of its bounds
template <class Get>
std::string shared_blueprint(Get&& get, const std::string& path, const std::string& base, int ordinal) {
  const rdf::Graph thing = [&] {
    if constexpr (std::is_invocable_v<Get, const std::string&>) return get(path).graph();
    else return get.get(path).graph();
  }();
  for (const rdf::TermView& type : thing.objects(rdf::iri(base + path), rdf::TermView(vocab::rdf_::type)))
    if (type.text.substr(0, base.size() + 12) == base + "/blueprints/" && ordinal-- == 0) return std::string(type.text.substr(base.size()));
  return {};
}

template <class Get>
std::string kind_of(Get&& get, const std::string& path, const std::string& base = "http://localhost") {
  return shared_blueprint(get, path, base, 0);
}
/// The path of the Blueprint of its bounds, "/blueprints/RevoluteJoint-1a2b3c4d-5e6f7a8b".
template <class Get>
std::string bounds_of(Get&& get, const std::string& path, const std::string& base = "http://localhost") {
  return shared_blueprint(get, path, base, 1);
}

/// The text with the name of a kind, "blueprints/RevoluteJoint-1a2b3c4d", for each "KIND".
inline std::string with_kind(std::string text, std::string kind) {
  if (kind.front() == '/') kind.erase(0, 1);
  for (std::size_t at = text.find("KIND"); at != std::string::npos; at = text.find("KIND", at + kind.size())) text.replace(at, 4, kind);
  return text;
}

/// The Blueprints of a Thing as one graph. They judge by their own targets.
/// @param get   gives the Answer to GET of a path
/// @param path  of the Thing, "/arm"
template <class Get>
rdf::Graph blueprint_of(Get get, const std::string& path, const std::string& base = "http://localhost") {
  const rdf::Graph thing = get(path).graph();
  rdf::Graph all;
  int document = 0;
  for (const rdf::TermView& iri : thing.objects(rdf::iri(base + path), rdf::TermView(vocab::hybrit::blueprint))) {
    if (iri.text.substr(0, base.size()) != base) continue;  // elsewhere
    const rdf::Graph one = get(std::string(iri.text.substr(base.size()))).graph();
    const std::string prefix = "d" + std::to_string(document++) + "-";  // two documents may have equal labels of blank nodes
    const auto node = [&](rdf::TermId id) {
      const rdf::TermView term = one.term(id);
      return all.intern(term.is_blank() ? rdf::blank(prefix + std::string(term.text)) : term);
    };
    for (const rdf::Triple& t : one.triples()) {
      const rdf::TermId s = node(t.subject), p = node(t.predicate), o = node(t.object);
      all.add(s, p, o);
    }
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
