// SPDX-License-Identifier: Apache-2.0
#include "src/engine/identity.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include <lrt/base/iri.hpp>
#include <lrt/engine/engine.hpp>

#include "src/base/quote.hpp"
#include "src/base/utf8.hpp"
#include "src/engine/description.hpp"

namespace lrt {
inline namespace v0 {

std::string Identity::name() const {
  const iri::Parts parts = iri::split(iri);
  std::string_view rest = parts.fragment.empty() ? parts.path : parts.fragment;
  const auto is_between = [&](char c) { return c == '/' || (c == ':' && !parts.has_authority); };
  while (!rest.empty() && is_between(rest.back())) rest.remove_suffix(1);
  if (rest.empty()) {
    rest = parts.authority.substr(parts.authority.find('@') + 1);  // npos + 1 is 0
    if (rest.substr(0, 1) != "[") rest = rest.substr(0, rest.find(':'));
    return std::string(rest.empty() ? parts.scheme : rest);
  }
  std::size_t begin = rest.size();
  while (begin > 0 && !is_between(rest[begin - 1])) --begin;
  return std::string(rest.substr(begin));
}

}  // namespace v0
}  // namespace lrt

namespace lrt::engine {
inline namespace v0 {

Result<void> check(const Identity& identity) {
  Result<void> result;
  bool is_empty = true;
  for_each_member(identity, [&](std::string_view name, const std::string& text) {
    is_empty = false;
    const bool has_control = std::any_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; });
    if (result && (has_control || utf8::find_invalid(text) || text.size() > max_identity_bytes))
      result =
          unexpected(Errc::invalid_option, "identity: " + std::string(name) + ": expected a text in UTF-8 without control characters, of at most " +
                                               std::to_string(max_identity_bytes) + " bytes, found " + quoted(text));
  });
  if (!result || is_empty) return result;
  if (!iri::is_absolute(identity.iri))
    return unexpected(
        Errc::invalid_option,
        "identity: iri: expected an absolute IRI such as \"https://robots.example/r7\" or \"urn:uuid:...\", found " + quoted(identity.iri));
  return {};
}

std::string json_of(const Identity& identity) {
  std::string text;
  for_each_member(identity, [&](std::string_view name, const std::string& value) {
    text += text.empty() ? "{\"" : ",\"";
    text.append(name).append("\":");
    append_json_string(text, value);
  });
  return text.empty() ? "{}" : text + "}";
}

void describe_identity(const std::string& document, const Description& d) {
  const Identity& identity = d.engine.options.identity;
  if (identity.iri.empty()) return;
  About(d.graph, document).link(vocab::lrt_::identity, identity.iri);
  About about(d.graph, identity.iri);
  about.a(vocab::schema::IndividualProduct);
  const std::pair<Iri, const std::string*> texts[] = {
      {vocab::schema::serialNumber, &identity.serial_number},
      {vocab::schema::model, &identity.model},
      {vocab::schema::manufacturer, &identity.manufacturer},
      {vocab::schema::softwareVersion, &identity.software_version},
      {vocab::lrt_::build, &identity.build},
  };
  for (const auto& [predicate, text] : texts)
    if (!text->empty()) about.add(predicate, rdf::literal(*text));
}

}  // namespace v0
}  // namespace lrt::engine
