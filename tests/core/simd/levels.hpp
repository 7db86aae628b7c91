// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/core/simd.hpp>

#include "support/catch.hpp"

namespace orbis::test {

/// Numbers of all sizes, with the ends of the type's range among them.
template <class T>
std::vector<T> numbers(std::size_t n, std::uint64_t seed) {
  random_bits random{seed};
  std::vector<T> out(n);
  for (std::size_t i = 0; i != n; ++i) {
    if constexpr (std::is_floating_point_v<T>)
      out[i] = static_cast<T>((random.uniform() - 0.5) * (i % 3 == 0 ? 2.0 : 2000.0));
    else
      out[i] = static_cast<T>(random() >> (random() % 64));
  }
  out[n / 2] = std::numeric_limits<T>::max();
  out[n / 3] = std::numeric_limits<T>::lowest();
  out[n / 4] = 0;
  out[n / 5] = out[n / 5 + 1];
  return out;
}

/// CHECKs that two vectors hold the same bits.
template <class T>
[[gnu::noinline]] void check_same_bits(const std::vector<T>& found, const std::vector<T>& expected) {
  REQUIRE(found.size() == expected.size());
  for (std::size_t i = 0; i != found.size(); ++i)
    if (std::memcmp(&found[i], &expected[i], sizeof(T)) != 0) {
      INFO("number " << i << " of " << sizeof(T) << " bytes");
      CHECK(+found[i] == +expected[i]);
      if (found[i] == expected[i]) FAIL_CHECK("zeros of different signs");
    }
}

/// Where results go: those of each operation into a row of its own, one row behind the other. A kernel puts vectors
/// and its plain reference numbers, in the same order.
template <class T>
struct rows {
  T* to;  ///< the place in the next row
  std::size_t length;

  template <class V>
  ORBIS_ALWAYS_INLINE void put(const V& v) {
    if constexpr (simd::vector<V>)
      v.store(to);
    else
      *to = static_cast<T>(v);
    to += length;
  }
};

/// Runs a kernel at every level with room for the results, and CHECKs that these are as expected, bit by bit. Comparing
/// is no part of the kernel, which is compiled for many targets, types and sizes.
template <class Kernel, class T, class... Args>
void check_on_every_level(const std::vector<T>& expected, const Args&... args) {
  for (const simd::level l : simd::available_levels()) {
    INFO("level " << static_cast<int>(l));
    std::vector<T> found(expected.size());
    simd::kernel<Kernel, void(T*, const Args&...), simd::popcnt, simd::avx2, simd::avx512>(l)(found.data(), args...);
    check_same_bits(found, expected);
  }
}

}  // namespace orbis::test
