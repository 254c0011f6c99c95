#pragma once

// The third parties of the transport that the test case is at, without the transport.

#include <memory>

#include "src/transport/port/protocols.hpp"
#include "tests/transport/harness.hpp"

#if LRT_HAS_ASIO
#include "src/transport/asio/beast_protocols.hpp"
#endif

namespace lrt::test {

inline std::unique_ptr<transport::Protocols> make_protocols() {
#if LRT_HAS_ASIO
  if (present_transport() == "asio") return std::make_unique<transport::BeastProtocols>();
#endif
  return nullptr;
}

}  // namespace lrt::test
