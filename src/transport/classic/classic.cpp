#include <lrt/transport/classic.hpp>

#include <utility>

#include "src/transport/classic/classic_protocols.hpp"
#include "src/transport/port/port.hpp"

namespace lrt::transport {

std::unique_ptr<Transport> make_classic(Options options) {
  return make_port(std::move(options), std::make_unique<ClassicProtocols>());
}

}  // namespace lrt::transport
