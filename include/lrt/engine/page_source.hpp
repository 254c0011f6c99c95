#pragma once

#include <memory>
#include <string>
#include <string_view>

#include <lrt/http/message.hpp>

namespace lrt::engine {

/// HTML for people, as one more variant of every resource. The bytes are the same for all resources: the page's script uses its own
/// address and reads the rest as any client does.
///
/// @par Threads  const: any.
class PageSource {
 public:
  virtual ~PageSource() = default;
  virtual const std::shared_ptr<const std::string>& html() const = 0;
  /// Its entity tag.
  virtual const std::string& tag() const = 0;
  /// An error page.
  /// @param home  IRI of the list of Things
  virtual std::string error(int status, std::string_view detail, std::string_view home) const = 0;
  /// Content-Type and security policy of both.
  virtual void add_fields(http::Fields& fields) const = 0;
};

}  // namespace lrt::engine
