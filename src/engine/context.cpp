// SPDX-License-Identifier: Apache-2.0
#include "src/engine/context.hpp"

#include <algorithm>

#include <lrt/base/iri.hpp>

#include "src/base/client_key.hpp"
#include "src/http/form.hpp"

namespace lrt::engine {
inline namespace v0 {

OwnedRequest::OwnedRequest(const http::Request& request) : view_(request) {
  std::size_t size = request.method.size() + request.target.size() + request.peer.size() + request.client_certificate.size() + request.mount.size();
  for (const http::Field& f : request.fields) size += f.name.size() + f.value.size();
  bytes_.reserve(size);  // so that the views stay valid
  const auto keep = [this](std::string_view& text) {
    const std::size_t at = bytes_.size();
    bytes_ += text;
    text = std::string_view(bytes_).substr(at);
  };
  for (std::string_view* text : {&view_.method, &view_.target, &view_.peer, &view_.client_certificate, &view_.mount}) keep(*text);
  for (http::Field& f : view_.fields) {
    keep(f.name);
    keep(f.value);
  }
  view_.body = {};
  view_.body_owner.reset();
}

std::string Context::share_key() const { return client.empty() ? client_key(request_->peer) : client; }

Context Context::kept() const {
  Context copy = *this;
  if (copy.owned_) return copy;
  copy.owned_ = std::make_shared<const OwnedRequest>(*request_);
  copy.request_ = &copy.owned_->view();
  copy.accept_.reset();  // a view of the other request
  return copy;
}

std::optional<std::string_view> Context::accept() const {
  if (accept_) return *accept_;
  const http::Request& r = *request_;
  accept_ = r.find("Accept");
  std::optional<std::string> text;
  if (r.method == "GET" || r.method == "HEAD") text = http::query_parameter(r.target, "accept");
  if (!text && r.count("Accept") > 1) text = r.joined("Accept");
  if (text) {
    accept_text_ = std::make_shared<const std::string>(*std::move(text));
    accept_ = std::optional<std::string_view>(*accept_text_);
  }
  return *accept_;
}

const http::Preferences& Context::preferences() const {
  if (!preferences_) preferences_ = request_->find("Prefer") ? http::parse_prefer(request_->joined("Prefer")) : http::Preferences();
  return *preferences_;
}

namespace {

std::string_view vary_on(bool prefer, const Audience& audience) noexcept {
  if (audience.is_restricted()) return prefer ? "Accept, Prefer, Authorization, Cookie" : "Accept, Authorization, Cookie";
  return prefer ? "Accept, Prefer" : "Accept";
}

}  // namespace

std::string_view Context::vary() const noexcept {
  const bool patches_value = request_->method == "PATCH" && resource && resource->patch_types() != update_type;
  const bool is_command = request_->method == "PUT" || request_->method == "POST" || patches_value;
  return vary_on(resource && (is_command || resource->container()), audience);
}

std::string_view vary_of(const Resource& resource, const Audience& audience) noexcept { return vary_on(resource.container() != nullptr, audience); }

}  // namespace v0
}  // namespace lrt::engine
