// SPDX-License-Identifier: Apache-2.0
#include <lrt/base/error.hpp>

namespace lrt {
inline namespace v0 {

std::string_view to_string(Errc code) noexcept {
  switch (code) {
    case Errc::expected_iri: return "expected_iri";
    case Errc::expected_media_type: return "expected_media_type";
    case Errc::expected_rdf: return "expected_rdf";
    case Errc::expected_value: return "expected_value";
    case Errc::expected_http: return "expected_http";
    case Errc::out_of_range: return "out_of_range";
    case Errc::duplicate_path: return "duplicate_path";
    case Errc::unknown_path: return "unknown_path";
    case Errc::unsupported_syntax: return "unsupported_syntax";
    case Errc::limit_exceeded: return "limit_exceeded";
    case Errc::invalid_option: return "invalid_option";
    case Errc::insecure_address: return "insecure_address";
    case Errc::address_in_use: return "address_in_use";
    case Errc::io_error: return "io_error";
    case Errc::refused: return "refused";
    case Errc::cancelled: return "cancelled";
    case Errc::timed_out: return "timed_out";
    case Errc::dropped: return "dropped";
    case Errc::failed: return "failed";
    case Errc::closed: return "closed";
    case Errc::unconfirmed: return "unconfirmed";
    case Errc::unavailable: return "unavailable";
  }
  return "unknown";
}

}  // namespace v0
}  // namespace lrt
