#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include <lrt/transport/transport.hpp>

namespace lrt::transport {

/// The transports with a network that this lrt was built with, the default first: "asio".
std::vector<std::string_view> names();

/// Makes the one of that name; an empty name means the default. nullptr: this lrt was built without it.
std::unique_ptr<Transport> make_named(std::string_view name, Options options);

}  // namespace lrt::transport
