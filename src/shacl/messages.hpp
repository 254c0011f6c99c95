#pragma once

#include <cstdint>
#include <string>

#include <lrt/rdf/term.hpp>

namespace lrt::shacl {

struct Plan;

/// A term for a message: with a prefix if possible, long text shortened.
std::string shown(const rdf::TermView& term);

/// A shape for a message: its IRI, its name or a description.
std::string shown_shape(const Plan& plan, std::uint32_t shape);

/// "1 value", "2 values".
std::string counted(std::size_t n, const char* one, const char* many);

}  // namespace lrt::shacl
