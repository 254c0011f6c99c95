// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <lrt/base/result.hpp>
#include <lrt/transport/transport.hpp>

struct ssl_st;
struct ssl_ctx_st;

namespace lrt::libwebsockets {

/// Loads certificate and key, and what set_up_tls() does.
/// @par Errors  io_error: a file, with the reason
Result<void> load_tls(ssl_ctx_st* context, const transport::TlsOptions& options);
/// Loads the files once, for what libwebsockets only logs.
/// @par Errors  io_error: a file, with the reason
Result<void> check_tls_files(const transport::TlsOptions& options);
/// Settings that libwebsockets does not make: TLS 1.2 or later with forward secrecy, and the authorities of clients. False: it failed.
bool set_up_tls(ssl_ctx_st* context, const transport::TlsOptions& options);
/// Subject of the client's verified certificate (RFC 2253); empty: it showed none.
std::string client_subject(ssl_st* ssl);

}  // namespace lrt::libwebsockets
