// SPDX-License-Identifier: Apache-2.0
#include "src/recording/mcap.hpp"

#include <algorithm>
#include <array>

namespace lrt::recording::mcap {
namespace {

enum Opcode : unsigned char {
  op_header = 0x01,
  op_footer = 0x02,
  op_schema = 0x03,
  op_channel = 0x04,
  op_message = 0x05,
  op_chunk = 0x06,
  op_message_index = 0x07,
  op_chunk_index = 0x08,
  op_statistics = 0x0B,
  op_metadata = 0x0C,
  op_metadata_index = 0x0D,
  op_summary_offset = 0x0E,
  op_data_end = 0x0F,
};

constexpr std::size_t prefix_bytes = 9;           // opcode and length of a record
constexpr std::string_view own_library = "lrt ";  // see WriterOptions::library
constexpr std::size_t message_bytes = 2 + 4 + 8 + 8;

// All numbers are little-endian.
template <class T>
void put(std::string& out, T value) {
  for (std::size_t i = 0; i < sizeof(T); ++i) out += static_cast<char>(static_cast<unsigned char>(static_cast<std::uint64_t>(value) >> (8 * i)));
}
void put_text(std::string& out, std::string_view text) {
  put(out, static_cast<std::uint32_t>(text.size()));
  out += text;
}
void put_map(std::string& out, const Metadata& map) {
  std::string members;
  for (const auto& [key, value] : map) {
    put_text(members, key);
    put_text(members, value);
  }
  put_text(out, members);
}
void put_record(std::string& out, Opcode opcode, std::string_view content) {
  out += static_cast<char>(opcode);
  put(out, static_cast<std::uint64_t>(content.size()));
  out += content;
}

std::string content_of(const Schema& schema) {
  std::string content;
  put(content, schema.id);
  put_text(content, schema.name);
  put_text(content, schema.encoding);
  put_text(content, schema.data);
  return content;
}
std::string content_of(const Channel& channel) {
  std::string content;
  put(content, channel.id);
  put(content, channel.schema_id);
  put_text(content, channel.topic);
  put_text(content, channel.message_encoding);
  put_map(content, channel.metadata);
  return content;
}

/// Takes fields from the beginning of a record. After a field that does not fit all further ones are empty, and ok() is false.
class Fields {
 public:
  explicit Fields(std::string_view bytes) : bytes_(bytes) {}
  template <class T>
  T number() {
    if (bytes_.size() < sizeof(T)) return fail(), T(0);
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i) value |= static_cast<std::uint64_t>(static_cast<unsigned char>(bytes_[i])) << (8 * i);
    bytes_.remove_prefix(sizeof(T));
    return static_cast<T>(value);
  }
  std::string_view bytes(std::uint64_t count) {
    if (count > bytes_.size()) return fail(), std::string_view();
    const std::string_view result = bytes_.substr(0, static_cast<std::size_t>(count));
    bytes_.remove_prefix(result.size());
    return result;
  }
  std::string_view text() { return bytes(number<std::uint32_t>()); }
  Metadata map() {
    Fields members(text());
    Metadata result;
    while (members.ok() && !members.rest().empty()) {
      const std::string_view key = members.text(), value = members.text();
      if (members.ok()) result.emplace(key, value);
    }
    if (!members.ok()) fail();
    return result;
  }
  std::string_view rest() const noexcept { return bytes_; }
  bool ok() const noexcept { return ok_; }

 private:
  void fail() noexcept {
    ok_ = false;
    bytes_ = {};
  }
  std::string_view bytes_;
  bool ok_ = true;
};

}  // namespace

std::uint32_t crc32(std::uint32_t crc, std::string_view bytes) noexcept {
  static constexpr auto table = [] {
    std::array<std::uint32_t, 256> made{};
    for (std::uint32_t i = 0; i < 256; ++i) {
      std::uint32_t value = i;
      for (int bit = 0; bit < 8; ++bit) value = (value & 1U) != 0 ? 0xEDB88320U ^ (value >> 1) : value >> 1;
      made[i] = value;
    }
    return made;
  }();
  crc = ~crc;
  for (const char c : bytes) crc = table[(crc ^ static_cast<unsigned char>(c)) & 0xFFU] ^ (crc >> 8);
  return ~crc;
}

// ----------------------------------------------------------------------------------------------------------------- writing

Writer::Writer(WriterOptions options, Sink sink) : options_(std::move(options)), sink_(std::move(sink)) {
  options_.compress = options_.compress && has_zstd();
}

Result<void> Writer::emit(std::string_view bytes) {
  if (error_) return unexpected(*error_);
  if (Result<void> written = sink_(bytes); !written) {
    error_ = written.error();
    return written;
  }
  position_ += bytes.size();
  crc_ = crc32(crc_, bytes);
  return {};
}

