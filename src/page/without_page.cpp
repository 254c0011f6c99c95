// SPDX-License-Identifier: Apache-2.0
#include "src/page/page.hpp"

namespace lrt::page {

std::shared_ptr<const engine::PageSource> console() { return nullptr; }

}  // namespace lrt::page
