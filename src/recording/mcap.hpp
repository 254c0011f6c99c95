// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/result.hpp>

/// MCAP, a file format for recorded messages with times (https://mcap.dev/spec). Names of records and fields are those of the specification.
///
/// The writer needs no seeking: a file can be a pipe. What it has written is readable up to the last complete record, so a program that is killed loses at
/// most one chunk.
namespace lrt::recording::mcap {

/// The first and the last bytes of a file.
inline constexpr std::string_view magic = "\x89MCAP0\r\n";

using Nanoseconds = std::uint64_t;  ///< since 1970, or since any other time: the file does not say it
using Metadata = std::map<std::string, std::string>;

struct Schema {
  std::uint16_t id = 0;  ///< more than 0
  std::string name, encoding, data;
};
struct Channel {
  std::uint16_t id = 0;
  std::uint16_t schema_id = 0;  ///< 0: none
  std::string topic, message_encoding;
  Metadata metadata{};
};
struct Message {
  std::uint16_t channel_id = 0;
  std::uint32_t sequence = 0;
  Nanoseconds log_time = 0, publish_time = 0;
  std::string_view data{};
};

struct WriterOptions {
  std::string library_version{};               ///< of lrt, for the header
  std::size_t max_chunk_bytes = 1024 * 1024;   ///< without compression; a chunk with one larger message is larger
  Nanoseconds max_chunk_time = 1'000'000'000;  ///< between the first and the last message of a chunk
  bool compress = true;                        ///< with zstd, if has_zstd()
  /// Of the index of chunks, which is in memory until end(). Beyond it chunks are indexed by their times only, which takes about 80 bytes for each.
  std::size_t max_index_bytes = 64 * 1024 * 1024;
};

/// Writes a file.
/// @par Errors   those of the sink; after one nothing more is written, and each function returns it
/// @par Threads  One thread at a time.
class Writer {
 public:
  using Sink = std::function<Result<void>(std::string_view)>;
  Writer(WriterOptions options, Sink sink);

  Result<void> begin();
  /// At any time between begin() and end().
  Result<void> add_metadata(const std::string& name, const Metadata& metadata);
  /// @return  its id; 0: there are 65,535 already
  std::uint16_t add_schema(std::string name, std::string encoding, std::string data);
  /// @return  its id; nullopt: there are 65,536 already
  std::optional<std::uint16_t> add_channel(std::uint16_t schema_id, std::string topic, std::string message_encoding, Metadata metadata);
  Result<void> add(const Message& message);
  /// Writes the open chunk if its first message is as old as max_chunk_time.
  Result<void> flush_older(Nanoseconds now);
  /// The summary and the end. Nothing follows.
  Result<void> end();

  std::uint64_t bytes() const noexcept { return position_; }  ///< written so far
  bool compresses() const noexcept { return options_.compress; }

 private:
  Result<void> emit(std::string_view bytes);
  Result<void> end_chunk();

  WriterOptions options_;
  Sink sink_;
  std::optional<Error> error_;
  std::uint64_t position_ = 0;
  std::uint32_t crc_ = 0;
  std::vector<Schema> schemas_;
  std::vector<Channel> channels_;
  std::vector<std::uint64_t> counts_;  // messages by channel
  std::string definitions_;            // of schemas and channels that are not written yet: before the next chunk, so that chunks can be passed over
  std::string chunk_;                  // messages, not compressed
  std::map<std::uint16_t, std::vector<std::pair<Nanoseconds, std::uint64_t>>> index_;
  Nanoseconds first_ = 0, last_ = 0;  // of the open chunk
  Nanoseconds first_of_all_ = 0, last_of_all_ = 0;
  std::uint64_t messages_ = 0;
  std::string chunk_index_;  // records
  std::uint32_t chunks_ = 0;
  std::string metadata_index_;  // records
  std::uint32_t metadata_ = 0;
};

/// What a reader hands out. A function returns false to end the reading.
class Events {
 public:
  Events() = default;
  virtual ~Events() = default;
  Events(const Events&) = delete;
  Events& operator=(const Events&) = delete;
  /// Whether messages of these times are wanted. A chunk without one is not decompressed, unless it is of another writer: then it may have the channels of
  /// later ones.
  virtual bool wants(Nanoseconds first, Nanoseconds last) = 0;
  virtual bool metadata(const std::string& name, const Metadata& metadata) = 0;
  virtual bool message(const Channel& channel, const Message& message) = 0;
};

struct ReaderLimits {
  std::size_t max_record_bytes = 64 * 1024 * 1024;  ///< a larger record ends the reading
  std::size_t max_chunk_bytes = 64 * 1024 * 1024;   ///< after decompression
  std::size_t max_metadata_bytes = 1024 * 1024;     ///< of one record; a larger one is passed over
};

/// What was read.
struct ReadReport {
  bool is_complete = false;  ///< it has its end; false: it was cut, or reading has ended before
  std::uint64_t bytes = 0;
  std::uint64_t damaged = 0;  ///< records that were left out: with a wrong checksum, of an unknown channel, that cannot be decompressed
  std::string compression{};  ///< of its chunks; empty: none
  std::string problem{};      ///< of the first damaged record, or why reading has ended
};

/// Reads a file from its beginning to its end. Hostile input: memory is within the limits.
/// @param read  fills a buffer, at least with one byte; 0: the end
/// @par Errors  expected_value: it is no MCAP; those of `read`
Result<ReadReport> read_file(const std::function<Result<std::size_t>(char*, std::size_t)>& read, Events& events, const ReaderLimits& limits = {});

/// CRC-32 as of Ethernet and zlib, of more bytes after those that gave `crc`; 0 at the beginning.
std::uint32_t crc32(std::uint32_t crc, std::string_view bytes) noexcept;

/// Whether chunks can be compressed, and compressed ones be read: it was built with libzstd.
bool has_zstd() noexcept;
/// nullopt: out of memory. @pre has_zstd()
std::optional<std::string> zstd_compressed(std::string_view bytes);
/// @param size  expected; @return nullopt: it has another one, or is damaged
std::optional<std::string> zstd_decompressed(std::string_view bytes, std::size_t size);

}  // namespace lrt::recording::mcap
