// SPDX-License-Identifier: Apache-2.0
#include <lrt/http/message.hpp>

#include <array>
#include <cassert>
#include <charconv>
#include <cstdint>

#include "src/base/ascii.hpp"

namespace lrt::http {
inline namespace v0 {
namespace {

/// Takes the first line off `block`.
Field take_field(std::string_view& block) noexcept {
  const std::size_t end = block.find("\r\n");
  const std::string_view line = block.substr(0, end);
  block.remove_prefix(end == std::string_view::npos ? block.size() : end + 2);
  const std::size_t colon = line.find(':');
  if (colon == std::string_view::npos) return {line, {}};
  return {line.substr(0, colon), detail::trim(line.substr(colon + 1))};
}

/// The bit of Fields::Known; 0: the name is not among them.
std::uint8_t known_bit(std::string_view name) noexcept {
  const auto bit = [name](std::string_view known, Fields::Known value) {
    return iequals(name, known) ? static_cast<std::uint8_t>(value) : std::uint8_t{0};
  };
  switch (name.size()) {  // the size rules out most fields
    case 4: return bit("Date", Fields::Known::date);
    case 7: return bit("Upgrade", Fields::Known::upgrade);
    case 14: return bit("Content-Length", Fields::Known::content_length);
    case 17: return bit("Transfer-Encoding", Fields::Known::transfer_encoding);
    case 22: return bit("X-Content-Type-Options", Fields::Known::content_type_options);
    default: return 0;
  }
}

void append_joined(std::string& out, bool& first, std::string_view value) {
  if (!first) out += ", ";
  first = false;
  out += value;
}

/// An IMF-fixdate has 29 bytes.
constexpr std::size_t max_date = 64;

/// The beginning of a response, assembled without a check for each part: status line, Date, one field of framing and
/// Connection have less than 256 bytes.
class Line {
 public:
  void put(std::string_view part) noexcept {
    assert(part.size() <= sizeof bytes_ - size_);
    size_ += part.copy(bytes_ + size_, part.size());  // memcpy() may not have the null pointer of an empty part
  }
  void put_number(std::uint64_t value) noexcept {
    size_ = static_cast<std::size_t>(std::to_chars(bytes_ + size_, bytes_ + sizeof bytes_, value).ptr - bytes_);
  }
  std::string_view text() const noexcept { return {bytes_, size_}; }
  std::size_t size() const noexcept { return size_; }

 private:
  char bytes_[256];
  std::size_t size_ = 0;
};

}  // namespace

bool iequals(std::string_view a, std::string_view b) noexcept { return detail::iequals_ascii(a, b); }

std::optional<std::string_view> Request::find(std::string_view name) const noexcept {
  for (const Field& field : fields) {
    if (detail::iequals_ascii(field.name, name)) return field.value;
  }
  return std::nullopt;
}

std::string Request::joined(std::string_view name) const {
  std::string result;
  bool first = true;
  for (const Field& field : fields) {
    if (iequals(field.name, name)) append_joined(result, first, field.value);
  }
  return result;
}

std::size_t Request::count(std::string_view name) const noexcept {
  std::size_t result = 0;
  for (const Field& field : fields) result += iequals(field.name, name) ? 1 : 0;
  return result;
}

void Fields::add(std::string_view name, std::string_view value) {
  const bool is_token = !name.empty() && detail::token_end(name, 0) == name.size();
  assert(is_token);
  if (!is_token) return;
  value = detail::trim(value);
  std::string& block = changeable();
  block += name;
  block += ": ";
  const std::size_t at = block.size();
  block += value;
  for (std::size_t i = at; i < block.size(); ++i) {
    if (!detail::is(block[i], detail::text)) block[i] = ' ';
  }
  block += "\r\n";
  known_ |= known_bit(name);
}

void Fields::set(std::string_view name, std::string_view value) {
  const std::string copy(value);  // may be a view into this object
  remove(name);
  add(name, copy);
}

void Fields::remove(std::string_view name) {
  if (!find(name)) return;
  std::string& block = changeable();
  std::size_t at = 0;
  while (at < block.size()) {
    std::string_view rest = std::string_view(block).substr(at);
    const std::size_t before = rest.size();
    const bool hit = iequals(take_field(rest).name, name);
    const std::size_t length = before - rest.size();
    if (hit) block.erase(at, length);
    else at += length;
  }
  known_ = static_cast<std::uint8_t>(known_ & ~known_bit(name));
}

void Fields::append(const Fields& other) {
  changeable() += other.block();
  known_ |= other.known_;
}

void Fields::share() {
  if (shared_) return;
  shared_ = std::make_shared<const std::string>(std::move(own_));
  own_.clear();
}

std::string& Fields::changeable() {
  if (shared_) {
    own_ = *shared_;
    shared_.reset();
  }
  return own_;
}

std::optional<std::string_view> Fields::find(std::string_view name) const noexcept {
  for (std::string_view rest = block(); !rest.empty();) {
    const Field field = take_field(rest);
    if (iequals(field.name, name)) return field.value;
  }
  return std::nullopt;
}

std::string Fields::joined(std::string_view name) const {
  std::string result;
  bool first = true;
  for (std::string_view rest = block(); !rest.empty();) {
    const Field field = take_field(rest);
    if (iequals(field.name, name)) append_joined(result, first, field.value);
  }
  return result;
}

std::vector<Field> Fields::list() const {
  std::vector<Field> result;
  for (std::string_view rest = block(); !rest.empty();) result.push_back(take_field(rest));
  return result;
}

std::string_view to_string(Denial denial) noexcept {
  static constexpr std::array<std::string_view, denial_count> names = {
      "", "credentials", "right", "origin", "notification", "receiver", "host", "rate", "invocations", "subscriptions", "late", "control"};
  return names[static_cast<std::size_t>(denial)];
}

std::string_view reason_phrase(int status) noexcept {
  switch (status) {
    case 100: return "Continue";
    case 101: return "Switching Protocols";
    case 200: return "OK";
    case 201: return "Created";
    case 202: return "Accepted";
    case 203: return "Non-Authoritative Information";
    case 204: return "No Content";
    case 205: return "Reset Content";
    case 206: return "Partial Content";
    case 300: return "Multiple Choices";
    case 301: return "Moved Permanently";
    case 302: return "Found";
    case 303: return "See Other";
    case 304: return "Not Modified";
    case 307: return "Temporary Redirect";
    case 308: return "Permanent Redirect";
    case 400: return "Bad Request";
    case 401: return "Unauthorized";
    case 402: return "Payment Required";
    case 403: return "Forbidden";
    case 404: return "Not Found";
    case 405: return "Method Not Allowed";
    case 406: return "Not Acceptable";
    case 407: return "Proxy Authentication Required";
    case 408: return "Request Timeout";
    case 409: return "Conflict";
    case 410: return "Gone";
    case 411: return "Length Required";
    case 412: return "Precondition Failed";
    case 413: return "Content Too Large";
    case 414: return "URI Too Long";
    case 415: return "Unsupported Media Type";
    case 416: return "Range Not Satisfiable";
    case 417: return "Expectation Failed";
    case 421: return "Misdirected Request";
    case 422: return "Unprocessable Content";
    case 426: return "Upgrade Required";
    case 428: return "Precondition Required";            // RFC 6585
    case 429: return "Too Many Requests";                // RFC 6585
    case 431: return "Request Header Fields Too Large";  // RFC 6585
    case 500: return "Internal Server Error";
    case 501: return "Not Implemented";
    case 502: return "Bad Gateway";
    case 503: return "Service Unavailable";
    case 504: return "Gateway Timeout";
    case 505: return "HTTP Version Not Supported";
    case 507: return "Insufficient Storage";
    default: return {};
  }
}

AddedFields added_fields(const Response& response, bool keep_alive, int version) noexcept {
  using Known = Fields::Known;
  const Fields& fields = response.fields;
  const bool has_upgrade = fields.has(Known::upgrade);
  AddedFields added;
  added.date = !fields.has(Known::date);
  added.content_length = may_have_body(response.status) && !fields.has(Known::content_length) && !fields.has(Known::transfer_encoding);
  const bool is_final = response.status >= 200;  // an interim response does not end the exchange
  if (is_final && (!keep_alive || response.close)) added.connection = has_upgrade ? "close, Upgrade" : "close";
  else if (is_final && version == 10) added.connection = has_upgrade ? "keep-alive, Upgrade" : "keep-alive";
  else if (has_upgrade) added.connection = "Upgrade";
  return added;
}

void write_response_header(std::string& out, const Response& response, std::string_view date, bool keep_alive, int version, BodyEnd end,
                           const Fields* more) {
  const AddedFields added = added_fields(response, keep_alive, version);
  Line line;
  line.put("HTTP/1.1 ");
  line.put_number(static_cast<std::uint64_t>(response.status));
  line.put(" ");
  line.put(reason_phrase(response.status));
  if (added.date) {
    line.put("\r\nDate: ");
    line.put(date.substr(0, max_date));
  }
  if (end == BodyEnd::chunked) line.put("\r\nTransfer-Encoding: chunked");
  if (end == BodyEnd::length && added.content_length) {
    line.put("\r\nContent-Length: ");
    line.put_number(response.content().size());
  }
  if (!added.connection.empty()) {
    line.put("\r\nConnection: ");
    line.put(added.connection);
  }
  line.put("\r\n");
  const std::string& block = response.fields.block();
  const std::string_view rest = more ? std::string_view(more->block()) : std::string_view();
  out.reserve(out.size() + line.size() + block.size() + rest.size() + 2);
  out.append(line.text()).append(block).append(rest).append("\r\n", 2);
}

}  // namespace v0
}  // namespace lrt::http
