// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace lrt::security {

/// 32 random bytes of the operating system, as 64 hexadecimal digits.
std::string random_secret();

/// Encrypts a text with a secret (AES-256-GCM). Each secret of random_secret() may seal one text.
std::string seal(std::string_view secret, std::string_view text);
/// The text given to seal(); nullopt: the secret is another one.
std::optional<std::string> unseal(std::string_view secret, std::string_view sealed);

}  // namespace lrt::security
