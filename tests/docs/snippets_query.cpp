// SPDX-License-Identifier: Apache-2.0
// Code of docs/queries.md. It is compiled, not run: tests/query runs the same functions.
#include <utility>

#include <lrt/lrt.hpp>
#include <lrt/query.hpp>

namespace docs {

lrt::Result<lrt::Server> with_queries() {
  lrt::Options options;
  options.query = lrt::query::endpoint();  // at /sparql; its limits are options
  return lrt::Server::create(std::move(options));
}

}  // namespace docs
