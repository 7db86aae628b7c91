// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <limits>

#include <orbis/camera/any.hpp>
#include <orbis/camera/project_lanes.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/simd.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

constexpr camera::intrinsics k{.width = 640, .height = 480, .fx = 517.3, .fy = 510.5, .cx = 318.6, .cy = 255.3};

/// Someone else's model.
class stretched {
 public:
  int width() const { return k.width; }
  int height() const { return k.height; }
  std::optional<vec2> project(const vec3& p) const {
    if (!(p.z() > 0.1) || !p.allFinite()) return std::nullopt;
    return vec2(k.fx * p.x() / p.z() + 0.3 * p.y() * p.y(), k.fy * p.y() / p.z());
  }
  std::optional<vec2> project(const vec3& p, matrix<2, 3>& j) const {
    const auto pixel = project(p);
    if (pixel)
      j << k.fx / p.z(), 0.6 * p.y(), -k.fx * p.x() / (p.z() * p.z()), 0.0, k.fy / p.z(),
          -k.fy * p.y() / (p.z() * p.z());
    return pixel;
  }
  std::optional<vec3> unproject(const vec2&) const { return std::nullopt; }
};

struct eight {
  double x[8], y[8], z[8];
};
struct projected {
  double value[9][8];  // u, v, valid, j
};

struct kernel {
  template <simd::target Target, class Camera>
  static ORBIS_ALWAYS_INLINE void run(const Camera& camera, const eight& p, projected& out) {
    using L = simd::vec<double, 8, Target>;
    camera::lane_projection<L> l;
    camera::lanes_of<Camera>::template project<true>(camera, L::load(p.x), L::load(p.y), L::load(p.z), l);
    l.u.store(out.value[0]);
    l.v.store(out.value[1]);
    select(l.valid, L(1.0), L(0.0)).store(out.value[2]);
    for (int i = 0; i != 6; ++i) l.j[i / 3][i % 3].store(out.value[3 + i]);
  }
};
template <class Camera>
void project_at(simd::level level, const Camera& camera, const eight& p, projected& out) {
  simd::kernel<kernel, void(const Camera&, const eight&, projected&)>(level)(camera, p, out);
}

template <class Camera>
void check(const Camera& camera) {
  random_bits random(5);
  int valid = 0;
  for (int trial = 0; trial != 300; ++trial) {
    eight p;
    for (int i = 0; i != 8; ++i) {
      const double spread = trial % 3 == 0 ? 3.0 : 0.6;
      p.z[i] = random.uniform(-0.2, 5.0);
      p.x[i] = random.uniform(-spread, spread) * p.z[i];
      p.y[i] = random.uniform(-spread, spread) * p.z[i];
      if (random.uniform() < 0.05) p.x[i] = p.y[i] = 0.0;
      if (random.uniform() < 0.05) p.x[i] *= 1e-7, p.y[i] *= 1e-7;
      if (random.uniform() < 0.05) p.x[i] *= 1e-12, p.y[i] *= 1e-12;
      if (random.uniform() < 0.02) p.y[i] = std::numeric_limits<double>::quiet_NaN();
      if (random.uniform() < 0.02) p.z[i] = 0.0;
    }
    projected expected;
    project_at(simd::level::portable, camera, p, expected);
    for (int i = 0; i != 8; ++i) {
      matrix<2, 3> j;
      const auto pixel = camera.project(vec3(p.x[i], p.y[i], p.z[i]), j);
      REQUIRE((expected.value[2][i] == 1.0) == pixel.has_value());
      if (!pixel) continue;
      ++valid;
      CHECK(std::abs(expected.value[0][i] - pixel->x()) <= 1e-13 * (1000.0 + std::abs(pixel->x())));
      CHECK(std::abs(expected.value[1][i] - pixel->y()) <= 1e-13 * (1000.0 + std::abs(pixel->y())));
      for (int e = 0; e != 6; ++e) CHECK(std::abs(expected.value[3 + e][i] - j(e / 3, e % 3)) <= 1e-12 * j.norm());
      if (camera::lanes_of<Camera>::axis_aligned) {
        CHECK(j(0, 1) == 0.0);
        CHECK(j(1, 0) == 0.0);
      }
    }
    for (const auto level : simd::available_levels()) {
      projected out;
      project_at(level, camera, p, out);
      for (int e = 0; e != 9; ++e)
        for (int i = 0; i != 8; ++i)
          if (expected.value[2][i] == 1.0) REQUIRE(out.value[e][i] == expected.value[e][i]);
      for (int i = 0; i != 8; ++i) REQUIRE(out.value[2][i] == expected.value[2][i]);
    }
  }
  CHECK(valid > 500);
}

}  // namespace

TEST_CASE("Eight points at a time are projected as one is, for every model and instruction set") {
  check(camera::pinhole{k});
  check(camera::radial_tangential{k, {}});
  check(camera::radial_tangential{k, {.k1 = 0.2624, .k2 = -0.9531, .p1 = -0.0054, .p2 = 0.0026, .k3 = 1.1633}});
  check(camera::radial_tangential{
      k, {.k1 = 0.3, .k2 = 0.1, .p1 = 0.001, .p2 = -0.002, .k3 = 0.01, .k4 = 0.5, .k5 = 0.2, .k6 = 0.03}});
  check(camera::kannala_brandt{k, {}});
  check(camera::kannala_brandt{k, {.k1 = -0.03, .k2 = 0.01, .k3 = -0.02, .k4 = 0.004}});
  check(stretched{});
  check(camera::any_camera{camera::pinhole{k}});
  check(camera::any_camera{camera::radial_tangential{k, {.k1 = 0.2624, .k2 = -0.9531, .p1 = -0.0054, .k3 = 1.1633}}});
  check(camera::any_camera{camera::kannala_brandt{k, {.k1 = -0.03, .k2 = 0.01, .k3 = -0.02, .k4 = 0.004}}});
}

TEST_CASE("points are projected into arrays, with NaN where there is no pixel") {
  const camera::radial_tangential model{k, {.k1 = 0.2624, .k2 = -0.9531, .p1 = -0.0054, .p2 = 0.0026, .k3 = 1.1633}};
  using kernel = camera::projection_kernel<camera::radial_tangential>;
  std::array<std::array<float, 16>, 3> p{};
  random_bits random(6);
  for (std::size_t i = 0; i != 16; ++i) {
    p[2][i] = i % 5 == 0 ? -1.0F : static_cast<float>(random.uniform(0.5, 5.0));
    p[0][i] = static_cast<float>(random.uniform(-0.5, 0.5));
    p[1][i] = static_cast<float>(random.uniform(-0.5, 0.5));
  }
  for (const auto level : simd::available_levels()) {
    std::array<double, 16> u{}, v{};
    simd::kernel<kernel, kernel::signature>(level)(model, {p[0].data(), p[1].data(), p[2].data()}, 16, u.data(),
                                                   v.data());
    for (std::size_t i = 0; i != 16; ++i) {
      const auto pixel = model.project(vec3(p[0][i], p[1][i], p[2][i]));
      REQUIRE(pixel.has_value() == (i % 5 != 0));
      CHECK(std::isnan(u[i]) == !pixel);
      CHECK(std::isnan(v[i]) == !pixel);
      if (pixel) CHECK((vec2(u[i], v[i]) - *pixel).norm() < 1e-10);
    }
  }
}
