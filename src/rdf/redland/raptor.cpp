// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/redland/raptor.hpp"

#include <dlfcn.h>

namespace lrt::rdf::redland {

namespace {

#ifdef LRT_RAPTOR_LIBRARY

bool fill(Raptor& raptor) noexcept {
  void* const library = ::dlopen(LRT_RAPTOR_LIBRARY, RTLD_NOW | RTLD_LOCAL);  // never closed
  if (library == nullptr) return false;
  bool complete = true;
#define LRT_LOAD(name)                                                                      \
  raptor.name = reinterpret_cast<decltype(raptor.name)>(::dlsym(library, "raptor_" #name)); \
  complete = complete && raptor.name != nullptr;
  LRT_RAPTOR_FUNCTIONS(LRT_LOAD)
#undef LRT_LOAD
  return complete;
}

#else

bool fill(Raptor& raptor) noexcept {
#define LRT_LINK(name) raptor.name = &raptor_##name;
  LRT_RAPTOR_FUNCTIONS(LRT_LINK)
#undef LRT_LINK
  return true;
}

#endif

}  // namespace

const Raptor* load_raptor() noexcept {
  static Raptor raptor;
  static const bool is_complete = fill(raptor);
  return is_complete ? &raptor : nullptr;
}

}  // namespace lrt::rdf::redland
