// SPDX-License-Identifier: BSD-3-Clause
#include <array>

#include <orbis/core/simd/memory.hpp>

#include "core/simd/levels.hpp"

using namespace orbis;

namespace {

constexpr std::size_t rounds = 20;

/// From where lanes are gathered (64 numbers before and behind the middle of `numbers`) and which ones are wanted.
template <class T>
struct scattered {
  std::vector<T> numbers;
  std::vector<std::int32_t> places;  ///< for each round as many as there are lanes
  std::array<std::uint64_t, rounds> wanted{};
};

/// In each round: N lanes gathered everywhere, N where wanted, and 2 N into which those that are wanted are
/// compressed; then how many these are.
template <class T>
struct gathered {
  std::vector<T> numbers;
  std::array<std::size_t, rounds> compressed{};
};

template <class T, std::size_t N>
struct gather_and_compress {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const scattered<T>& in, gathered<T>& out) {
    using V = simd::vec<T, N, Target>;
    using I = simd::vec<std::int32_t, N, Target>;
    const T* const from = in.numbers.data() + 64;
    T* to = out.numbers.data();
    for (std::size_t k = 0; k != rounds; ++k, to += 4 * N) {
      const I at = I::load(in.places.data() + k * N);
      const auto m = V::mask_type::from_bits(in.wanted[k]);
      const V all = simd::gather(from, at);
      all.store(to);
      simd::gather(from, at, m, V(T(9))).store(to + N);
      out.compressed[k] = simd::compress_store(to + 2 * N, all, m);
    }
  }
};

template <class T>
[[gnu::noinline]] void check_gathered(const scattered<T>& in, const gathered<T>& out, std::size_t lanes) {
  const T* const from = in.numbers.data() + 64;
  const T* found = out.numbers.data();
  for (std::size_t k = 0; k != rounds; ++k, found += 4 * lanes) {
    std::vector<T> all, some, chosen;
    for (std::size_t i = 0; i != lanes; ++i) {
      const bool wanted = (in.wanted[k] >> i & 1U) != 0;
      all.push_back(from[in.places[k * lanes + i]]);
      some.push_back(wanted ? all.back() : T(9));
      if (wanted) chosen.push_back(all.back());
    }
    CAPTURE(k);
    test::check_same_bits({found, found + lanes}, all);
    test::check_same_bits({found + lanes, found + 2 * lanes}, some);
    const T* const packed = found + 2 * lanes;
    REQUIRE(out.compressed[k] == chosen.size());
    test::check_same_bits({packed, packed + chosen.size()}, chosen);
    CHECK(packed[lanes] == T(5));  // not beyond N
  }
}

template <class T, std::size_t N>
void check_scattered(std::uint64_t seed) {
  scattered<T> in{test::numbers<T>(128, seed), {}};
  random_bits random{N};
  for (std::size_t k = 0; k != rounds; ++k) {
    for (std::size_t i = 0; i != N; ++i) in.places.push_back(static_cast<std::int32_t>(random.below(128)) - 64);
    in.wanted[k] = k == 0 ? 0 : random();
  }
  for (const simd::level l : simd::available_levels()) {
    INFO("level " << static_cast<int>(l));
    gathered<T> out{std::vector<T>(4 * N * rounds, T(5))};
    simd::kernel<gather_and_compress<T, N>, void(const scattered<T>&, gathered<T>&), simd::popcnt, simd::avx2,
                 simd::avx512>(l)(in, out);
    check_gathered(in, out, N);
  }
}

}  // namespace

TEST_CASE("vectors gather their lanes and put those that are wanted together") {
  check_scattered<float, 8>(21);
  check_scattered<float, 16>(22);
  check_scattered<std::int32_t, 16>(23);
  check_scattered<double, 4>(24);
  check_scattered<double, 8>(25);
  check_scattered<std::uint64_t, 8>(26);
  check_scattered<std::uint16_t, 16>(27);
}
