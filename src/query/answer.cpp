// SPDX-License-Identifier: Apache-2.0
#include <lrt/query/answer.hpp>

namespace lrt::query {
inline namespace v0 {

std::string_view media_type(ResultFormat format) noexcept {
  switch (format) {
    case ResultFormat::json: return "application/sparql-results+json";
    case ResultFormat::xml: return "application/sparql-results+xml";
    case ResultFormat::csv: return "text/csv";
    case ResultFormat::tsv: return "text/tab-separated-values";
  }
  return {};
}

}  // namespace v0
}  // namespace lrt::query
