// SPDX-License-Identifier: BSD-3-Clause
#include <bit>

#include <orbis/core/simd/mask.hpp>

#include "core/simd/levels.hpp"

using namespace orbis;

namespace {

template <std::size_t Size, std::size_t N>
struct masks {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const std::uint64_t& seed) {
    using M = simd::mask<Size, N, Target>;
    constexpr std::uint64_t every = ~std::uint64_t{0} >> (64 - N);
    random_bits random{seed};
    for (int k = 0; k != 20; ++k) {
      const std::uint64_t p = k == 0 ? 0 : k == 1 ? every : random() & every, q = random() & every;
      const M a = M::from_bits(p), b = M::from_bits(q);
      CHECK(bits(a) == p);
      CHECK(bits(a & b) == (p & q));
      CHECK(bits(a | b) == (p | q));
      CHECK(bits(a ^ b) == (p ^ q));
      CHECK(bits(!a) == (~p & every));
      CHECK(bits(and_not(a, b)) == (p & ~q));
      CHECK(any(a) == (p != 0));
      CHECK(none(a) == (p == 0));
      CHECK(all(a) == (p == every));
      CHECK(number_of(a) == static_cast<unsigned>(std::popcount(p)));
    }
    for (std::size_t n = 0; n <= N; ++n) CHECK(bits(M::first(n)) == (n == 64 ? every : (std::uint64_t{1} << n) - 1));
  }
};

}  // namespace

TEST_CASE("masks are made of bits and give them back, whatever the width") {
  test::on_every_level<masks<8, 2>>(std::uint64_t{1});
  test::on_every_level<masks<8, 8>>(std::uint64_t{2});
  test::on_every_level<masks<4, 8>>(std::uint64_t{3});
  test::on_every_level<masks<4, 16>>(std::uint64_t{4});
  test::on_every_level<masks<2, 8>>(std::uint64_t{5});
  test::on_every_level<masks<2, 32>>(std::uint64_t{6});
  test::on_every_level<masks<1, 8>>(std::uint64_t{7});
  test::on_every_level<masks<1, 32>>(std::uint64_t{8});
  test::on_every_level<masks<1, 64>>(std::uint64_t{9});
}
