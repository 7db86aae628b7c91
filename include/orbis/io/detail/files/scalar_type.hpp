// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The number types of binary cloud files.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

#include <orbis/core/bytes.hpp>

namespace orbis::io::detail {

/// The number types that a cloud file may store.
enum class scalar_type { int8, uint8, int16, uint16, int32, uint32, int64, uint64, float32, float64 };

/// Size of a number, bytes.
[[nodiscard]] constexpr std::size_t size_of(scalar_type type) noexcept {
  switch (type) {
    case scalar_type::int8:
    case scalar_type::uint8: return 1;
    case scalar_type::int16:
    case scalar_type::uint16: return 2;
    case scalar_type::int32:
    case scalar_type::uint32:
    case scalar_type::float32: return 4;
    case scalar_type::int64:
    case scalar_type::uint64:
    case scalar_type::float64: return 8;
  }
  return 0;
}

/// The number of type `type` stored at `from`.
[[nodiscard]] inline double load_as_double(const char* from, scalar_type type, std::endian order) noexcept {
  switch (type) {
    case scalar_type::int8: return load_number<std::int8_t>(from, order);
    case scalar_type::uint8: return load_number<std::uint8_t>(from, order);
    case scalar_type::int16: return load_number<std::int16_t>(from, order);
    case scalar_type::uint16: return load_number<std::uint16_t>(from, order);
    case scalar_type::int32: return load_number<std::int32_t>(from, order);
    case scalar_type::uint32: return load_number<std::uint32_t>(from, order);
    case scalar_type::int64: return static_cast<double>(load_number<std::int64_t>(from, order));
    case scalar_type::uint64: return static_cast<double>(load_number<std::uint64_t>(from, order));
    case scalar_type::float32: return static_cast<double>(load_number<float>(from, order));
    case scalar_type::float64: return load_number<double>(from, order);
  }
  return 0.0;
}

}  // namespace orbis::io::detail
