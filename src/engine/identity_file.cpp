// SPDX-License-Identifier: Apache-2.0
// Not linked into a program that states its identity itself.
#include <lrt/identity.hpp>

#include <string_view>

#include "src/base/quote.hpp"
#include "src/base/read_file.hpp"
#include "src/base/utf8.hpp"
#include "src/engine/identity.hpp"
#include "src/rdf/json_parse.hpp"

namespace lrt {
inline namespace v0 {

namespace {

constexpr std::size_t max_identity_file_bytes = 64 * 1024;
constexpr std::string_view identity_members = "iri, serialNumber, model, manufacturer, softwareVersion or build";

std::string* identity_member(Identity& identity, std::string_view name) {
  if (name == "iri") return &identity.iri;
  if (name == "serialNumber") return &identity.serial_number;
  if (name == "model") return &identity.model;
  if (name == "manufacturer") return &identity.manufacturer;
  if (name == "softwareVersion") return &identity.software_version;
  if (name == "build") return &identity.build;
  return nullptr;
}

}  // namespace

Result<Identity> Identity::from_file(const std::string& path) {
  using rdf::json::Document;
  const auto invalid = [&](const std::string& what) { return unexpected(Errc::invalid_option, "identity \"" + path + "\": " + what); };
  Result<std::string> text = read_file(path, max_identity_file_bytes);
  if (!text) return unexpected(text.error().code, "identity: " + text.error().message);
  if (text->size() > max_identity_file_bytes) return invalid("expected at most " + std::to_string(max_identity_file_bytes) + " bytes");
  rdf::json::Limits limits;
  limits.values = 64;
  limits.depth = 4;
  const Result<Document> read = Document::parse(utf8::without_mark(*text), limits);
  if (!read) return invalid("expected a JSON object: " + read.error().message);
  if (read->kind(read->root()) != Document::Kind::object) return invalid("expected a JSON object with the member \"iri\"");
  Identity identity;
  for (const Document::Id one : rdf::json::Children(*read, read->root())) {
    std::string* const member = identity_member(identity, read->key(one));
    if (!member) return invalid("expected " + std::string(identity_members) + ", found the member " + quoted(read->key(one)));
    if (read->kind(one) != Document::Kind::string) return invalid("expected a text in the member " + quoted(read->key(one)));
    *member = std::string(read->text(one));
  }
  if (identity.iri.empty()) return invalid("expected the member \"iri\": {\"iri\": \"https://robots.example/r7\"}");
  if (Result<void> checked = engine::check(identity); !checked) return invalid(checked.error().message);
  return identity;
}

}  // namespace v0
}  // namespace lrt
