// SPDX-License-Identifier: Apache-2.0
#include "src/client/structure_store.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string_view>

#include "src/base/descriptor.hpp"
#include "src/exchange/tls.hpp"
#include "src/rdf/hash.hpp"

namespace lrt::client {
inline namespace v0 {

namespace {

constexpr std::string_view mark = "lrt structure 1\n";
constexpr std::size_t key_size = 64;

bool is_key(std::string_view name) noexcept {
  return name.size() == key_size && name.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

std::string number(std::uint64_t n) { return std::to_string(n); }

/// A line; nullopt: there is none. A line of a URL or an entity tag has no control characters.
std::optional<std::string_view> take_line(std::string_view& rest) {
  const std::size_t end = rest.find('\n');
  if (end == std::string_view::npos) return std::nullopt;
  const std::string_view line = rest.substr(0, end);
  rest.remove_prefix(end + 1);
  return line;
}

std::optional<std::uint64_t> take_number(std::string_view& rest) {
  const std::optional<std::string_view> line = take_line(rest);
  std::uint64_t n = 0;
  if (!line || line->empty()) return std::nullopt;
  const auto [end, error] = std::from_chars(line->data(), line->data() + line->size(), n);
  return error == std::errc() && end == line->data() + line->size() ? std::optional(n) : std::nullopt;
}

std::string written(const StoredStructure& document) {
  std::string text;
  for (const std::string* line : {&document.start, &document.url, &document.entity_tag}) text.append(*line).append("\n");
  text.append(number(document.pages.size())).append("\n");
  for (const std::string& page : document.pages) text.append(number(page.size())).append("\n");
  for (const std::string& page : document.pages) text.append(page);
  return std::string(mark) + number(rdf::hash_bytes(text, 0)) + "\n" + text;
}

std::optional<StoredStructure> parsed(std::string_view rest) {
  if (rest.substr(0, mark.size()) != mark) return std::nullopt;
  rest.remove_prefix(mark.size());
  const auto hash = take_number(rest);
  if (!hash || *hash != rdf::hash_bytes(rest, 0)) return std::nullopt;
  StoredStructure document;
  for (std::string* line : {&document.start, &document.url, &document.entity_tag}) {
    const auto text = take_line(rest);
    if (!text) return std::nullopt;
    *line = *text;
  }
  const auto count = take_number(rest);
  if (!count || *count == 0 || *count > rest.size()) return std::nullopt;
  std::vector<std::uint64_t> sizes;
  for (std::uint64_t i = 0; i < *count; ++i) {
    const auto size = take_number(rest);
    if (!size) return std::nullopt;
    sizes.push_back(*size);
  }
  for (const std::uint64_t size : sizes) {
    if (size > rest.size()) return std::nullopt;
    document.pages.emplace_back(rest.substr(0, size));
    rest.remove_prefix(size);
  }
  return rest.empty() ? std::optional(std::move(document)) : std::nullopt;
}

bool is_private(const struct stat& status) noexcept { return status.st_uid == ::geteuid() && (status.st_mode & (S_IRWXG | S_IRWXO)) == 0; }

bool write_all(int file, std::string_view bytes) noexcept {
  while (!bytes.empty()) {
    const ssize_t n = ::write(file, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
  return true;
}

/// Makes a folder with those above it.
void make_folders(const std::string& folder) {
  for (std::size_t slash = folder.find('/', 1); slash != std::string::npos; slash = folder.find('/', slash + 1))
    ::mkdir(folder.substr(0, slash).c_str(), 0700);
  ::mkdir(folder.c_str(), 0700);
}

}  // namespace

std::string StructureStore::key(const std::string& url, const std::vector<std::pair<std::string, std::string>>& fields) {
  std::string text = number(url.size()) + ":" + url;
  for (const auto& [name, value] : fields) text += number(name.size()) + ":" + name + number(value.size()) + ":" + value;
  return exchange::sha256(text);
}

/// A folder that others could write to is not used: what is in it would be believed.
bool StructureStore::has_folder() const {
  struct stat status {};
  return ::lstat(folder_.c_str(), &status) == 0 && S_ISDIR(status.st_mode) && is_private(status);
}

std::optional<StructureStore::Found> StructureStore::find(const std::string& key) const {
  if (!is_key(key) || !has_folder()) return std::nullopt;
  const Descriptor file(::open(path_of(key).c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK));
  struct stat status {};
  if (!file || ::fstat(file.get(), &status) != 0 || !S_ISREG(status.st_mode) || !is_private(status)) return std::nullopt;
  if (status.st_size <= 0 || static_cast<std::uint64_t>(status.st_size) > max_file_bytes) return std::nullopt;
  std::string bytes(static_cast<std::size_t>(status.st_size), '\0');
  std::size_t got = 0;
  while (got < bytes.size()) {
    const ssize_t n = ::read(file.get(), bytes.data() + got, bytes.size() - got);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return std::nullopt;
    got += static_cast<std::size_t>(n);
  }
  std::optional<StoredStructure> document = parsed(bytes);
  if (!document) return std::nullopt;
  const auto since = std::chrono::seconds(status.st_mtim.tv_sec) + std::chrono::nanoseconds(status.st_mtim.tv_nsec);
  return Found{*std::move(document), std::chrono::system_clock::time_point(std::chrono::duration_cast<std::chrono::system_clock::duration>(since))};
}

void StructureStore::put(const std::string& key, const StoredStructure& document) const {
  const auto has_control = [](const std::string& text) {
    return std::any_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20; });
  };
  if (!is_key(key) || has_control(document.start) || has_control(document.url) || has_control(document.entity_tag)) return;
  const std::string bytes = written(document);
  if (bytes.size() > max_file_bytes) return remove(key);
  make_folders(folder_);
  if (!has_folder()) return;
  std::string fresh = path_of("new-XXXXXX");
  Descriptor file(::mkostemp(fresh.data(), O_CLOEXEC));  // 0600
  if (!file) return;
  const bool written = write_all(file.get(), bytes) && file.close();
  if (!written || ::rename(fresh.c_str(), path_of(key).c_str()) != 0) {
    ::unlink(fresh.c_str());
    return;
  }
  remove_oldest();
}

void StructureStore::confirm(const std::string& key) const {
  if (is_key(key)) ::utimensat(AT_FDCWD, path_of(key).c_str(), nullptr, AT_SYMLINK_NOFOLLOW);
}

void StructureStore::remove(const std::string& key) const {
  if (is_key(key)) ::unlink(path_of(key).c_str());
}

void StructureStore::remove_oldest() const {
  struct File {
    std::string name;
    timespec confirmed;
    std::uint64_t bytes;
  };
  const std::unique_ptr<DIR, int (*)(DIR*)> folder(::opendir(folder_.c_str()), &::closedir);
  if (!folder) return;
  std::vector<File> files;
  std::uint64_t bytes = 0;
  while (const dirent* const entry = ::readdir(folder.get())) {
    struct stat status {};
    const std::string name = entry->d_name;
    const bool is_left = name.compare(0, 4, "new-") == 0;
    if ((!is_key(name) && !is_left) || ::lstat(path_of(name).c_str(), &status) != 0 || !S_ISREG(status.st_mode)) continue;
    files.push_back({name, status.st_mtim, static_cast<std::uint64_t>(status.st_size)});
    bytes += files.back().bytes;
  }
  std::sort(files.begin(), files.end(), [](const File& a, const File& b) {
    return std::make_pair(a.confirmed.tv_sec, a.confirmed.tv_nsec) < std::make_pair(b.confirmed.tv_sec, b.confirmed.tv_nsec);
  });
  std::size_t left = files.size();
  for (const File& file : files) {
    if (left <= max_files && bytes <= max_bytes) return;
    ::unlink(path_of(file.name).c_str());
    bytes -= file.bytes;
    --left;
  }
}

}  // namespace v0
}  // namespace lrt::client
