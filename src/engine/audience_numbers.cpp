// SPDX-License-Identifier: Apache-2.0
#include "src/engine/audience_numbers.hpp"

#include <algorithm>

namespace lrt::engine {
inline namespace v0 {

std::uint64_t AudienceNumbers::of(const Audience& audience) const {
  if (!kept_) kept_ = std::make_unique<Kept>();
  const auto make = [this] { return kept_->least; };
  return kept_->numbers.of(audience, make, [this](std::uint64_t gone) { kept_->least = std::max(kept_->least, gone); });
}

void AudienceNumbers::count(SeenBy seen) {
  if (!kept_) return;
  kept_->numbers.for_each([&](const Audience& audience, std::uint64_t& number) {
    if (seen(audience)) ++number;
  });
}

}  // namespace v0
}  // namespace lrt::engine
