// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include <orbis/core/random.hpp>

#include "support/catch.hpp"

using orbis::random_bits;

TEST_CASE("the generator gives the published sequence of SplitMix64") {
  static_assert(std::uniform_random_bit_generator<random_bits>);
  random_bits zero{0};
  CHECK(zero() == 0xe220a8397b1dcdafULL);
  CHECK(zero() == 0x6e789e6aa1b965f4ULL);
  CHECK(zero() == 0x06c45d188009454fULL);
  random_bits other{1234567};
  CHECK(other() == 6457827717110365317ULL);
  CHECK(other() == 3203168211198807973ULL);
  CHECK(orbis::mix64(0) == 0xe220a8397b1dcdafULL);
}

TEST_CASE("uniform numbers stay in their interval and fill it evenly") {
  random_bits random{42};
  constexpr int n = 200000;
  double sum = 0.0, squares = 0.0;
  std::array<int, 16> bins{};
  for (int i = 0; i != n; ++i) {
    const double u = random.uniform();
    REQUIRE((u >= 0.0 && u < 1.0));
    sum += u;
    squares += u * u;
    ++bins[static_cast<std::size_t>(u * 16.0)];
    const double v = random.uniform(-3.0, 5.0);
    REQUIRE((v >= -3.0 && v < 5.0));
  }
  CHECK(sum / n == Approx(0.5).margin(5.0 * std::sqrt(1.0 / 12.0 / n)));
  CHECK(squares / n == Approx(1.0 / 3.0).margin(0.005));
  for (const int count : bins) CHECK(count == Approx(n / 16.0).margin(5.0 * std::sqrt(n / 16.0)));
}

TEST_CASE("numbers below a bound are below it and all of them occur") {
  random_bits random{7};
  for (const std::uint32_t bound : {1U, 2U, 3U, 7U, 100U}) {
    std::vector<int> seen(bound, 0);
    for (int i = 0; i != 5000; ++i) ++seen.at(random.below(bound));
    for (const int count : seen) CHECK(count > 0);
  }
  for (int i = 0; i != 1000; ++i) REQUIRE(random.below(0xffffffffU) < 0xffffffffU);
}

TEST_CASE("normal numbers have the moments and tails of a normal distribution") {
  random_bits random{11};
  constexpr int n = 400000;
  double m1 = 0, m2 = 0, m3 = 0, m4 = 0;
  int beyond_one = 0, beyond_two = 0, beyond_three = 0;
  for (int i = 0; i != n; ++i) {
    const double x = random.normal();
    m1 += x;
    m2 += x * x;
    m3 += x * x * x;
    m4 += x * x * x * x;
    beyond_one += std::abs(x) > 1.0;
    beyond_two += std::abs(x) > 2.0;
    beyond_three += std::abs(x) > 3.0;
  }
  CHECK(m1 / n == Approx(0.0).margin(0.008));
  CHECK(m2 / n == Approx(1.0).margin(0.012));
  CHECK(m3 / n == Approx(0.0).margin(0.03));
  CHECK(m4 / n == Approx(3.0).margin(0.12));
  CHECK(double(beyond_one) / n == Approx(0.3173).margin(0.006));
  CHECK(double(beyond_two) / n == Approx(0.0455).margin(0.003));
  CHECK(double(beyond_three) / n == Approx(0.0027).margin(0.0006));
}

TEST_CASE("normal numbers take their words in a fixed order") {
  const double a = random_bits::gaussian_from(orbis::mix64(1), orbis::mix64(2));
  CHECK(random_bits::gaussian_from(orbis::mix64(1), orbis::mix64(2)) == a);
  random_bits random{9}, words{9};
  const double drawn = random.normal();
  const std::uint64_t x = words(), y = words();
  CHECK(drawn == random_bits::gaussian_from(x, y));
  static_assert(random_bits::gaussian_from(0, 0) < -8.0 && random_bits::gaussian_from(~0ULL, ~0ULL) > 8.0);
}
