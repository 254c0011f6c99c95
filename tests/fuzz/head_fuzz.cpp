// SPDX-License-Identifier: Apache-2.0
// Any bytes as the header section of a request: what the parser accepts must be unambiguous, and every field parser must survive every value.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include <lrt/base/iri.hpp>
#include <lrt/base/media_type.hpp>
#include <lrt/http/problem.hpp>
#include <lrt/http/request_parser.hpp>

#include "src/base/utf8.hpp"
#include "src/http/etag.hpp"
#include "src/http/link.hpp"
#include "src/http/negotiate.hpp"
#include "src/http/prefer.hpp"
#include "src/http/target.hpp"

using namespace lrt;

namespace {

void require(bool condition) {
  if (!condition) std::abort();
}

bool is_printable(std::string_view text) {
  for (const char c : text) {
    if (c < ' ' || c > '~') return false;
  }
  return true;
}

/// The most simple reading of a header section that the parser has accepted.
http::Request parse(std::string_view head) {
  http::Request request;
  const auto take = [&head](std::string_view until) {
    const std::size_t end = head.find(until);
    require(end != std::string_view::npos);
    const std::string_view part = head.substr(0, end);
    head.remove_prefix(end + until.size());
    return part;
  };
  request.method = take(" ");
  request.target = take(" ");
  const std::string_view version = take("\r\n");
  require(version.size() == 8 && version.substr(0, 7) == "HTTP/1." && version[7] >= '0' && version[7] <= '9');  // RFC 9110 6.2
  request.version = version == "HTTP/1.0" ? 10 : 11;
  while (head != "\r\n") {
    const std::string_view line = take("\r\n");
    const std::size_t colon = line.find(':');
    require(colon != std::string_view::npos && colon > 0);
    std::string_view value = line.substr(colon + 1);
    while (!value.empty() && (value.front() == ' ' || value.front() == '\t')) value.remove_prefix(1);
    while (!value.empty() && (value.back() == ' ' || value.back() == '\t')) value.remove_suffix(1);
    request.fields.push_back({line.substr(0, colon), value});
  }
  return request;
}

void check_refusal(const http::Refusal& refusal) {
  require(refusal.status >= 400 && refusal.status <= 505 && !http::reason_phrase(refusal.status).empty());
  require(!refusal.reason.empty() && is_printable(refusal.reason));
}

/// Every parser on any text, with what must hold of its answer.
void try_value(std::string_view text) {
  static const std::vector<std::string_view> offers = {"text/turtle", "application/json", "text/html;level=1"};
  if (const auto index = http::negotiate(text, offers)) require(*index < offers.size());

  const std::string tag = http::entity_tag(text, text);
  require(http::matches(tag, tag, false) == http::Match::yes);
  require(http::matches("W/" + tag, tag, false) == http::Match::no);
  // A strong match is a weak one, and both agree on what is malformed.
  const auto strong = http::matches(text, tag, false);
  const auto weak = http::matches(text, tag, true);
  require((strong == http::Match::malformed) == (weak == http::Match::malformed));
  require(strong != http::Match::yes || weak == http::Match::yes);
  if (strong == http::Match::no) require(http::matches(std::string(text) + "," + tag, tag, false) == http::Match::yes);

  const http::Preferences prefer = http::parse_prefer(text);
  if (prefer.wait) require(prefer.wait->count() >= 0 && prefer.wait->count() <= 86400);
  for (const std::string& iri : prefer.include) require(iri::is_absolute(iri));

  if (const auto type = MediaType::parse(text)) {
    const auto again = MediaType::parse(type->essence());
    require(again && again->essence() == type->essence() && again->parameters.empty());
  } else {
    require(type.error().offset && *type.error().offset <= text.size());
  }

  const iri::Parts parts = iri::split(text);
  require(parts.has_scheme + parts.has_query + parts.has_fragment + 2 * parts.has_authority + parts.scheme.size() + parts.authority.size() +
              parts.path.size() + parts.query.size() + parts.fragment.size() ==
          text.size());
  for (const std::string_view base : {"http://a/b/c/d;p?q", "urn:x:y", "http://a", "x:a/b"}) {
    const auto resolved = iri::resolve(base, text);
    require(resolved.has_value() == iri::is_reference(text));
    if (!resolved) continue;
    require(iri::is_absolute(*resolved));
    require(*iri::resolve(base, *resolved) == *iri::resolve(*resolved, *resolved));
    require(iri::split(*resolved).has_authority || iri::split(*resolved).path.substr(0, 2) != "//");
  }
  if (iri::is_absolute(text)) {
    require(iri::is_reference(text));
    const auto below = iri::resolve(text, "x");
    require(below && iri::is_absolute(*below));
  }
  require(*iri::decode(iri::encode_segment(text)) == text);
  if (const auto decoded = iri::decode(text)) require(decoded->size() <= text.size());

  require(!utf8::find_invalid(http::json_string(text)));
  http::LinkWriter writer(600);
  for (int i = 0; i < 5; ++i) writer.add(text, text);
  http::Fields fields;
  writer.finish(fields, "/rest");
  require(fields.block().size() <= 600);
  for (const http::Field& field : fields.list()) require(field.name == "Link" && is_printable(field.value));
  http::Fields any;
  any.add("X", text);
  require(any.list().size() == 1);

  if (const auto host = http::parse_host(text)) {
    require(!host->host.empty() && text.substr(0, host->host.size()) == host->host);
    require(text.find_first_of(",@/?# ") == std::string_view::npos);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // An exact copy, so that a read past the end is seen.
  const std::string copy(reinterpret_cast<const char*>(data), size);
  const std::string_view head(copy);
  try_value(head);
  if (const auto target = http::split_target(head)) require(!target->path.empty() && (target->path == "*" || target->path.front() == '/'));

  http::Request request;
  http::Framing framing;
  if (const auto refusal = http::parse_request_header(head, request, framing)) {
    check_refusal(*refusal);
    return 0;
  }
  const http::Request plain = parse(head);
  require(request.method == plain.method && request.target == plain.target && request.version == plain.version);
  require(request.fields.size() == plain.fields.size());
  for (std::size_t i = 0; i < plain.fields.size(); ++i)
    require(request.fields[i].name == plain.fields[i].name && request.fields[i].value == plain.fields[i].value);
  require(is_printable(request.method) && is_printable(request.target));
  for (const http::Field& field : request.fields) {
    require(is_printable(field.name));
    for (const char c : field.value) require(static_cast<unsigned char>(c) >= ' ' || c == '\t');
    require(field.value.find('\x7F') == std::string_view::npos);
    try_value(field.value);
  }
  require(!framing.chunked || (framing.length == 0 && request.count("Content-Length") == 0));
  require(framing.chunked == (request.count("Transfer-Encoding") == 1));
  require(!framing.expects_continue || request.version == 11);
  require(request.count("Host") == 1 || (request.version == 10 && request.count("Host") == 0));
  require(!request.find("Host") || http::parse_host(*request.find("Host")));
  const auto target = http::split_target(request.target);
  require(target && (target->path != "*" || request.method == "OPTIONS"));
  require(target->absolute == !target->authority.empty());
  if (target->absolute) require(http::parse_host(target->authority).has_value());
  return 0;
}
