// SPDX-License-Identifier: Apache-2.0
#include <lrt/client/patch.hpp>

#include <utility>

#include "src/base/quote.hpp"
#include "src/rdf/plain.hpp"

namespace lrt::client {
inline namespace v0 {

Patch Patch::from_json(std::string document) {
  Patch patch;
  patch.json_ = std::move(document);
  return patch;
}

Patch& Patch::add(std::string_view name, std::string_view json) {
  json_.pop_back();
  if (json_.size() > 1) json_ += ',';
  append_json_string(json_, name);
  json_.append(":").append(json) += '}';
  return *this;
}

Patch& Patch::set(std::string_view name, const rdf::Type& type, const rdf::Value& value) {
  const Result<std::string> json = rdf::write_plain(type, {}, value, rdf::Plain::json);
  return add(name, json ? *json : "null");
}

Patch& Patch::set(std::string_view name, const Patch& parts) { return add(name, parts.json_); }
Patch& Patch::clear(std::string_view name) { return add(name, "null"); }

}  // namespace v0
}  // namespace lrt::client
