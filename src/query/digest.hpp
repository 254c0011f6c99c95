// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace lrt::query {

/// The hash functions of SPARQL 17.4.6.
enum class Hash : std::uint8_t { md5, sha1, sha256, sha384, sha512 };

/// In lower-case hexadecimal digits; empty: this system's OpenSSL refuses the function (MD5 where only FIPS is allowed), or the process is exiting.
std::string digest_of(std::string_view bytes, Hash hash);

}  // namespace lrt::query
