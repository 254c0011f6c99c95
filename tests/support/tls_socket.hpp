// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

#include "tests/support/socket.hpp"
#include "tests/support/tls.hpp"

namespace lrt::test {

/// TLS for a Socket.
class TlsLayer final : public Socket::Layer {
 public:
  explicit TlsLayer(SSL_CTX* context) : side_(context) {}
  void write(std::string_view text) override { side_.write(text); }
  std::string give() override { return side_.give(); }
  std::string take(std::string_view bytes) override {
    std::string text = side_.take(bytes);
    if (!side_.failure.empty()) throw std::runtime_error("TLS: " + side_.failure);
    return text;
  }

 private:
  TlsClientSide side_;
};

}  // namespace lrt::test