Result<void> Writer::begin() {
  std::string content, bytes(magic);
  put_text(content, "");  // profile
  put_text(content, std::string(own_library) + options_.library_version);
  put_record(bytes, op_header, content);
  return emit(bytes);
}

Result<void> Writer::add_metadata(const std::string& name, const Metadata& metadata) {
  std::string content, record, place;
  put_text(content, name);
  put_map(content, metadata);
  put_record(record, op_metadata, content);
  put(place, position_);
  put(place, static_cast<std::uint64_t>(record.size()));
  put_text(place, name);
  if (Result<void> written = emit(record); !written) return written;
  put_record(metadata_index_, op_metadata_index, place);
  ++metadata_;
  return {};
}

std::uint16_t Writer::add_schema(std::string name, std::string encoding, std::string data) {
  if (schemas_.size() >= UINT16_MAX) return 0;
  schemas_.push_back({static_cast<std::uint16_t>(schemas_.size() + 1), std::move(name), std::move(encoding), std::move(data)});
  put_record(definitions_, op_schema, content_of(schemas_.back()));
  return schemas_.back().id;
}

std::optional<std::uint16_t> Writer::add_channel(std::uint16_t schema_id, std::string topic, std::string message_encoding, Metadata metadata) {
  if (channels_.size() > UINT16_MAX) return std::nullopt;
  channels_.push_back({static_cast<std::uint16_t>(channels_.size()), schema_id, std::move(topic), std::move(message_encoding), std::move(metadata)});
  counts_.push_back(0);
  put_record(definitions_, op_channel, content_of(channels_.back()));
  return channels_.back().id;
}

Result<void> Writer::add(const Message& message) {
  if (error_) return unexpected(*error_);
  const bool is_old = !index_.empty() && message.log_time > first_ && message.log_time - first_ >= options_.max_chunk_time;
  if (is_old || (!index_.empty() && chunk_.size() + message.data.size() > options_.max_chunk_bytes))
    if (Result<void> ended = end_chunk(); !ended) return ended;
  first_ = index_.empty() ? message.log_time : std::min(first_, message.log_time);
  last_ = index_.empty() ? message.log_time : std::max(last_, message.log_time);
  first_of_all_ = messages_ == 0 ? message.log_time : std::min(first_of_all_, message.log_time);
  last_of_all_ = messages_ == 0 ? message.log_time : std::max(last_of_all_, message.log_time);
  index_[message.channel_id].emplace_back(message.log_time, chunk_.size());
  ++messages_;
  if (message.channel_id < counts_.size()) ++counts_[message.channel_id];
  chunk_ += static_cast<char>(op_message);
  put(chunk_, static_cast<std::uint64_t>(message_bytes + message.data.size()));
  put(chunk_, message.channel_id);
  put(chunk_, message.sequence);
  put(chunk_, message.log_time);
  put(chunk_, message.publish_time);
  chunk_ += message.data;
  return {};
}

Result<void> Writer::flush_older(Nanoseconds now) {
  if (index_.empty() || now <= first_ || now - first_ < options_.max_chunk_time) return error_ ? Result<void>(unexpected(*error_)) : Result<void>();
  return end_chunk();
}

