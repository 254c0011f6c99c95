// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mutex>

#include <lrt/client/things.hpp>

namespace lrt::client {
inline namespace v0 {

/// The document of a Thing, which may be read later than the Thing was found.
struct Thing::LateDocument {
  std::mutex mutex;
  RepresentationPtr read;  ///< null: not yet
};

}  // namespace v0
}  // namespace lrt::client
