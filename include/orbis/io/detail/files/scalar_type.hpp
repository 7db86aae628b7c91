// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The number types of cloud files: their sizes, and conversion from and to bytes.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <orbis/core/bytes.hpp>
#include <orbis/io/cloud_fields.hpp>

namespace orbis::io::detail {

/// Returns `f(T{})` for the C++ type of `type`.
template <class F>
constexpr decltype(auto) with_type(scalar_type type, F&& f) {
  switch (type) {
    case scalar_type::int8: return f(std::int8_t{});
    case scalar_type::uint8: return f(std::uint8_t{});
    case scalar_type::int16: return f(std::int16_t{});
    case scalar_type::uint16: return f(std::uint16_t{});
    case scalar_type::int32: return f(std::int32_t{});
    case scalar_type::uint32: return f(std::uint32_t{});
    case scalar_type::int64: return f(std::int64_t{});
    case scalar_type::uint64: return f(std::uint64_t{});
    case scalar_type::float32: return f(float{});
    case scalar_type::float64: break;
  }
  return f(double{});
}

/// Size of a number, bytes.
[[nodiscard]] constexpr std::size_t byte_size(scalar_type type) noexcept {
  return with_type(type, [](auto zero) { return sizeof zero; });
}

[[nodiscard]] constexpr bool is_floating(scalar_type type) noexcept {
  return type == scalar_type::float32 || type == scalar_type::float64;
}

/// The number of type `type` stored at `from`.
[[nodiscard]] inline double load_as_double(const char* from, scalar_type type, std::endian order) noexcept {
  return with_type(type, [&](auto zero) { return static_cast<double>(load_number<decltype(zero)>(from, order)); });
}

/// Stores a number at `to`.
template <class T>
void store_little_endian(char* to, T value) noexcept {
  const T stored = load_number<T>(reinterpret_cast<const char*>(&value), std::endian::little);
  std::memcpy(to, &stored, sizeof stored);
}

}  // namespace orbis::io::detail
