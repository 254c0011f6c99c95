// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include <lrt/client/recording.hpp>

#include "src/recording/bag.hpp"
#include "src/recording/mcap.hpp"
#include "tools/lrt/bag_file.hpp"
#include "tools/lrt/observing.hpp"
#include "tools/lrt/recorder.hpp"

namespace lrt::tool {

using std::chrono::microseconds;
using std::chrono::steady_clock;
using std::chrono::system_clock;

namespace {

/// A file that is written from its beginning to its end.
class OutputFile {
 public:
  OutputFile() = default;
  ~OutputFile() {
    if (descriptor_ > STDERR_FILENO) ::close(descriptor_);
  }
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  Result<void> open(const std::string& name, bool force) {
    name_ = name;
    descriptor_ = name == "-" ? STDOUT_FILENO : ::open(name.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | (force ? O_TRUNC : O_EXCL), 0666);
    if (descriptor_ >= 0) return {};
    if (errno == EEXIST) return unexpected(Errc::invalid_option, "\"" + name + "\" exists; --force replaces it");
    return unexpected(Errc::invalid_option, "cannot write \"" + name + "\": " + std::strerror(errno));
  }
  Result<void> write(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) {
        is_pipe_closed_ = descriptor_ == STDOUT_FILENO && errno == EPIPE;
        return unexpected(Errc::failed, "cannot write \"" + name_ + "\": " + std::strerror(errno));
      }
      bytes.remove_prefix(static_cast<std::size_t>(written));
    }
    return {};
  }
  /// Some file systems report a full disk only here.
  Result<void> close() {
    if (descriptor_ <= STDERR_FILENO) return {};
    const int closed = ::close(std::exchange(descriptor_, -1));
    if (closed != 0 && errno != EINTR) return unexpected(Errc::failed, "cannot write \"" + name_ + "\": " + std::strerror(errno));
    return {};
  }
  bool is_pipe_closed() const noexcept { return is_pipe_closed_; }

 private:
  std::string name_;
  int descriptor_ = -1;
  bool is_pipe_closed_ = false;
};

