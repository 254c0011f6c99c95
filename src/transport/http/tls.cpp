// SPDX-License-Identifier: Apache-2.0
#include "src/transport/http/tls.hpp"

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstdio>
#include <cstring>
#include <utility>

#include "src/base/third_party_call.hpp"

namespace lrt::transport {
namespace {

/// The limit of unsent bytes for a client that does not read. Above it the connection is closed.
constexpr std::size_t max_owed = 128 * 1024;
/// Bytes of one TLS record.
constexpr std::size_t record_bytes = 16 * 1024;
constexpr std::size_t kept_scratch = 64 * 1024;

std::string last_error(const std::string& fallback) {
  const unsigned long code = ERR_peek_last_error();
  const char* const words = code != 0 ? ERR_reason_error_string(code) : nullptr;
  ERR_clear_error();
  return words != nullptr ? words : fallback;
}

}  // namespace

/// The BIO of OpenSSL. It reads from the socket, and writes to memory only, see TlsStream.
struct TlsBio {
  static TlsStream& owner(BIO* bio) { return *static_cast<TlsStream*>(BIO_get_data(bio)); }

  static int read(BIO* bio, char* to, int size) {
    auto& stream = owner(bio);
    BIO_clear_retry_flags(bio);
    if (stream.drained_) return BIO_set_retry_read(bio), -1;
    ssize_t got = 0;
    do got = ::recv(stream.descriptor_, to, static_cast<std::size_t>(size), 0);
    while (got < 0 && errno == EINTR);
    if (got < 0) {
      if (errno == EAGAIN || errno == EWOULDBLOCK) BIO_set_retry_read(bio);
      return -1;
    }
    if (got == 0) stream.input_ended_ = true;
    stream.drained_ = got < size;
    if (got > 0 && !std::exchange(stream.begun_, true)) {
      // A handshake begins with byte 22 (RFC 8446 5.1), a request with a letter or an empty line, which is ignored (RFC 9112 2.2).
      const char first = *to;
      stream.plain_ = (first >= 'A' && first <= 'Z') || (first >= 'a' && first <= 'z') || first == '\r' || first == '\n';
      if (stream.plain_) return -1;
    }
    return static_cast<int>(got);
  }
  static int write(BIO* bio, const char* from, int size) {
    BIO_clear_retry_flags(bio);
    owner(bio).scratch_.append(from, static_cast<std::size_t>(size));
    return size;
  }
  static long control(BIO*, int command, long, void*) { return command == BIO_CTRL_FLUSH ? 1 : 0; }
  static int create(BIO* bio) {
    BIO_set_init(bio, 1);
    return 1;
  }

