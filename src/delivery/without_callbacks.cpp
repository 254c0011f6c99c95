// SPDX-License-Identifier: Apache-2.0
#include <lrt/delivery/deliverer.hpp>

namespace lrt::delivery {
inline namespace v0 {

Result<std::unique_ptr<Deliverer>> make_deliverer(Source& /*source*/, const subscription::CallbackOptions& /*options*/, LogCallback /*log*/) {
  return unexpected(Errc::invalid_option, "web callbacks: lrt was built without LRT_CALLBACKS");
}

}  // namespace v0
}  // namespace lrt::delivery
