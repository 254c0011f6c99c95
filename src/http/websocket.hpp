// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/http/request_parser.hpp>
#include <lrt/http/message.hpp>

namespace lrt::http {

/// Whether a member of the Upgrade fields names a protocol (RFC 9110 7.8): "websocket", "callback". The comparison
/// ignores case and the version of the protocol.
/// @par Threads  Any.
/// @par Time     Linear in the fields.
bool requests_upgrade(const Request& request, std::string_view protocol) noexcept;

/// Checks a request with `Upgrade: websocket`. An opening handshake has the method GET, HTTP/1.1, no body, `Connection`
/// with `upgrade`, one Sec-WebSocket-Version of 13 (else 426, with `Sec-WebSocket-Version: 13`), and one
/// Sec-WebSocket-Key of 16 bytes in base64 (else 400).
/// @return  nullopt: it is an opening handshake
/// @par Threads  Any.
/// @par Time     Linear in the fields.
/// @par Implements  R0.12, RFC 6455 4.2.1, 4.4
std::optional<Refusal> check_websocket(const Request& request);

/// The subprotocol (RFC 6455 1.9) in which a text message with a stamp precedes each representation (SPEC 3.6).
inline constexpr std::string_view stamped_protocol = "lrt.stamped";

/// Whether the Sec-WebSocket-Protocol fields offer a subprotocol.
/// @par Threads  Any.
/// @par Time     Linear in the fields.
bool offers_subprotocol(const Request& request, std::string_view name) noexcept;

/// Whether a close frame may have this payload: nothing, or a status code that an endpoint may send, followed by a
/// reason in UTF-8 (RFC 6455 5.5.1, 7.4; codes 1012 and 1013 are registered by IANA).
/// @par Threads  Any.
/// @par Time     Linear in the text. Does not allocate.
bool is_close_payload(std::string_view payload) noexcept;

/// The value of Sec-WebSocket-Accept (RFC 6455 4.2.2).
/// @param key  value of Sec-WebSocket-Key
/// @par Threads  Any.
/// @par Time     Linear in the key.
LRT_INTERNAL_API std::string websocket_accept(std::string_view key);

/// A new value of Sec-WebSocket-Key.
LRT_INTERNAL_API std::string new_websocket_key();

/// What is wrong with the header fields of a 101 (RFC 6455 4.1) besides Sec-WebSocket-Accept. Empty: nothing.
/// @param protocol  the subprotocol that was offered; empty: none
LRT_INTERNAL_API std::string opening_fault(const Fields& fields, std::string_view protocol = {});

}  // namespace lrt::http
