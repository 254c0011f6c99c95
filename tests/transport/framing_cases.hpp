// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace lrt::test {

/// Bytes of one connection and what becomes of them, whichever way they are split.
struct FramingCase {
  const char* name;
  std::string bytes;
  std::vector<int> statuses;  ///< of all final responses
  bool closes;
};

inline std::vector<FramingCase> framing_cases() {
  using S = std::string;
  const S get = "GET / HTTP/1.1\r\nHost: a\r\n";
  const S post = "POST / HTTP/1.1\r\nHost: a\r\n";
  const S chunked = post + "Transfer-Encoding: chunked\r\n\r\n";
  const S next = "GET / HTTP/1.1\r\nHost: a\r\n\r\n";
  const S most = get + "A: " + S(6000, 'a') + "\r\nB: " + S(6000, 'b') + "\r\nC: ";
  return {
      // Well-formed.
      {"a GET", get + "\r\n", {200}, false},
      {"two pipelined requests", get + "\r\n" + next, {200, 200}, false},
      {"empty lines before a request", "\r\n\r\n" + get + "\r\n\r\n" + next, {200, 200}, false},
      {"a body by Content-Length", post + "Content-Length: 5\r\n\r\nhello" + next, {200, 200}, false},
      {"a Content-Length of 0", post + "Content-Length: 0\r\n\r\n" + next, {200, 200}, false},
      {"PUT without a body", "PUT / HTTP/1.1\r\nHost: a\r\n\r\n" + next, {200, 200}, false},
      {"a chunked body", chunked + "5\r\nhello\r\n6\r\n world\r\n0\r\n\r\n" + next, {200, 200}, false},
      {"chunk sizes in upper case with leading zeros", chunked + "00A\r\n0123456789\r\n000\r\n\r\n" + next, {200, 200}, false},
      {"chunk extensions", chunked + "5;a;b=c;d=\"e \\\" f\"\r\nhello\r\n0;last\r\n\r\n" + next, {200, 200}, false},
      {"trailers", chunked + "5\r\nhello\r\n0\r\nX-Sum: 1\r\nY: \r\n\r\n" + next, {200, 200}, false},
      {"Expect: 100-continue with the body at once", post + "Expect: 100-continue\r\nContent-Length: 2\r\n\r\nhi" + next, {200, 200}, false},
      {"Connection: close ends it", get + "Connection: close\r\n\r\n" + next, {200}, true},
      {"HTTP/1.0 ends it", "GET / HTTP/1.0\r\n\r\n" + next, {200}, true},
      {"HTTP/1.0 with keep-alive", "GET / HTTP/1.0\r\nHost: a\r\nConnection: keep-alive\r\n\r\n" + next, {200, 200}, false},
      {"OPTIONS *", "OPTIONS * HTTP/1.1\r\nHost: a\r\n\r\n", {200}, false},

      // Heads.
      {"no Host", "GET / HTTP/1.1\r\n\r\n" + next, {400}, true},
      {"two Hosts", get + "Host: b\r\n\r\n" + next, {400}, true},
      {"an empty Host", "GET / HTTP/1.1\r\nHost:\r\n\r\n", {400}, true},
      {"a Host with userinfo", "GET / HTTP/1.1\r\nHost: u@a\r\n\r\n", {400}, true},
      {"a Host with a path", "GET / HTTP/1.1\r\nHost: a/b\r\n\r\n", {400}, true},
      {"a Host with a comma", "GET / HTTP/1.1\r\nHost: a, b\r\n\r\n", {400}, true},
      {"obs-fold", get + "X: a\r\n b\r\n\r\n", {400}, true},
      {"a space before the colon", get + "X : a\r\n\r\n", {400}, true},
      {"a bare CR in a value", get + "X: a\rb\r\n\r\n", {400}, true},
      {"a bare LF", get + "X: a\nY: b\r\n\r\n", {400}, true},
      {"bare LFs throughout", "GET / HTTP/1.1\nHost: a\n\n", {400}, true},
      {"an empty line of one LF", "\n" + next, {400}, true},
      {"a NUL in a value", get + "X: a" + S(1, '\0') + "b\r\n\r\n", {400}, true},
      {"a control character in a value", get + "X: a\x01\r\n\r\n", {400}, true},
      {"a field without a colon", get + "X\r\n\r\n", {400}, true},
      {"an empty field name", get + ": a\r\n\r\n", {400}, true},
      {"a lower-case method", "get / HTTP/1.1\r\nHost: a\r\n\r\n", {400}, true},
      {"a fragment in the target", "GET /#a HTTP/1.1\r\nHost: a\r\n\r\n", {400}, true},
      {"a byte above ASCII in the target", "GET /\xc3\xa4 HTTP/1.1\r\nHost: a\r\n\r\n", {400}, true},
      {"an http target", "GET http://a/ HTTP/1.1\r\nHost: a\r\n\r\n" + next, {200, 200}, false},
      {"an https target without TLS", "GET https://a/ HTTP/1.1\r\nHost: a\r\n\r\n" + next, {421}, true},
      {"* with GET", "GET * HTTP/1.1\r\nHost: a\r\n\r\n", {400}, true},
      {"two spaces in the request line", "GET  / HTTP/1.1\r\nHost: a\r\n\r\n", {400}, true},
      {"a later minor version", "GET / HTTP/1.9\r\nHost: a\r\n\r\n" + next, {200, 200}, false},
      {"HTTP/2.0", "GET / HTTP/2.0\r\nHost: a\r\n\r\n", {505}, true},
      {"CONNECT", "CONNECT a:80 HTTP/1.1\r\nHost: a:80\r\n\r\n", {501}, true},
      {"TRACE", "TRACE / HTTP/1.1\r\nHost: a\r\n\r\n", {501}, true},
      {"a TLS client hello", S("\x16\x03\x01\x02", 4), {400}, true},
      {"too many empty lines", "\r\n\r\n\r\n\r\n\r\n\r\n" + next, {400}, true},
      {"an unknown expectation", post + "Expect: a-pony\r\nContent-Length: 1\r\n\r\nx", {417}, true},

      // Framing.
      {"Content-Length with Transfer-Encoding", post + "Content-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n" + next, {400}, true},
      {"two Content-Lengths", post + "Content-Length: 5\r\nContent-Length: 5\r\n\r\nhello", {400}, true},
      {"a list of Content-Lengths", post + "Content-Length: 5, 5\r\n\r\nhello", {400}, true},
      {"a signed Content-Length", post + "Content-Length: +5\r\n\r\nhello", {400}, true},
      {"a hexadecimal Content-Length", post + "Content-Length: 0x5\r\n\r\nhello", {400}, true},
      {"an unknown coding", post + "Transfer-Encoding: gzip\r\n\r\n0\r\n\r\n", {501}, true},
      {"chunked after another coding", post + "Transfer-Encoding: gzip, chunked\r\n\r\n0\r\n\r\n" + next, {501}, true},
      {"chunked before another coding", post + "Transfer-Encoding: chunked, gzip\r\n\r\n0\r\n\r\n", {400}, true},
      {"two fields of chunked", post + "Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n" + next, {400}, true},
      {"two differing Content-Lengths", post + "Content-Length: 5\r\nContent-Length: 6\r\n\r\nhello", {400}, true},
      {"a Content-Length that overflows", post + "Content-Length: 18446744073709551621\r\n\r\nhello", {400}, true},
      {"an empty Content-Length", post + "Content-Length:\r\n\r\nhello", {400}, true},
      {"chunked twice", post + "Transfer-Encoding: chunked, chunked\r\n\r\n0\r\n\r\n", {400}, true},
      {"chunked with a control character",
       post + "Transfer-Encoding: \x0b"
              "chunked\r\n\r\n0\r\n\r\n",
       {400},
       true},
      {"a length above the limit", post + "Content-Length: 1000001\r\n\r\nx", {413}, true},

      // Chunks.
      {"an empty chunk size", chunked + "\r\nhello\r\n0\r\n\r\n", {400}, true},
      {"a chunk size with 0x", chunked + "0x5\r\nhello\r\n0\r\n\r\n", {400}, true},
      {"a negative chunk size", chunked + "-5\r\nhello\r\n0\r\n\r\n", {400}, true},
      {"a chunk size with a plus", chunked + "+5\r\nhello\r\n0\r\n\r\n", {400}, true},
      {"a chunk size with an underscore", chunked + "1_0\r\nhello\r\n0\r\n\r\n", {400}, true},
      {"a space before a chunk size", chunked + " 5\r\nhello\r\n0\r\n\r\n", {400}, true},
      {"a space after a chunk size", chunked + "5 \r\nhello\r\n0\r\n\r\n", {400}, true},
      {"white space around ';' and '=' of a chunk extension",
       chunked + "5 ; a = b\t;\tc\t=\t\"d\" ;e\r\nhello\r\n0 \t; last\r\n\r\n" + next,
       {200, 200},
       false},
      {"a space between the digits of a chunk size", chunked + "0 5;a\r\nhello\r\n0\r\n\r\n", {400}, true},
      {"a space before a chunk size with an extension", chunked + " 5;a\r\nhello\r\n0\r\n\r\n", {400}, true},
      {"a space after a chunk extension's name", chunked + "5;a \r\nhello\r\n0\r\n\r\n", {400}, true},
      {"a space after a chunk extension's value", chunked + "5;a=b \r\nhello\r\n0\r\n\r\n", {400}, true},
      {"a chunk extension of two words", chunked + "5;a b\r\nhello\r\n0\r\n\r\n", {400}, true},
      {"a chunk extension without a value", chunked + "5;a= ;b\r\nhello\r\n0\r\n\r\n", {400}, true},
      {"a chunk extension of white space only", chunked + "5 ; \r\nhello\r\n0\r\n\r\n", {400}, true},
      {"white space of a chunk extension without end", chunked + "5" + S(20'000, ' '), {400}, true},
      {"an empty chunk extension", chunked + "5;\r\nhello\r\n0\r\n\r\n", {400}, true},
      {"a chunk extension with a NUL", chunked + "5;a=" + S(1, '\0') + "\r\nhello\r\n0\r\n\r\n", {400}, true},
      {"a chunk extension with a bare CR", chunked + "5;a=\"b\rc\"\r\nhello\r\n0\r\n\r\n", {400}, true},
      {"a chunk size line with a bare LF", chunked + "5\nhello\r\n0\r\n\r\n", {400}, true},
      {"a chunk extension with a bare LF", chunked + "5;a\nhello\r\n0\r\n\r\n", {400}, true},
      {"a chunk size that overflows", chunked + "FFFFFFFFFFFFFFFF0\r\nhello\r\n0\r\n\r\n", {400}, true},
      {"a huge chunk size", chunked + "FFFFFFFFFFFFFFF\r\nhello\r\n0\r\n\r\n", {413}, true},
      {"a chunk longer than its size", chunked + "4\r\nhello\r\n0\r\n\r\n", {400}, true},
      {"a chunk ended by a bare LF", chunked + "5\r\nhello\n0\r\n\r\n", {400}, true},
      {"chunk extensions without end", chunked + "1;" + S(20'000, 'a'), {400}, true},
      {"a trailer without a colon", chunked + "0\r\nX\r\n\r\n", {400}, true},
      {"a trailer with a space before the colon", chunked + "0\r\nX : 1\r\n\r\n", {400}, true},
      {"a folded trailer", chunked + "0\r\nX: 1\r\n 2\r\n\r\n", {400}, true},
      {"a trailer with a bare LF", chunked + "0\r\nX: 1\nY: 2\r\n\r\n", {400}, true},
      {"a trailer with a control character", chunked + "0\r\nX: \x7f\r\n\r\n", {400}, true},
      {"a trailer that frames", chunked + "0\r\nContent-Length: 5\r\n\r\n", {400}, true},
      {"trailers without end", chunked + "0\r\nX: " + S(20'000, 'a'), {400}, true},
      {"chunked with HTTP/1.0", "POST / HTTP/1.0\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n" + next, {400}, true},

      // Sizes; the tests leave the limits of the header section at 16384 and of its lines at 8000, and set the body's to 1000000.
      {"a request line above the limit", "GET /" + S(20'000, 'a') + " HTTP/1.1\r\nHost: a\r\n\r\n", {414}, true},
      {"a request line of exactly the limit", "GET /head?" + S(8000 - 19, 'a') + " HTTP/1.1\r\nHost: a\r\n\r\n" + next, {200, 200}, false},
      {"a request line one byte above the limit", "GET /head?" + S(8000 - 18, 'a') + " HTTP/1.1\r\nHost: a\r\n\r\n" + next, {414}, true},
      {"a field line above the limit", get + "X: " + S(20'000, 'a') + "\r\n\r\n", {431}, true},
      {"a field line of exactly the limit", get + "X: " + S(7997, 'a') + "\r\n\r\n" + next, {200, 200}, false},
      {"a field line one byte above the limit", get + "X: " + S(7998, 'a') + "\r\n\r\n" + next, {431}, true},
      {"a head of exactly the limit", most + S(16'384 - most.size() - 4, 'a') + "\r\n\r\n" + next, {200, 200}, false},
      {"a head one byte above the limit", most + S(16'384 - most.size() - 3, 'a') + "\r\n\r\n" + next, {431}, true},
  };
}

}  // namespace lrt::test
