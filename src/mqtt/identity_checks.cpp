// SPDX-License-Identifier: Apache-2.0
#include "src/mqtt/identity_checks.hpp"

#include <algorithm>
#include <cstdint>

#include <lrt/base/clock.hpp>

#include "src/base/quote.hpp"
#include "src/mqtt/topics.hpp"
#include "src/rdf/json_parse.hpp"
#include "src/security/certificate.hpp"

namespace lrt::mqtt {
inline namespace v0 {

namespace {

constexpr std::chrono::hours soon{14 * 24};

/// A base that differs with each port: nobody links to it.
bool is_of_this_machine(std::string_view base) noexcept {
  const std::size_t host = base.find("://");
  if (host == std::string_view::npos) return false;
  const std::string_view rest = base.substr(host + 3);
  for (const std::string_view name : {"127.", "localhost", "[::1]"})
    if (rest.substr(0, name.size()) == name) return true;
  return false;
}

/// A time without a part of a second, as certificates have them.
std::string time_of(std::chrono::system_clock::time_point time) {
  const std::string text = to_xsd_date_time(time);
  return text.substr(0, text.find('.')) + "Z";
}

std::string in_brackets(std::string_view iri) { return "<" + shortened(iri, 200) + ">"; }

}  // namespace

std::string without_identity() {
  return "a robot at a broker needs a name that stays when its address changes: write options.identity.iri = \"https://robots.example/r7\"; before "
         "lrt::Server::create(options), or set options.listen.public_base";
}

std::string default_prefix(const Identity& identity) {
  std::string level;
  for (const char c : identity.name()) level += c == '+' ? "%2B" : std::string(1, c);
  return "robots/" + level;
}

std::string client_id_of(const Identity& identity) {
  constexpr std::size_t max_readable = 32;
  constexpr char digits[] = "0123456789abcdef";
  const auto is_plain = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  std::string id = "lrt-";
  for (const char c : identity.name().substr(0, max_readable - id.size())) id += is_plain(c) ? c : '-';
  std::uint64_t hash = 14695981039346656037U;  // FNV-1a
  for (const char c : identity.iri) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211U;
  id += '-';
  for (int shift = 60; shift >= 0; shift -= 4) id += digits[(hash >> shift) & 15];
  return id;
}

StatusText read_status(std::string_view payload) {
  using rdf::json::Document;
  StatusText status;
  rdf::json::Limits limits;
  limits.values = 256;
  limits.depth = 16;
  constexpr std::size_t max_bytes = 64 * 1024;
  if (payload.size() > max_bytes) return status;
  const Result<Document> read = Document::parse(payload, limits);
  if (!read || read->kind(read->root()) != Document::Kind::object) return status;
  const auto text = [&](Document::Id object, std::string_view name) {
    const Document::Id member = read->member(object, name);
    return member != Document::none && read->kind(member) == Document::Kind::string ? std::string(read->text(member)) : std::string();
  };
  status.session = text(read->root(), "session");
  status.base = text(read->root(), "base");
  const Document::Id online = read->member(read->root(), "online"), identity = read->member(read->root(), "identity");
  status.online = online != Document::none && read->kind(online) == Document::Kind::true_;
  status.since = text(read->root(), status.online ? "since" : "onlineSince");
  if (identity != Document::none && read->kind(identity) == Document::Kind::object) status.iri = text(identity, "iri");
  return status;
}

std::string another_robot(const Identity& identity, const std::string& prefix, const StatusText& other) {
  if (other.iri == identity.iri)
    return "another robot is " + in_brackets(identity.iri) + ", too, and publishes as " + prefix +
           " at this broker: give each robot an identity of its own";
  return "another robot" + (other.iri.empty() ? std::string() : ", " + in_brackets(other.iri) + ",") + " publishes as " + prefix +
         " at this broker: each robot needs a prefix of its own";
}

std::string taken_over(const Identity& identity, const std::string& client_id) {
  return "another client has connected as " + quoted(client_id) + ", which is the client id of " + in_brackets(identity.iri) +
         ": two robots have one identity, or one robot has two bridges without broker.client_id";
}

std::string earlier_status(const Identity& identity, const std::string& prefix, const std::string& base, const StatusText& earlier) {
  if (earlier.iri.empty()) return {};
  if (earlier.iri != identity.iri)
    return prefix + " was " + in_brackets(earlier.iri) + " before, and is " + in_brackets(identity.iri) +
           " now: if that robot still exists, each needs a prefix of its own";
  if (earlier.base.empty() || earlier.base == base || (is_of_this_machine(earlier.base) && is_of_this_machine(base))) return {};
  return in_brackets(identity.iri) + " was at " + in_brackets(earlier.base + "/") + " before, and is at " + in_brackets(base + "/") +
         " now: links, graphs in stores and rules with the old IRIs do not lead to it";
}

std::string why_not_connected(const Broker& broker, const std::string& reason, std::chrono::system_clock::time_point now) {
  if (!broker.tls) return {};
  const Tls& tls = *broker.tls;
  if (!tls.certificate_file.empty()) {
    const Result<security::CertificateText> own = security::read_certificate(tls.certificate_file);
    const std::string file = "; the robot's certificate " + tls.certificate_file;
    if (!own) return "; the robot's certificate cannot be read: " + own.error().message;
    if (now > own->to) return file + " has expired at " + time_of(own->to) + ": replace the file, and its key; it is read at the next attempt";
    if (now < own->from) return file + " is valid from " + time_of(own->from) + ", and the robot's clock says " + time_of(now) + ": set the clock";
  }
  if (reason.find("certificate verify failed") == std::string::npos) return {};
  return "; the certificate of " + broker.host + " has expired, does not name this host, or is of no authority in " +
         (tls.ca_file.empty() ? "the system's list" : tls.ca_file);
}

std::string certificate_warning(const Broker& broker, const Identity& identity, const std::string& prefix,
                                std::chrono::system_clock::time_point now) {
  if (!broker.tls || broker.tls->certificate_file.empty()) return {};
  const std::string& file = broker.tls->certificate_file;
  const Result<security::CertificateText> own = security::read_certificate(file);
  if (!own) return "the robot's certificate cannot be read: " + own.error().message + "; the next connection fails";
  if (own->to - now < soon) return "the robot's certificate " + file + " expires at " + time_of(own->to) + ": replace the file, and its key";
  const std::string level = prefix.substr(prefix.rfind('/') + 1);
  const auto has = [](const std::vector<std::string>& all, const std::string& one) { return std::find(all.begin(), all.end(), one) != all.end(); };
  const std::string& cn = own->common_name;
  if (has(own->uris, identity.iri) || cn == identity.iri || (own->uris.empty() && (cn == level || cn == identity.name() || has(own->names, level))))
    return {};
  return "the robot's certificate " + file + " is of " + (own->uris.empty() ? quoted(cn) : in_brackets(own->uris.front())) + ", and this robot is " +
         in_brackets(identity.iri) + ": its broker takes it for another one";
}

}  // namespace v0
}  // namespace lrt::mqtt
