// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/redland/rdf_xml_scan.hpp"

#include <algorithm>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "src/base/ascii.hpp"
#include "src/base/quote.hpp"
#include "src/base/utf8.hpp"
#include "src/rdf/limits.hpp"

namespace lrt::rdf {
namespace {

constexpr std::size_t npos = std::string_view::npos;
constexpr std::string_view spaces = " \t\r\n";

/// The quoted value after a name, white space and "="; `from` is its offset, or npos if it is missing.
std::string_view attribute_value(std::string_view text, std::size_t behind_name, std::size_t& from) {
  from = text.find_first_not_of(spaces, behind_name);
  if (from == npos || text[from] != '=') return from = npos, std::string_view();
  from = text.find_first_not_of(spaces, from + 1);
  if (from == npos || (text[from] != '"' && text[from] != '\'')) return from = npos, std::string_view();
  const std::size_t end = text.find(text[from], from + 1);
  ++from;
  return text.substr(from, end == npos ? npos : end - from);
}

/// Checks the number, depth, attributes and prefixes of tags. libxml2 checks everything else.
class TagScanner {
 public:
  TagScanner(std::string_view text, const ReadOptions& options) : text_(text), options_(options) {}

  /// Scans from the root element on.
  Result<void> scan(std::size_t at) {
    for (at_ = text_.find('<', at); at_ != npos; at_ = text_.find('<', at_)) {
      const std::string_view rest = text_.substr(at_, 9);
      if (rest.substr(0, 4) == "<!--") skip_behind("-->", 4);
      else if (rest == "<![CDATA[") skip_behind("]]>", 9);
      else if (rest.substr(0, 2) == "<?") skip_behind("?>", 2);
      else if (rest.substr(0, 2) == "<!") return misread(text_, at_, "a declaration is not accepted");
      else if (rest.substr(0, 2) == "</") end_tag();
      else if (Result<void> good = start_tag(); !good) return good;
    }
    return {};
  }

 private:
  /// Skips to the end of the text if the end is missing. libxml2 reports that error.
  void skip_behind(std::string_view end, std::size_t length) {
    const std::size_t found = text_.find(end, at_ + length);
    at_ = found == npos ? text_.size() : found + end.size();
  }
  void end_tag() {
    leave_element();
    skip_behind(">", 2);
  }
  /// What the element has declared is no longer in scope (Namespaces in XML 6.1).
  void leave_element() {
    for (; !declared_.empty() && declared_.back().first == depth_; declared_.pop_back()) --in_scope_[declared_.back().second];
    if (depth_ > 0) --depth_;
  }
  /// The prefix of a name in the present tag, which may declare it further on.
  void use(std::string_view name) {
    if (const std::size_t colon = name.find(':'); colon != npos) used_.push_back(name.substr(0, colon));
  }
  /// Namespaces in XML 5: libxml2 goes on with a name without a namespace, and Raptor 2.0 loses memory over it.
  Result<void> judge_prefixes() {
    for (const std::string_view prefix : std::exchange(used_, {}))
      if (const auto found = in_scope_.find(prefix); prefix != "xml" && (found == in_scope_.end() || found->second == 0))
        return misread(text_, static_cast<std::size_t>(prefix.data() - text_.data()), "the prefix " + shortened(prefix) + " is not declared");
    return {};
  }
  Unexpected exceeds(const char* what, std::size_t limit, const char* unit) const {
    return misread(text_, at_, std::string(what) + "more than " + std::to_string(limit) + unit, Errc::limit_exceeded);
  }
  /// Counts the bytes that a long namespace adds to a name.
  bool count_name() {
    bytes_ += longest_namespace_ > 256 ? longest_namespace_ : 0;
    return bytes_ <= options_.max_bytes;
  }

  Result<void> start_tag() {
    if (++depth_ > max_elements_deep) return exceeds("elements nested ", max_elements_deep, " deep");
    const std::size_t most = elements_per_triple * std::max<std::size_t>(options_.max_triples, 4);
    if (++elements_ > most) return exceeds("", most, " elements");
    std::size_t attributes = 0;
    const std::size_t begin = at_ + 1;
    at_ = std::min(text_.find_first_of(" \t\r\n/><=\"'", begin), text_.size());
    use(text_.substr(begin, at_ - begin));
    for (;;) {
      if (!count_name()) return exceeds("names of ", options_.max_bytes, " bytes when written out");
      at_ = text_.find_first_not_of(spaces, at_);
      if (at_ == npos) return misread(text_, text_.size(), "unterminated tag");
      const bool ends = text_.substr(at_, 2) == "/>";
      if (ends || text_[at_] == '>') {
        if (Result<void> good = judge_prefixes(); !good) return good;
        if (ends) leave_element();
        at_ += ends ? 2 : 1;
        return {};
      }
      const std::size_t name_end = text_.find_first_of(" \t\r\n/><=\"'", at_);
      if (name_end == npos || name_end == at_) return misread(text_, at_, "expected an attribute");
      const std::string_view name = text_.substr(at_, name_end - at_);
      std::size_t from = 0;
      const std::string_view value = attribute_value(text_, name_end, from);
      if (from == npos || from + value.size() >= text_.size() || value.find('<') != npos) {
        return misread(text_, at_, "expected an attribute with its value in quotes");
      }
      if (++attributes > max_attributes) return exceeds("", max_attributes, " attributes");
      if (Result<void> good = attribute(name, value); !good) return good;
      at_ = from + value.size() + 1;
    }
  }

