// A host of lrt::query: a robot that answers a question.
#include <lrt/lrt.hpp>
#include <lrt/query.hpp>

int main() {
  lrt::Options options;
  options.listen.port = 0;
  options.query = lrt::query::endpoint();
  lrt::Server server = lrt::Server::create(options).value();
  lrt::http::Request request;
  request.method = "GET";
  request.target = "/sparql?query=ASK%7B%7D";
  request.fields = {{"Host", "localhost"}};
  return server.serve(request).response.content().find("true") == std::string_view::npos ? 1 : 0;
}