bool ends_with(const std::string& text, std::string_view end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

std::string number(double value, int digits) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

std::string bytes_text(std::uint64_t bytes) {
  std::string text = std::to_string(bytes);
  for (std::size_t at = text.size(); at > 3; at -= 3) text.insert(at - 3, ",");
  return text + " bytes";
}

/// Whether a gap is a possible loss of an unknown number of values.
std::string missing_text(const recording::PropertySummary& property) {
  if (property.gaps == 0) return "0";
  return std::to_string(property.left_out) + (property.gaps_unknown > 0 ? " + ?" : "");
}

Result<int> info(Session& session, const std::string& name, bool as_json) {
  recording::Summary summary;
  InputFile file;
  if (Result<void> opened = file.open(name); !opened) return unexpected(std::move(opened).error());
  const Result<recording::BagReport> read = recording::read_bag(
      file.source(), [](const client::RecordingHeader&) -> Result<recording::BagRange> { return recording::BagRange{}; },
      [&](client::RecordedChange&& change) -> Result<void> {
        summary.add(change);
        return {};
      });
  if (!read) return unexpected(Errc::invalid_option, "\"" + name + "\": " + read.error().message);
  const client::RecordingHeader& header = read->header;
  std::vector<std::string> robots = header.robots;
  if (robots.empty() && !header.robot.empty()) robots.push_back(header.robot);
  std::optional<microseconds> last;
  std::uint64_t values = 0, gaps = 0, left_out = 0;
  for (const recording::PropertySummary& property : summary.properties()) {
    values += property.values;
    gaps += property.gaps;
    left_out += property.left_out;
    if (property.last && (!last || *property.last > *last)) last = property.last;
  }
  Terminal& terminal = session.terminal();
  if (as_json) {
    std::string json = "{\"file\":" + json_string(name) + ",\"format\":\"" + (read->format == recording::Format::mcap ? "mcap" : "jsonl") +
                       "\",\"bytes\":" + std::to_string(read->bytes);
    if (read->format == recording::Format::json_lines) json += ",\"version\":" + std::to_string(read->version);
    else json += ",\"compression\":" + json_string(read->compression);
    json += std::string(",\"complete\":") + (read->is_complete ? "true" : "false") + ",\"damaged\":" + std::to_string(read->damaged);
    json += ",\"started\":" + json_string(header.started) + ",\"seconds\":" + number(last ? static_cast<double>(last->count()) / 1e6 : 0, 6) +
            ",\"robots\":[";
    for (std::size_t i = 0; i < robots.size(); ++i) json += (i == 0 ? "" : ",") + json_string(robots[i]);
    json += "],\"properties\":[";
    bool is_first = true;
    for (const recording::PropertySummary& property : summary.properties()) {
      json += std::string(std::exchange(is_first, false) ? "" : ",") + "{\"name\":" + json_string(property.name) +
              ",\"url\":" + json_string(property.url) + ",\"robot\":" + json_string(property.robot.empty() ? header.robot : property.robot) +
              ",\"unit\":" + json_string(property.unit) + ",\"values\":" + std::to_string(property.values) +
              ",\"gaps\":" + std::to_string(property.gaps) + ",\"leftOut\":" + std::to_string(property.left_out) +
              ",\"gapsOfUnknownLength\":" + std::to_string(property.gaps_unknown) + ",\"series\":" + std::to_string(property.series);
      if (property.first)
        json += ",\"from\":" + number(static_cast<double>(property.first->count()) / 1e6, 6) +
                ",\"to\":" + number(static_cast<double>(property.last->count()) / 1e6, 6);
      if (property.first_source)
        json += ",\"sourceFrom\":\"" + utc(*property.first_source) + "\",\"sourceTo\":\"" + utc(*property.last_source) + "\"";
      json += "}";
    }
    terminal.print_line(json + "]}");
    return Exit::success;
  }
  const std::string tab = terminal.is_for_people() ? "  " : "\t";
  const auto line = [&](const std::string& title, const std::string& text) {
    terminal.print_line((terminal.is_for_people() ? title + std::string(9 - std::min<std::size_t>(title.size(), 8), ' ') : title + "\t") + text);
  };
  std::string format(recording::to_string(read->format));
  if (read->format == recording::Format::mcap) format += read->compression.empty() ? ", not compressed" : ", " + printable(read->compression);
  else format += ", version " + std::to_string(read->version);
  line("file", printable(name) + tab + format + tab + bytes_text(read->bytes));
  for (const std::string& robot : robots) line("robot", printable(robot));
  line("time", printable(header.started) + tab + number(last ? static_cast<double>(last->count()) / 1e6 : 0, 3) + " s");
  line("content", std::to_string(values) + " values" + tab + std::to_string(gaps) + (gaps == 1 ? " gap" : " gaps") + tab + std::to_string(left_out) +
                      " values missing in them");
  if (!read->is_complete) line("end", "not complete; what is before it was read: " + printable(read->problem));
  else if (read->damaged > 0) line("damaged", std::to_string(read->damaged) + ": " + printable(read->problem));
  if (summary.properties().empty()) return Exit::success;
  Table table;
  for (const recording::PropertySummary& property : summary.properties()) {
    const auto seconds = [](const std::optional<microseconds>& at) {
      return at ? number(static_cast<double>(at->count()) / 1e6, 3) : std::string("-");
    };
    table.add({{printable(property.name), Style::strong},
               {std::to_string(property.values)},
               {std::to_string(property.gaps), property.gaps > 0 ? Style::warning : Style::plain},
               {missing_text(property), property.gaps > 0 ? Style::warning : Style::plain},
               {seconds(property.first)},
               {seconds(property.last)},
               {printable(property.unit)},
               {printable(property.url), Style::faint}});
  }
  if (terminal.is_for_people()) terminal.print("\n");
  table.print(terminal, {"PROPERTY", "VALUES", "GAPS", "MISSING", "FROM", "TO", "UNIT", "IRI"});
  return Exit::success;
}

Result<int> record(Session& session, RecordOptions& options) {
  if (!options.words.empty() && options.words.front() == "info" && options.file.empty()) {
    if (options.words.size() != 2) return unexpected(Errc::invalid_option, "expected one file: lrt record info FILE");
    return info(session, options.words[1], options.json);
  }
  if (options.file.empty()) return unexpected(Errc::invalid_option, "--output is required");
  if (options.json) return unexpected(Errc::invalid_option, "--json is of lrt record info");
  recording::BagWriterOptions bag;
  bag.format = options.format == "mcap" || (options.format.empty() && ends_with(options.file, ".mcap")) ? recording::Format::mcap
                                                                                                        : recording::Format::json_lines;
  bag.compress = !options.no_compression;
  if (bag.format == recording::Format::mcap && bag.compress && !recording::mcap::has_zstd())
    session.warn("this program was built without libzstd: the file is not compressed");
  Recorder recorder(session, options);
  if (Result<void> found = recorder.find(); !found) return unexpected(std::move(found).error());
  OutputFile file;
  if (Result<void> opened = file.open(options.file, options.force); !opened) return unexpected(std::move(opened).error());
  const auto start = steady_clock::now();
  // To microseconds, as it is written.
  bag.started = std::chrono::floor<microseconds>(system_clock::now());
  bag.topics_are_iris = recorder.has_several_origins();
  client::RecordingHeader header{recorder.robots().front(), utc(bag.started), recorder.robots()};
  if (header.robots.size() == 1) header.robots.clear();
  const auto failed = [&](const Error& error) -> Result<int> {
    if (file.is_pipe_closed()) return Exit::pipe_closed;
    return unexpected(error);
  };
  Result<std::unique_ptr<recording::BagWriter>> writer = recording::begin_bag(header, bag, [&](std::string_view bytes) { return file.write(bytes); });
  if (!writer) return failed(writer.error());
  Result<int> result = recorder.run(**writer, start);
  Result<void> ended = (*writer)->end();
  if (ended) ended = file.close();
  if (file.is_pipe_closed()) return Exit::pipe_closed;
  if (!result) return unexpected(std::move(result).error());
  if (!ended) return unexpected(std::move(ended).error());
  if (session.terminal().shows_progress() && options.file != "-") {
    std::string said = std::to_string(recorder.values()) + " values in \"" + options.file + "\"";
    if (recorder.gaps() > 0)
      said += ", " + std::to_string(recorder.gaps()) + (recorder.gaps() == 1 ? " gap" : " gaps") + ", " + std::to_string(recorder.left_out()) +
              " values missing in them";
    session.warn(said);
  }
  if (*result == Exit::success && recorder.values() == 0) return unexpected(Errc::failed, "no value has come, and \"" + options.file + "\" has none");
  return result;
}

}  // namespace

