#include "src/engine/page.hpp"

#include <lrt/http/etag.hpp>
#include <lrt/http/message.hpp>

#include "src/engine/page/parts.hpp"

namespace lrt::engine {

namespace {

constexpr std::string_view media_type = "text/html; charset=utf-8";

std::string escaped(std::string_view text) {
  std::string html;
  for (const char c : text) {
    switch (c) {
      case '&': html += "&amp;"; break;
      case '<': html += "&lt;"; break;
      case '>': html += "&gt;"; break;
      case '"': html += "&quot;"; break;
      case '\'': html += "&#39;"; break;
      default: html += c;
    }
  }
  return html;
}

}  // namespace

const std::shared_ptr<const std::string>& page_html() {
  static const auto html = std::make_shared<const std::string>(page_parts::page);
  return html;
}

const std::string& page_tag() {
  static const std::string tag = http::entity_tag(media_type, page_parts::page);
  return tag;
}

std::string error_page(int status, std::string_view detail, std::string_view home) {
  const std::string title = std::to_string(status) + " " + std::string(http::reason_phrase(status));
  std::string html;
  // In one pass, so that what is put in is not searched for places.
  for (std::string_view rest = page_parts::error; !rest.empty();) {
    const std::size_t from = rest.find("{{");
    html += rest.substr(0, from);
    if (from == std::string_view::npos) break;
    rest.remove_prefix(from + 2);
    const std::size_t to = rest.find("}}");
    const std::string_view name = rest.substr(0, to);
    html += escaped(name == "title" ? std::string_view(title) : name == "detail" ? detail : home);
    rest.remove_prefix(to + 2);
  }
  return html;
}

void add_page_fields(http::Fields& fields) {
  static const std::string policy = "default-src 'none'; script-src '" + std::string(page_parts::script_hash) + "'; style-src '" +
                                    std::string(page_parts::style_hash) +
                                    "'; connect-src 'self'; img-src data: 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
  fields.add("Content-Type", media_type);
  fields.add("Content-Security-Policy", policy);
  fields.add("X-Content-Type-Options", "nosniff");
  fields.add("Referrer-Policy", "no-referrer");
}

}  // namespace lrt::engine
