// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include <lrt/base/result.hpp>
#include <lrt/http/message.hpp>

#include "src/engine/context.hpp"
#include "src/http/target.hpp"

namespace lrt::engine {
inline namespace v0 {
struct Parts;
}  // namespace v0

/// Finds the resource that the target of a request names.
class Targets {
 public:
  explicit Targets(Parts& parts) : parts_(parts) {}

  /// The resource at the path of a target; nullptr: there is none.
  /// @par Errors  those of canonical_path
  Result<Resource*> resource_at(std::string_view path) const;
  /// Sets resource, page and first link of a context. Without a resource, or if the target is not valid, it returns the response.
  std::optional<http::Response> find(Context& context, const http::Target& target) const;

 private:
  std::string_view local_path(std::string_view path) const;
  Resource* new_graph(std::string_view path, const Audience& audience) const;
  std::optional<http::Response> read_page(Context& context, std::string_view query) const;

  Parts& parts_;
};

}  // namespace lrt::engine
