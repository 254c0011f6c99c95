// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <utility>

#include <lrt/server.hpp>
#include <lrt/transport/named.hpp>

namespace bench {

/// `--transport NAME`. Ends the program when it was not built.
inline void use_transport(std::string_view name, lrt::Options& options) {
  const auto names = lrt::transport::names();
  if (std::find(names.begin(), names.end(), name) == names.end()) {
    std::fprintf(stderr, "no transport %.*s in this build\n", static_cast<int>(name.size()), name.data());
    std::exit(3);
  }
  options.listen.transport = [name](lrt::transport::TransportOptions o) { return lrt::transport::make_named(name, std::move(o)); };
}

/// `--tls DIR`: what examples/make-certificate.sh has put there.
inline void use_tls(const std::string& dir, lrt::Options& options) {
  lrt::transport::TlsOptions tls;
  tls.certificate_file = dir + "/server.pem";
  tls.key_file = dir + "/server-key.pem";
  options.security.tls = tls;
}

}  // namespace bench
