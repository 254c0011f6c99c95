// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <lrt/base/abi.hpp>
#include <lrt/rdf/term.hpp>

namespace lrt::rdf {

/// What a message shows of a term: with a prefix if possible, numbers and booleans as in Turtle, long text cut.
LRT_INTERNAL_API std::string shown(const TermView& term);

/// Turtle writes the literal without quotation marks and datatype.
bool is_bare(const TermView& term) noexcept;

}  // namespace lrt::rdf
