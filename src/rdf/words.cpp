// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/words.hpp"

#include <algorithm>
#include <deque>
#include <mutex>
#include <utility>

#include <lrt/base/immortal.hpp>
#include <lrt/rdf/lexical.hpp>

#include "src/base/utf8.hpp"

namespace lrt::rdf {
inline namespace v0 {

namespace {

/// Of ASCII: a tag has no other characters.
std::string lower_case(std::string tag) {
  for (char& c : tag)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return tag;
}

bool is_english(std::string_view language) noexcept { return language == "en" || language.substr(0, 3) == "en-"; }

}  // namespace

Texts& Texts::add(std::string text, std::string language) {
  all_.push_back({std::move(text), lower_case(std::move(language))});
  return *this;
}

const Text* Texts::choose(const std::vector<std::string>& wanted) const {
  if (all_.empty()) return nullptr;
  std::vector<std::string_view> offered;
  for (const Text& t : all_) offered.push_back(t.language);
  return &all_[choose_language(offered, wanted)];
}

std::size_t choose_language(const std::vector<std::string_view>& offered, const std::vector<std::string>& wanted) {
  const auto index = [&](auto is_it) { return static_cast<std::size_t>(std::find_if(offered.begin(), offered.end(), is_it) - offered.begin()); };
  if (offered.size() == 1) return 0;
  for (const std::string& range : wanted)
    for (const std::string& form : shorter_forms(range))
      if (const std::size_t i = index([&](std::string_view l) { return l == form; }); i < offered.size()) return i;
  if (const std::size_t i = index([](std::string_view l) { return l.empty(); }); i < offered.size()) return i;
  const std::size_t english = index(is_english);
  return english < offered.size() ? english : 0;
}

namespace detail {

const Words& kept_words(Words words) {
  struct Kept {
    std::mutex mutex;  // guards `all`
    std::deque<Words> all;
  };
  static Immortal<Kept> kept;
  const std::lock_guard lock(kept->mutex);
  return kept->all.emplace_back(std::move(words));
}

}  // namespace detail
}  // namespace v0

std::vector<std::string> shorter_forms(std::string_view range) {
  std::vector<std::string> forms;
  std::string form = lower_case(std::string(range));
  while (!form.empty() && form != "*") {
    forms.push_back(form);
    const std::size_t end = form.rfind('-');
    if (end == std::string::npos) break;
    form.resize(end);
    // A subtag of one character introduces those behind it.
    if (form.size() > 2 && form[form.size() - 2] == '-') form.resize(form.size() - 2);
  }
  return forms;
}

Error twice(const std::string& name, std::string_view what, std::string_view language) {
  return {Errc::invalid_option, name + ": it has two texts as " + std::string(what) +
                                    (language.empty() ? " without a language" : " in the language \"" + std::string(language) + "\"") +
                                    "; give one for each language"};
}

Result<void> check_texts(const Texts& texts, const std::string& name, std::string_view what) {
  for (const Text& t : texts) {
    if (utf8::find_invalid(t.text) || t.text.find('\0') != std::string::npos)
      return unexpected(Errc::expected_rdf, name + ": expected UTF-8 without NUL as " + std::string(what));
    if (!t.language.empty() && !lexical::is_well_formed(t.language, lexical::Datatype::language))
      return unexpected(Errc::expected_rdf,
                        name + ": expected a language tag of its " + std::string(what) + ", for example \"en\", found \"" + t.language + "\"");
    for (const Text& other : texts)
      if (&other != &t && other.language == t.language) return Unexpected{twice(name, what, t.language)};
  }
  return {};
}

Result<void> check_words(const Words& words, const std::string& name) {
  if (Result<void> r = check_texts(words.titles, name, "title"); !r) return r;
  return check_texts(words.descriptions, name, "description");
}

}  // namespace lrt::rdf
