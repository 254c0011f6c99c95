// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/rdf/words.hpp>

namespace lrt::rdf {

/// Each text is UTF-8, each tag well-formed, each language given once.
/// @param name  what has the words, for messages: "server"
/// @param what  "title" or "description"
/// @par Errors  expected_rdf, invalid_option
Result<void> check_texts(const Texts& texts, const std::string& name, std::string_view what);
Result<void> check_words(const Words& words, const std::string& name);

/// Two texts have the same language.
Error twice(const std::string& name, std::string_view what, std::string_view language);

/// A language range and its shorter forms, in lower case (RFC 4647 3.4): "de-ch", "de". Nothing for "*" and "".
std::vector<std::string> shorter_forms(std::string_view range);

}  // namespace lrt::rdf
