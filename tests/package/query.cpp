// SPDX-License-Identifier: Apache-2.0
// A host of lrt::query: a robot that answers a question.
#include <lrt/lrt.hpp>
#include <lrt/query.hpp>
#include <lrt/served.hpp>

int main() {
  lrt::Options options;
  options.listen.port = 0;
  options.query = lrt::query::endpoint();
  lrt::Server server = lrt::Server::create(options).value();
  const std::string host = "127.0.0.1:" + std::to_string(server.port());
  lrt::http::Request request;
  request.method = "GET";
  request.target = "/sparql?query=ASK%7B%7D";
  request.fields = {{"Host", host}};
  return server.serve(request).response.content().find("true") == std::string_view::npos ? 1 : 0;
}
