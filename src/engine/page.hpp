#pragma once

#include <memory>
#include <string>
#include <string_view>

#include <lrt/http/message.hpp>

namespace lrt::engine {

/// The page for people: src/engine/page/, put into the library by CMake. The same bytes for every resource, for its script looks at
/// where it is and reads the rest as N-Triples.
const std::shared_ptr<const std::string>& page_html();
const std::string& page_tag();  ///< its ETag

/// An error for a browser.
/// @param home  IRI of the list of Things
std::string error_page(int status, std::string_view detail, std::string_view home);

/// What a browser must know of both: Content-Type, and that nothing but what is in them is to be run or fetched from elsewhere.
void add_page_fields(http::Fields& fields);

}  // namespace lrt::engine
