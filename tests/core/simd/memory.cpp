// SPDX-License-Identifier: BSD-3-Clause
#include <array>

#include <orbis/core/simd/memory.hpp>

#include "core/simd/levels.hpp"

using namespace orbis;

namespace {

template <class T, std::size_t N>
struct scattered {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const std::vector<T>& in) {
    using V = simd::vec<T, N, Target>;
    using I = simd::vec<std::int32_t, N, Target>;
    random_bits random{N};
    for (int k = 0; k != 20; ++k) {
      std::array<std::int32_t, N> place;
      for (auto& p : place) p = static_cast<std::int32_t>(random.below(128)) - 64;
      const T* const from = in.data() + 64;
      const std::uint64_t wanted = k == 0 ? 0 : random();
      const auto m = V::mask_type::from_bits(wanted);
      const V all = simd::gather(from, I::load(place.data()));
      const V some = simd::gather(from, I::load(place.data()), m, V(T(9)));
      for (std::size_t i = 0; i != N; ++i) {
        CHECK(test::same_bits(all[i], from[place[i]]));
        CHECK(test::same_bits(some[i], (wanted >> i & 1U) != 0 ? from[place[i]] : T(9)));
      }
      std::array<T, 2 * N> out{};
      out[N] = T(5);
      const std::size_t n = simd::compress_store(out.data(), all, m);
      CHECK(n == number_of(m));
      CHECK(out[N] == T(5));  // not beyond N
      std::size_t next = 0;
      for (std::size_t i = 0; i != N; ++i)
        if ((wanted >> i & 1U) != 0) CHECK(test::same_bits(out[next++], all[i]));
    }
  }
};

}  // namespace

TEST_CASE("vectors gather their lanes and put those that are wanted together") {
  test::on_every_level<scattered<float, 8>>(test::numbers<float>(128, 21));
  test::on_every_level<scattered<float, 16>>(test::numbers<float>(128, 22));
  test::on_every_level<scattered<std::int32_t, 16>>(test::numbers<std::int32_t>(128, 23));
  test::on_every_level<scattered<double, 4>>(test::numbers<double>(128, 24));
  test::on_every_level<scattered<double, 8>>(test::numbers<double>(128, 25));
  test::on_every_level<scattered<std::uint64_t, 8>>(test::numbers<std::uint64_t>(128, 26));
  test::on_every_level<scattered<std::uint16_t, 16>>(test::numbers<std::uint16_t>(128, 27));
}
