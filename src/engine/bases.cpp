#include "src/engine/bases.hpp"

#include <algorithm>
#include <utility>

namespace lrt::engine {

namespace {

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return out;
}

/// In lower case, without the scheme's own port.
std::string canonical_host(std::string_view authority, bool secure) {
  std::string host = lower(authority);
  const std::string_view port = secure ? ":443" : ":80";
  if (host.size() > port.size() && host.compare(host.size() - port.size(), std::string::npos, port) == 0)
    host.resize(host.size() - port.size());
  if (!host.empty() && host.back() == ':') host.pop_back();
  return host;
}

constexpr std::string_view scheme(bool secure) noexcept { return secure ? "https://" : "http://"; }

bool is_loopback_name(std::string_view host) noexcept { return host == "localhost" || host == "127.0.0.1" || host == "[::1]"; }

}  // namespace

Bases::Bases(std::string public_base, std::vector<std::string> allowed_hosts)
    : public_base_(std::move(public_base)), allowed_(std::move(allowed_hosts)) {
  listens_on("127.0.0.1", 80, false);
}

void Bases::listens_on(std::string_view address, std::uint16_t port, bool secure) {
  const std::string suffix = ":" + std::to_string(port);
  const std::string numeric =
      address.find(':') == std::string_view::npos ? std::string(address) : "[" + std::string(address) + "]";
  port_ = port;
  hosts_.clear();
  const auto accept = [&](std::string_view host) {
    std::string canonical = canonical_host(host, secure);
    if (!accepts(canonical)) hosts_.push_back(std::move(canonical));
  };
  for (const std::string& host : {numeric, std::string("localhost"), std::string("127.0.0.1"), std::string("[::1]")})
    accept(host + suffix);
  for (const std::string& named : allowed_) {
    const auto parsed = http::parse_host(named);
    accept(named + (parsed && !parsed->port ? suffix : ""));
  }
  bases_.clear();
  served_.clear();
  intern(public_base_.empty() ? std::string(scheme(secure)) + hosts_.front() : public_base_, true);
}

bool Bases::accepts(const std::string& host) const { return std::find(hosts_.begin(), hosts_.end(), host) != hosts_.end(); }

bool Bases::is_known_name(std::string_view host) const {
  return is_loopback_name(host) ||
         std::any_of(allowed_.begin(), allowed_.end(), [&](const std::string& named) { return http::iequals(named, host); });
}

Result<std::size_t> Bases::of(const http::Request& request, const http::Target& target) {
  if (const std::uint16_t port = request.local_port;
      port != 0 && std::find(guest_ports_.begin(), guest_ports_.end(), port) == guest_ports_.end())
    guest_ports_.push_back(port);
  if (!public_base_.empty()) return std::size_t{0};
  std::string_view authority = target.absolute ? target.authority : request.find("Host").value_or(std::string_view());
  std::string listening;
  if (authority.empty()) {  // HTTP/1.0 without Host: the listening address
    if (request.local_port == 0) return std::size_t{0};
    listening = "127.0.0.1:" + std::to_string(request.local_port);
    authority = listening;
  }
  // The usual case first: a base that is known.
  const std::string_view start = scheme(request.secure);
  const std::size_t host_end = start.size() + authority.size();
  for (std::size_t i = 0; i < bases_.size(); ++i) {
    const std::string_view base = bases_[i];
    if (served_[i] && base.size() == host_end + request.mount.size() && base.substr(0, start.size()) == start &&
        base.substr(start.size(), authority.size()) == authority && base.substr(host_end) == request.mount)
      return i;
  }
  const std::string host = canonical_host(authority, request.secure);
  bool known = accepts(host);
  if (!known && request.local_port != 0) {
    // Behind a host's own HTTP server: its port instead of ours.
    const auto parsed = http::parse_host(host);
    const std::uint16_t port = parsed && parsed->port ? *parsed->port : request.secure ? 443 : 80;
    known = parsed && port == request.local_port && is_known_name(parsed->host);
  }
  if (!known) return unexpected(Errc::refused, "this server does not answer for the host \"" + host + "\"");
  return intern(std::string(start) + host + std::string(request.mount), true);
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

std::string_view Bases::origin(std::size_t number) const {
  const std::string_view base = bases_[number];
  return base.substr(0, base.find('/', base.find("://") + 3));
}

std::optional<std::string> Bases::path_of(std::string_view iri) const {
  std::string_view path;
  for (const std::string& base : bases_)
    if (iri.size() > base.size() && iri.compare(0, base.size(), base) == 0 && iri[base.size()] == '/' &&
        (path.empty() || iri.size() - base.size() < path.size()))  // the longest: one base can be a prefix of another
      path = iri.substr(base.size());
  if (path.empty()) {
    const auto target = http::split_target(iri);
    if (!target || !target->absolute || !target->query.empty() || !accepts(std::string(target->authority))) return std::nullopt;
    path = target->path;
  }
  if (path.find_first_of("?#") != std::string_view::npos) return std::nullopt;
  return std::string(path);
}

bool Bases::is_this_server(const subscription::CallbackUrl& url) const {
  const bool is_this_machine = url.host == "localhost" || url.host == "[::1]" || url.host.compare(0, 4, "127.") == 0;
  const bool is_guest_port = std::find(guest_ports_.begin(), guest_ports_.end(), url.port) != guest_ports_.end();
  return (is_this_machine && url.port == port_) || (is_guest_port && (is_this_machine || is_known_name(url.host))) ||
         accepts(url.authority) || accepts(url.host + ":" + std::to_string(url.port));
}

}  // namespace lrt::engine
