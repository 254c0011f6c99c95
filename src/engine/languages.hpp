// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <lrt/http/message.hpp>
#include <lrt/rdf/words.hpp>

namespace lrt::engine {

/// The languages that the sender of a request wants (Accept-Language). The field is parsed when it is first needed.
class Languages {
 public:
  explicit Languages(const http::Request& request) noexcept : request_(request) {}

  /// Language ranges, the best first.
  const std::vector<std::string>& wanted() const;
  /// Those of `offered` that it wants, in its order, as one text. Requests with equal texts get the same of any texts in these languages.
  std::string wanted_of(const std::vector<std::string>& offered) const;

 private:
  const http::Request& request_;
  mutable bool parsed_ = false;
  mutable std::vector<std::string> wanted_;
};

/// Chooses the texts of one representation, and records what was chosen from.
class ChosenTexts {
 public:
  /// @param languages  nullptr: none is wanted
  explicit ChosenTexts(const Languages* languages) noexcept : languages_(languages) {}

  /// The text that the representation shows; nullptr: there is none.
  const rdf::Text* choose(const rdf::Texts& texts);
  /// Records what was chosen for a part of the representation that was written before.
  void take(const ChosenTexts& part);
  /// Languages that are wanted, the best first.
  const std::vector<std::string>& wanted() const;

  /// Languages of the texts of which one was chosen, each once; empty: the representation is the same in all languages.
  const std::vector<std::string>& offered() const noexcept { return offered_; }
  /// The language of the texts that have one; empty: there are none, or they are in several languages.
  std::string_view language() const noexcept { return is_mixed_ ? std::string_view() : language_; }

 private:
  void offer(const std::string& language);
  void use(const std::string& language);

  const Languages* languages_;
  std::vector<std::string> offered_;
  std::string language_;
  bool is_mixed_ = false;
};

}  // namespace lrt::engine
