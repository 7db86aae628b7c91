// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>
#include <vector>

#include <orbis/core/lanes.hpp>
#include <orbis/core/random.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

/// Everything lanes can do, on eight numbers at a time.
template <int Native>
ORBIS_ALWAYS_INLINE void everything(const double* a, const double* b, double* out) {
  using L = simd::lanes<Native>;
  const L x = L::load(a), y = L::load(b);
  const auto less = x < y, equal = x == y;
  L r[] = {x + y,
           x - y,
           x * y,
           x / y,
           x * y + x * x - 3.0 * y,
           select(less, x, y),
           select((x <= y) & !equal, L(1.0), L(0.0)),
           select(less | equal, L(1.0), L(0.0)),
           simd::reciprocal_root(x * x + 1e-9),
           simd::square_root(x * x)};
  for (const L& v : r) {
    v.store(out);
    out += simd::lane_count;
  }
  for (const L& v : r) *out++ = simd::sum(v);
}

using kernel = void(const double*, const double*, double*);
ORBIS_UNFUSED void everything_portable(const double* a, const double* b, double* out) { everything<2>(a, b, out); }
#if ORBIS_X86
ORBIS_UNFUSED ORBIS_TARGET_AVX2 void everything_avx2(const double* a, const double* b, double* out) {
  everything<4>(a, b, out);
}
ORBIS_UNFUSED ORBIS_TARGET_AVX512 void everything_avx512(const double* a, const double* b, double* out) {
  everything<8>(a, b, out);
}
constexpr simd::variants<kernel> all{everything_portable, nullptr, everything_avx2, everything_avx512};
#else
constexpr simd::variants<kernel> all{everything_portable};
#endif

bool same_bits(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0 || (std::isnan(a) && std::isnan(b)); }

}  // namespace

TEST_CASE("Lanes compute what numbers do, with the same bits for every instruction set") {
  random_bits random(11);
  for (int trial = 0; trial != 200; ++trial) {
    double a[8], b[8];
    for (int i = 0; i != 8; ++i) a[i] = random.uniform(-3, 3), b[i] = random.uniform() < 0.2 ? a[i] : random.normal();
    if (trial == 0) b[3] = std::numeric_limits<double>::quiet_NaN(), a[5] = std::numeric_limits<double>::infinity();
    double expected[90];
    simd::select<kernel>(simd::level::portable, all)(a, b, expected);
    for (const auto level : {simd::level::avx2, simd::level::avx512}) {
      double out[90];
      simd::select<kernel>(level, all)(a, b, out);
      for (int i = 0; i != 90; ++i) REQUIRE(same_bits(out[i], expected[i]));
    }
    for (int i = 0; i != 8; ++i) {
      const double x = a[i], y = b[i];
      CHECK(same_bits(expected[i], x + y));
      CHECK(same_bits(expected[8 + i], x - y));
      CHECK(same_bits(expected[16 + i], x * y));
      CHECK(same_bits(expected[24 + i], x / y));
      CHECK(same_bits(expected[40 + i], x < y ? x : y));
      CHECK(expected[48 + i] == (x < y ? 1.0 : 0.0));
      CHECK(expected[56 + i] == (x <= y ? 1.0 : 0.0));
      if (!std::isfinite(x)) continue;
      CHECK(expected[64 + i] == Approx(1.0 / std::sqrt(x * x + 1e-9)).epsilon(1e-15));
      CHECK(expected[72 + i] == Approx(std::abs(x)).epsilon(1e-15));
    }
  }
}

TEST_CASE("The root of lanes holds over the range of double") {
  for (double x = 1e-300; x < 1e300; x *= 7.3) {
    const simd::lanes<2> l(x);
    double root[8], reciprocal[8];
    simd::square_root(l).store(root);
    simd::reciprocal_root(l).store(reciprocal);
    CHECK(std::abs(root[3] - std::sqrt(x)) <= 4e-16 * std::sqrt(x));
    CHECK(std::abs(reciprocal[6] * std::sqrt(x) - 1.0) <= 6e-16);
  }
  double zero[8];
  simd::square_root(simd::lanes<2>(0.0)).store(zero);
  CHECK(zero[0] == 0.0);
}
