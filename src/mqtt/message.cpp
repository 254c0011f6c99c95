// SPDX-License-Identifier: Apache-2.0
#include "src/mqtt/message.hpp"

#include <utility>

#include <lrt/base/clock.hpp>
#include <lrt/http/problem.hpp>

#include "src/base/charset.hpp"

namespace lrt::mqtt {
inline namespace v0 {

namespace {

bool begins_with(std::string_view text, std::string_view start) noexcept { return text.substr(0, start.size()) == start; }
bool ends_with(std::string_view text, std::string_view end) noexcept {
  return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}
/// Without parameters.
std::string_view essence(std::string_view media_type) noexcept {
  media_type = media_type.substr(0, media_type.find(';'));
  while (!media_type.empty() && media_type.back() == ' ') media_type.remove_suffix(1);
  return media_type;
}

/// Calls `add` with the name and the text of each fact besides the sequence.
template <class Add>
void for_each_fact(const Said& said, Add add) {
  if (said.at) add("time", to_xsd_date_time(*said.at));
  if (!said.meaning.unit.empty()) add("unit", said.meaning.unit);
  if (!said.meaning.datatype.empty()) add("datatype", said.meaning.datatype);
  if (!said.meaning.frame.empty()) add("frame", said.meaning.frame);
}

std::string json_with_meaning(const std::string& value, const Said& said) {
  std::string text = "{\"value\":" + value;
  text += ",\"seq\":" + std::to_string(said.sequence);
  for_each_fact(said, [&](const char* name, const std::string& fact) { (text.append(",\"").append(name) += "\":") += http::json_string(fact); });
  return text += '}';
}

}  // namespace

bool is_json(std::string_view media_type) noexcept {
  const std::string_view type = essence(media_type);
  return ends_with(type, "/json") || ends_with(type, "+json");
}

bool is_utf8(std::string_view media_type) noexcept {
  const std::string_view type = essence(media_type);
  if (begins_with(type, "text/")) {  // lrt writes UTF-8; another encoding is named
    const std::size_t at = media_type.find("charset=");
    return at == std::string_view::npos || begins_with(media_type.substr(at + 8), "utf-8") || begins_with(media_type.substr(at + 8), "UTF-8");
  }
  return is_json(media_type) || ends_with(type, "/xml") || ends_with(type, "+xml") || type == "application/n-triples" ||
         type == "application/n-quads" || type == "application/trig";
}

void say(OutMessage& message, std::shared_ptr<const std::string> body, const Publication& how, const Said& said) {
  message.user.emplace_back("seq", std::to_string(said.sequence));
  const std::string_view type = how.media_type.empty() ? std::string_view("text/turtle") : std::string_view(how.media_type);
  message.is_utf8 = is_utf8(type);
  message.content_type = body ? charset::content_type(type, *body) : std::string(type);
  if (how.form == Form::with_meaning && body) {
    message.payload = std::make_shared<const std::string>(json_with_meaning(*body, said));
    return;
  }
  message.payload = std::move(body);
  for_each_fact(said, [&](const char* name, const std::string& fact) { message.user.emplace_back(name, fact); });
}

std::size_t wire_bytes(const OutMessage& message) noexcept {
  std::size_t bytes = 16 + message.topic.size() + message.content_type.size() + message.correlation.size();
  if (message.payload) bytes += message.payload->size();
  for (const auto& [name, value] : message.user) bytes += 5 + name.size() + value.size();
  return bytes;
}

}  // namespace v0
}  // namespace lrt::mqtt
