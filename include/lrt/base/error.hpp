#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace lrt {

/// What went wrong, named for what was expected or refused.
enum class Errc : std::uint8_t {
  expected_iri,            ///< a text that should be an IRI (or IRI reference) is none
  expected_media_type,     ///< a text that should be a media type is none
  expected_rdf,            ///< bytes that should be Turtle, N-Triples, RDF/XML, JSON-LD, JSON, CBOR or octets are none
  expected_value,          ///< a value of another type, or a missing or repeated one
  expected_http,           ///< a header field or message that RFC 9110/9112 does not allow
  out_of_range,            ///< a value of the right type that a bound excludes
  duplicate_path,          ///< a path that another resource of the same server has
  unknown_path,            ///< a path that no resource has
  unsupported_syntax,      ///< a media type or graph that a codec cannot carry
  limit_exceeded,          ///< a stated limit (bytes, triples, members, ...) was reached
  invalid_option,          ///< an option that contradicts itself or another one
  insecure_address,        ///< a listening address that needs TLS, an authorizer, or an explicit word (R0.2)
  address_in_use,          ///< the port is taken
  io_error,                ///< the operating system refused; the message has its words
  refused,                 ///< the robot declines: the request is well formed but its state or limits exclude it
  cancelled,               ///< ended by a cancellation
  timed_out,               ///< not done within a stated time
  dropped,                 ///< a Responder was destroyed without an answer
  failed,                  ///< the robot tried and did not succeed, or user code threw
  closed,                  ///< the server, thing or connection is gone
};

/// The enumerator's name, "expected_iri".
std::string_view to_string(Errc code) noexcept;

/// A code, a sentence that says what was found and where, and for text the place.
struct Error {
  Errc code;
  std::string message;
  std::optional<std::size_t> offset{};  ///< byte in the text, where known
  std::uint32_t line = 0;               ///< 1-based; 0 when unknown
  std::uint32_t column = 0;             ///< 1-based, in bytes; 0 when unknown
};

}  // namespace lrt
