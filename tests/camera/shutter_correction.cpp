// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

#include <orbis/camera/any.hpp>
#include <orbis/camera/depth.hpp>
#include <orbis/camera/kannala_brandt.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/camera/shutter_correction.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/simd.hpp>

#include "support/allocations.hpp"
#include "support/catch.hpp"

using namespace orbis;

namespace {

/// Walls, a slanted floor and ceiling, and a plate before them; in the camera's frame at the frame's time.
struct room {
  struct surface {
    vec3 normal;  // n . p = distance
    double distance;
    vec3 low, high;
  };
  std::array<surface, 6> surfaces{{
      {{0.2, 0.0, 1.0}, 3.0, vec3::Constant(-9.0), vec3::Constant(9.0)},
      {{0.0, 1.0, 0.1}, 1.2, vec3::Constant(-9.0), vec3::Constant(9.0)},
      {{0.0, -1.0, 0.0}, 1.1, vec3::Constant(-9.0), vec3::Constant(9.0)},
      {{1.0, 0.0, 0.0}, 2.0, vec3::Constant(-9.0), vec3::Constant(9.0)},
      {{-1.0, 0.0, 0.0}, 2.5, vec3::Constant(-9.0), vec3::Constant(9.0)},
      {{0.0, 0.1, 1.0}, 1.2, {-0.4, -0.3, 0.0}, {0.3, 0.35, 9.0}},
  }};

  /// How far along the direction the nearest surface is.
  [[nodiscard]] double cast(const vec3& origin, const vec3& direction) const {
    double nearest = std::numeric_limits<double>::infinity();
    for (const surface& s : surfaces) {
      const double along = (s.distance - s.normal.dot(origin)) / s.normal.dot(direction);
      const vec3 p = origin + along * direction;
      const bool is_hit = along > 0.0 && (p.array() > s.low.array()).all() && (p.array() < s.high.array()).all();
      if (is_hit) nearest = std::min(nearest, along);
    }
    return nearest;
  }
  /// Changes slowly over the surfaces.
  [[nodiscard]] static rgb8 color(const vec3& p) {
    const auto wave = [](double x) { return static_cast<std::uint8_t>(128.0 + 100.0 * std::sin(6.0 * x)); };
    return {wave(p.x()), wave(p.y()), wave(p.z())};
  }
};

struct images {
  image<float> depth;  // metres, 0: no ray
  image<rgb8> color;
};

template <class Camera>
images render(const Camera& camera, const camera::shutter& s, const vec6& twist) {
  const room world;
  images seen{image<float>(camera.width(), camera.height()), image<rgb8>(camera.width(), camera.height())};
  for (int y = 0; y != camera.height(); ++y) {
    const se3 at_depth = se3::exp(s.depth_time(y, camera.height()) * twist);
    const se3 at_color = se3::exp(s.color_time(y, camera.height()) * twist);
    for (int x = 0; x != camera.width(); ++x) {
      const auto ray = camera.unproject({x, y});
      if (!ray) continue;
      seen.depth(x, y) = static_cast<float>(world.cast(at_depth.translation(), at_depth.rotation() * *ray));
      const double z = world.cast(at_color.translation(), at_color.rotation() * *ray);
      seen.color(x, y) = room::color(at_color * vec3(z * *ray));
    }
  }
  return seen;
}

struct difference {
  double mean = 0.0;       // of those on the same surface, metres
  std::size_t edges = 0;   // on another surface
  std::size_t holes = 0;   // without depth, that have one in truth
  std::size_t pixels = 0;  // with depth in truth
};

difference compare(const image<float>& depth, const image<float>& truth) {
  difference d;
  std::size_t same = 0;
  for (std::size_t i = 0; i != truth.pixels().size(); ++i) {
    const double is = truth.pixels()[i], found = depth.pixels()[i];
    if (is == 0.0) continue;
    ++d.pixels;
    if (found == 0.0)
      ++d.holes;
    else if (std::abs(found - is) > 0.03 * is)
      ++d.edges;
    else
      ++same, d.mean += std::abs(found - is);
  }
  d.mean /= static_cast<double>(std::max<std::size_t>(same, 1));
  return d;
}

double compare(const image<rgb8>& color, const image<rgb8>& truth, const image<float>& depth) {
  double sum = 0.0, count = 0.0;
  for (std::size_t i = 0; i != truth.pixels().size(); ++i) {
    if (depth.pixels()[i] == 0.0F) continue;
    const rgb8 a = color.pixels()[i], b = truth.pixels()[i];
    const int off = std::abs(a.r - b.r) + std::abs(a.g - b.g) + std::abs(a.b - b.b);
    if (off > 60) continue;  // of another surface: it was hidden when the colours were read
    sum += off;
    count += 3.0;
  }
  return sum / count;
}

constexpr camera::shutter rolling{.color_read_out = 0.03, .depth_read_out = 0.02, .depth_delay = 0.01};

/// Of a camera that is swung by hand.
vec6 swing() {
  vec6 twist;
  twist << 0.4, -0.3, 0.5, 0.6, -0.9, 0.4;
  return twist;
}

const camera::intrinsics large{400, 300, 330.0, 328.0, 199.5, 149.5};
camera::pinhole small_camera() { return camera::pinhole{camera::intrinsics{200, 150, 165.0, 164.0, 99.0, 74.5}}; }

template <class Camera>
void check_correction(const Camera& camera) {
  const images truth = render(camera, {}, swing()), read = render(camera, rolling, swing());
  camera::shutter_correction correct{camera};
  image<float> depth(camera.width(), camera.height());
  REQUIRE(correct.depth(rolling, swing(), camera::depth_view{read.depth}, depth.view()));
  const difference before = compare(read.depth, truth.depth), after = compare(depth, truth.depth);
  INFO("before " << before.mean << " " << before.edges << ", after " << after.mean << " " << after.edges << " "
                 << after.holes << " of " << after.pixels);
  CHECK(after.mean < 0.03 * before.mean);
  CHECK(after.edges * 20 < before.edges);
  CHECK(after.holes * 25 < after.pixels);  // what comes into view meanwhile

  image<rgb8> color(camera.width(), camera.height());
  const camera::depth_view corrected{depth};
  REQUIRE(correct.color(rolling, swing(), corrected, read.color.view(), color.view()));
  CHECK(compare(color, truth.color, depth) < 0.35 * compare(read.color, truth.color, depth));  // of the nearest pixel

  const rgb8 unchanged{1, 2, 3};
  image<rgb8> every_third(camera.width(), camera.height(), unchanged);
  REQUIRE(correct.color(rolling, swing(), corrected, read.color.view(), every_third.view(), 3));
  for (int y = 0; y != camera.height(); ++y) {
    const auto is_unchanged = [&](const rgb8& pixel) { return pixel == unchanged; };
    CHECK((y % 3 == 0 ? std::ranges::equal(every_third.row(y), color.row(y))
                      : std::ranges::all_of(every_third.row(y), is_unchanged)));
  }
}

image<std::uint16_t> in_units(const image<float>& metres, double scale) {
  image<std::uint16_t> stored(metres.width(), metres.height());
  std::ranges::transform(metres.pixels(), stored.pixels().begin(),
                         [&](float z) { return static_cast<std::uint16_t>(static_cast<double>(z) * scale + 0.5); });
  return stored;
}

}  // namespace

