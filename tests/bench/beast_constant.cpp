// SPDX-License-Identifier: Apache-2.0
// The yardstick for the transport http: Boost.Beast answering every request with the same bytes.
//
//   beast_constant [--port 0] [--size 600 (of the body) | --total BYTES (with the head)] [--tls DIR]
//
// One thread, one io_context, Beast's parser and serializer, no time-outs; the message is made once. DIR has server.pem and
// server-key.pem. Ends on SIGINT or SIGTERM.

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/ssl.hpp>
#include <boost/beast/version.hpp>

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

namespace {

namespace beast = boost::beast;
namespace http = beast::http;
namespace net = boost::asio;
using Executor = net::io_context::executor_type;  // not any_io_executor: it is known, so calls of it are inlined
using Socket = net::basic_stream_socket<net::ip::tcp, Executor>;
using Acceptor = net::basic_socket_acceptor<net::ip::tcp, Executor>;
using Tls = beast::ssl_stream<Socket>;
using Answer = http::response<http::string_body>;

Answer make_answer(std::size_t size, bool keep_alive) {
  Answer answer{http::status::ok, 11};
  answer.set(http::field::content_type, "text/plain");
  answer.body() = std::string(size, 'x');
  answer.keep_alive(keep_alive);
  answer.prepare_payload();
  return answer;
}

std::size_t bytes_of(const Answer& answer) {
  std::ostringstream text;
  text << answer;
  return text.str().size();
}

struct Answers {
  Answer going_on, last;
};

template <class Stream>
class Session : public std::enable_shared_from_this<Session<Stream>> {
 public:
  Session(Stream stream, const Answers& answers) : stream_(std::move(stream)), answers_(answers) {}
  void start() {
    if constexpr (std::is_same_v<Stream, Tls>) {
      stream_.async_handshake(net::ssl::stream_base::server, [self = this->shared_from_this()](beast::error_code error) {
        if (!error) self->read();
      });
    } else {
      read();
    }
  }

 private:
  void read() {
    parser_.emplace();
    http::async_read(stream_, buffer_, *parser_, [self = this->shared_from_this()](beast::error_code error, std::size_t) {
      if (!error) self->write();
    });
  }
  void write() {
    const Answer& answer = parser_->get().keep_alive() ? answers_.going_on : answers_.last;
    http::async_write(stream_, answer, [self = this->shared_from_this()](beast::error_code error, std::size_t) {
      if (error) return;
      if (self->parser_->get().keep_alive()) return self->read();
      beast::error_code ignored;
      beast::get_lowest_layer(self->stream_).shutdown(net::ip::tcp::socket::shutdown_send, ignored);
    });
  }

  Stream stream_;
  const Answers& answers_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::empty_body>> parser_;
};

struct Server {
  Acceptor acceptor;
  net::ssl::context* tls;
  const Answers& answers;

  void accept() {
    acceptor.async_accept([this](beast::error_code error, Socket socket) {
      if (!error) {
        socket.set_option(net::ip::tcp::no_delay(true));
        if (tls) std::make_shared<Session<Tls>>(Tls(std::move(socket), *tls), answers)->start();
        else std::make_shared<Session<Socket>>(std::move(socket), answers)->start();
      }
      accept();
    });
  }
};

}  // namespace

int main(int argc, char** argv) {
  unsigned short port = 0;
  std::size_t size = 600, total = 0;
  std::string tls_dir;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string_view name = argv[i];
    if (name == "--port") port = static_cast<unsigned short>(std::atoi(argv[i + 1]));
    else if (name == "--size") size = static_cast<std::size_t>(std::atol(argv[i + 1]));
    else if (name == "--total") total = static_cast<std::size_t>(std::atol(argv[i + 1]));
    else if (name == "--tls") tls_dir = argv[i + 1];
    else return std::fprintf(stderr, "usage: beast_constant [--port N] [--size BYTES | --total BYTES] [--tls DIR]\n"), 2;
  }
  if (total > 0) {  // the head has the body's length in it: its digits settle at the second look
    size = total;
    for (int look = 0; look < 2; ++look) size = total - (bytes_of(make_answer(size, true)) - size);
  }
  const Answers answers{make_answer(size, true), make_answer(size, false)};

  net::io_context io(1);
  std::optional<net::ssl::context> tls;
  if (!tls_dir.empty()) {
    tls.emplace(net::ssl::context::tls_server);
    tls->use_certificate_chain_file(tls_dir + "/server.pem");
    tls->use_private_key_file(tls_dir + "/server-key.pem", net::ssl::context::pem);
  }
  Server server{Acceptor(io, {net::ip::address_v4::loopback(), port}), tls ? &*tls : nullptr, answers};
  server.acceptor.listen(net::socket_base::max_listen_connections);
  server.accept();
  net::signal_set signals(io, SIGINT, SIGTERM);
  signals.async_wait([&](beast::error_code, int) { io.stop(); });
  std::printf("listening on http%s://127.0.0.1:%u/\n", tls ? "s" : "", unsigned{server.acceptor.local_endpoint().port()});
  std::fflush(stdout);
  io.run();
}
