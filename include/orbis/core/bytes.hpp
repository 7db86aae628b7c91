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

namespace orbis {

/// The `T` stored at `from` in the byte order `order`.
template <class T>
requires std::is_arithmetic_v<T>
[[nodiscard]] T load_number(const char* from, std::endian order = std::endian::little) noexcept {
  char bytes[sizeof(T)];
  std::memcpy(bytes, from, sizeof(T));
  if (order != std::endian::native) std::reverse(bytes, bytes + sizeof(T));
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return value;
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

}  // namespace orbis
