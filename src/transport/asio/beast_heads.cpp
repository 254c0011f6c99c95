#include "src/transport/asio/beast_heads.hpp"

#include <utility>  // before Boost.Asio 1.74, which forgets it in C++20

#include <boost/asio/buffer.hpp>
#include <boost/beast/http/basic_parser.hpp>
#include <string>

namespace lrt::transport {
namespace {

namespace beast = boost::beast;
using beast::error_code;

std::string_view view(beast::string_view text) noexcept { return {text.data(), text.size()}; }

class HeadParser final : public beast::http::basic_parser<true> {
 public:
  explicit HeadParser(http::Request& request) : request_(request) {}

 private:
  void on_request_impl(beast::http::verb, beast::string_view method, beast::string_view target, int version,
                       error_code&) override {
    request_.method = view(method);
    request_.target = view(target);
    request_.version = version;
  }
  void on_field_impl(beast::http::field, beast::string_view name, beast::string_view value, error_code&) override {
    request_.fields.push_back({view(name), view(value)});
  }
  void on_response_impl(int, beast::string_view, int, error_code&) override {}
  void on_header_impl(error_code&) override {}
  void on_body_init_impl(boost::optional<std::uint64_t> const&, error_code&) override {}
  std::size_t on_body_impl(beast::string_view body, error_code&) override { return body.size(); }
  void on_chunk_header_impl(std::uint64_t, beast::string_view, error_code&) override {}
  std::size_t on_chunk_body_impl(std::uint64_t, beast::string_view body, error_code&) override { return body.size(); }
  void on_finish_impl(error_code&) override {}

  http::Request& request_;
};

}  // namespace

std::optional<http::Refusal> parse_head(std::string_view head, http::Request& request) {
  request.fields.clear();
  HeadParser parser(request);
  parser.header_limit(static_cast<std::uint32_t>(head.size()) + 1);
  parser.skip(true);  // the body is not its business
  error_code error;
  const auto used = parser.put(boost::asio::const_buffer(head.data(), head.size()), error);
  if (!error && parser.is_header_done() && used == head.size()) return std::nullopt;
  // Beast judges the fields that frame a body as soon as it meets them, and says little. check_head() says what and where.
  http::split_head(head, request);
  if (auto refusal = http::check_head(request)) return refusal;
  return http::Refusal{400, "the head cannot be parsed: " + error.message() + ", after byte " + std::to_string(used)};
}

}  // namespace lrt::transport
