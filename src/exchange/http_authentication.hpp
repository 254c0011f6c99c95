// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/http/message.hpp>

/// HTTP authentication for clients (RFC 9110 11).
namespace lrt::exchange {

/// A hash function of HTTP Digest.
enum class HashAlgorithm : unsigned char { md5, sha256 };

/// A digest in lower-case hex.
/// @par Errors  failed: OpenSSL does not have the algorithm, as MD5 where only algorithms of FIPS are allowed; or the process ends
LRT_INTERNAL_API Result<std::string> hex_digest(HashAlgorithm algorithm, std::string_view bytes);

/// One challenge of a WWW-Authenticate field (RFC 9110 11.3). A token68 is ignored.
struct Challenge {
  std::string scheme{};                                           ///< in lower case
  std::vector<std::pair<std::string, std::string>> parameters{};  ///< names in lower case

  /// The value of a parameter; empty: there is none.
  std::string_view parameter(std::string_view name) const noexcept;
};

/// The challenges of a response, in their order. What is ill-formed ends the list of its field.
/// @param max  challenges; the others are left out
LRT_INTERNAL_API std::vector<Challenge> challenges_of(const http::Fields& fields, std::size_t max = 16);

/// A challenge of HTTP Digest that this client can respond to.
struct DigestChallenge {
  std::string realm{}, nonce{}, opaque{};
  HashAlgorithm algorithm = HashAlgorithm::md5;
  bool states_algorithm = false;
  bool has_qop = false;   ///< "auth" is offered; false: RFC 2069
  bool is_stale = false;  ///< the last response was right, but its nonce was too old
};

/// The first challenge with MD5 or SHA-256, and with the quality of protection "auth" or none; nullopt: there is none.
LRT_INTERNAL_API std::optional<DigestChallenge> digest_challenge(const std::vector<Challenge>& challenges);

/// The value of Authorization for a request.
///
/// @param target  the request target as it is sent
/// @param count   of the requests with this nonce, from 1
/// @param cnonce  a random text of the client's
/// @par Errors      expected_value: the user has a control character or a colon; those of hex_digest()
/// @par Implements  RFC 7616 3.4, RFC 2617 3.2.2
LRT_INTERNAL_API Result<std::string> digest_authorization(const DigestChallenge& challenge, std::string_view user, std::string_view password,
                                                          std::string_view method, std::string_view target, std::uint32_t count,
                                                          std::string_view cnonce);

}  // namespace lrt::exchange
