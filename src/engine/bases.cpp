// SPDX-License-Identifier: Apache-2.0
#include "src/engine/bases.hpp"

#include <algorithm>
#include <utility>

#include "src/base/ascii.hpp"
#include "src/http/host.hpp"

namespace lrt::engine {

namespace {

using lrt::detail::lower;

/// The authority in lower case, without the default port of the scheme.
std::string canonical_host(std::string_view authority, bool secure) {
  std::string host = lower(authority);
  const std::string_view port = secure ? ":443" : ":80";
  if (host.size() > port.size() && host.compare(host.size() - port.size(), std::string::npos, port) == 0) host.resize(host.size() - port.size());
  if (!host.empty() && host.back() == ':') host.pop_back();
  return host;
}

constexpr std::string_view scheme(bool secure) noexcept { return secure ? "https://" : "http://"; }

Unexpected misdirected(const std::string& host) { return unexpected(Errc::refused, "this server does not serve the host \"" + host + "\""); }

/// No name server can give such a name to another machine (RFC 6761 6.3), so that no page has it by rebinding.
bool is_loopback_name(std::string_view host) {
  constexpr std::string_view below = ".localhost";
  const bool is_below = host.size() > below.size() && host.substr(host.size() - below.size()) == below && http::is_host_name(host);
  return is_below || http::is_this_machine(host);
}

}  // namespace

Bases::Bases(std::string public_base, std::vector<std::string> allowed_hosts, std::size_t max_forwarded)
    : public_base_(std::move(public_base)), allowed_(std::move(allowed_hosts)), max_forwarded_(max_forwarded) {
  if (const auto parts = http::split_target(public_base_); parts && parts->absolute) {
    public_secure_ = parts->secure;
    if (parts->path != "/") public_path_ = parts->path;
    public_hosts_.push_back(canonical_host(parts->authority, public_secure_));
    const auto own = http::parse_host(parts->authority);
    const std::string port = own && own->port ? ":" + std::to_string(*own->port) : std::string();
    for (const std::string& named : allowed_) {
      const auto parsed = http::parse_host(named);
      public_hosts_.push_back(canonical_host(named + (parsed && !parsed->port ? port : ""), public_secure_));
    }
  }
  listens_on("127.0.0.1", 80, false);
}

Result<void> Bases::check() const {
  const auto parts = http::split_target(public_base_);
  if (!public_base_.empty() && (!parts || !parts->absolute || public_base_.find_first_of("?# ") != std::string::npos))
    return unexpected(Errc::invalid_option, "public_base: expected \"https://host/path\" or \"http://host/path\", found \"" + public_base_ + "\"");
  for (const std::string& named : allowed_)
    if (!http::parse_host(named))
      return unexpected(Errc::invalid_option, "allowed_hosts: expected \"name\" or \"name:port\", found \"" + named + "\"");
  return {};
}

void Bases::listens_on(std::string_view address, std::uint16_t port, bool secure, std::string_view name, Upgrades upgrades) {
  const std::string suffix = ":" + std::to_string(port);
  const std::string numeric = address.find(':') == std::string_view::npos ? std::string(address) : "[" + std::string(address) + "]";
  port_ = port;
  upgrades_ = upgrades;
  hosts_.clear();
  const auto accept = [&](std::string_view host) {
    std::string canonical = canonical_host(host, secure);
    if (!accepts(canonical)) hosts_.push_back(std::move(canonical));
  };
  if (!name.empty()) accept(std::string(name) + suffix);
  for (const std::string& host : {numeric, std::string("localhost"), std::string("127.0.0.1"), std::string("[::1]")}) accept(host + suffix);
  for (const std::string& named : allowed_) {
    const auto parsed = http::parse_host(named);
    accept(named + (parsed && !parsed->port ? suffix : ""));
  }
  bases_.clear();
  served_.clear();
  forwarded_.clear();
  replaced_.clear();
  intern(public_base_.empty() ? std::string(scheme(secure)) + hosts_.front() : public_base_, true);
}

bool Bases::accepts(const std::string& host) const { return std::find(hosts_.begin(), hosts_.end(), host) != hosts_.end(); }

bool Bases::accepts_from_proxy(std::string_view authority) const {
  return !public_hosts_.empty() &&
         std::find(public_hosts_.begin(), public_hosts_.end(), canonical_host(authority, public_secure_)) != public_hosts_.end();
}

bool Bases::is_known_name(std::string_view host) const {
  return is_loopback_name(host) ||
         std::any_of(allowed_.begin(), allowed_.end(), [&](const std::string& named) { return http::iequals(named, host); });
}

Result<std::size_t> Bases::of(const http::Request& request, const http::Target& target) {
  if (const std::uint16_t port = request.local_port; port != 0 && std::find(guest_ports_.begin(), guest_ports_.end(), port) == guest_ports_.end())
    guest_ports_.push_back(port);
  std::string_view authority = target.absolute ? target.authority : request.find("Host").value_or(std::string_view());
  std::string listening;
  if (authority.empty()) {  // HTTP/1.0 without Host: the listening address
    if (request.local_port == 0 || !public_base_.empty()) return std::size_t{0};
    listening = "127.0.0.1:" + std::to_string(request.local_port);
    authority = listening;
  }
  if (!public_base_.empty()) {
    if (is_served(authority, request) || is_forwarded(authority, request)) return std::size_t{0};
    return misdirected(canonical_host(authority, request.secure));
  }
  // The usual case first: a known base.
  const std::string_view start = scheme(request.secure);
  const std::size_t host_end = start.size() + authority.size();
  for (std::size_t i = 0; i < bases_.size(); ++i) {
    const std::string_view base = bases_[i];
    if (served_[i] && base.size() == host_end + request.mount.size() && base.substr(0, start.size()) == start &&
        base.substr(start.size(), authority.size()) == authority && base.substr(host_end) == request.mount) {
      for (Forwarded& one : forwarded_)
        if (one.number == i) one.last_use = ++uses_;
      return i;
    }
  }
  std::string host = canonical_host(authority, request.secure);
  const bool served = is_served(authority, request);
  if (!served && !is_forwarded(authority, request)) return misdirected(host);
  std::string base = std::string(start) + host + std::string(request.mount);
  return served ? intern(std::move(base), true) : intern_forwarded(std::move(base), request.local_port != 0);
}

bool Bases::is_forwarded(std::string_view authority, const http::Request& request) const {
  const std::string host = canonical_host(authority, request.secure);
  const auto parsed = http::parse_host(host);
  return parsed && is_loopback_name(parsed->host) && !is_served(authority, request);
}

/// The base that was used last stays longest. If subscriptions and requests in progress hold all of them, the listening address is the base.
std::size_t Bases::intern_forwarded(std::string base, bool is_guest) {
  const std::uint64_t use = ++uses_;
  for (Forwarded& one : forwarded_) {
    if (bases_[one.number] != base) continue;
    one.last_use = use;
    one.is_guest = is_guest;
    return one.number;
  }
  if (std::find(bases_.begin(), bases_.end(), base) != bases_.end()) return intern(std::move(base), true);  // of a restored subscription
  if (forwarded_.size() < max_forwarded_) {
    forwarded_.push_back({intern(std::move(base), true), use, is_guest, std::make_shared<char>()});
    return forwarded_.back().number;
  }
  Forwarded* oldest = nullptr;
  for (Forwarded& one : forwarded_)
    if (one.token.use_count() == 1 && (!oldest || one.last_use < oldest->last_use)) oldest = &one;
  if (!oldest) return 0;
  bases_[oldest->number] = std::move(base);
  oldest->last_use = use;
  oldest->is_guest = is_guest;
  replaced_.push_back(oldest->number);
  return oldest->number;
}

std::size_t Bases::restore(std::string base) {
  const auto parts = http::split_target(base);
  const auto host = parts && parts->absolute ? http::parse_host(parts->authority) : std::nullopt;
  const bool is_known = std::find(bases_.begin(), bases_.end(), base) != bases_.end();
  const bool names_another_port = host && is_loopback_name(host->host) && !accepts(canonical_host(parts->authority, parts->secure));
  if (is_known || !public_base_.empty() || !names_another_port) return intern(std::move(base), false);
  // Nothing is replaced here: what was made for it would be forgotten only with the next request.
  return forwarded_.size() < max_forwarded_ ? intern_forwarded(std::move(base), false) : 0;
}

std::shared_ptr<const void> Bases::hold(std::size_t number) const {
  for (const Forwarded& one : forwarded_)
    if (one.number == number) return one.token;
  return nullptr;
}

std::vector<std::size_t> Bases::take_replaced() { return std::exchange(replaced_, {}); }

bool Bases::is_served(std::string_view authority, const http::Request& request) const {
  if (accepts_from_proxy(authority)) return true;
  const std::string host = canonical_host(authority, request.secure);
  if (accepts(host)) return true;
  if (request.local_port == 0) return false;
  // Requests from a host's own HTTP server have its port instead of ours.
  const auto parsed = http::parse_host(host);
  const std::uint16_t port = parsed && parsed->port ? *parsed->port : request.secure ? 443 : 80;
  return parsed && port == request.local_port && is_known_name(parsed->host);
}

std::size_t Bases::intern(std::string base, bool served) {
  const auto known = std::find(bases_.begin(), bases_.end(), base);
  const auto number = static_cast<std::size_t>(known - bases_.begin());
  if (known == bases_.end()) {
    bases_.push_back(std::move(base));
    served_.push_back(served);
  }
  served_[number] = served_[number] || served;
  return number;
}

Upgrades Bases::upgrades(std::string_view base) const {
  for (const Forwarded& one : forwarded_)
    if (bases_[one.number] == base) return one.is_guest ? Upgrades() : upgrades_;
  if (guest_ports_.empty() || !public_base_.empty()) return upgrades_;
  const auto parts = http::split_target(base);
  const auto host = parts ? http::parse_host(parts->authority) : std::nullopt;
  if (!host) return upgrades_;
  const std::uint16_t port = host->port ? *host->port : parts->secure ? 443 : 80;
  const bool is_guest = port != port_ && std::find(guest_ports_.begin(), guest_ports_.end(), port) != guest_ports_.end();
  return is_guest ? Upgrades() : upgrades_;
}

std::string_view Bases::origin(std::size_t number) const {
  const std::string_view base = bases_[number];
  return base.substr(0, base.find('/', base.find("://") + 3));
}

bool Bases::is_own_origin(std::string_view origin, std::size_t base, const http::Request& request) const {
  const auto host = request.find("Host");
  // Behind a forwarded port another port of this machine can be anything, also a page of another program.
  if (host && is_forwarded(*host, request)) return http::iequals(origin, std::string(scheme(request.secure)) + canonical_host(*host, request.secure));
  if (http::iequals(origin, this->origin(base))) return true;
  if (public_base_.empty() || !host) return false;
  const auto is_at = [&](bool secure) { return http::iequals(origin, std::string(scheme(secure)) + canonical_host(*host, secure)); };
  return (accepts_from_proxy(*host) && is_at(public_secure_)) || (accepts(canonical_host(*host, request.secure)) && is_at(request.secure));
}

std::optional<std::string_view> Bases::below_public_path(std::string_view path) const {
  if (path.substr(0, public_path_.size()) != public_path_) return std::nullopt;
  path.remove_prefix(public_path_.size());
  if (path.empty() || path.front() != '/') return std::nullopt;
  return path;
}

std::optional<std::string> Bases::path_of(std::string_view iri) const {
  std::string_view path;
  for (const std::string& base : bases_)
    if (iri.size() > base.size() && iri.compare(0, base.size(), base) == 0 && iri[base.size()] == '/' &&
        (path.empty() || iri.size() - base.size() < path.size()))  // the longest: one base can be a prefix of another
      path = iri.substr(base.size());
  if (path.empty()) {
    const auto target = http::split_target(iri);
    if (!target || !target->absolute || !target->query.empty()) return std::nullopt;
    if (const auto below = below_public_path(target->path); below && accepts_from_proxy(target->authority)) path = *below;
    else if (accepts(std::string(target->authority))) path = target->path;
    else return std::nullopt;
  }
  if (path.find_first_of("?#") != std::string_view::npos) return std::nullopt;
  return std::string(path);
}

bool Bases::is_this_server(const subscription::CallbackUrl& url) const {
  const bool is_this_machine = url.host == "localhost" || url.host == "[::1]" || url.host.compare(0, 4, "127.") == 0;
  const bool is_guest_port = std::find(guest_ports_.begin(), guest_ports_.end(), url.port) != guest_ports_.end();
  if (url.secure == public_secure_ && accepts_from_proxy(url.authority) && below_public_path(url.target.substr(0, url.target.find('?')))) return true;
  return (is_this_machine && url.port == port_) || (is_guest_port && (is_this_machine || is_known_name(url.host))) || accepts(url.authority) ||
         accepts(url.host + ":" + std::to_string(url.port));
}

}  // namespace lrt::engine
