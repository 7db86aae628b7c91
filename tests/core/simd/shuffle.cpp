// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/core/simd/shuffle.hpp>

#include "core/simd/levels.hpp"

using namespace orbis;

namespace {

/// Of 0, 1, 2 ... and what follows it.
template <class T, std::size_t N>
struct interleaving {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(T* out) {
    using V = simd::vec<T, N, Target>;
    const V a = V::iota(), b = a + V(T(N));
    test::rows<T> to{out, N};
    to.put(simd::zip_low(a, b));
    to.put(simd::zip_high(a, b));
    to.put(simd::unzip_even(simd::zip_low(a, b), simd::zip_high(a, b)));
    to.put(simd::unzip_odd(simd::zip_low(a, b), simd::zip_high(a, b)));
    if constexpr (N * sizeof(T) >= 16) {
      to.put(simd::zip_low_in_blocks(a, b));
      to.put(simd::zip_high_in_blocks(a, b));
    }
  }
};

template <class T, std::size_t N>
void check_interleaving() {
  constexpr std::size_t block = 16 / sizeof(T);
  std::vector<T> expected((N >= block ? 6 : 4) * N);
  for (std::size_t i = 0; i != N; ++i) {
    test::rows<T> to{expected.data() + i, N};
    to.put(i / 2 + i % 2 * N);
    to.put((i + N) / 2 + i % 2 * N);
    to.put(i);
    to.put(i + N);
    if (N >= block) {
      to.put(i / block * block + i % block / 2 + i % 2 * N);
      to.put(i / block * block + block / 2 + i % block / 2 + i % 2 * N);
    }
  }
  test::check_on_every_level<interleaving<T, N>>(expected);
}

/// Rows of N: what stands at some places of a table of N, and of one of 2 N.
template <class T, std::size_t N>
struct tables {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(T* out, const std::vector<T>& in) {
    using V = simd::vec<T, N, Target>;
    using I = simd::vec<std::int32_t, N, Target>;
    const V low = V::load(in.data()), high = V::load(in.data() + N);
    test::rows<T> to{out, N};
    for (int k = 0; k != 5; ++k) {
      const I at = (I::iota() * (2 * k + 1) + k) & (2 * int(N) - 1), near = at & (int(N) - 1);
      to.put(simd::look_up(low, near));
      to.put(simd::look_up(low, high, at));
    }
  }
};

template <class T, std::size_t N>
void check_tables(std::uint64_t seed) {
  const auto in = test::numbers<T>(32, seed);
  std::vector<T> expected(10 * N);
  for (std::size_t i = 0; i != N; ++i) {
    test::rows<T> to{expected.data() + i, N};
    for (std::size_t k = 0; k != 5; ++k) {
      const std::size_t at = (i * (2 * k + 1) + k) % (2 * N);
      to.put(in[at % N]);
      to.put(in[at]);
    }
  }
  test::check_on_every_level<tables<T, N>>(expected, in);
}

template <std::size_t N>
struct byte_tables {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(std::uint8_t* out, const std::vector<std::uint8_t>& in) {
    using V = simd::vec<std::uint8_t, N, Target>;
    simd::look_up_in_blocks(V::load(in.data()), V::load(in.data() + 64)).store(out);
  }
};

template <std::size_t N>
void check_byte_tables() {
  const auto in = test::numbers<std::uint8_t>(128, 34);
  std::vector<std::uint8_t> expected(N);
  for (std::size_t i = 0; i != N; ++i) {
    const std::uint8_t at = in[64 + i];
    expected[i] = at < 128 ? in[i / 16 * 16 + at % 16] : std::uint8_t{0};
  }
  test::check_on_every_level<byte_tables<N>>(expected, in);
}

struct constants {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(std::int32_t* out) {
    using V = simd::vec<std::int32_t, 4, Target>;
    const V a = V::iota(), b = a + 4;
    simd::shuffle<3, 2, 1, 0>(a).store(out);
    simd::shuffle<0, 4, 1, 5>(a, b).store(out + 4);
    simd::shuffle<6, 1>(a, b).store(out + 8);
  }
};

}  // namespace

TEST_CASE("vectors are interleaved and taken apart again") {
  check_interleaving<std::uint8_t, 16>();
  check_interleaving<std::uint8_t, 64>();
  check_interleaving<std::uint16_t, 16>();
  check_interleaving<float, 8>();
  check_interleaving<double, 8>();
}
TEST_CASE("lanes and bytes are looked up in tables") {
  check_tables<float, 8>(31);
  check_tables<float, 16>(32);
  check_tables<std::int32_t, 16>(33);
  check_byte_tables<16>();
  check_byte_tables<32>();
  check_byte_tables<64>();
}
TEST_CASE("constant shuffles choose lanes from two vectors") {
  test::check_on_every_level<constants>(std::vector<std::int32_t>{3, 2, 1, 0, 0, 4, 1, 5, 6, 1});
}
