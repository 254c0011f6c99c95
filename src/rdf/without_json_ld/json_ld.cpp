// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/codecs.hpp"

// Builds without JSON-LD (LRT_JSON_LD=OFF).

namespace lrt::rdf {
inline namespace v0 {
namespace {

Unexpected absent() { return unexpected(Errc::unsupported_syntax, "this build of lrt has no JSON-LD (LRT_JSON_LD is OFF)"); }

}  // namespace

bool has_json_ld() noexcept { return false; }
Result<Graph> read_json_ld(std::string_view, const ReadOptions&) { return absent(); }
Result<Dataset> read_json_ld_dataset(std::string_view, const ReadOptions&) { return absent(); }
Result<void> Contexts::add(std::string_view, std::string_view) { return absent(); }
Result<std::string> write_json_ld(const Graph&, const Prefixes&, std::string_view) { return absent(); }
std::string json_ld_context(const Prefixes&) { return {}; }

}  // namespace v0
}  // namespace lrt::rdf