TEST_CASE("Images of a rolling shutter are corrected to those of a global one for a pinhole") {
  check_correction(camera::pinhole{large});
}

TEST_CASE("Images of a rolling shutter are corrected to those of a global one with distortion") {
  check_correction(camera::radial_tangential{large, {.k1 = 0.2, .k2 = -0.5, .p1 = 0.001, .k3 = 0.3}});
}

TEST_CASE("Images of a rolling shutter are corrected to those of a global one for a fisheye") {
  check_correction(camera::any_camera{
      camera::kannala_brandt{camera::intrinsics{400, 300, 180.0, 180.0, 199.5, 149.5}, {.k1 = 0.01, .k2 = -0.005}}});
}

TEST_CASE("A global shutter with late depth is corrected, and its colours stay") {
  const camera::pinhole camera = small_camera();
  constexpr camera::shutter late{.depth_delay = 0.02};
  const images truth = render(camera, {}, swing()), read = render(camera, late, swing());
  camera::shutter_correction correct{camera};
  image<float> depth(200, 150);
  REQUIRE(correct.depth(late, swing(), camera::depth_view{read.depth}, depth.view()));
  CHECK(compare(depth, truth.depth).mean < 0.03 * compare(read.depth, truth.depth).mean);
  image<rgb8> color(200, 150);
  REQUIRE(correct.color(late, swing(), camera::depth_view{depth}, read.color.view(), color.view()));
  CHECK(color == read.color);
}