  Result<void> attribute(std::string_view name, std::string_view value) {
    const bool declares = name == "xmlns" || name.substr(0, 6) == "xmlns:";
    const std::size_t colon = name.find(':');
    const std::string_view local = colon == npos ? name : name.substr(colon + 1);
    const bool base = local == "base";
    if (declares || base || local == "about" || local == "resource" || local == "datatype") {
      if (value.size() > max_iri) return exceeds("IRI of ", max_iri, " bytes");
    }
    if (declares) {
      if (++namespaces_ > max_namespaces) return exceeds("", max_namespaces, " namespace declarations");
      longest_namespace_ = std::max(longest_namespace_, value.size());
      declared_.emplace_back(depth_, colon == npos ? std::string_view() : local);
      ++in_scope_[declared_.back().second];
    } else if (base) {
      std::size_t dots = 0;
      for (std::size_t i = 0; i < value.size(); ++i) dots += value[i] == '.' && (i == 0 || value[i - 1] == '/');
      if (dots > max_base_dots) return exceeds("base of ", max_base_dots, " dot segments");
    }
    if (!declares) use(name);
    return {};
  }

  std::string_view text_;
  const ReadOptions& options_;
  std::size_t at_ = 0;
  std::size_t depth_ = 0, elements_ = 0, namespaces_ = 0, longest_namespace_ = 0, bytes_ = 0;
  std::vector<std::pair<std::size_t, std::string_view>> declared_;  ///< prefixes in scope, each with the depth of its element
  std::unordered_map<std::string_view, std::size_t> in_scope_;      ///< how many of the open elements declare a prefix
  std::vector<std::string_view> used_;                              ///< prefixes of the names in the present tag
};

}  // namespace

Result<void> scan_rdf_xml(std::string_view text, const ReadOptions& options) {
  if (const auto at = utf8::find_invalid(text)) return misread(text, *at, "invalid UTF-8");
  if (const std::size_t at = text.find('\0'); at != npos) return misread(text, at, "U+0000 is not accepted");

  // The prolog (XML 1.0 2.8): white space, comments and instructions before the root element.
  std::size_t at = text.substr(0, 3) == "\xEF\xBB\xBF" ? 3 : 0;
  for (;;) {
    at = text.find_first_not_of(spaces, at);
    if (at == npos || text[at] != '<') break;
    const std::string_view rest = text.substr(at);
    if (rest.substr(0, 2) == "<?") {
      const std::size_t end = rest.find("?>");
      const std::string_view instruction = rest.substr(0, end);
      if (const std::size_t name = instruction.find("encoding"); instruction.substr(0, 5) == "<?xml" && name != npos) {
        std::size_t from = 0;
        const std::string_view encoding = attribute_value(instruction, name + 8, from);
        if (!lrt::detail::iequals_ascii(encoding, "utf-8") && !lrt::detail::iequals_ascii(encoding, "us-ascii")) {
          return misread(text, at, "expected the encoding UTF-8");
        }
      }
      if (end == npos) break;
      at += end + 2;
    } else if (rest.substr(0, 4) == "<!--") {
      const std::size_t end = rest.find("-->", 4);
      if (end == npos) break;
      at += end + 3;
    } else if (rest.substr(0, 2) == "<!") {
      return misread(text, at, "a document type declaration is not accepted");
    } else {
      break;
    }
  }

  const std::size_t root = at;
  constexpr std::string_view lang = "xml:lang";
  for (at = text.find(lang); at != npos; at = text.find(lang, at + 1)) {
    std::size_t from = 0;
    if (attribute_value(text, at + lang.size(), from).size() > max_language_tag) {
      return misread(text, from, "language tag of more than " + std::to_string(max_language_tag) + " bytes");
    }
  }
  return root == npos ? Result<void>() : TagScanner(text, options).scan(root);
}

}  // namespace lrt::rdf
