// SPDX-License-Identifier: Apache-2.0
#include <lrt/http/problem.hpp>

#include <lrt/http/message.hpp>

#include "src/base/utf8.hpp"

namespace lrt::http {
inline namespace v0 {
namespace {

void append_json_string(std::string& out, std::string_view text) {
  static constexpr char digits[] = "0123456789abcdef";
  out += '"';
  while (!text.empty()) {
    const std::size_t good = utf8::find_invalid(text).value_or(text.size());
    for (const char c : text.substr(0, good)) {
      const auto byte = static_cast<unsigned char>(c);
      if (c == '"' || c == '\\') {
        out += '\\';
        out += c;
      } else if (c == '\n') {
        out += "\\n";
      } else if (c == '\t') {
        out += "\\t";
      } else if (c == '\r') {
        out += "\\r";
      } else if (byte < 0x20 || byte == 0x7F) {
        out += "\\u00";
        out += digits[byte >> 4];
        out += digits[byte & 0x0FU];
      } else {
        out += c;
      }
    }
    text.remove_prefix(good);
    if (text.empty()) break;
    utf8::append(out, 0xFFFD);
    text.remove_prefix(1);
  }
  out += '"';
}

}  // namespace

std::string json_string(std::string_view text) {
  std::string result;
  result.reserve(text.size() + 2);
  append_json_string(result, text);
  return result;
}

std::string to_json(const Problem& problem) {
  std::string result = R"({"type":"about:blank","title":)";
  append_json_string(result, reason_phrase(problem.status));
  result += ",\"status\":" + std::to_string(problem.status);
  if (!problem.detail.empty()) {
    result += ",\"detail\":";
    append_json_string(result, problem.detail);
  }
  if (!problem.errors.empty()) result += ",\"errors\":" + problem.errors;
  result += '}';
  return result;
}

void set_problem(Response& response, const Problem& problem) {
  response.status = problem.status;
  response.fields.set("Content-Type", "application/problem+json");
  response.fields.set("X-Content-Type-Options", "nosniff");
  response.fields.set("Cross-Origin-Resource-Policy", "same-origin");
  response.set_body(to_json(problem));
}

}  // namespace v0
}  // namespace lrt::http
