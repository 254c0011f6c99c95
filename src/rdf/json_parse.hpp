// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>

namespace lrt::rdf::json {

/// Limits of a document; beyond: limit_exceeded.
struct Limits {
  std::size_t values = 0;
  std::size_t depth = 0;  ///< of nested objects and arrays
  bool nul = false;       ///< whether a string may have U+0000; the name of a member never has it
};

/// A document in JSON, or in CBOR with the same structure, as a compact tree. Its memory is a small multiple of the document's size.
class LRT_INTERNAL_API Document {
 public:
  enum class Kind : std::uint8_t { null, false_, true_, number, string, array, object };
  using Id = std::uint32_t;
  static constexpr Id none = 0xFFFFFFFF;

  /// @par Errors  expected_rdf with the position; also for repeated members, U+0000, invalid UTF-8, numbers out of the range of double
  static Result<Document> parse(std::string_view text, const Limits& limits);
  /// RFC 8949: the types of JSON, NaN and infinities, and byte strings, which become strings in base64. The text of a floating-point number never looks like an integer: "1.0", "NaN", "-INF".
  /// @par Errors  as for JSON; also expected_rdf for tags, undefined, and member names that are not texts
  static Result<Document> parse_cbor(std::string_view bytes, const Limits& limits);

  Id root() const noexcept { return 0; }
  Kind kind(Id id) const noexcept { return values_[id].kind; }
  /// The characters of a string or the digits of a number. Digits are as written, except that integers within 64 bits are normalised ("-5").
  std::string_view text(Id id) const noexcept { return view(values_[id].text, values_[id].length); }
  /// Whether a string was a byte string of CBOR.
  bool is_octets(Id id) const noexcept { return values_[id].octets; }
  /// The name of a member of an object.
  std::string_view key(Id id) const noexcept { return view(values_[id].key, values_[id].key_length); }
  Id parent(Id id) const noexcept { return values_[id].parent; }
  Id first(Id id) const noexcept { return values_[id].first; }
  Id next(Id id) const noexcept { return values_[id].next; }
  /// The member with that name, or none.
  Id member(Id object, std::string_view name) const noexcept;
  /// The JSON Pointer of a value (RFC 6901), shortened if it is long: "/@graph/0/unit"; "" for none.
  std::string pointer(Id id) const;

 private:
  friend class Builder;
  struct Value {
    Kind kind;
    bool octets = false;
    std::uint32_t text = 0, length = 0, key = 0, key_length = 0;
    Id parent = none, first = none, last = none, next = none;
  };
  std::string_view view(std::uint32_t at, std::uint32_t length) const noexcept { return std::string_view(text_).substr(at, length); }

  std::string text_;
  std::vector<Value> values_;
};

/// The range of an array's items or an object's members: `for (Id item : children(document, id))`.
class Children {
 public:
  class iterator {
   public:
    iterator(const Document& document, Document::Id at) noexcept : document_(&document), at_(at) {}
    Document::Id operator*() const noexcept { return at_; }
    iterator& operator++() noexcept {
      at_ = document_->next(at_);
      return *this;
    }
    bool operator!=(const iterator& other) const noexcept { return at_ != other.at_; }

   private:
    const Document* document_;
    Document::Id at_;
  };
  Children(const Document& document, Document::Id of) noexcept : document_(document), first_(document.first(of)) {}
  iterator begin() const noexcept { return {document_, first_}; }
  iterator end() const noexcept { return {document_, Document::none}; }

 private:
  const Document& document_;
  Document::Id first_;
};

/// Appends the name of a member, or the index of an item, to a JSON Pointer.
void append_step(std::string& pointer, std::string_view name);

}  // namespace lrt::rdf::json
