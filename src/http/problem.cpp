// SPDX-License-Identifier: Apache-2.0
#include <lrt/http/problem.hpp>

#include <lrt/http/message.hpp>

#include "src/base/quote.hpp"
#include "src/base/utf8.hpp"

namespace lrt::http {
inline namespace v0 {
namespace {}  // namespace

std::string json_string(std::string_view text) { return lrt::json_string(text); }

std::string to_json(const Problem& problem) {
  std::string result = "{\"type\":";
  append_json_string(result, problem.type.empty() ? std::string_view("about:blank") : std::string_view(problem.type));
  result += ",\"title\":";
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