Result<void> Writer::end_chunk() {
  std::string bytes = std::exchange(definitions_, {});
  if (chunk_.empty()) return bytes.empty() ? Result<void>() : emit(bytes);
  const std::uint64_t chunk_offset = position_ + bytes.size();
  std::optional<std::string> compressed = options_.compress ? zstd_compressed(chunk_) : std::nullopt;
  const std::string_view compression = compressed ? "zstd" : "";
  const std::string_view stored = compressed ? *compressed : chunk_;
  std::string content;
  put(content, first_);
  put(content, last_);
  put(content, static_cast<std::uint64_t>(chunk_.size()));
  put(content, crc32(0, chunk_));
  put_text(content, compression);
  put(content, static_cast<std::uint64_t>(stored.size()));
  content += stored;
  const std::size_t begin = bytes.size();
  put_record(bytes, op_chunk, content);
  const std::size_t chunk_end = bytes.size();
  std::string offsets;
  for (auto& [channel, entries] : index_) {
    std::stable_sort(entries.begin(), entries.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    put(offsets, channel);
    put(offsets, position_ + bytes.size());
    std::string record, pairs;
    for (const auto& [time, offset] : entries) {
      put(pairs, time);
      put(pairs, offset);
    }
    put(record, channel);
    put_text(record, pairs);
    put_record(bytes, op_message_index, record);
  }
  std::uint64_t index_length = bytes.size() - chunk_end;
  if (chunk_index_.size() + offsets.size() > options_.max_index_bytes) {
    offsets.clear();  // "an empty map indicates no message indexing is available"
    index_length = 0;
  }
  std::string place;
  put(place, first_);
  put(place, last_);
  put(place, chunk_offset);
  put(place, static_cast<std::uint64_t>(chunk_end - begin));
  put_text(place, offsets);
  put(place, index_length);
  put_text(place, compression);
  put(place, static_cast<std::uint64_t>(stored.size()));
  put(place, static_cast<std::uint64_t>(chunk_.size()));
  if (Result<void> written = emit(bytes); !written) return written;  // one write: a killed program leaves whole chunks
  put_record(chunk_index_, op_chunk_index, place);
  ++chunks_;
  chunk_.clear();
  index_.clear();
  first_ = last_ = 0;
  return {};
}

Result<void> Writer::end() {
  if (error_) return unexpected(*error_);
  if (Result<void> ended = end_chunk(); !ended) return ended;
  std::string bytes, content;
  put(content, crc_);
  put_record(bytes, op_data_end, content);
  if (Result<void> written = emit(bytes); !written) return written;

  const std::uint64_t summary_start = position_;
  std::string summary, groups;
  const auto add_group = [&](Opcode opcode, const std::string& records) {
    if (records.empty()) return;
    std::string group;
    put(group, static_cast<unsigned char>(opcode));
    put(group, summary_start + summary.size());
    put(group, static_cast<std::uint64_t>(records.size()));
    put_record(groups, op_summary_offset, group);
    summary += records;
  };
  std::string records;
  for (const Schema& schema : schemas_) put_record(records, op_schema, content_of(schema));
  add_group(op_schema, records);
  records.clear();
  for (const Channel& channel : channels_) put_record(records, op_channel, content_of(channel));
  add_group(op_channel, records);
  content.clear();
  put(content, messages_);
  put(content, static_cast<std::uint16_t>(schemas_.size()));
  put(content, static_cast<std::uint32_t>(channels_.size()));
  put(content, std::uint32_t{0});  // attachments
  put(content, metadata_);
  put(content, chunks_);
  put(content, first_of_all_);
  put(content, last_of_all_);
  std::string counts;
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    put(counts, static_cast<std::uint16_t>(i));
    put(counts, counts_[i]);
  }
  put_text(content, counts);
  records.clear();
  put_record(records, op_statistics, content);
  add_group(op_statistics, records);
  add_group(op_metadata_index, metadata_index_);
  add_group(op_chunk_index, chunk_index_);
  const std::uint64_t summary_offset_start = summary_start + summary.size();
  summary += groups;
  // The checksum is of the summary and of the footer up to the checksum itself.
  summary += static_cast<char>(op_footer);
  put(summary, std::uint64_t{8 + 8 + 4});
  put(summary, summary_start);
  put(summary, summary_offset_start);
  put(summary, crc32(0, summary));
  summary += magic;
  return emit(summary);
}

// ----------------------------------------------------------------------------------------------------------------- reading

namespace {

class FileReader {
 public:
  FileReader(const std::function<Result<std::size_t>(char*, std::size_t)>& read, Events& events, const ReaderLimits& limits)
      : read_(read), events_(events), limits_(limits) {}

  Result<ReadReport> run() {
    Result<bool> whole = take(magic.size());
    if (!whole) return unexpected(std::move(whole).error());
    if (!*whole || buffer_ != magic) return unexpected(Errc::expected_value, "no MCAP: it does not begin as one");
    while (!is_ended_) {
      whole = take(prefix_bytes);
      if (!whole) return unexpected(std::move(whole).error());
      if (!*whole) return cut();
      Fields prefix(buffer_);
      const auto opcode = prefix.number<unsigned char>();
      const auto length = prefix.number<std::uint64_t>();
      if (length > limits_.max_record_bytes) {
        note("a record of " + std::to_string(length) + " bytes; expected at most " + std::to_string(limits_.max_record_bytes));
        ++report_.damaged;
        return report_;
      }
      whole = take(static_cast<std::size_t>(length));
      if (!whole) return unexpected(std::move(whole).error());
      if (!*whole) return cut();
      if (opcode == op_footer) {
        whole = take(magic.size());
        if (!whole) return unexpected(std::move(whole).error());
        if (!*whole || buffer_ != magic) return cut();
        report_.is_complete = true;
        return report_;
      }
      if (opcode == op_data_end) is_after_data_ = true;
      if (!is_after_data_) record(opcode, buffer_, false);
    }
    return report_;
  }

 private:
  /// Reads `size` bytes into the buffer. Memory grows with what is there, not with what a length says.
  Result<bool> take(std::size_t size) {
    buffer_.clear();
    constexpr std::size_t step = 64 * 1024;
    while (buffer_.size() < size) {
      const std::size_t had = buffer_.size();
      buffer_.resize(std::min(size, had + step));
      const Result<std::size_t> count = read_(buffer_.data() + had, buffer_.size() - had);
      if (!count) return unexpected(count.error());
      buffer_.resize(had + *count);
      report_.bytes += *count;
      if (*count == 0) return false;
    }
    return true;
  }
  ReadReport cut() {
    note("the file ends without its last part");
    return report_;
  }
  void note(std::string problem) {
    if (report_.problem.empty()) report_.problem = std::move(problem);
  }
  void damaged(std::string problem) {
    note(std::move(problem));
    ++report_.damaged;
  }

