// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cstddef>

#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/level.hpp>
#include <orbis/core/simd/vec.hpp>
#include <orbis/optimize/detail/bundle/transposed.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

using rows = std::array<std::array<double, 4>, 8>;
using columns = std::array<std::array<double, 8>, 4>;

struct read_columns {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const double* const* from, columns& out) {
    simd::vec<double, 8, Target> v[4];
    optimize::detail::load_transposed<4>(from, v);
    for (std::size_t k = 0; k != 4; ++k) v[k].store(out[k].data());
    optimize::detail::load_transposed<3>(from, v);
    for (std::size_t k = 0; k != 3; ++k) (v[k] + v[k]).store(out[k].data());
  }
};
struct write_rows {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const columns& in, double* const* to, int offset) {
    using V = simd::vec<double, 8, Target>;
    optimize::detail::store_transposed(V::load(in[0].data()), V::load(in[1].data()), V::load(in[2].data()),
                                       V::load(in[3].data()), to, offset);
  }
};
struct add_rows {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const columns& in, double* const* to, int offset) {
    using V = simd::vec<double, 8, Target>;
    optimize::detail::add_transposed(V::load(in[0].data()), V::load(in[1].data()), V::load(in[2].data()),
                                     V::load(in[3].data()), to, offset);
  }
};

}  // namespace

TEST_CASE("Eight rows anywhere are read as columns, and columns written as rows, on every instruction set") {
  rows numbers;
  for (std::size_t i = 0; i != 8; ++i)
    for (std::size_t k = 0; k != 4; ++k) numbers[i][k] = static_cast<double>(10 * i + k);
  const double* from[8];
  for (std::size_t i = 0; i != 8; ++i) from[i] = numbers[7 - i].data();  // in any order
  for (const simd::level level : simd::available_levels()) {
    INFO("level " << static_cast<int>(level));
    const simd::level_limit limit{level};
    columns read{};
    simd::kernel<read_columns, void(const double* const*, columns&)>()(from, read);
    for (std::size_t i = 0; i != 8; ++i)
      for (std::size_t k = 0; k != 4; ++k) CHECK(read[k][i] == (k == 3 ? 1.0 : 2.0) * numbers[7 - i][k]);

    for (std::size_t k = 0; k != 3; ++k)
      for (double& number : read[k]) number *= 0.5;
    std::array<std::array<double, 6>, 8> written{};
    double* to[8];
    for (std::size_t i = 0; i != 8; ++i) to[i] = written[7 - i].data();
    simd::kernel<write_rows, void(const columns&, double* const*, int)>()(read, to, 1);
    for (std::size_t i = 0; i != 8; ++i) {
      CHECK(written[i][0] == 0.0);
      for (std::size_t k = 0; k != 4; ++k) CHECK(written[i][1 + k] == numbers[i][k]);
      CHECK(written[i][5] == 0.0);
    }
    to[2] = to[5];  // the same row twice
    simd::kernel<add_rows, void(const columns&, double* const*, int)>()(read, to, 1);
    for (std::size_t i = 0; i != 8; ++i)
      for (std::size_t k = 0; k != 4; ++k)
        CHECK(written[i][1 + k] == (i == 5   ? numbers[5][k]
                                    : i == 2 ? 2.0 * numbers[2][k] + numbers[5][k]
                                             : 2.0 * numbers[i][k]));
  }
}
