// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/core/types.hpp>

#include "support/catch.hpp"

namespace {

using orbis::cloud::detail::point_view;
using orbis::cloud::detail::viewed_points;

struct labelled {
  std::uint32_t label;
  float z, x, y;
};
struct [[gnu::packed]] packed {
  std::uint8_t label;
  float x, y, z;
};
struct with_traits {
  float x, y, z;
};
struct computed {
  std::array<float, 3> own;
  [[nodiscard]] float operator[](std::size_t a) const { return own[a] + 1; }
};

/// Whether a view of the points has the coordinates of the second of three, {2, 3, 4}.
template <class Points>
bool is_read(const Points& points) {
  const viewed_points viewed{points};
  const point_view& view = viewed;
  return view.size() == 3 && view[1] == std::array{2.0F, 3.0F, 4.0F};
}

}  // namespace

template <>
struct orbis::point_traits<with_traits> {
  using scalar = float;
  static float x(const with_traits& p) { return p.z; }
  static float y(const with_traits& p) { return p.x; }
  static float z(const with_traits& p) { return p.y; }
};

TEST_CASE("all types of point are viewed as coordinates") {
  CHECK(is_read(std::vector<std::array<float, 3>>{{}, {2, 3, 4}, {}}));
  CHECK(is_read(std::vector<std::array<float, 4>>{{}, {2, 3, 4, 5}, {}}));
  CHECK(is_read(std::deque<std::array<float, 3>>{{}, {2, 3, 4}, {}}));
  CHECK(is_read(std::vector<std::array<double, 3>>{{}, {2, 3, 4}, {}}));
  CHECK(is_read(std::vector<orbis::vec3f>{{0, 0, 0}, {2, 3, 4}, {0, 0, 0}}));
  CHECK(is_read(std::vector<orbis::vec3>{{0, 0, 0}, {2, 3, 4}, {0, 0, 0}}));
  CHECK(is_read(std::vector<labelled>{{}, {7, 4, 2, 3}, {}}));
  CHECK(is_read(std::vector<packed>{{}, {7, 2, 3, 4}, {}}));
  CHECK(is_read(std::vector<with_traits>{{}, {3, 4, 2}, {}}));
  CHECK(is_read(std::vector<computed>{{}, {{1, 2, 3}}, {}}));
  CHECK(is_read(std::vector<std::vector<float>>{{0, 0, 0}, {2, 3, 4}, {0, 0, 0}}));
  CHECK(static_cast<const point_view&>(viewed_points{std::vector<orbis::vec3f>{}}).size() == 0);
}

TEST_CASE("points that hold floats are viewed in place") {
  std::vector<orbis::vec3f> points{{0, 0, 0}, {2, 3, 4}};
  std::vector<labelled> others{{}, {7, 4, 2, 3}};
  const viewed_points viewed{points}, viewed_others{others};
  points[1].y() = 5;
  others[1].y = 6;
  CHECK(viewed.view()[1] == std::array{2.0F, 5.0F, 4.0F});
  CHECK(viewed_others.view()[1] == std::array{2.0F, 6.0F, 4.0F});
}
