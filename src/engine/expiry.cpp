// SPDX-License-Identifier: Apache-2.0
#include "src/engine/expiry.hpp"

#include <algorithm>

#include "src/base/quote.hpp"
#include "src/base/random.hpp"

namespace lrt::engine {
inline namespace v0 {

namespace {

using std::chrono::duration_cast;
using std::chrono::milliseconds;

/// A response may have a stamp that is that much older than it is.
constexpr milliseconds stamp_life{50};

std::uint64_t random_instance() {
  unsigned char bytes[8];
  fill_random(bytes, sizeof bytes);
  std::uint64_t number = 0;
  for (const unsigned char byte : bytes) number = number << 8 | byte;
  return number;
}

}  // namespace

RunTime::RunTime(const Clock& clock) : clock_(clock), begin_(clock.now().steady), instance_(random_instance()) {}

http::RobotTime RunTime::at(Instant now) const noexcept {
  const auto passed = duration_cast<milliseconds>(now - begin_).count();
  return {instance_, static_cast<std::uint64_t>(std::max<milliseconds::rep>(passed, 0))};
}

RunTime::Instant RunTime::instant(const http::RobotTime& stamp) const noexcept {
  if (stamp.instance != instance_) return Instant::min();
  const auto most = static_cast<std::uint64_t>(duration_cast<milliseconds>(Instant::max() - begin_).count());
  return begin_ + milliseconds(std::min(stamp.milliseconds, most - 1));
}

std::variant<Expiry, std::string> RunTime::expiry_of(const http::Request& request) const {
  Expiry expiry;
  for (const auto& [name, instant] :
       {std::pair(http::valid_until_field, &expiry.valid_until), std::pair(http::start_before_field, &expiry.start_before)}) {
    const auto field = request.find(name);
    if (!field) continue;
    const auto stamp = request.count(name) == 1 ? http::RobotTime::parse(*field) : std::nullopt;
    if (!stamp) {
      return std::string(name) + ": expected one value of " + std::string(http::robot_time_field) +
             " from a response of this server, with milliseconds added to its number, such as \"0123456789abcdef/73521\", found \"" +
             shortened(request.joined(name)) + "\"";
    }
    *instant = this->instant(*stamp);
  }
  return expiry;
}

const http::Fields& StampedFields::at(TimePoint now) {
  if (fields_.block().empty() || now.steady < made_ || now.steady - made_ > stamp_life) {
    made_ = now.steady;
    fields_.set(http::robot_time_field, time_.at(made_).text());
  }
  return fields_;
}

}  // namespace v0
}  // namespace lrt::engine