  static const BIO_METHOD* method() {
    // Made once and never freed: streams of any transport may live until the end of the process.
    static const BIO_METHOD* const made = [] {
      BIO_METHOD* const method = BIO_meth_new(BIO_get_new_index() | BIO_TYPE_SOURCE_SINK, "lrt");
      if (method == nullptr) return method;
      BIO_meth_set_read(method, &read);
      BIO_meth_set_write(method, &write);
      BIO_meth_set_ctrl(method, &control);
      BIO_meth_set_create(method, &create);
      return method;
    }();
    return made;
  }
};

// ----------------------------------------------------------------------------------------------------------------- stream

void TlsStream::End::operator()(ssl_st* ssl) const noexcept {
  if (const ThirdPartyCall call; call) SSL_free(ssl);
}

TlsStream::TlsStream(ssl_ctx_st* context, int descriptor, std::string& scratch) : descriptor_(descriptor), scratch_(scratch) {
  const ThirdPartyCall call;
  if (!call) throw std::bad_alloc();  // the process ends
  ssl_.reset(SSL_new(context));
  const BIO_METHOD* const method = TlsBio::method();
  BIO* const bio = method != nullptr ? BIO_new(method) : nullptr;
  if (!ssl_ || bio == nullptr) {
    BIO_free(bio);
    ERR_clear_error();
    throw std::bad_alloc();
  }
  BIO_set_data(bio, this);
  SSL_set_bio(ssl_.get(), bio, bio);
  SSL_set_accept_state(ssl_.get());
}

TlsStream::~TlsStream() = default;

/// The error as errno. OpenSSL's error queue belongs to the host's thread, and is therefore left empty.
ssize_t TlsStream::fail(int result) noexcept {
  const int why = SSL_get_error(ssl_.get(), result);
  ERR_clear_error();
  if (why == SSL_ERROR_WANT_READ) return errno = EAGAIN, -1;
  if (why == SSL_ERROR_ZERO_RETURN) return 0;
  if (input_ended_ && open_) return 0;
  failed_ = true;
  return errno = EPROTO, -1;
}

ssize_t TlsStream::receive(char* to, std::size_t size) {
  const ThirdPartyCall call;
  if (failed_ || !call) return errno = EPROTO, -1;
  drained_ = more_ = false;
  std::size_t filled = 0;
  ssize_t result = 0;
  while (filled < size) {
    ERR_clear_error();
    std::size_t got = 0;
    const int done = SSL_read_ex(ssl_.get(), to + filled, size - filled, &got);
    if (done != 1) {
      result = fail(done);
      break;
    }
    filled += got;
  }
  open_ = open_ || SSL_is_init_finished(ssl_.get()) != 0;
  const int error = errno;
  if (plain_) scratch_.clear();
  const bool taken = flush_scratch();
  if (filled > 0) {
    // The next call returns an end or a failure that came with the bytes.
    more_ = filled == size || result == 0 || error != EAGAIN;
    return static_cast<ssize_t>(filled);
  }
  if (result < 0 && error == EAGAIN && (!taken || out_.size() > max_owed)) failed_ = true;
  return errno = failed_ ? EPROTO : error, result;
}

ssize_t TlsStream::send(const iovec* parts, std::size_t count) {
  const ThirdPartyCall call;
  if (failed_ || !call) return errno = EPROTO, -1;
  if (!open_) return errno = EINPROGRESS, -1;
  std::size_t before = out_.size();
  bool good = flush() == 0 || errno == EAGAIN || errno == EWOULDBLOCK;
  if (good && out_.empty() && encrypted_ == 0) {
    if (!encrypt(parts, count)) return errno = EPROTO, -1;
    before = scratch_.size();
    good = flush_scratch();
  }
  if (!good) return failed_ = true, errno = EPIPE, -1;
  // Sent ciphertext is reported as sent text, to show that the client reads. The last byte is reported at the end.
  const std::size_t sent = out_.empty() ? encrypted_ : std::min(before - out_.size(), encrypted_ > 0 ? encrypted_ - 1 : 0);
  encrypted_ -= sent;
  if (sent == 0) return errno = EAGAIN, -1;
  return static_cast<ssize_t>(sent);
}

/// Up to chunk_bytes, into the scratch.
bool TlsStream::encrypt(const iovec* parts, std::size_t count) {
  for (std::size_t i = 0; i < count && encrypted_ < chunk_bytes; ++i) {
    const auto* from = static_cast<const char*>(parts[i].iov_base);
    for (std::size_t left = std::min(parts[i].iov_len, chunk_bytes - encrypted_); left > 0;) {
      ERR_clear_error();
      std::size_t put = 0;
      if (SSL_write_ex(ssl_.get(), from, std::min(left, record_bytes), &put) != 1) {
        // Writing never waits, so this is a failure: of memory, or after one of reading.
        ERR_clear_error();
        scratch_.clear();
        failed_ = true;
        return false;
      }
      from += put;
      left -= put;
      encrypted_ += put;
    }
  }
  return true;
}

int TlsStream::flush() {
  while (!out_.empty()) {
    const auto sent = ::send(descriptor_, out_.data(), out_.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0) return -1;
    out_.erase(0, static_cast<std::size_t>(sent));
  }
  std::string().swap(out_);
  return 0;
}

/// Sends what OpenSSL has written; the rest is kept. False when the connection is broken.
bool TlsStream::flush_scratch() noexcept {
  std::size_t taken = 0;
  bool broken = false;
  if (out_.empty()) {
    while (taken < scratch_.size()) {
      const auto sent = ::send(descriptor_, scratch_.data() + taken, scratch_.size() - taken, MSG_NOSIGNAL);
      if (sent < 0 && errno == EINTR) continue;
      if (sent < 0) {
        broken = errno != EAGAIN && errno != EWOULDBLOCK;
        break;
      }
      taken += static_cast<std::size_t>(sent);
    }
  }
  if (!broken) out_.append(scratch_, taken, std::string::npos);
  if (scratch_.capacity() > kept_scratch) std::string().swap(scratch_);
  else scratch_.clear();
  // Further records would not be readable without those that were lost.
  failed_ = failed_ || broken;
  return !broken;
}

void TlsStream::end() noexcept {
  const ThirdPartyCall call;
  if (!call || std::exchange(ended_, true) || failed_ || !open_ || flush() != 0) return;
  ERR_clear_error();
  SSL_shutdown(ssl_.get());  // an alert, and no waiting for the client's
  ERR_clear_error();
  flush_scratch();
}

bool TlsStream::is_under_way() const noexcept { return (begun_ && !open_) || more_ || SSL_has_pending(ssl_.get()) == 1; }

std::string TlsStream::client_certificate() const {
  const ThirdPartyCall call;
  if (!call) return {};
  const std::unique_ptr<X509, void (*)(X509*)> certificate(SSL_get_peer_certificate(ssl_.get()), X509_free);
  if (!certificate || SSL_get_verify_result(ssl_.get()) != X509_V_OK) return {};
  const std::unique_ptr<BIO, int (*)(BIO*)> text(BIO_new(BIO_s_mem()), BIO_free);
  if (!text || X509_NAME_print_ex(text.get(), X509_get_subject_name(certificate.get()), 0, XN_FLAG_RFC2253) < 0) return {};
  char* data = nullptr;
  const long size = BIO_get_mem_data(text.get(), &data);
  return size > 0 ? std::string(data, static_cast<std::size_t>(size)) : std::string();
}

// ------------------------------------------------------------------------------------------------------------------- port

namespace {

/// Only http/1.1 is supported. A client that offers only h2 gets the alert no_application_protocol
/// (RFC 7301 3.2).
int choose_protocol(SSL*, const unsigned char** chosen, unsigned char* size, const unsigned char* offered, unsigned offered_size, void*) {
  static constexpr std::string_view ours = "http/1.1";
  for (std::string_view list(reinterpret_cast<const char*>(offered), offered_size); !list.empty();) {
    const auto name = list.substr(1, static_cast<unsigned char>(list.front()));
    if (name == ours) {
      *chosen = reinterpret_cast<const unsigned char*>(name.data());
      *size = static_cast<unsigned char>(name.size());
      return SSL_TLSEXT_ERR_OK;
    }
    list.remove_prefix(std::min(list.size(), name.size() + 1));
  }
  return SSL_TLSEXT_ERR_ALERT_FATAL;
}

/// Replaces the password callback of OpenSSL, which prompts on the terminal.
int no_passphrase(char*, int, int, void* needed) {
  *static_cast<bool*>(needed) = true;
  return 0;
}

Result<void> check_readable(const char* what, const std::string& path) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "re"), std::fclose);
  char byte = 0;
  if (file && (std::fread(&byte, 1, 1, file.get()) == 1 || std::ferror(file.get()) == 0)) return {};
  return unexpected(Errc::io_error, std::string(what) + " \"" + path + "\": " + std::strerror(errno));
}

