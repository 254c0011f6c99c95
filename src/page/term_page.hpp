// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <lrt/engine/page_source.hpp>

namespace lrt::page {

/// The part of a page that is a list of terms.
struct TermPage {
  std::string title;    ///< text
  std::string content;  ///< HTML
};

/// Writes the terms of an ontology with what is stated of them. Each has an anchor: its name below the ontology's IRI, as in `#state` or
/// `#Pose/x`; a term of another vocabulary its prefixed name, as in `#hybrit:Action`.
TermPage term_page(const engine::TermList& list);

}  // namespace lrt::page
