// SPDX-License-Identifier: Apache-2.0
#include "src/page/page.hpp"

#include <initializer_list>
#include <utility>

#include <lrt/http/message.hpp>

#include "src/http/etag.hpp"
#include "src/page/html.hpp"
#include "src/page/parts.hpp"
#include "src/page/term_page.hpp"

namespace lrt::page {

namespace {

constexpr std::string_view media_type = "text/html; charset=utf-8";

constexpr std::string_view main_of_script =
    "<main id=\"main\" tabindex=\"-1\"><noscript><p>This page needs JavaScript. Without it, <code>curl</code> returns the data as "
    "Turtle.</p></noscript></main>";

/// Replaces the placeholders of a page by values in HTML. One pass: placeholders in inserted values are not replaced.
std::string filled(std::string_view page, std::initializer_list<std::pair<std::string_view, std::string_view>> values) {
  std::string html;
  for (std::string_view rest = page; !rest.empty();) {
    const std::size_t from = rest.find("{{");
    html += rest.substr(0, from);
    if (from == std::string_view::npos) break;
    rest.remove_prefix(from + 2);
    const std::size_t to = rest.find("}}");
    for (const auto& [name, value] : values)
      if (rest.substr(0, to) == name) html += value;
    rest.remove_prefix(to + 2);
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
  std::string terms(const engine::TermList& list) const override;

 private:
  static std::string policy_of(std::string_view script_hash) {
    return "default-src 'none'; script-src '" + std::string(script_hash) + "'; style-src '" + std::string(parts::style_hash) +
           "'; connect-src 'self'; img-src data: 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
  }
  static void add_fields(http::Fields& fields, const std::string& policy);

  const std::shared_ptr<const std::string> html_ =
      std::make_shared<const std::string>(filled(parts::page, {{"title", "Robot"}, {"main", main_of_script}}));
  const std::string tag_ = http::entity_tag(media_type, *html_);
  const std::string policy_ = policy_of(parts::script_hash), login_policy_ = policy_of(parts::login_hash);
};

std::string Console::error(int status, std::string_view detail, std::string_view home) const {
  const std::string title = std::to_string(status) + " " + std::string(http::reason_phrase(status));
  // The stops of the robot are in sight here, too. The script leaves this content.
  const std::string main = "<main id=\"main\" tabindex=\"-1\" data-home=\"" + html_text(home) + "\">\n<h1>" + title + "</h1>\n<p class=\"detail\">" +
                           html_text(detail) + "</p>\n<p><a href=\"" + html_text(home) + "\">Back to the list of Things</a></p>\n</main>";
  return filled(parts::page, {{"title", html_text(title)}, {"main", main}});
}

bool Console::add_login(http::Response& response, std::string_view session) const {
  add_fields(response.fields, login_policy_);
  response.set_body(filled(parts::login, {{"session", html_text(session)}}));
  return true;
}

std::string Console::terms(const engine::TermList& list) const {
  const TermPage page = term_page(list);
  // The script leaves this content.
  const std::string main = "<main id=\"main\" tabindex=\"-1\" data-of=\"" + html_text(list.iri) + "\">\n" + page.content + "</main>";
  return filled(parts::page, {{"title", html_text(page.title)}, {"main", main}});
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
