// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include <lrt/base/result.hpp>
#include <lrt/model/representation.hpp>
#include <lrt/urdf.hpp>

namespace lrt::urdf {

/// A file of a package, below the package's folder.
struct PackageFile {
  std::string package, name;  ///< name: below the folder, decoded, "meshes/hand.stl"
  std::string folder;         ///< canonical
  std::string_view media_type;

  std::string path() const { return folder + '/' + name; }
};

/// Size and time of a file, and where it is. The time stamp makes a new version of a file another value.
struct FileState {
  std::uint64_t bytes = 0;
  std::chrono::system_clock::time_point modified{};
  std::string path;  ///< canonical
};

/// Finds the file that `package://NAME/...` names. It must be a regular file below the package's folder, after all symbolic links are
/// followed, and not larger than the limit.
/// @par Errors  unknown_path: no package:// IRI of a package that is allowed. refused: it is not below the folder. io_error: it is not there.
///              limit_exceeded
Result<PackageFile> find_file(std::string_view iri, const PackageOptions& options);

/// The same check, each time the file is used.
/// @par Errors  refused, io_error, limit_exceeded
Result<FileState> state_of(const PackageFile& file, std::size_t max_bytes);
/// @par Errors  io_error, limit_exceeded
Result<Bytes> read_file(const FileState& file, std::size_t max_bytes);

}  // namespace lrt::urdf
