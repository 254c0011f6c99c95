// SPDX-License-Identifier: Apache-2.0
// Any bytes as a journal: what is read is the same in pieces of any size, a change of a record whose sum is right is one, and changes that are read can
// be written and read again. The first byte says whether the rest is a file, or the content of a record.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "src/model/graph_changes.hpp"
#include "src/model/graph_state.hpp"
#include "src/server/journal_format.hpp"

using namespace lrt;

namespace {

std::string read(std::string_view bytes) {
  const auto source = [&](std::uint64_t offset, char* to, std::size_t size) -> Result<std::size_t> {
    if (offset > bytes.size()) std::abort();
    const std::size_t count = std::min<std::size_t>(size, bytes.size() - static_cast<std::size_t>(offset));
    std::copy_n(bytes.data() + offset, count, to);
    return count;
  };
  journal::Reader reader(source, bytes.size(), 0, 1);
  std::string again;
  while (true) {
    const std::uint64_t from = reader.offset();
    const auto record = reader.next();
    if (!record) std::abort();
    if (!*record) break;
    if (reader.offset() <= from || (*record)->content.size() != reader.offset() - from - journal::head_size) std::abort();
    again.append((*record)->content);
  }
  if (!reader.is_damaged()) std::abort();
  return again;
}

void replay(std::string_view text) {
  const GraphOptions limits;
  model::GraphEdit edit(rdf::Graph(), 0, "http://e.org/g", limits);
  edit.keep_changes();
  (void)model::replay_changes(text, edit);
  if (edit.error()) return;
  const std::string changes = edit.take_changes();
  model::GraphEdit second(rdf::Graph(), 0, "http://e.org/g", limits);
  if (!model::replay_changes(changes, second)) std::abort();
  const rdf::Graph one = edit.take(), two = second.take();
  if (one.size() != two.size()) std::abort();
  for (const rdf::Triple& t : one.triples())
    if (!two.contains(one.term(t.subject), one.term(t.predicate), one.term(t.object))) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  if ((data[0] & 1U) != 0) {
    replay(bytes);
    return 0;
  }
  (void)read(bytes);
  // The same bytes as records with right sums, and one damaged byte in them.
  std::string file;
  const std::size_t piece = 1U + data[0];
  std::uint64_t number = 1;
  for (std::string_view rest = bytes; !rest.empty(); rest.remove_prefix(std::min(piece, rest.size()))) {
    journal::append(file, journal::Kind::change, number, number - 1, rest.substr(0, piece));
    ++number;
  }
  if (read(file) != bytes) std::abort();
  if (file.empty()) return 0;
  file[size * 31 % file.size()] ^= 4;
  const std::string damaged = read(file);
  if (damaged.size() >= bytes.size() || bytes.substr(0, damaged.size()) != damaged) std::abort();
  return 0;
}
