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

/// Runs a kernel at every level that the processor has.
template <class Kernel, class... Args>
void on_every_level(const Args&... args) {
  for (const simd::level l : simd::available_levels()) {
    INFO("level " << static_cast<int>(l));
    simd::kernel<Kernel, void(const Args&...), simd::popcnt, simd::avx2, simd::avx512>(l)(args...);
  }
}

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

/// Whether two numbers are the same bits.
template <class T>
bool same_bits(const T& a, const T& b) {
  return std::memcmp(&a, &b, sizeof a) == 0;
}

/// CHECKs that `f(a[i], b[i])` is what the vector holds in lane i, bit by bit.
template <class V, class T, class F>
void check_lanes(const V& v, const T* a, const T* b, const F& f) {
  using U = typename V::value_type;
  U lanes[V::count];
  v.store(lanes);
  for (std::size_t i = 0; i != V::count; ++i) {
    const U expected = static_cast<U>(f(a[i], b[i]));
    if (!same_bits(lanes[i], expected)) {
      INFO("lane " << i << " of " << V::count << " numbers of " << sizeof(T) << " bytes");
      CHECK(+lanes[i] == +expected);
    }
  }
}

}  // namespace orbis::test
