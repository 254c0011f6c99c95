// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/base/language.hpp>

namespace lrt {
inline namespace v0 {

/// The kind of an error. Its name says what was expected or refused.
enum class Errc : std::uint8_t {
  expected_iri,         ///< the text is not a valid IRI or IRI reference
  expected_media_type,  ///< the text is not a valid media type
  expected_rdf,         ///< the bytes are not valid in their format: Turtle, N-Triples, RDF/XML, JSON-LD, JSON, CBOR, octets
  expected_value,       ///< a value has the wrong type, is missing or is repeated
  expected_http,        ///< the header field or message is not valid by RFC 9110/9112
  out_of_range,         ///< the value has the right type but is outside its bounds
  duplicate_path,       ///< another resource of the server has this path
  unknown_path,         ///< no resource has this path
  unsupported_syntax,   ///< the codec does not support this media type or graph
  limit_exceeded,       ///< a documented limit (bytes, triples, members, ...) was reached
  invalid_option,       ///< an option is invalid or contradicts another option
  insecure_address,     ///< this listening address requires TLS, tokens, an authorizer or an explicit option (R0.2)
  address_in_use,       ///< the port is in use
  io_error,             ///< a system call failed; the message has the system's reason
  refused,              ///< the robot refused: the request is valid, but the robot's state or limits exclude it
  cancelled,            ///< cancelled by a client or by the host
  timed_out,            ///< a documented time limit was exceeded
  dropped,              ///< a Responder was destroyed before succeed() or fail()
  failed,               ///< the robot tried and failed, or user code threw an exception
  closed,               ///< the server, thing or connection is closed
  unconfirmed,          ///< a command was sent and no response has come: it may have been carried out
  unavailable,          ///< what a lambda needs is not there now: the client gets 503 with the reason
};

/// The enumerator's name, "expected_iri".
/// @par Threads  Any.
LRT_API std::string_view to_string(Errc code) noexcept;

/// An error: its kind, a sentence for people, and, for errors in a text, the position.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
struct Error {
  Errc code;                            ///< its kind, for programs
  std::string message;                  ///< what was found, where, and what was expected, for people
  std::optional<std::size_t> offset{};  ///< byte offset in the text; nullopt: unknown
  std::uint32_t line = 0;               ///< 1-based; 0: unknown
  std::uint32_t column = 0;             ///< 1-based, in bytes; 0: unknown
};

}  // namespace v0
}  // namespace lrt
