// SPDX-License-Identifier: Apache-2.0
// Any bytes as a recording, MCAP or lines of JSON: in pieces of any size it has the same changes, and what was read can be written and read again.
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "src/client/recording_json.hpp"
#include "src/recording/bag.hpp"

using namespace lrt;
using client::RecordedChange;

namespace {

struct Read {
  bool ok = false;
  recording::BagReport report;
  std::vector<RecordedChange> changes;
};

Read read(std::string_view bytes, std::size_t piece) {
  Read result;
  const Result<recording::BagReport> report = recording::read_bag(
      [&](char* buffer, std::size_t size) -> Result<std::size_t> {
        const std::size_t count = std::min({size, piece, bytes.size()});
        std::copy_n(bytes.data(), count, buffer);
        bytes.remove_prefix(count);
        return count;
      },
      [](const client::RecordingHeader&) -> Result<recording::BagRange> { return recording::BagRange{}; },
      [&](RecordedChange&& change) -> Result<void> {
        result.changes.push_back(std::move(change));
        return {};
      });
  result.ok = static_cast<bool>(report);
  if (report) result.report = *report;
  return result;
}

std::string text_of(const RecordedChange& change) {
  return std::to_string(change.at.count()) + "\n" + change.name + "\n" + change.url + "\n" + change.robot + "\n" + client::detail::members_of(change);
}

void check_same(const Read& a, const Read& b) {
  if (a.ok != b.ok || a.changes.size() != b.changes.size()) std::abort();
  for (std::size_t i = 0; i < a.changes.size(); ++i)
    if (text_of(a.changes[i]) != text_of(b.changes[i])) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  const Read whole = read(bytes, bytes.size() + 1), pieces = read(bytes, 1U + data[0] % 32U);
  check_same(whole, pieces);
  if (whole.ok && (whole.report.bytes != pieces.report.bytes || whole.report.damaged != pieces.report.damaged)) std::abort();

  recording::Summary summary;
  recording::ReplayPlan plan({}, 1'000'000);
  for (const RecordedChange& change : whole.changes) {
    summary.add(change);
    static_cast<void>(plan.add(change));
  }
  plan.finish(false);
  if (!std::is_sorted(plan.steps().begin(), plan.steps().end(), [](const auto& a, const auto& b) { return a.due < b.due; })) std::abort();

  for (const recording::Format format : {recording::Format::json_lines, recording::Format::mcap}) {
    recording::BagWriterOptions options;
    options.format = format;
    std::string again;
    auto writer = recording::begin_bag(whole.report.header, options, [&](std::string_view more) -> Result<void> {
      again += more;
      return {};
    });
    if (!writer) std::abort();
    for (const RecordedChange& change : whole.changes)
      if (!(*writer)->add(change)) return 0;  // more channels than a file can have
    if (!(*writer)->end()) std::abort();
    const Read second = read(again, again.size() + 1);
    if (!second.ok || !second.report.is_complete || second.changes.size() + second.report.damaged != whole.changes.size()) std::abort();
  }
  return 0;
}
