// SPDX-License-Identifier: Apache-2.0
#include <lrt/client.hpp>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "src/base/ascii.hpp"
#include "src/client/http_client.hpp"
#include "src/client/robot_times.hpp"
#include "src/client/session.hpp"
#include "tests/fuzz/round_trip.hpp"

// What a hostile server can do with a client. The input is responses, divided by a byte 0xFF: for each a line with the status, header fields, an empty
// line and a body in Turtle. Response n is that of http://robot.example/n. The client opens /0 and uses all that it finds. Whatever comes, it must not
// send a request to another server, nor more requests than its limits allow.

namespace {

using namespace lrt;
using fuzz::broken;

constexpr std::size_t max_requests = 2'000;

/// Responds from the input instead of a network.
class Scripted final : public client::HttpClient {
 public:
  Scripted(const client::Options& options, std::vector<client::Response> responses) : HttpClient(options), responses_(std::move(responses)) {}

  Result<client::Response> send(const client::Request& request) override {
    const Result<http::Url> url = http::parse_url(request.url);
    if (!url) return unexpected(url.error());
    if (url->origin() != "http://robot.example") broken("a request to another server", request.url);
    if (++requests_ > max_requests) return unexpected(Errc::cancelled, "enough");
    std::size_t number = responses_.size();
    if (url->target.size() == 2 && url->target[1] >= '0' && url->target[1] <= '9') number = static_cast<std::size_t>(url->target[1] - '0');
    client::Response response;
    if (number < responses_.size()) response = responses_[number];
    else response.status = 404;
    response.url = request.url;
    return response;
  }
  Result<std::unique_ptr<exchange::Wire>> connect(const http::Url&, exchange::WaitLimit, bool) override {
    return unexpected(Errc::cancelled, "not here");
  }
  std::vector<std::pair<std::string, std::string>> identity_fields(const http::Url&) override { return {}; }
  bool is_trusted(const http::Url&) const override { return false; }
  void trust(const http::Url&) override {}
  client::RobotTimes& robot_times() noexcept override { return times_; }
  void stop() noexcept override {}
  int stop_descriptor() const noexcept override { return -1; }

 private:
  std::vector<client::Response> responses_;
  client::RobotTimes times_;
  std::size_t requests_ = 0;
};

client::Response response_of(std::string_view text) {
  static const std::string prefixes =
      "@prefix hybrit: <https://hybr-it-projekt.de/ns/hybr-it#> . @prefix vom: <http://vocab.arvida.de/2015/06/vom/vocab#> . "
      "@prefix maths: <http://vocab.arvida.de/2015/06/maths/vocab#> . @prefix ldp: <http://www.w3.org/ns/ldp#> . "
      "@prefix sh: <http://www.w3.org/ns/shacl#> . @prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> . "
      "@prefix dcterms: <http://purl.org/dc/terms/> . @prefix h: <http://www.w3.org/2011/http#> . @prefix m: <http://www.w3.org/2011/http-methods#> "
      ". "
      "@prefix lrt: <https://w3id.org/lrt/ns#> . @prefix ssn: <http://www.w3.org/ns/ssn/> . @prefix qudt: <http://qudt.org/schema/qudt/> .\n";
  client::Response response;
  response.status = 200;
  const std::size_t end = std::min(text.find("\n\n"), text.size());
  std::string_view header = text.substr(0, end);
  bool has_type = false;
  while (!header.empty()) {
    const std::size_t line_end = std::min(header.find('\n'), header.size());
    const std::string_view line = header.substr(0, line_end);
    const std::size_t colon = line.find(':');
    const std::string_view name = line.substr(0, std::min(colon, line.size()));
    const bool is_name = !name.empty() && std::all_of(name.begin(), name.end(), [](char c) { return lrt::detail::is(c, lrt::detail::tchar); });
    if (colon != std::string_view::npos && is_name) {  // as exchange() hands them on
      response.fields.add(line.substr(0, colon), line.substr(colon + 1));
      has_type = has_type || http::iequals(line.substr(0, colon), "Content-Type");
    } else if (line.size() == 3) {
      response.status = (line[0] - '0') * 100 + (line[1] - '0') * 10 + (line[2] - '0');
    }
    header.remove_prefix(std::min(line_end + 1, header.size()));
  }
  if (!has_type) response.fields.add("Content-Type", "text/turtle");
  response.body = prefixes + std::string(text.substr(std::min(end + 2, text.size())));
  return response;
}

void use(const client::Property& property) {
  (void)property.name();
  (void)property.read<double>();
  (void)property.read<std::string>();
  (void)property.read<std::vector<double>>();
  (void)property.unit();
  (void)property.is_writable();
  (void)property.write(1.5);
}

void use(const client::Action& action) {
  (void)action.output_shape();
  (void)action.effects();
  (void)action.consumed_classes();
  (void)action.is_available();
  if (const auto begun = action.invoke(2.5)) {
    (void)begun->state();
    (void)begun->result<double>();
    (void)begun->cancel();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  if (size > 20'000) return 0;
  std::string_view input(reinterpret_cast<const char*>(bytes), size);
  std::vector<client::Response> responses;
  while (responses.size() < 10) {
    const std::size_t end = std::min(input.find('\xFF'), input.size());
    responses.push_back(response_of(input.substr(0, end)));
    if (responses.back().reason().size() > 600) broken("a long reason", responses.back().reason());
    if (end == input.size()) break;
    input.remove_prefix(end + 1);
  }
  client::Options options;
  options.limits.max_triples = 400;
  options.limits.max_resources = 30;
  options.limits.max_depth = 5;
  auto session = std::make_shared<client::Session>(std::make_shared<Scripted>(options, std::move(responses)), options);
  const Result<client::Robot> robot = session->open("http://robot.example/0");
  if (!robot) {
    if (robot.error().message.empty()) broken("an error without a word", std::string(input));
    return 0;
  }
  std::size_t used = 0;
  for (const client::Thing& thing : robot->things()) {
    (void)thing.name();
    for (const client::Property& property : thing.properties())
      if (++used < 20) use(property);
    for (const client::Action& action : thing.actions())
      if (++used < 20) use(action);
  }
  client::ActionQuery query;
  query.affects = "http://robot.example/1";
  (void)robot->actions(query);
  return 0;
}
