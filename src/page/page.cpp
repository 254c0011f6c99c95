// SPDX-License-Identifier: Apache-2.0
#include "src/page/page.hpp"

#include <initializer_list>
#include <utility>

#include <lrt/http/message.hpp>

#include "src/http/etag.hpp"
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
  bool add_login(http::Response& response, std::string_view session) const override;
  void add_fields(http::Fields& fields) const override { add_fields(fields, policy_); }

 private:
  static std::string policy_of(std::string_view script_hash) {
    return "default-src 'none'; script-src '" + std::string(script_hash) + "'; style-src '" + std::string(parts::style_hash) +
           "'; connect-src 'self'; img-src data: 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
  }
  static void add_fields(http::Fields& fields, const std::string& policy);

  const std::shared_ptr<const std::string> html_ = std::make_shared<const std::string>(parts::page);
  const std::string tag_ = http::entity_tag(media_type, parts::page);
  const std::string policy_ = policy_of(parts::script_hash), login_policy_ = policy_of(parts::login_hash);
};

/// Replaces the placeholders of a page by `values`, escaped. One pass: placeholders in inserted values are not replaced.
std::string filled(std::string_view page, std::initializer_list<std::pair<std::string_view, std::string_view>> values) {
  std::string html;
  for (std::string_view rest = page; !rest.empty();) {
    const std::size_t from = rest.find("{{");
    html += rest.substr(0, from);
    if (from == std::string_view::npos) break;
    rest.remove_prefix(from + 2);
    const std::size_t to = rest.find("}}");
    for (const auto& [name, value] : values)
      if (rest.substr(0, to) == name) html += escaped(value);
    rest.remove_prefix(to + 2);
  }
  return html;
}

std::string Console::error(int status, std::string_view detail, std::string_view home) const {
  const std::string title = std::to_string(status) + " " + std::string(http::reason_phrase(status));
  return filled(parts::error, {{"title", title}, {"detail", detail}, {"home", home}});
}

bool Console::add_login(http::Response& response, std::string_view session) const {
  add_fields(response.fields, login_policy_);
  response.set_body(filled(parts::login, {{"session", session}}));
  return true;
}

void Console::add_fields(http::Fields& fields, const std::string& policy) {
  fields.add("Content-Type", media_type);
  fields.add("Content-Security-Policy", policy);
  fields.add("X-Frame-Options", "DENY");
  fields.add("Referrer-Policy", "no-referrer");
}

}  // namespace

std::shared_ptr<const engine::PageSource> console() { return std::make_shared<const Console>(); }

}  // namespace lrt::page
