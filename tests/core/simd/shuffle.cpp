// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/core/simd/shuffle.hpp>

#include "core/simd/levels.hpp"

using namespace orbis;

namespace {

/// CHECKs that lane i is `f(i)`.
template <class V, class F>
void check_each(const V& v, const F& f) {
  for (std::size_t i = 0; i != V::count; ++i) CHECK(v[i] == f(i));
}

template <class T, std::size_t N>
struct interleaving {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const int&) {
    using V = simd::vec<T, N, Target>;
    const V a = V::iota(), b = a + V(T(N));
    const auto merged = [](std::size_t i) { return static_cast<T>(i / 2 + i % 2 * N); };
    check_each(simd::zip_low(a, b), merged);
    check_each(simd::zip_high(a, b), [&](std::size_t i) { return merged(i + N); });
    check_each(simd::unzip_even(simd::zip_low(a, b), simd::zip_high(a, b)), [](std::size_t i) { return T(i); });
    check_each(simd::unzip_odd(simd::zip_low(a, b), simd::zip_high(a, b)), [](std::size_t i) { return T(i + N); });
    if constexpr (N * sizeof(T) >= 16) {
      constexpr std::size_t block = 16 / sizeof(T);
      const auto in_block = [](std::size_t i, std::size_t offset) {
        return static_cast<T>(i / block * block + offset + i % block / 2 + i % 2 * N);
      };
      check_each(simd::zip_low_in_blocks(a, b), [&](std::size_t i) { return in_block(i, 0); });
      check_each(simd::zip_high_in_blocks(a, b), [&](std::size_t i) { return in_block(i, block / 2); });
    }
  }
};

template <class T, std::size_t N>
struct tables {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const std::vector<T>& in) {
    using V = simd::vec<T, N, Target>;
    using I = simd::vec<std::int32_t, N, Target>;
    const V low = V::load(in.data()), high = V::load(in.data() + N);
    for (int k = 0; k != 5; ++k) {
      const I at = (I::iota() * (2 * k + 1) + k) & (2 * int(N) - 1), near = at & (int(N) - 1);
      check_each(simd::look_up(low, near), [&](std::size_t i) { return in[std::size_t(near[i])]; });
      check_each(simd::look_up(low, high, at), [&](std::size_t i) { return in[std::size_t(at[i])]; });
    }
  }
};

template <std::size_t N>
struct byte_tables {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const std::vector<std::uint8_t>& in) {
    using V = simd::vec<std::uint8_t, N, Target>;
    const V table = V::load(in.data()), at = V::load(in.data() + 64);
    check_each(simd::look_up_in_blocks(table, at),
               [&](std::size_t i) { return at[i] < 128 ? in[i / 16 * 16 + at[i] % 16] : std::uint8_t{0}; });
  }
};

struct constants {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const int&) {
    using V = simd::vec<std::int32_t, 4, Target>;
    const V a = V::iota(), b = a + 4;
    check_each(simd::shuffle<3, 2, 1, 0>(a), [](std::size_t i) { return 3 - int(i); });
    check_each(simd::shuffle<0, 4, 1, 5>(a, b), [](std::size_t i) { return int(i / 2 + i % 2 * 4); });
    check_each(simd::shuffle<6, 1>(a, b), [](std::size_t i) { return i == 0 ? 6 : 1; });
  }
};

}  // namespace

TEST_CASE("vectors are interleaved and taken apart again") {
  test::on_every_level<interleaving<std::uint8_t, 16>>(0);
  test::on_every_level<interleaving<std::uint8_t, 64>>(0);
  test::on_every_level<interleaving<std::uint16_t, 16>>(0);
  test::on_every_level<interleaving<float, 8>>(0);
  test::on_every_level<interleaving<double, 8>>(0);
}
TEST_CASE("lanes and bytes are looked up in tables") {
  test::on_every_level<tables<float, 8>>(test::numbers<float>(32, 31));
  test::on_every_level<tables<float, 16>>(test::numbers<float>(32, 32));
  test::on_every_level<tables<std::int32_t, 16>>(test::numbers<std::int32_t>(32, 33));
  const auto bytes = test::numbers<std::uint8_t>(128, 34);
  test::on_every_level<byte_tables<16>>(bytes);
  test::on_every_level<byte_tables<32>>(bytes);
  test::on_every_level<byte_tables<64>>(bytes);
}
TEST_CASE("constant shuffles choose lanes from two vectors") { test::on_every_level<constants>(0); }
