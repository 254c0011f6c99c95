// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>

namespace lrt::rdf {
inline namespace v0 {

/// A text for people, and its language.
struct Text {
  std::string text;        ///< UTF-8
  std::string language{};  ///< language tag (BCP 47): "de", "pt-br"; empty: none is stated
};

/// One text in several languages, each language once:
///
///     options.title = {{"Kitchen robot", "en"}, {"Küchenroboter", "de"}};
///     options.title = {"Kitchen robot", "en"};
///     options.title = "Kitchen robot";   // without a language
///
/// @par Errors   A language tag that is not well-formed, or a language given twice: expected_rdf, invalid_option, from
///               where the texts are registered, for example Server::add()
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
class LRT_API Texts {
 public:
  /// No text.
  Texts() = default;
  /// @{
  /// One text. Implicit, because an option takes a plain text, too.
  Texts(const char* text) : Texts(std::string(text)) {}                                              // NOLINT
  Texts(std::string text, std::string language = {}) { add(std::move(text), std::move(language)); }  // NOLINT
  /// @}
  /// Several.
  Texts(std::initializer_list<Text> texts) {
    for (const Text& t : texts) add(t.text, t.language);
  }

  /// Adds the text in a further language. The tag is stored in lower case.
  Texts& add(std::string text, std::string language = {});

  bool empty() const noexcept { return all_.empty(); }       ///< there is none
  std::size_t size() const noexcept { return all_.size(); }  ///< number of languages
  auto begin() const noexcept { return all_.begin(); }       ///< the first
  auto end() const noexcept { return all_.end(); }           ///< behind the last
  /// The text for a reader of these languages, as choose_language(); nullptr: there is none.
  const Text* choose(const std::vector<std::string>& wanted) const;

 private:
  std::vector<Text> all_;
};

/// What people call something, and what they say about it.
struct Words {
  Texts titles;        ///< dcterms:title, sh:name
  Texts descriptions;  ///< dcterms:description, sh:description

  bool empty() const noexcept { return titles.empty() && descriptions.empty(); }  ///< there is nothing
};

/// Which of several texts a reader gets (RFC 4647 3.4, "lookup"): for each wanted language in order the text in it, or in
/// the language that is left without its last subtags ("de-CH", then "de"). If there is none: the text without a
/// language, else the English one, else the first.
///
/// @param offered  languages of the texts, in lower case; empty: none
/// @param wanted   language ranges, the best first: "de-CH", "en". "*" and "" are no language.
/// @return         index into `offered`, which is not empty
/// @par Threads  Any.
LRT_API std::size_t choose_language(const std::vector<std::string_view>& offered, const std::vector<std::string>& wanted);

namespace detail {

/// Words that the process keeps. They are never destroyed.
/// @par Threads  Any. Locks and allocates.
LRT_API const Words& kept_words(Words words);

}  // namespace detail

}  // namespace v0
}  // namespace lrt::rdf

namespace lrt {
inline namespace v0 {
using rdf::Texts;
}  // namespace v0
}  // namespace lrt