TEST_CASE("Stored depths and metres are corrected alike") {
  const camera::pinhole camera = small_camera();
  const images read = render(camera, rolling, swing());
  const image<std::uint16_t> stored = in_units(read.depth, 5000.0);
  image<float> metres(200, 150), depth(200, 150);
  std::ranges::transform(stored.pixels(), metres.pixels().begin(),
                         [](std::uint16_t z) { return static_cast<float>(static_cast<double>(z) / 5000.0); });
  camera::shutter_correction correct{camera};
  image<std::uint16_t> units(200, 150);
  REQUIRE(correct.depth(rolling, swing(), camera::depth_view{stored, 5000.0}, units.view()));
  REQUIRE(correct.depth(rolling, swing(), camera::depth_view{metres}, depth.view()));
  CHECK(units == in_units(depth, 5000.0));
}

TEST_CASE("Depth has the unit that it is stored in") {
  using correction = camera::shutter_correction<camera::pinhole>;
  const auto takes = []<class Depth, class T>(const Depth&, image_view<T>) {
    return requires(correction c, Depth depth, image_view<T> out) { c.depth(rolling, swing(), depth, out); };
  };
  const image_view<float> metres;
  const image_view<std::uint16_t> units;
  CHECK(takes(camera::depth_view<float>{}, metres));
  CHECK(takes(camera::depth_view<std::uint16_t>{}, units));
  CHECK_FALSE(takes(camera::depth_view<std::uint16_t>{}, metres));
  CHECK_FALSE(takes(camera::depth_view<float>{}, units));
}

TEST_CASE("Depths too small to have an inverse are no depths") {
  const camera::pinhole camera = small_camera();
  images read = render(camera, rolling, swing());
  images without{read.depth, {}};
  for (int y = 20; y != 130; ++y)
    for (int x = 30 + y % 3; x < 170; x += 5) read.depth(x, y) = 1e-39F, without.depth(x, y) = 0.0F;
  camera::shutter_correction correct{camera};
  image<float> depth(200, 150), expected(200, 150);
  REQUIRE(correct.depth(rolling, swing(), camera::depth_view{read.depth}, depth.view()));
  REQUIRE(correct.depth(rolling, swing(), camera::depth_view{without.depth}, expected.view()));
  CHECK(depth == expected);
  image<rgb8> color(200, 150), expected_color(200, 150);
  REQUIRE(correct.color(rolling, swing(), camera::depth_view{read.depth}, read.color.view(), color.view()));
  REQUIRE(correct.color(rolling, swing(), camera::depth_view{without.depth}, read.color.view(), expected_color.view()));
  CHECK(color == expected_color);
}

TEST_CASE("A second image is corrected without an allocation") {
  const camera::pinhole camera = small_camera();
  const images read = render(camera, rolling, swing());
  camera::shutter_correction correct{camera};
  image<float> depth(200, 150);
  image<rgb8> color(200, 150);
  const auto both = [&](const vec6& twist) {
    return correct.depth(rolling, twist, camera::depth_view{read.depth}, depth.view()) &&
           correct.color(rolling, twist, camera::depth_view{depth}, read.color.view(), color.view());
  };
  REQUIRE(both(swing()));
  const vec6 other = -0.5 * swing();
  const std::size_t before = test::allocations();
  const bool corrected = both(other);
  CHECK(test::allocations() == before);
  CHECK(corrected);
}

TEST_CASE("Every instruction set corrects alike") {
  const camera::pinhole camera = small_camera();
  const images read = render(camera, rolling, swing());
  camera::shutter_correction correct{camera};
  const auto corrected = [&](simd::level level) {
    const simd::level_limit limit{level};
    image<float> depth(200, 150);
    REQUIRE(correct.depth(rolling, swing(), camera::depth_view{read.depth}, depth.view()));
    return depth;
  };
  const image<float> portable = corrected(simd::level::portable);
  for (const simd::level level : simd::available_levels()) CHECK(corrected(level) == portable);
}

TEST_CASE("Without motion or without rows images keep their bytes") {
  const camera::pinhole camera = small_camera();
  const images read = render(camera, rolling, swing());
  image<std::uint16_t> stored = in_units(read.depth, 5000.0);
  stored(3, 4) = 65535;
  stored(5, 4) = 0;
  camera::shutter_correction correct{camera};
  using correction = camera::shutter_correction<camera::pinhole>;
  const vec6 rest = vec6::Zero();
  CHECK(correction::is_needed(rolling, swing()));
  CHECK_FALSE(correction::is_needed(rolling, rest));
  CHECK_FALSE(correction::is_needed({}, swing()));
  for (const auto& [shutter, twist] : {std::pair{rolling, rest}, std::pair{camera::shutter{}, swing()}}) {
    image<std::uint16_t> out(200, 150);
    REQUIRE(correct.depth(shutter, twist, camera::depth_view{stored, 5000.0}, out.view()));
    CHECK(out == stored);
    image<rgb8> color(200, 150);
    REQUIRE(correct.color(shutter, twist, camera::depth_view{stored, 5000.0}, read.color.view(), color.view()));
    CHECK(color == read.color);
  }
}

