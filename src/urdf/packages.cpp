// SPDX-License-Identifier: Apache-2.0
#include "src/urdf/packages.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <system_error>
#include <utility>

#include <lrt/base/iri.hpp>

#include "src/base/read_file.hpp"
#include "src/base/utf8.hpp"

namespace lrt::urdf {
namespace {

namespace fs = std::filesystem;

/// Media types of meshes as IANA has registered them (https://www.iana.org/assignments/media-types), by the end of the file's name. Formats
/// that are not registered (PLY, 3DS) are octets.
constexpr std::array<std::pair<std::string_view, std::string_view>, 7> media_types = {{{"stl", "model/stl"},
                                                                                       {"dae", "model/vnd.collada+xml"},
                                                                                       {"obj", "model/obj"},
                                                                                       {"mtl", "model/mtl"},
                                                                                       {"glb", "model/gltf-binary"},
                                                                                       {"gltf", "model/gltf+json"},
                                                                                       {"step", "model/step"}}};

std::string_view media_type_of(const std::string& name) {
  std::string ending = name.substr(name.rfind('.') + 1);
  for (char& c : ending)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  for (const auto& [known, type] : media_types)
    if (known == ending) return type;
  return "application/octet-stream";
}

/// Whether the names of `inner` begin with all names of `outer`. Both are canonical.
bool is_below(const fs::path& inner, const fs::path& outer) {
  return std::mismatch(outer.begin(), outer.end(), inner.begin(), inner.end()).first == outer.end();
}

}  // namespace

Result<PackageFile> find_file(std::string_view iri, const PackageOptions& options) {
  constexpr std::string_view scheme = "package://";
  if (iri.substr(0, scheme.size()) != scheme) return unexpected(Errc::unknown_path, "it is not a package:// IRI");
  iri.remove_prefix(scheme.size());
  const std::size_t slash = std::min(iri.find('/'), iri.size());
  PackageFile file;
  file.package = std::string(iri.substr(0, slash));
  const auto folder = options.folders.find(file.package);
  if (folder == options.folders.end()) return unexpected(Errc::unknown_path, "no folder is given for the package \"" + file.package + "\"");
  const std::string_view encoded = iri.substr(std::min(slash + 1, iri.size()));
  file.name = iri::decode(encoded).value_or(std::string(encoded));  // real files have a bare '%'
  if (utf8::find_invalid(file.name) || file.name.find('\0') != std::string::npos || fs::path(file.name).is_absolute())
    return unexpected(Errc::refused, "its name is not a relative path in UTF-8");
  std::string joined;
  for (const fs::path& part : fs::path(file.name)) {
    if (part == ".." || part == "." || part.empty()) return unexpected(Errc::refused, "its name contains \"" + part.string() + "\"");
    joined.append(joined.empty() ? "" : "/").append(part.string());  // "a//b" is "a/b"
  }
  file.name = std::move(joined);
  std::error_code error;
  file.folder = fs::canonical(folder->second, error).string();
  if (error) return unexpected(Errc::io_error, folder->second + ": " + error.message());
  file.media_type = media_type_of(file.name);
  if (const Result<FileState> state = state_of(file, options.max_bytes); !state) return Unexpected{state.error()};
  return file;
}

Result<FileState> state_of(const PackageFile& file, std::size_t max_bytes) {
  std::error_code error;
  const fs::path path = fs::canonical(file.path(), error);
  if (error) return unexpected(Errc::io_error, file.path() + ": " + error.message());
  if (!is_below(path, file.folder)) return unexpected(Errc::refused, file.path() + " leads out of the folder " + file.folder);
  if (!fs::is_regular_file(path, error)) return unexpected(Errc::refused, file.path() + " is not a file");
  FileState state;
  state.bytes = fs::file_size(path, error);
  if (error) return unexpected(Errc::io_error, file.path() + ": " + error.message());
  if (state.bytes > max_bytes)
    return unexpected(Errc::limit_exceeded, file.path() + " has " + std::to_string(state.bytes) + " bytes, more than " + std::to_string(max_bytes));
  const fs::file_time_type modified = fs::last_write_time(path, error);
  if (error) return unexpected(Errc::io_error, file.path() + ": " + error.message());
  // The epoch of file_time_type is not specified in C++17.
  static const auto offset = [] {
    const auto file_now = fs::file_time_type::clock::now().time_since_epoch();
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    return std::chrono::duration_cast<std::chrono::seconds>(now) - std::chrono::duration_cast<std::chrono::seconds>(file_now);
  }();
  state.modified =
      std::chrono::system_clock::time_point(std::chrono::duration_cast<std::chrono::system_clock::duration>(modified.time_since_epoch() + offset));
  state.path = path.string();
  return state;
}

Result<Bytes> read_file(const FileState& file, std::size_t max_bytes) {
  Result<std::string> bytes = lrt::read_file(file.path, max_bytes);
  if (!bytes) return unexpected(Errc::io_error, file.path + " cannot be read");
  if (bytes->size() > max_bytes) return unexpected(Errc::limit_exceeded, file.path + " has more than " + std::to_string(max_bytes) + " bytes");
  return std::make_shared<const std::string>(*std::move(bytes));
}

}  // namespace lrt::urdf