  void record(unsigned char opcode, std::string_view content, bool in_chunk) {
    Fields fields(content);
    switch (opcode) {
      case op_channel: {
        Channel channel;
        channel.id = fields.number<std::uint16_t>();
        channel.schema_id = fields.number<std::uint16_t>();
        channel.topic = fields.text();
        channel.message_encoding = fields.text();
        if (content.size() > limits_.max_metadata_bytes) return damaged("a channel that is too long");
        channel.metadata = fields.map();
        if (!fields.ok()) return damaged("a channel that is too short");
        channel_bytes_ += content.size();
        constexpr std::size_t max_channel_bytes = 64 * 1024 * 1024;
        if (channel_bytes_ > max_channel_bytes) return damaged("too many channels");
        channels_.emplace(channel.id, std::move(channel));  // a repeated one is the same
        return;
      }
      case op_message: {
        Message message;
        message.channel_id = fields.number<std::uint16_t>();
        message.sequence = fields.number<std::uint32_t>();
        message.log_time = fields.number<std::uint64_t>();
        message.publish_time = fields.number<std::uint64_t>();
        if (!fields.ok()) return damaged("a message that is too short");
        message.data = fields.rest();
        const auto channel = channels_.find(message.channel_id);
        if (channel == channels_.end()) return damaged("a message of an unknown channel");
        is_ended_ = !events_.message(channel->second, message);
        return;
      }
      case op_header:
        fields.text();
        chunks_have_messages_only_ = fields.text().substr(0, own_library.size()) == own_library;
        return;
      case op_chunk:
        if (in_chunk) return damaged("a chunk in a chunk");
        return chunk(fields);
      case op_metadata: {
        if (in_chunk || content.size() > limits_.max_metadata_bytes) return damaged("metadata that cannot be read");
        const std::string name(fields.text());
        const Metadata metadata = fields.map();
        if (!fields.ok()) return damaged("metadata that cannot be read");
        is_ended_ = !events_.metadata(name, metadata);
        return;
      }
      default: return;  // indexes, attachments, and what later versions have
    }
  }

  void chunk(Fields fields) {
    const auto first = fields.number<std::uint64_t>();
    const auto last = fields.number<std::uint64_t>();
    const auto size = fields.number<std::uint64_t>();
    const auto crc = fields.number<std::uint32_t>();
    const std::string compression(fields.text().substr(0, 20));
    const std::string_view stored = fields.bytes(fields.number<std::uint64_t>());
    if (!fields.ok()) return damaged("a chunk that is too short");
    if (!compression.empty()) report_.compression = compression;
    if (size > limits_.max_chunk_bytes) return damaged("a chunk of " + std::to_string(size) + " bytes");
    if (chunks_have_messages_only_ && !events_.wants(first, last)) return;
    std::optional<std::string> decompressed;
    std::string_view records = stored;
    if (compression == "zstd") {
      if (!has_zstd()) return damaged("a chunk that is compressed with zstd, without which this program was built");
      decompressed = zstd_decompressed(stored, static_cast<std::size_t>(size));
      if (!decompressed) return damaged("a chunk that cannot be decompressed");
      records = *decompressed;
    } else if (!compression.empty()) {
      return damaged("a chunk with the compression \"" + compression + "\"; expected zstd or none");
    }
    if (records.size() != size || (crc != 0 && crc32(0, records) != crc)) return damaged("a chunk with a wrong size or checksum");
    while (!records.empty() && !is_ended_) {
      Fields inner(records);
      const auto opcode = inner.number<unsigned char>();
      const std::string_view content = inner.bytes(inner.number<std::uint64_t>());
      if (!inner.ok()) return damaged("a chunk whose records do not fit");
      records = inner.rest();
      record(opcode, content, true);
    }
  }

  const std::function<Result<std::size_t>(char*, std::size_t)>& read_;
  Events& events_;
  const ReaderLimits limits_;
  ReadReport report_;
  std::string buffer_;
  std::map<std::uint16_t, Channel> channels_;
  std::size_t channel_bytes_ = 0;
  bool is_after_data_ = false, is_ended_ = false;
  bool chunks_have_messages_only_ = false;  // a chunk of others may have the channels of later ones
};

}  // namespace

Result<ReadReport> read_file(const std::function<Result<std::size_t>(char*, std::size_t)>& read, Events& events, const ReaderLimits& limits) {
  return FileReader(read, events, limits).run();
}

}  // namespace lrt::recording::mcap
