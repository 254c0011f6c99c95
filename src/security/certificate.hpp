// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>

namespace lrt::security {

/// What a certificate says of its owner.
struct CertificateText {
  std::string common_name;         ///< CN of the subject, the last one; empty: it has none
  std::vector<std::string> uris;   ///< alternative names
  std::vector<std::string> names;  ///< alternative names that are DNS names
  std::chrono::system_clock::time_point from{}, to{};
};

/// Reads the first certificate of a PEM file.
/// @par Errors  io_error; invalid_option: there is no certificate in it
LRT_INTERNAL_API Result<CertificateText> read_certificate(const std::string& file);

/// Whether a key, without a passphrase, is that of the first certificate of a file: of two files that are replaced one after the other.
/// @par Errors  io_error; invalid_option
LRT_INTERNAL_API Result<void> check_key(const std::string& certificate_file, const std::string& key_file);

}  // namespace lrt::security