Result<std::shared_ptr<ssl_ctx_st>> make_context(const TlsOptions& tls) {
  if (tls.certificate_file.empty()) return unexpected(Errc::invalid_option, "tls.certificate_file: no file is named");
  if (tls.key_file.empty()) return unexpected(Errc::invalid_option, "tls.key_file: no file is named");
  if (tls.require_client_certificate && tls.client_ca_file.empty())
    return unexpected(Errc::invalid_option, "tls.require_client_certificate needs tls.client_ca_file");

  const auto failed = [](const char* what, const std::string& path, const std::string& reason) {
    return unexpected(Errc::io_error, std::string(what) + " \"" + path + "\": " + reason);
  };
  // The first error names the reason, the last one only the part of OpenSSL that reported it.
  const auto pem_error = [](const char* expected) {
    std::string first;
    bool no_pem = false;
    while (const unsigned long code = ERR_get_error()) {
      const int library = ERR_GET_LIB(code), reason = ERR_GET_REASON(code);
      no_pem |= library == ERR_LIB_PEM && reason == PEM_R_NO_START_LINE;
#ifdef X509_R_NO_CERTIFICATE_OR_CRL_FOUND
      no_pem |= library == ERR_LIB_X509 && reason == X509_R_NO_CERTIFICATE_OR_CRL_FOUND;
#endif
#ifdef ERR_LIB_OSSL_DECODER
      no_pem |= library == ERR_LIB_OSSL_DECODER;  // OpenSSL 3: nothing that it knows
#endif
      const char* const words = ERR_reason_error_string(code);
      if (first.empty() && words != nullptr) first = words;
    }
    return no_pem || first.empty() ? std::string("expected ") + expected + " in PEM" : first;
  };
  ERR_clear_error();
  const ThirdPartyCall call;
  if (!call) return unexpected(Errc::closed, "the process is exiting");
  std::shared_ptr<ssl_ctx_st> made(SSL_CTX_new(TLS_server_method()), [](ssl_ctx_st* context) {
    if (const ThirdPartyCall in_time; in_time) SSL_CTX_free(context);
  });
  [[maybe_unused]] static const bool closes = ThirdPartyCall::close_at_exit();
  SSL_CTX* const context = made.get();
  if (context == nullptr) return unexpected(Errc::io_error, "TLS: " + last_error("no context"));
  SSL_CTX_set_min_proto_version(context, TLS1_2_VERSION);
  // With TLS 1.2: forward secrecy and authenticated encryption (RFC 9325 4.2).
  if (SSL_CTX_set_cipher_list(context, "ECDHE+AESGCM:ECDHE+CHACHA20") != 1) return unexpected(Errc::io_error, "TLS: " + last_error("no ciphers"));
  SSL_CTX_set_options(context, SSL_OP_NO_COMPRESSION | SSL_OP_NO_RENEGOTIATION);
  SSL_CTX_set_mode(context, SSL_MODE_RELEASE_BUFFERS | SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER);
  SSL_CTX_set_read_ahead(context, 1);                           // one recv() for a record and its header
  SSL_CTX_set_session_cache_mode(context, SSL_SESS_CACHE_OFF);  // tickets need no memory here
  static constexpr unsigned char name[] = "lrt";
  SSL_CTX_set_session_id_context(context, name, sizeof name - 1);  // without it sessions with client certificates do not resume
  SSL_CTX_set_alpn_select_cb(context, &choose_protocol, nullptr);

  constexpr const char* certificate = "TLS certificate";
  constexpr const char* key = "TLS key";
  constexpr const char* authorities = "TLS authorities of clients";
  if (auto readable = check_readable(certificate, tls.certificate_file); !readable) return Unexpected{std::move(readable).error()};
  if (SSL_CTX_use_certificate_chain_file(context, tls.certificate_file.c_str()) != 1)
    return failed(certificate, tls.certificate_file, pem_error("a certificate"));

  if (auto readable = check_readable(key, tls.key_file); !readable) return Unexpected{std::move(readable).error()};
  bool encrypted = false;
  SSL_CTX_set_default_passwd_cb(context, &no_passphrase);
  SSL_CTX_set_default_passwd_cb_userdata(context, &encrypted);
  const bool has_key = SSL_CTX_use_PrivateKey_file(context, tls.key_file.c_str(), SSL_FILETYPE_PEM) == 1;
  SSL_CTX_set_default_passwd_cb_userdata(context, nullptr);
  SSL_CTX_set_default_passwd_cb(context, nullptr);
  if (encrypted) return ERR_clear_error(), failed(key, tls.key_file, "it is encrypted; expected one without a passphrase");
  const bool mismatch =
      !has_key && ERR_GET_REASON(ERR_peek_last_error()) == X509_R_KEY_VALUES_MISMATCH && ERR_GET_LIB(ERR_peek_last_error()) == ERR_LIB_X509;
  if (mismatch || (has_key && SSL_CTX_check_private_key(context) != 1))
    return ERR_clear_error(), failed(key, tls.key_file, "it does not belong to the certificate in \"" + tls.certificate_file + "\"");
  if (!has_key) return failed(key, tls.key_file, pem_error("a private key"));

  if (!tls.client_ca_file.empty()) {
    if (auto readable = check_readable(authorities, tls.client_ca_file); !readable) return Unexpected{std::move(readable).error()};
    if (SSL_CTX_load_verify_locations(context, tls.client_ca_file.c_str(), nullptr) != 1)
      return failed(authorities, tls.client_ca_file, pem_error("certificates"));
    SSL_CTX_set_client_CA_list(context, SSL_load_client_CA_file(tls.client_ca_file.c_str()));
    SSL_CTX_set_verify(context, SSL_VERIFY_PEER | (tls.require_client_certificate ? SSL_VERIFY_FAIL_IF_NO_PEER_CERT : 0), nullptr);
  }
  ERR_clear_error();
  return made;
}

}  // namespace

Result<void> TlsContext::load(const TlsOptions& tls) {
  const std::lock_guard loading(loading_);
  auto made = make_context(tls);
  if (!made) return Unexpected{std::move(made).error()};
  auto context = *std::move(made);
  const std::lock_guard lock(mutex_);
  context_.swap(context);
  return {};
}

std::unique_ptr<TlsStream> TlsContext::make(int descriptor) {
  std::shared_ptr<ssl_ctx_st> context;
  {
    const std::lock_guard lock(mutex_);
    context = context_;
  }
  try {
    return context ? std::make_unique<TlsStream>(context.get(), descriptor, scratch_) : nullptr;
  } catch (const std::bad_alloc&) { return nullptr; }
}

}  // namespace lrt::transport
