// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace lrt::page {

/// A text as content of HTML, or as the value of an attribute in quotation marks.
std::string html_text(std::string_view text);

}  // namespace lrt::page
