// SPDX-License-Identifier: Apache-2.0
#include "src/server/service.hpp"

#include <utility>

/// One line for each service: the function that makes it, or returns nullptr if the options do not request it. They start in this order; replies and
/// channels are offered to them in this order.
// clang-format off
#define LRT_SERVICES(service)   \
  service(make_counters)        \
  service(make_audit)           \
  service(make_user_jobs)       \
  service(make_rights_renewal)  \
  service(make_guest_requests)  \
  service(make_feeds)           \
  service(make_saved_callbacks) \
  service(make_delivery)        \
  service(make_kept_graphs)     \
  service(make_body_pool)       \
  service(make_query_pool)      \
  service(make_metric_sources)
// clang-format on

namespace lrt {

#define LRT_DECLARE(make) std::unique_ptr<Service> make(SharedEngine& server);
LRT_SERVICES(LRT_DECLARE)
#undef LRT_DECLARE

std::vector<std::unique_ptr<Service>> make_services(SharedEngine& server) {
  std::vector<std::unique_ptr<Service>> all;
  const auto add = [&](std::unique_ptr<Service> service) {
    if (service) all.push_back(std::move(service));
  };
#define LRT_ADD(make) add(make(server));
  LRT_SERVICES(LRT_ADD)
#undef LRT_ADD
  return all;
}

}  // namespace lrt
