// SPDX-License-Identifier: BSD-3-Clause
#include <bit>

#include <orbis/core/simd/mask.hpp>

#include "core/simd/levels.hpp"

using namespace orbis;

namespace {

/// Pairs of bit patterns.
using patterns = std::vector<std::pair<std::uint64_t, std::uint64_t>>;

template <std::size_t Size, std::size_t N>
struct masks {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(std::uint64_t* out, const patterns& in) {
    using M = simd::mask<Size, N, Target>;
    for (const auto& [p, q] : in) {
      const M a = M::from_bits(p), b = M::from_bits(q);
      *out++ = bits(a);
      *out++ = bits(a & b);
      *out++ = bits(a | b);
      *out++ = bits(a ^ b);
      *out++ = bits(!a);
      *out++ = bits(and_not(a, b));
      *out++ = any(a);
      *out++ = none(a);
      *out++ = all(a);
      *out++ = popcount(a);
    }
    for (std::size_t n = 0; n <= N; ++n) *out++ = bits(M::first(n));
  }
};

/// The plain reference for masks of n lanes.
[[gnu::noinline]] std::vector<std::uint64_t> expected_masks(const patterns& in, std::size_t lanes) {
  const std::uint64_t every = ~std::uint64_t{0} >> (64 - lanes);
  std::vector<std::uint64_t> out;
  for (const auto& [p, q] : in)
    for (const std::uint64_t x : {p, p & q, p | q, p ^ q, ~p & every, p & ~q, std::uint64_t{p != 0},
                                  std::uint64_t{p == 0}, std::uint64_t{p == every}, std::uint64_t(std::popcount(p))})
      out.push_back(x);
  for (std::size_t n = 0; n <= lanes; ++n) out.push_back(n == 64 ? every : (std::uint64_t{1} << n) - 1);
  return out;
}

template <std::size_t Size, std::size_t N>
void check_masks(std::uint64_t seed) {
  constexpr std::uint64_t every = ~std::uint64_t{0} >> (64 - N);
  random_bits random{seed};
  patterns in;
  for (int k = 0; k != 20; ++k) {
    const std::uint64_t p = k == 0 ? 0 : k == 1 ? every : random() & every;
    in.emplace_back(p, random() & every);
  }
  test::check_on_every_level<masks<Size, N>>(expected_masks(in, N), in);
}

}  // namespace

TEST_CASE("masks are made of bits and give them back, whatever the width") {
  check_masks<8, 2>(1);
  check_masks<8, 8>(2);
  check_masks<4, 8>(3);
  check_masks<4, 16>(4);
  check_masks<2, 8>(5);
  check_masks<2, 32>(6);
  check_masks<1, 8>(7);
  check_masks<1, 32>(8);
  check_masks<1, 64>(9);
}