TEST_CASE("Edges lie between two pixels") {
  const camera::pinhole camera = small_camera();
  const images read = render(camera, rolling, swing());
  camera::shutter_correction correct{camera};
  image<float> depth(200, 150);
  REQUIRE(correct.depth(rolling, swing(), camera::depth_view{read.depth}, depth.view()));
  const room world;
  std::size_t between = 0;
  for (int y = 0; y != 150; ++y)
    for (int x = 0; x != 200; ++x) {
      if (depth(x, y) == 0.0F) continue;
      double off = std::numeric_limits<double>::infinity();  // from any surface
      const vec3 p = static_cast<double>(depth(x, y)) * *camera.unproject({x, y});
      for (const auto& s : world.surfaces)
        off = std::min(off, std::abs(s.normal.dot(p) - s.distance) / s.normal.norm());
      between += off > 0.01;
    }
  CHECK(between == 0);
}

TEST_CASE("A motion that cannot be is refused, and the image left alone") {
  const camera::pinhole camera = small_camera();
  const images read = render(camera, rolling, swing());
  camera::shutter_correction correct{camera};
  image<float> depth(200, 150, 7.0F);
  image<rgb8> color(200, 150, rgb8{1, 2, 3});
  vec6 unknown = swing();
  unknown[1] = std::numeric_limits<double>::quiet_NaN();
  vec6 endless = swing();
  endless[4] = std::numeric_limits<double>::infinity();
  vec6 spinning = swing();
  spinning[5] = 40.0;
  for (const vec6& twist : {unknown, endless, spinning}) {
    const auto done = correct.depth(rolling, twist, camera::depth_view{read.depth}, depth.view());
    REQUIRE_FALSE(done);
    CHECK(done.error().code == errc::invalid_argument);
    CHECK_FALSE(correct.color(rolling, twist, camera::depth_view{read.depth}, read.color.view(), color.view()));
  }
  CHECK(depth == image<float>(200, 150, 7.0F));
  CHECK(color == image<rgb8>(200, 150, rgb8{1, 2, 3}));
}

TEST_CASE("What is passed by faster than it is read has no depth") {
  const camera::pinhole camera = small_camera();
  const images read = render(camera, rolling, vec6::Zero());
  camera::shutter_correction correct{camera};
  for (const double speed : {50.0, -50.0, 1e6, -1e6, 1e300}) {
    vec6 twist = vec6::Zero();
    twist[2] = speed;
    image<float> depth(200, 150);
    REQUIRE(correct.depth(rolling, twist, camera::depth_view{read.depth}, depth.view()));
    for (const float z : depth.pixels()) REQUIRE((z >= 0.0F && std::isfinite(z)));
  }
}

TEST_CASE("Images without depth and images of one pixel are corrected") {
  camera::shutter_correction correct{small_camera()};
  image<float> none(200, 150), depth(200, 150, 7.0F);
  none(3, 3) = std::numeric_limits<float>::quiet_NaN();
  REQUIRE(correct.depth(rolling, swing(), camera::depth_view{none}, depth.view()));
  CHECK(depth == image<float>(200, 150));

  const camera::pinhole one_pixel{camera::intrinsics{1, 1, 1.0, 1.0, 0.0, 0.0}};
  camera::shutter_correction correct_one{one_pixel};
  image<float> near(1, 1, 2.0F), out(1, 1);
  REQUIRE(correct_one.depth(rolling, swing(), camera::depth_view{near}, out.view()));
  CHECK(std::abs(out(0, 0) - 2.0F) < 0.1F);
}

TEST_CASE("Depth beyond what an image can store is left out") {
  const camera::pinhole camera = small_camera();
  image<std::uint16_t> far(200, 150, 65500), out(200, 150);
  vec6 back = vec6::Zero();
  back[2] = -1.0;
  back[3] = 0.001;
  camera::shutter_correction correct{camera};
  constexpr camera::shutter late{.depth_delay = -0.1};  // the camera was nearer, by 10 cm
  REQUIRE(correct.depth(late, back, camera::depth_view{far, 5000.0}, out.view()));
  for (const std::uint16_t z : out.pixels()) REQUIRE((z == 0 || z > 65000));
}
