// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include <lrt/base/result.hpp>

namespace lrt::ros2 {

/// Pixels in memory, as in sensor_msgs/msg/Image.
struct Pixels {
  std::uint32_t width = 0, height = 0;
  std::uint32_t step = 0;       ///< bytes of a row
  std::string_view encoding{};  ///< of sensor_msgs/image_encodings: "rgb8"
  bool big_endian = false;      ///< numbers of 16 and 32 bits
  std::string_view bytes{};     ///< step * height
};

/// An image as PNG. Colours and grey of 8 and 16 bits keep their values; "32FC1" and "16UC1" are depths: 16 bits of grey in millimetres ("32FC1" in
/// metres is converted; what is not finite, negative or above 65.5 m is 0). A Bayer pattern is shown as grey.
/// @par Errors  unsupported_syntax: another encoding, or sizes that contradict each other; limit_exceeded
Result<std::string> png_of(const Pixels& pixels, std::size_t max_bytes);

/// A grid of nav_msgs/msg/OccupancyGrid as PNG with 8 bits of grey, as map_server writes it: free is 254, occupied 0, unknown 205; the first row
/// is the one with the greatest y.
Result<std::string> png_of_grid(std::uint32_t width, std::uint32_t height, std::string_view cells, std::size_t max_bytes);

/// Grey or colour rows as PNG: `channels` 1 to 4, `depth` 8 or 16 bits (big endian). Compressed by runs, which is fast.
/// @pre rows.size() == width * channels * depth / 8 * height
std::string png(std::uint32_t width, std::uint32_t height, unsigned channels, unsigned depth, std::string_view rows);

/// Where the coordinates of a point are, in sensor_msgs/msg/PointCloud2.
struct CloudLayout {
  std::uint32_t width = 0, height = 0, point_step = 0, row_step = 0;
  std::uint32_t offsets[3] = {0, 0, 0};  ///< of x, y and z in a point
  bool is_double[3] = {false, false, false};
  bool big_endian = false;
};
/// The coordinates of all points, in their order, as float32 in little endian: x y z of the first, ... A point that is not valid has NaN.
/// @par Errors  unsupported_syntax: sizes that contradict each other; limit_exceeded
Result<std::string> coordinates_of(const CloudLayout& layout, std::string_view data, std::size_t max_bytes);

}  // namespace lrt::ros2
