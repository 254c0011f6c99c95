#include <lrt/http/message.hpp>

#include <cassert>
#include <cstdint>

#include "src/base/ascii.hpp"

namespace lrt::http {
namespace {

constexpr std::size_t npos = std::string_view::npos;

/// Takes the first line off `block`.
Field take_field(std::string_view& block) noexcept {
  const std::size_t end = block.find("\r\n");
  const std::string_view line = block.substr(0, end);
  block.remove_prefix(end == npos ? block.size() : end + 2);
  const std::size_t colon = line.find(':');
  if (colon == npos) return {line, {}};
  return {line.substr(0, colon), detail::trim(line.substr(colon + 1))};
}

void append_joined(std::string& out, bool& first, std::string_view value) {
  if (!first) out += ", ";
  first = false;
  out += value;
}

void append_number(std::string& out, std::uint64_t value) {
  char digits[20];
  std::size_t at = sizeof digits;
  do {
    digits[--at] = static_cast<char>('0' + value % 10);
    value /= 10;
  } while (value != 0);
  out.append(digits + at, sizeof digits - at);
}

}  // namespace

bool iequals(std::string_view a, std::string_view b) noexcept { return detail::iequals_ascii(a, b); }

std::optional<std::string_view> Request::find(std::string_view name) const noexcept {
  for (const Field& field : fields) {
    if (iequals(field.name, name)) return field.value;
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
  block_ += name;
  block_ += ": ";
  const std::size_t at = block_.size();
  block_ += value;
  for (std::size_t i = at; i < block_.size(); ++i) {
    if (!detail::is(block_[i], detail::text)) block_[i] = ' ';
  }
  block_ += "\r\n";
}

void Fields::set(std::string_view name, std::string_view value) {
  const std::string copy(value);  // may be a view into this object
  remove(name);
  add(name, copy);
}

void Fields::remove(std::string_view name) {
  std::size_t at = 0;
  while (at < block_.size()) {
    std::string_view rest = std::string_view(block_).substr(at);
    const std::size_t before = rest.size();
    const bool hit = iequals(take_field(rest).name, name);
    const std::size_t length = before - rest.size();
    if (hit) block_.erase(at, length);
    else at += length;
  }
}

std::optional<std::string_view> Fields::find(std::string_view name) const noexcept {
  for (std::string_view rest = block_; !rest.empty();) {
    const Field field = take_field(rest);
    if (iequals(field.name, name)) return field.value;
  }
  return std::nullopt;
}

std::string Fields::joined(std::string_view name) const {
  std::string result;
  bool first = true;
  for (std::string_view rest = block_; !rest.empty();) {
    const Field field = take_field(rest);
    if (iequals(field.name, name)) append_joined(result, first, field.value);
  }
  return result;
}

std::vector<Field> Fields::list() const {
  std::vector<Field> result;
  for (std::string_view rest = block_; !rest.empty();) result.push_back(take_field(rest));
  return result;
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
    default: return {};
  }
}

AddedFields added_fields(const Response& response, bool keep_alive, int version) noexcept {
  bool has_date = false;
  bool has_length = false;
  bool has_transfer_encoding = false;
  bool has_upgrade = false;
  for (std::string_view rest = response.fields.block(); !rest.empty();) {
    const std::string_view name = take_field(rest).name;
    has_date = has_date || iequals(name, "Date");
    has_length = has_length || iequals(name, "Content-Length");
    has_transfer_encoding = has_transfer_encoding || iequals(name, "Transfer-Encoding");
    has_upgrade = has_upgrade || iequals(name, "Upgrade");
  }
  AddedFields added;
  added.date = !has_date;
  added.content_length = may_have_body(response.status) && !has_length && !has_transfer_encoding;
  const bool is_final = response.status >= 200;  // an interim response ends nothing
  if (is_final && (!keep_alive || response.close)) added.connection = has_upgrade ? "close, Upgrade" : "close";
  else if (is_final && version == 10) added.connection = has_upgrade ? "keep-alive, Upgrade" : "keep-alive";
  else if (has_upgrade) added.connection = "Upgrade";
  return added;
}

void write_response_header(std::string& out, const Response& response, std::string_view date, bool keep_alive, int version,
                           BodyEnd end) {
  const AddedFields added = added_fields(response, keep_alive, version);
  out += "HTTP/1.1 ";
  append_number(out, static_cast<std::uint64_t>(response.status));
  out += ' ';
  out += reason_phrase(response.status);
  if (added.date) {
    out += "\r\nDate: ";
    out += date;
  }
  if (end == BodyEnd::chunked) out += "\r\nTransfer-Encoding: chunked";
  if (end == BodyEnd::length && added.content_length) {
    out += "\r\nContent-Length: ";
    append_number(out, response.content().size());
  }
  if (!added.connection.empty()) {
    out += "\r\nConnection: ";
    out += added.connection;
  }
  out += "\r\n";
  out += response.fields.block();
  out += "\r\n";
}

}  // namespace lrt::http
