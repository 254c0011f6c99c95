// SPDX-License-Identifier: Apache-2.0
#include "src/query/terms.hpp"

#include <algorithm>
#include <cstring>

#include "src/rdf/hash.hpp"

namespace lrt::query {
namespace {

constexpr std::size_t block_bytes = 16 * 1024;

std::uint32_t hash_of(const rdf::TermView& term) noexcept {
  std::uint64_t h = rdf::hash_bytes(term.text, rdf::hash_seeds().bytes + static_cast<std::uint64_t>(term.kind));
  if (term.is_literal()) h = rdf::hash_bytes(term.language.empty() ? term.datatype : term.language, h);
  return rdf::to_32_bits(h);
}

}  // namespace

std::string_view Terms::keep(std::string_view text) {
  if (text.empty()) return {};
  if (text.size() > left_) {
    const std::size_t bytes = std::max(block_bytes, text.size());
    budget_.take(bytes);
    blocks_.emplace_back(new char[bytes]);
    at_ = blocks_.back().get();
    left_ = bytes;
  }
  std::memcpy(at_, text.data(), text.size());
  const std::string_view kept(at_, text.size());
  at_ += text.size();
  left_ -= text.size();
  return kept;
}

TermNumber Terms::intern(const rdf::TermView& term) {
  if (const TermNumber known = data_.find(term); known != nothing) return known;
  budget_.work(term.text.size());
  const std::uint32_t hash = hash_of(term);
  if (const std::uint32_t known = index_.find(hash, [&](std::uint32_t at) { return made_[at].term == term; }); known != lrt::detail::HashIndex::none)
    return first_ + known;
  budget_.take(sizeof(Entry) + 3 * sizeof(std::uint32_t));
  Entry entry{term, read_value(term)};
  entry.term.text = keep(term.text);
  if (term.is_literal()) {
    // Datatypes are few: the text of an earlier one is used again.
    const rdf::TermView datatype = this->term(intern(rdf::iri(term.datatype)));
    entry.term.datatype = datatype.text;
    entry.term.language = keep(term.language);
  }
  const auto at = static_cast<std::uint32_t>(made_.size());
  made_.push_back(entry);
  index_.insert(hash, at);
  return first_ + at;
}

TermNumber Terms::fresh_blank() {
  budget_.take(sizeof(Entry));
  Entry entry;
  entry.term.kind = rdf::TermKind::blank;
  entry.value.type = Type::blank;
  made_.push_back(entry);
  return first_ + static_cast<TermNumber>(made_.size() - 1);
}

rdf::TermView Terms::term(TermNumber number) const noexcept { return number < first_ ? data_.term(number) : made_[number - first_].term; }

}  // namespace lrt::query
