// SPDX-License-Identifier: BSD-3-Clause
#include <cstring>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/optimize/detail/sparse/panel_kernels.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::optimize::detail;

namespace {

std::vector<double> random_numbers(random_bits& random, std::size_t count) {
  std::vector<double> numbers(count);
  for (double& x : numbers) x = random.normal();
  return numbers;
}

template <int Size>
void check_kernels() {
  random_bits random{341};
  constexpr std::size_t N = Size;
  const auto portable = [] {
    const simd::level_limit limit{simd::level::portable};
    return panel_kernels<Size>{};
  }();
  for (const simd::level level : simd::available_levels()) {
    const simd::level_limit limit{level};
    const panel_kernels<Size> kernels;
    for (const std::size_t rows : {std::size_t{1}, N, 2 * N, std::size_t{16}, std::size_t{17}, 7 * N})
      for (const std::size_t depth : {std::size_t{1}, N, 5 * N}) {
        const std::size_t stride = rows + 3;
        const auto a = random_numbers(random, stride * depth + panel_slack + rows);
        const std::size_t out_stride = (rows + panel_slack - 1) / panel_slack * panel_slack;
        std::vector<double> out(out_stride * N), expected(out_stride * N);
        kernels.product(a.data(), a.data(), stride, rows, depth, out.data(), out_stride);
        portable.product(a.data(), a.data(), stride, rows, depth, expected.data(), out_stride);
        for (std::size_t j = 0; j != N; ++j) {
          CHECK(std::memcmp(&out[j * out_stride], &expected[j * out_stride], rows * sizeof(double)) == 0);
          for (std::size_t i = 0; i != rows; ++i) {
            double sum = 0.0;
            for (std::size_t k = 0; k != depth; ++k) sum += a[k * stride + i] * a[k * stride + j];
            CHECK(out[j * out_stride + i] == Approx(sum).margin(1e-12));
          }
        }
      }
    for (const std::size_t rows : {std::size_t{0}, std::size_t{1}, std::size_t{4}, std::size_t{11}, 6 * N}) {
      const std::size_t stride = rows + N + 2;
      auto l = random_numbers(random, stride * N);
      std::vector<double> inverse(N);
      for (std::size_t j = 0; j != N; ++j) inverse[j] = 1.0 / (l[j * stride + j] += 4.0);
      auto x = l, expected = l;
      kernels.solve(l.data(), inverse.data(), stride, x.data() + N, rows);
      portable.solve(l.data(), inverse.data(), stride, expected.data() + N, rows);
      CHECK(std::memcmp(x.data(), expected.data(), x.size() * sizeof(double)) == 0);
      for (std::size_t i = N; i != N + rows; ++i)  // X L^T is what it was
        for (std::size_t j = 0; j != N; ++j) {
          double sum = 0.0;
          for (std::size_t k = 0; k <= j; ++k) sum += x[k * stride + i] * l[k * stride + j];
          CHECK(sum == Approx(l[j * stride + i]).margin(1e-12));
        }
      for (std::size_t j = 0; j != N; ++j)  // and nothing else has changed
        for (std::size_t i = N + rows; i != stride; ++i) CHECK(x[j * stride + i] == l[j * stride + i]);
    }
  }
}

}  // namespace

TEST_CASE("Products and triangular solves are right, with the same bits for every instruction set") {
  check_kernels<1>();
  check_kernels<2>();
  check_kernels<3>();
  check_kernels<6>();
  check_kernels<7>();
  check_kernels<12>();
  check_kernels<18>();
}