void add_record(CommandLine& line) {
  auto options = std::make_shared<RecordOptions>();
  CLI::App* const command =
      line.add("record", "Write the changes of properties to a file that lrt replay and viewers read",
               "Ctrl-C ends it; what is written is readable at any time. Each value is in the file, or counted in a gap. Examples:\n"
               "  lrt record right_s0/position right_s1 -o wave.mcap --for 10   # a property, and all of a Thing\n"
               "  lrt record http://left/ arm/angle http://right/ arm/angle -o both.jsonl\n"
               "  lrt record info wave.mcap                                     # what is in a file",
               options, record);
  command->add_option("NAME", options->words, "Names or URLs of properties and Things; a URL before names is their robot")
      ->required()
      ->type_name("[ROBOT] NAME... | info FILE")
      ->expected(1, 1000);
  command->add_option("-o,--output", options->file, "The file; - is standard output")->type_name("FILE");
  command->add_flag("-f,--force", options->force, "Replace the file if it exists");
  command->add_option("--format", options->format, "jsonl (lines of JSON) or mcap; default: by the suffix, else jsonl")
      ->type_name("FORMAT")
      ->check(CLI::IsMember({"jsonl", "mcap"}));
  command->add_flag("--no-compression", options->no_compression, "Do not compress MCAP");
  command
      ->add_option("--queue", options->queue,
                   "Values that the robot holds while this program is slow, 1,000 by default; five times as many wait here")
      ->type_name("N")
      ->check(CLI::Range(std::size_t{1}, std::size_t{1} << 30));
  command->add_option("--count", options->count, "End after this number of values")
      ->type_name("N")
      ->check(CLI::Range(std::size_t{1}, std::size_t{1} << 40));
  command->add_option("--for", options->seconds, "End after this time")->type_name("SECONDS")->check(CLI::Range(0.0, 1e9));
  command->add_option("--via", options->via, "websocket, event-stream or polling; default: the first of them that the server has")
      ->type_name("PROTOCOL")
      ->transform(CLI::CheckedTransformer(std::map<std::string, client::Via>{
          {"websocket", client::Via::websocket}, {"event-stream", client::Via::event_stream}, {"polling", client::Via::polling}}));
  command->add_flag("--json", options->json, "Of info: print JSON");
}

}  // namespace lrt::tool
