#include "src/page/page.hpp"

#include <lrt/http/etag.hpp>
#include <lrt/http/message.hpp>

#include "src/page/parts.hpp"

namespace lrt::page {

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

class Console final : public engine::PageSource {
 public:
  const std::shared_ptr<const std::string>& html() const override { return html_; }
  const std::string& tag() const override { return tag_; }
  std::string error(int status, std::string_view detail, std::string_view home) const override;
  void add_fields(http::Fields& fields) const override;

 private:
  const std::shared_ptr<const std::string> html_ = std::make_shared<const std::string>(parts::page);
  const std::string tag_ = http::entity_tag(media_type, parts::page);
  const std::string policy_ = "default-src 'none'; script-src '" + std::string(parts::script_hash) + "'; style-src '" +
                              std::string(parts::style_hash) +
                              "'; connect-src 'self'; img-src data: 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
};

std::string Console::error(int status, std::string_view detail, std::string_view home) const {
  const std::string title = std::to_string(status) + " " + std::string(http::reason_phrase(status));
  std::string html;
  // In one pass, so that inserted text is not searched for places.
  for (std::string_view rest = parts::error; !rest.empty();) {
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

void Console::add_fields(http::Fields& fields) const {
  fields.add("Content-Type", media_type);
  fields.add("Content-Security-Policy", policy_);
  fields.add("Referrer-Policy", "no-referrer");
}

}  // namespace

std::shared_ptr<const engine::PageSource> console() { return std::make_shared<const Console>(); }

}  // namespace lrt::page
