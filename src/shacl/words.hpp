#pragma once

#include <string>

#include <lrt/rdf/term.hpp>

namespace lrt::shacl {

/// A term for a message: prefixes where they fit, long text cut at a character.
std::string shown(const rdf::TermView& term);

/// "1 value", "2 values".
std::string counted(std::size_t n, const char* one, const char* many);

}  // namespace lrt::shacl
