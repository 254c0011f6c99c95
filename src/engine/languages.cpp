// SPDX-License-Identifier: Apache-2.0
#include "src/engine/languages.hpp"

#include <algorithm>

#include <lrt/base/immortal.hpp>

#include "src/http/negotiate.hpp"
#include "src/rdf/words.hpp"

namespace lrt::engine {

const std::vector<std::string>& Languages::wanted() const {
  if (!parsed_ && request_.find("Accept-Language")) wanted_ = http::accepted_languages(request_.joined("Accept-Language"));
  parsed_ = true;
  return wanted_;
}

std::string Languages::wanted_of(const std::vector<std::string>& offered) const {
  std::vector<std::string> found;
  for (const std::string& range : wanted())
    for (std::string& form : rdf::shorter_forms(range))
      if (std::find(offered.begin(), offered.end(), form) != offered.end() && std::find(found.begin(), found.end(), form) == found.end())
        found.push_back(std::move(form));
  std::string text;
  for (const std::string& language : found) text.append(text.empty() ? "" : ",").append(language);
  return text;
}

const rdf::Text* ChosenTexts::choose(const rdf::Texts& texts) {
  if (texts.empty()) return nullptr;
  const rdf::Text* chosen = texts.begin().operator->();
  if (texts.size() > 1) {
    for (const rdf::Text& t : texts) offer(t.language);
    chosen = texts.choose(wanted());
  }
  use(chosen->language);
  return chosen;
}

void ChosenTexts::take(const ChosenTexts& part) {
  for (const std::string& language : part.offered_) offer(language);
  use(part.language_);
  is_mixed_ = is_mixed_ || part.is_mixed_;
}

const std::vector<std::string>& ChosenTexts::wanted() const {
  static const Immortal<std::vector<std::string>> none;
  return languages_ ? languages_->wanted() : *none;
}

void ChosenTexts::offer(const std::string& language) {
  if (std::find(offered_.begin(), offered_.end(), language) == offered_.end()) offered_.push_back(language);
}

void ChosenTexts::use(const std::string& language) {
  if (language.empty()) return;
  is_mixed_ = is_mixed_ || (!language_.empty() && language_ != language);
  language_ = language;
}

}  // namespace lrt::engine
