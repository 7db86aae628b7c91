// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Numbers in binary files, of either byte order.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

namespace orbis::io {

/// The number types a cloud file may store.
enum class scalar_type { int8, uint8, int16, uint16, int32, uint32, int64, uint64, float32, float64 };

/// Bytes of a number.
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

/// The `T` stored at `from` in the byte order `order`.
template <class T>
requires std::is_arithmetic_v<T>
[[nodiscard]] T load(const char* from, std::endian order = std::endian::little) noexcept {
  char bytes[sizeof(T)];
  std::memcpy(bytes, from, sizeof(T));
  if (order != std::endian::native) std::reverse(bytes, bytes + sizeof(T));
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

/// The number of type `type` stored at `from`.
[[nodiscard]] inline double load_as_double(const char* from, scalar_type type, std::endian order) noexcept {
  switch (type) {
    case scalar_type::int8: return load<std::int8_t>(from, order);
    case scalar_type::uint8: return load<std::uint8_t>(from, order);
    case scalar_type::int16: return load<std::int16_t>(from, order);
    case scalar_type::uint16: return load<std::uint16_t>(from, order);
    case scalar_type::int32: return load<std::int32_t>(from, order);
    case scalar_type::uint32: return load<std::uint32_t>(from, order);
    case scalar_type::int64: return static_cast<double>(load<std::int64_t>(from, order));
    case scalar_type::uint64: return static_cast<double>(load<std::uint64_t>(from, order));
    case scalar_type::float32: return static_cast<double>(load<float>(from, order));
    case scalar_type::float64: return load<double>(from, order);
  }
  return 0.0;
}

/// Appends `value` in little-endian order.
template <class T>
requires std::is_arithmetic_v<T>
void append_little_endian(std::string& to, T value) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  if constexpr (std::endian::native != std::endian::little) std::reverse(bytes, bytes + sizeof(T));
  to.append(bytes, sizeof(T));
}

}  // namespace orbis::io
