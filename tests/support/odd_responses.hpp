// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace lrt::test {

/// A response that is valid by RFC 9110 and RFC 9112, and that some clients do not read.
struct OddResponse {
  std::string name, bytes;
  std::string body = "hello";
  int status = 200;
  bool closes = false;           ///< the server closes the connection after it, and announces that, or it is how the body ends
  bool is_byte_by_byte = false;  ///< how it is sent
};

/// "hello" in several codings.
namespace coded {
inline constexpr std::string_view gzip("\037\213\010\000\000\000\000\000\002\003\313\110\315\311\311\007\000\206\246\020\066\005\000\000\000", 25);
inline constexpr std::string_view named_gzip(
    "\037\213\010\010\001\000\000\000\002\377\156\141\155\145\056\164\170\164\000\313\110\315\311\311\007\000\206\246\020\066\005\000\000\000", 34);
inline constexpr std::string_view zlib("\170\234\313\110\315\311\311\007\000\006\054\002\025", 13);
inline constexpr std::string_view raw_deflate("\313\110\315\311\311\007\000", 7);
inline constexpr std::string_view two_members(
    "\037\213\010\000\000\000\000\000\002\003\313\110\315\001\000\033\361\013\345\003\000\000\000\037\213\010\000\000\000\000\000\002\003\313\311\007"
    "\000\235\112\234\125\002\000\000\000",
    45);
inline constexpr std::string_view gzip_of_zlib(
    "\037\213\010\000\000\000\000\000\002\003\253\230\163\332\343\354\311\223\354\014\154\072\114\242\000\104\376\205\252\015\000\000\000", 33);
}  // namespace coded

