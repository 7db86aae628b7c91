// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <orbis/cloud/detail/voxels/voxel_cells.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/simd/level.hpp>

#include "support/catch.hpp"

namespace {

template <class S>
void check_cells(double inverse_size) {
  using orbis::cloud::detail::voxel_cells;
  using limits = std::numeric_limits<S>;
  std::array<S, 256> x{S(0),
                       -S(0),
                       limits::denorm_min(),
                       -limits::denorm_min(),
                       limits::max(),
                       limits::lowest(),
                       limits::infinity(),
                       -limits::infinity(),
                       limits::quiet_NaN(),
                       S(2147483646),
                       S(-2147483646),
                       S(2147483647),
                       S(-2147483647),
                       S(2147483648),
                       S(-2147483648)};
  orbis::random_bits random{1};
  for (std::size_t i = 15; i != x.size(); ++i) x[i] = static_cast<S>(random.uniform(-40, 40));
  for (std::size_t i = 15; i < x.size(); i += 5) x[i] = std::round(x[i]);
  for (const auto level : {orbis::simd::level::portable, orbis::simd::level::avx2, orbis::simd::level::avx512}) {
    std::array<std::int32_t, 256> cells{};
    orbis::simd::kernel<voxel_cells<S>, typename voxel_cells<S>::signature>(level)(x.data(), x.size(), inverse_size,
                                                                                   cells.data());
    for (std::size_t i = 0; i != x.size(); ++i) {
      const double cell = std::floor(double{x[i]} * inverse_size);
      REQUIRE(orbis::cloud::detail::is_cell(cells[i]) == (std::abs(cell) < 2147483647.0));
      if (orbis::cloud::detail::is_cell(cells[i])) REQUIRE(static_cast<double>(cells[i]) == cell);
    }
  }
}

}  // namespace

TEST_CASE("cells are found by rounding down on every instruction set") {
  for (const double inverse_size : {1.0, 1 / 0.07, 100.0, 1e-3}) {
    check_cells<float>(inverse_size);
    check_cells<double>(inverse_size);
  }
}

TEST_CASE("hashes are those of the cubes that cells lie in on every instruction set") {
  using orbis::cloud::detail::mixed_key;
  using orbis::cloud::detail::voxel_hashes;
  orbis::random_bits random{2};
  std::array<std::array<std::int32_t, 64>, 3> cells{};
  for (auto& axis : cells)
    for (std::size_t i = 0; i != axis.size(); ++i)
      axis[i] = i % 2 == 0 ? static_cast<std::int32_t>(random.below(2000)) - 1000
                           : static_cast<std::int32_t>(static_cast<std::uint32_t>(random()));
  for (const auto level : {orbis::simd::level::portable, orbis::simd::level::avx2, orbis::simd::level::avx512})
    for (const int bits : {0, 3}) {
      std::array<std::uint32_t, 64> hashes{};
      orbis::simd::kernel<voxel_hashes, voxel_hashes::signature>(level)(cells[0].data(), cells[1].data(),
                                                                        cells[2].data(), 64, bits, hashes.data());
      for (std::size_t i = 0; i != hashes.size(); ++i)
        REQUIRE(hashes[i] == mixed_key({cells[0][i] >> bits, cells[1][i] >> bits, cells[2][i] >> bits}));
    }
}
