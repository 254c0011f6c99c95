// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>
#include <sys/uio.h>

#include <cstddef>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include <lrt/base/result.hpp>
#include <lrt/transport/transport.hpp>

struct bio_st;
struct ssl_st;
struct ssl_ctx_st;

namespace lrt::transport {

/// The server's side of TLS on one socket that does not block, to be used in place of recv() and sendmsg().
///
/// OpenSSL writes to memory. Its output is collected and sent by one send(). The rest waits in a buffer (at most
/// `chunk_bytes` of a message). No call of OpenSSL waits for the socket, so none must be repeated with the same arguments.
///
/// @par Implements  R0.2
class TlsStream {
 public:
  /// Encrypted at once; the next bytes are encrypted when the socket has taken these.
  static constexpr std::size_t chunk_bytes = 32 * 1024;

  /// @param scratch  ciphertext during a call, shared by the streams of one thread
  TlsStream(ssl_ctx_st* context, int descriptor, std::string& scratch);
  ~TlsStream();
  TlsStream(const TlsStream&) = delete;
  TlsStream& operator=(const TlsStream&) = delete;

  /// Receives like recv(): returns the bytes, 0 at the end, or -1 with errno. The end may come with or without close_notify: the framing shows
  /// whether bytes are missing. EAGAIN: no more bytes are available. EPROTO: TLS failed; an alert states the reason.
  ssize_t receive(char* to, std::size_t size);
  /// Sends like sendmsg(): returns the bytes, or -1 with errno. EAGAIN: the socket accepts no more now. EINPROGRESS: the handshake waits for
  /// the client. The next call must begin with the bytes that were not sent.
  ssize_t send(const iovec* parts, std::size_t count);
  /// Sends ciphertext that the socket has not taken. -1 with errno EAGAIN: not all of it.
  int flush();
  /// Sends close_notify as far as the socket takes it, once.
  void end() noexcept;

  /// The handshake is complete.
  bool is_open() const noexcept { return open_; }
  /// The client began with something other than TLS that looks like HTTP; nothing was sent.
  bool is_plain() const noexcept { return plain_; }
  /// receive() may have more bytes that the socket does not report.
  bool has_more() const noexcept { return more_; }
  /// There is ciphertext that the socket has not taken.
  bool owes() const noexcept { return !out_.empty(); }
  /// The client has sent part of a handshake or a record.
  bool is_under_way() const noexcept;
  /// Subject of the verified certificate of the client (RFC 2253); empty: it showed none.
  std::string client_certificate() const;

 private:
  friend struct TlsBio;
  struct End {
    void operator()(ssl_st* ssl) const noexcept;
  };
  ssize_t fail(int result) noexcept;
  bool encrypt(const iovec* parts, std::size_t count);
  bool flush_scratch() noexcept;

  std::unique_ptr<ssl_st, End> ssl_;
  const int descriptor_;
  std::string& scratch_;
  std::string out_;            ///< encrypted, not taken by the socket
  std::size_t encrypted_ = 0;  ///< bytes at the front of what send() gets that are in out_, or were
  bool drained_ = false;       ///< the socket had fewer bytes than the buffer takes
  bool begun_ = false;
  bool open_ = false;
  bool plain_ = false;
  bool more_ = false;
  bool input_ended_ = false;
  bool failed_ = false;
  bool ended_ = false;
};

/// The TLS context for the streams of one transport. It is replaced as a whole.
///
/// @par Threads  make(): one thread. load(): any.
class TlsContext {
 public:
  /// Reads the files; on error nothing changes.
  /// @par Errors  invalid_option: a file is not named; io_error: a file, with the reason
  Result<void> load(const TlsOptions& tls);
  /// nullptr: no memory.
  std::unique_ptr<TlsStream> make(int descriptor);

 private:
  std::mutex loading_;  ///< the last call takes effect
  std::mutex mutex_;    ///< guards context_
  std::shared_ptr<ssl_ctx_st> context_;
  std::string scratch_;
};

}  // namespace lrt::transport