inline const std::vector<OddResponse>& odd_responses() {
  const auto whole = [](std::string_view fields, std::string_view body = "hello") {
    return "HTTP/1.1 200 OK\r\n" + std::string(fields) + "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + std::string(body);
  };
  const auto in_bytes = [](std::string_view body) {
    std::string chunks;
    for (const char c : body) chunks += std::string("1\r\n") + c + "\r\n";
    return chunks;
  };
  const std::string ok = "HTTP/1.1 200 OK\r\n", five = "Content-Length: 5\r\n\r\nhello", chunked = "Transfer-Encoding: chunked\r\n\r\n";
  const std::string early = "HTTP/1.1 103 Early Hints\r\nLink: </style.css>; rel=preload\r\n\r\n", processing = "HTTP/1.1 102 Processing\r\n\r\n";
  const auto list = [&] {
    std::string many;
    for (int i = 0; i < 300; ++i) many += "X-" + std::to_string(i) + ": y\r\n";
    std::vector<OddResponse> all{
        {"one chunk", ok + chunked + "5\r\nhello\r\n0\r\n\r\n"},
        {"a chunk for each byte", ok + chunked + in_bytes("hello") + "0\r\n\r\n"},
        {"zeros and capitals in the size of a chunk", ok + chunked + "00000000000000000000A\r\nhellohello\r\n000\r\n\r\n", "hellohello"},
        {"chunk extensions", ok + chunked + "2;a;b=c\r\nhe\r\n3 ; d = \"e;f\"\r\nllo\r\n0;last\r\n\r\n"},
        {"a trailer", ok + chunked + "5\r\nhello\r\n0\r\nX-Sum: 1\r\n\r\n"},
        {"trailers that look like framing", ok + chunked + "5\r\nhello\r\n0\r\nContent-Length: 9\r\nTransfer-Encoding: x\r\nA: b\r\n c\r\n\r\n"},
        {"a trailer before the end of the connection", ok + "Connection: close\r\n" + chunked + "5\r\nhello\r\n0\r\nX-Sum: 1\r\n\r\n", "hello", 200,
         true},
        {"100 before it", "HTTP/1.1 100 Continue\r\n\r\n" + ok + five},
        {"102 before it", processing + ok + five},
        {"103 with fields before it", early + ok + five},
        {"103 twice before it", early + early + ok + five},
        {"100, 102, 103 and an unknown one before it", "HTTP/1.1 100\r\n\r\n" + processing + early + "HTTP/1.1 199 Odd\r\nA: b\r\n\r\n" + ok + five},
        {"102 before a 204", processing + "HTTP/1.1 204 No Content\r\n\r\n", "", 204},
        {"HTTP/1.0 with a length", "HTTP/1.0 200 OK\r\n" + five, "hello", 200, true},
        {"HTTP/1.0 until it closes", "HTTP/1.0 200 OK\r\nServer: old\r\n\r\nhello", "hello", 200, true},
        {"a later minor version", "HTTP/1.7 200 OK\r\n" + five},
        {"no length", ok + "\r\nhello", "hello", 200, true},
        {"no length and no body", ok + "\r\n", "", 200, true},
        {"no reason", "HTTP/1.1 200 \r\n" + five},
        {"no reason and no space", "HTTP/1.1 200\r\n" + five},
        {"a reason with bytes beyond ASCII", "HTTP/1.1 200 J\xC3\xA4 \xFF\tgut\r\n" + five},
        {"byte by byte", ok + "X: y\r\n" + five, "hello", 200, false, true},
        {"chunks byte by byte, with 103 and a trailer", early + ok + chunked + "5;x=y\r\nhello\r\n0\r\nX-Sum: 1\r\n\r\n", "hello", 200, false, true},
        {"a field of 9,000 bytes", whole("X: " + std::string(9'000, 'y') + "\r\n")},
        {"300 fields", whole(many)},
        {"a folded field", whole("X: a\r\n b\r\n\tc\r\n")},
        {"a folded length", ok + "Content-Length:\r\n 5\r\n\r\nhello"},
        {"white space around values, or none", ok + "A:b\r\nB: \t c \t\r\nContent-Length:5\r\n\r\nhello"},
        {"an empty field", whole("X:\r\nY: \r\n")},
        {"names and codings in other letters", ok + "TRANSFER-ENCODING: ChunKed\r\n\r\n5\r\nhello\r\n0\r\n\r\n"},
        {"an empty element in the list of codings", ok + "Transfer-Encoding: , chunked ,\r\n\r\n5\r\nhello\r\n0\r\n\r\n"},
        {"the same length twice", ok + "Content-Length: 5\r\n" + five},
        {"the same length in a list", ok + "Content-Length: 5, 5\r\n\r\nhello"},
        {"zeros before the length", ok + "Content-Length: 0000000000000000005\r\n\r\nhello"},
        {"an unknown success", "HTTP/1.1 299 Odd\r\n" + five, "hello", 299},
        {"204 with a length of 0", "HTTP/1.1 204 No Content\r\nContent-Length: 0\r\n\r\n", "", 204},
        {"205", "HTTP/1.1 205 Reset Content\r\nContent-Length: 0\r\n\r\n", "", 205},
        {"the coding identity", whole("Content-Encoding: identity\r\n")},
        {"gzip unasked", whole("Content-Encoding: gzip\r\n", coded::gzip)},
        {"gzip in capitals, with the name of a file", whole("Content-Encoding: X-GZIP\r\n", coded::named_gzip)},
        {"gzip in chunks with a trailer", ok + "Content-Encoding: gzip\r\n" + chunked + in_bytes(coded::gzip) + "0\r\nX-Sum: 1\r\n\r\n"},
        {"gzip of two members", whole("Content-Encoding: gzip\r\n", coded::two_members)},
        {"deflate", whole("Content-Encoding: deflate\r\n", coded::zlib)},
        {"deflate without its header, byte by byte", whole("Content-Encoding: deflate\r\n", coded::raw_deflate), "hello", 200, false, true},
        {"two codings", whole("Content-Encoding: deflate, gzip\r\n", coded::gzip_of_zlib)},
        {"two codings in two fields, until it closes",
         ok + "Content-Encoding: deflate\r\nContent-Encoding: gzip\r\n\r\n" + std::string(coded::gzip_of_zlib), "hello", 200, true},
        {"a coding of nothing", ok + "Content-Encoding: gzip\r\nContent-Length: 0\r\n\r\n", ""},
        {"Keep-Alive", whole("Connection: keep-alive\r\nKeep-Alive: timeout=5, max=9\r\n")},
    };
    return all;
  };
  static const std::vector<OddResponse>& all = *new std::vector<OddResponse>(list());
  return all;
}

/// A response that is invalid or beyond a limit, and what the error says.
struct BadResponse {
  std::string name, bytes, says;
};

inline const std::vector<BadResponse>& bad_responses() {
  const std::string ok = "HTTP/1.1 200 OK\r\n", chunked = ok + "Transfer-Encoding: chunked\r\n\r\n";
  const auto times = [](std::size_t n, std::string_view text) {
    std::string result;
    for (std::size_t i = 0; i < n; ++i) result += text;
    return result;
  };
  static const std::vector<BadResponse>& all = *new std::vector<BadResponse>{
      {"HTTP/2", "HTTP/2 200\r\n\r\n", "not HTTP/1.1: it begins with \"HTTP/2 200\""},
      {"SSH", "SSH-2.0-OpenSSH_9.2\r\n", "not HTTP/1.1: it begins with \"SSH-2.0-OpenSSH_9.2\""},
      {"a status of two digits", "HTTP/1.1 20 OK\r\n\r\n", "its status line is \"HTTP/1.1 20 OK\""},
      {"a status below 100", "HTTP/1.1 099 OK\r\n\r\n", "its status line is \"HTTP/1.1 099 OK\""},
      {"two lengths", ok + "Content-Length: 5\r\nContent-Length: 3\r\n\r\nhello", "more than one length: 5 and 3"},
      {"two lengths in a list", ok + "Content-Length: 5, 6\r\n\r\nhello", "more than one length: 5 and 6"},
      {"a length and chunks", ok + "Content-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
       "Content-Length 5 and Transfer-Encoding \"chunked\""},
      {"a length that is no number", ok + "Content-Length: +5\r\n\r\nhello", "the Content-Length \"+5\""},
      {"a length that is empty", ok + "Content-Length:\r\n\r\nhello", "the Content-Length \"\""},
      {"a length in a line that is no field", ok + "Content-Length : 5\r\n\r\nhello", "in a line that is no field: \"Content-Length : 5\""},
      {"another transfer coding", ok + "Transfer-Encoding: gzip, chunked\r\n\r\n0\r\n\r\n",
       "the Transfer-Encoding \"gzip, chunked\", expected chunked"},
      {"chunked twice", ok + "Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n", "\"chunked, chunked\", expected chunked"},
      {"no transfer coding", ok + "Transfer-Encoding: \r\n\r\n0\r\n\r\n", "the Transfer-Encoding \"\", expected chunked"},
      {"a line with LF alone", ok + "X: y\nZ: z\r\n\r\n", "LF without CR in the line \"X: y\""},
      {"CR in a field", ok + "X: y\rZ: z\r\n\r\n", "CR without LF in the line \"X: y\\x0DZ: z\""},
      {"NUL in a field", ok + "X: y" + std::string(1, '\0') + "\r\n\r\n", "NUL in the line \"X: y\\x00\""},
      {"another protocol", "HTTP/1.1 101 Switching Protocols\r\nUpgrade: x\r\n\r\n", "switched to another protocol (101)"},
      {"a bad chunk", chunked + "zz\r\n", "a chunk with the size \"zz\""},
      {"a chunk of a negative size", chunked + "-1\r\n", "a chunk with the size \"-1\""},
      {"a chunk longer than its size", chunked + "3\r\nhello\r\n0\r\n\r\n", "a chunk of its response is longer than its size"},
      {"no gzip", ok + "Content-Encoding: gzip\r\nContent-Length: 5\r\n\r\nhello", "its body is not valid gzip"},
      {"half of gzip", ok + "Content-Encoding: gzip\r\nContent-Length: 12\r\n\r\n" + std::string(coded::gzip.substr(0, 12)),
       "its gzip body is incomplete"},
      {"more than gzip",
       ok + "Content-Encoding: gzip\r\nContent-Length: " + std::to_string(coded::gzip.size() + 1) + "\r\n\r\n" + std::string(coded::gzip) + "x",
       "bytes after the end of its gzip body"},
      {"no deflate", ok + "Content-Encoding: deflate\r\nContent-Length: 5\r\n\r\nhello", "its body is not valid deflate"},
      {"an unknown coding", ok + "Content-Encoding: br\r\nContent-Length: 5\r\n\r\nhello",
       "the Content-Encoding \"br\", expected gzip, deflate or identity"},
      // limits
      {"a long status line", "HTTP/1.1 200 " + std::string(600, 'y') + "\r\n\r\n", "the status line of its response is longer than 512 bytes"},
      {"a long header section", ok + "X: " + std::string(20'000, 'y') + "\r\n\r\n", "the header section of its response is longer than 16384 bytes"},
      {"many fields", ok + times(1'001, "X: y\r\n") + "\r\n", "more than 1000 fields"},
      {"many interim responses", times(17, "HTTP/1.1 100 Continue\r\n\r\n"), "more than 16 interim responses"},
      {"long interim responses", times(9, "HTTP/1.1 103 Early\r\nX: " + std::string(2'000, 'y') + "\r\n\r\n"),
       "the header section of its response is longer"},
      {"a long body", ok + "Content-Length: 70000\r\n\r\n" + std::string(70'000, 'y'), "its response is longer than 65536 bytes"},
      {"a long chunk", chunked + "11170\r\n" + std::string(70'000, 'y'), "its response is longer than 65536 bytes"},
      {"a chunk of more than 64 bits", chunked + "10000000000000005\r\nhello\r\n0\r\n\r\n", "its response is longer than 65536 bytes"},
      {"a long chunk line", chunked + "5;" + std::string(5'000, 'y') + "\r\nhello\r\n0\r\n\r\n",
       "chunk of its response is too long: more than 4096 bytes"},
      {"long chunk extensions", chunked + times(9, "1;" + std::string(2'000, 'y') + "\r\nx\r\n") + "0\r\n\r\n",
       "the chunk extensions of its response are longer than 16384 bytes"},
      {"a long trailer section", chunked + "0\r\n" + times(5, "X: " + std::string(2'000, 'y') + "\r\n") + "\r\n",
       "the trailer section of its response is longer than 8192 bytes"},
      {"three codings", ok + "Content-Encoding: gzip, gzip, gzip\r\nContent-Length: 5\r\n\r\nhello", "more than 2 codings: \"gzip, gzip, gzip\""},
      // an end of the connection
      {"nothing", "", "it closed the connection without a response"},
      {"half of a status line", "HTTP/1.1 2", "it closed the connection before its response was complete"},
      {"103 only", "HTTP/1.1 103 Early Hints\r\n\r\n", "before its response was complete: the last one was 103, which is not final"},
      {"half of a header section", ok + "X: ", "it closed the connection before its response was complete"},
      {"half of a body", ok + "Content-Length: 10\r\n\r\nhello", "before its response was complete: 5 bytes are missing"},
      {"half of a chunk", chunked + "6\r\nhello", "before its response was complete: the last chunk is missing"},
      {"no last chunk", chunked + "5\r\nhello\r\n", "before its response was complete: the last chunk is missing"},
      {"half of a trailer section", chunked + "0\r\nX: y\r\n", "before its response was complete: its trailer section has no end"},
  };
  return all;
}

}  // namespace lrt::test
