// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A point cloud together with the other values that its file stores for each point: intensity, normals, time, labels.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include <orbis/core/point_cloud.hpp>

namespace orbis::io {

/// The number types that a cloud file may store.
enum class scalar_type { int8, uint8, int16, uint16, int32, uint32, int64, uint64, float32, float64 };

/// A named field of a cloud: `count` numbers of one type for each point.
struct cloud_field {
  std::string name;
  scalar_type type = scalar_type::float32;
  std::size_t count = 1;
  std::string bytes;  ///< little-endian, point by point
};

/// A cloud with the fields of its file that are neither coordinates nor colours.
struct cloud_with_fields {
  point_cloud cloud;
  std::vector<cloud_field> fields;  ///< in the order of the file, each with the values of all points
  /// VIEWPOINT of a PCD file: translation in metres, then a quaternion, w first.
  std::array<double, 7> viewpoint{0, 0, 0, 1, 0, 0, 0};
  std::vector<std::string> notes;  ///< warnings for the user: assumptions, and omitted parts of the file
};

namespace detail {

/// Joins the texts with commas; of more than 12 texts, lists the first 12 and the number of the others.
[[nodiscard]] inline std::string joined(const std::vector<std::string>& texts) {
  constexpr std::size_t most = 12;
  std::string all;
  for (std::size_t i = 0; i != std::min(most, texts.size()); ++i) all += (i == 0 ? "" : ", ") + texts[i];
  return texts.size() <= most ? all : all + " and " + std::to_string(texts.size() - most) + " more";
}

}  // namespace detail

/// The names of fields for a message: the first twelve, separated by commas, and the number of omitted ones.
[[nodiscard]] inline std::string field_names(const std::vector<cloud_field>& fields) {
  std::vector<std::string> names;
  for (const cloud_field& field : fields) names.push_back(field.name);
  return detail::joined(names);
}
[[deprecated("use field_names")]] [[nodiscard]] inline std::string names_of(const std::vector<cloud_field>& fields) {
  return field_names(fields);
}

}  // namespace orbis::io
